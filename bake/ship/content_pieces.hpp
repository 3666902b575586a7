// Where to cut bytes so that the cuts move with the content: an insertion changes the pieces round
// it and no other.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace modar {

/// Sizes of the pieces that the bytes fall into, front to back: 8 to 256 KiB, 64 KiB in the middle.
/// FastCDC (Xia et al., "FastCDC: a fast and efficient content-defined chunking approach for data
/// deduplication", 2016), with its normalised chunking.
/// unit: cuts fall on multiples of it, counted from the first byte.
std::vector<std::size_t> content_pieces(std::span<const std::byte> bytes, std::size_t unit);

}  // namespace modar
