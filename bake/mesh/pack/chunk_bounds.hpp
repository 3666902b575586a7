// What a renderer may skip a chunk by: its box and the cone of its normals, both conservative.
#pragma once

#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

namespace modar {

/// As ChunkRecord has them.
struct ChunkBounds {
  glm::vec3 low{0.0f};
  glm::vec3 high{0.0f};
  glm::vec3 cone_axis{0.0f};
  float cone_cutoff = 2.0f;  ///< > 1: never culled
};

/// positions: decoded, as the device will have them. Triangles without area have no side that could
/// be seen and do not count.
ChunkBounds chunk_bounds(std::span<const glm::vec3> positions,
                         std::span<const std::uint16_t> indices);

}  // namespace modar
