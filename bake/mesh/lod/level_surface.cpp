// Finds neighbours by the edges that leave each vertex.
#include "bake/mesh/lod/level_surface.hpp"

#include <numeric>

#include "bake/import/source_model.hpp"

namespace modar {
namespace {

constexpr std::size_t next_corner(std::size_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

}  // namespace

LevelSurface::LevelSurface(std::span<const glm::dvec3> positions,
                           std::span<const std::uint16_t> indices)
    : positions_(positions), indices_(indices), neighbours_(indices.size(), kNoIndex) {
  // Corners by vertex: each stands for the edge that begins there.
  std::vector<std::uint32_t> begins(positions.size() + 1, 0);
  for (const std::uint16_t v : indices) ++begins[v + std::size_t{1}];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<std::uint32_t> corners(indices.size());
  std::vector<std::uint32_t> free(begins.begin(), begins.end() - 1);
  for (std::uint32_t c = 0; c < indices.size(); ++c) corners[free[indices[c]]++] = c;
  for (std::size_t c = 0; c < indices.size(); ++c) {
    const std::uint16_t to = indices[next_corner(c)];
    for (std::uint32_t i = begins[to]; i < begins[to + std::size_t{1}]; ++i) {
      if (indices[next_corner(corners[i])] != indices[c]) continue;
      neighbours_[c] = corners[i] / 3;
      break;
    }
  }
}

std::vector<std::uint32_t> LevelSurface::triangles_of_vertices() const {
  std::vector<std::uint32_t> result(positions_.size(), kNoIndex);
  for (std::size_t c = 0; c < indices_.size(); ++c) {
    result[indices_[c]] = static_cast<std::uint32_t>(c / 3);
  }
  return result;
}

TriangleTree& LevelSurface::tree() {
  if (!tree_) tree_ = std::make_unique<TriangleTree>(positions_, indices_);
  return *tree_;
}

}  // namespace modar
