// The pieces that a bundle's chunks and coarser levels travel as.
#pragma once

#include <cstddef>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

struct MeshPiece {
  PieceRecord record{};  ///< without `id`, `stage` and `stored_size`
  std::vector<std::byte> stored;
};

/// Pieces of kMesh and kLevel, which do not overlap: of every chunk and coarser level that has some
/// size and can travel so (mesh_coder.hpp). jobs: threads at once.
std::vector<MeshPiece> mesh_pieces(const BundleView& bundle, unsigned jobs);

}  // namespace modar
