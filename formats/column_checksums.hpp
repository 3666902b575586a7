// Sums of 16-bit words by their place in a row: what statements tell of payloads. Internal to
// formats/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

/// sums[i] += word i of every row, little-endian. bytes: whole rows of 2 * sums.size() bytes.
void add_column_checksums(std::span<const std::byte> bytes, std::span<std::uint64_t> sums);

/// The same for an array in which rows have `sums.size()` words, a power of two up to 8, read many
/// rows at a time. bytes: any number of whole rows.
void add_array_sums(std::span<const std::byte> bytes, std::span<std::uint64_t> sums);

}  // namespace modar
