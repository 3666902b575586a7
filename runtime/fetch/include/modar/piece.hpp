// Decodes the pieces that bundles travel as (formats/shipping.md). Decoding restores exact bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// The raw bytes of a piece: raw_size bytes whose hash is raw_hash. For kFeatureText `stored` is
/// the section of mapped features, taken from the bundle under construction.
/// Errors: kInvalidInput "piece.*", "mesh.*".
Result<std::vector<std::byte>> decode_piece(const PieceRecord& piece,
                                            std::span<const std::byte> stored);

/// Unpacks one zstd frame of exactly `size` bytes. Errors: kInvalidInput "piece.zstd".
Result<std::vector<std::byte>> unpack_zstd(std::span<const std::byte> frame, std::size_t size);

}  // namespace modar
