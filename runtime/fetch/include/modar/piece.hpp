// A piece's stored bytes back to the raw ones.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "formats/error.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// The raw bytes, as many as the record says and with its hash. For kFeatureText `stored` is the
/// twin's section, taken from the bundle under construction.
/// Errors: kInvalidInput "piece.*", "mesh.*".
Result<std::vector<std::byte>> decode_piece(const PieceRecord& piece,
                                            std::span<const std::byte> stored);

/// One frame of zstd that holds exactly `size` bytes. Errors: kInvalidInput "piece.zstd".
Result<std::vector<std::byte>> unpack_zstd(std::span<const std::byte> frame, std::size_t size);

}  // namespace modar
