// Lists of vertices, one a triangle.
#include "bake/mesh/lod/removed_vertex_map.hpp"

#include <algorithm>
#include <limits>

#include <glm/geometric.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/triangle_tree.hpp"

namespace modar {
namespace {

struct Landing {
  const LandingFace* face = nullptr;
  Foot foot;
};

Landing nearest_of(const ChunkVertices& vertices, std::uint16_t vertex,
                   std::span<const LandingFace> faces) {
  Landing nearest;
  for (const LandingFace& face : faces) {
    const auto& [a, b, c] = face.corners;
    const Foot foot =
        nearest_foot(vertices.positions[vertex],
                     {vertices.positions[a], vertices.positions[b], vertices.positions[c]});
    if (nearest.face == nullptr || foot.square < nearest.foot.square) nearest = {&face, foot};
  }
  return nearest;
}

double shift_at(const ChunkVertices& vertices, std::uint16_t vertex, const Landing& landing) {
  const auto& [a, b, c] = landing.face->corners;
  const std::span<const glm::dvec2> uvs = vertices.uvs;
  const glm::dvec2 there =
      uvs[a] + landing.foot.b * (uvs[b] - uvs[a]) + landing.foot.c * (uvs[c] - uvs[a]);
  return glm::length(there - uvs[vertex]);
}

}  // namespace

double uv_shift_of(const ChunkVertices& vertices, std::uint16_t vertex,
                   std::span<const LandingFace> faces) {
  return shift_at(vertices, vertex, nearest_of(vertices, vertex, faces));
}

RemovedVertexMap::RemovedVertexMap(const ChunkVertices& vertices, std::size_t faces)
    : vertices_(vertices),
      face_of_(vertices.positions.size(), kNoIndex),
      first_(faces, kNoIndex),
      next_(vertices.positions.size(), kNoIndex),
      uv_shifts_(faces, 0.0) {}

void RemovedVertexMap::lift(std::uint32_t face) {
  for (std::uint32_t v = first_[face]; v != kNoIndex; v = next_[v]) {
    hand_.push_back(static_cast<std::uint16_t>(v));
  }
  first_[face] = kNoIndex;
  uv_shifts_[face] = 0;
}

void RemovedVertexMap::settle(std::span<const LandingFace> faces) {
  for (const std::uint16_t vertex : hand_) {
    const Landing landing = nearest_of(vertices_, vertex, faces);
    const std::uint32_t face = landing.face->face;
    face_of_[vertex] = face;
    next_[vertex] = first_[face];
    first_[face] = vertex;
    if (vertices_.uvs.empty()) continue;
    uv_shifts_[face] = std::max(uv_shifts_[face], shift_at(vertices_, vertex, landing));
  }
  hand_.clear();
}

}  // namespace modar
