// Content-defined chunking: cuts move with the content, so that an insertion changes only the
// pieces around it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace modar {

/// Sizes of the pieces, front to back: 8 to 256 KiB, typically 64 KiB.
/// FastCDC (Xia et al., "FastCDC: a fast and efficient content-defined chunking approach for data
/// deduplication", 2016), with its normalised chunking.
/// unit: cuts fall on multiples of it, counted from the first byte.
std::vector<std::size_t> content_pieces(std::span<const std::byte> bytes, std::size_t unit);

}  // namespace modar
