// A mesh cut into spatially compact chunks that 16-bit indices reach.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "formats/base/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// A coarser level of a chunk: triangles over the chunk's vertices.
struct ChunkLevel {
  std::vector<std::uint16_t> indices;
  double error = 0;     ///< model space: bounds the distance from level 0, and of level 0 from it
  double uv_shift = 0;  ///< texels: greatest shift of the texture at a vertex of level 0
  double shading = 0;   ///< model space: side of the smallest pixels that show too little of it
  std::uint32_t halvings = 0;  ///< of the model's triangles, at the level that this belongs to
};

/// One chunk: local vertex i is vertex `vertices[i]` of the TriMesh; triangles index `vertices`.
/// Triangles are in file order, vertices in that of their first use: pack() orders the final bytes.
struct Chunk {
  std::uint32_t material = 0;
  std::vector<std::uint32_t> vertices;
  std::vector<std::uint16_t> indices;
  std::vector<ChunkLevel> coarser;  ///< levels 1 and up; errors never fall
};

struct ChunkedMesh {
  TriMesh mesh;  ///< without its triangles and their materials, which the chunks hold
  std::vector<std::uint32_t>
      repeats;  ///< repeating_materials() of the mesh when it had its triangles
  std::vector<Chunk> chunks;
};

struct ChunkOptions {
  std::uint32_t max_vertices = 65535;  ///< 3 to 65535
  double max_side = 0.0;               ///< model space: longest side of a chunk's box; 0: no limit
  [[nodiscard]] Result<void> validate() const;
};

/// The number of vertices that chunks of a model should have: the maximum, or a quarter of it where
/// the model needs many chunks. Measured from inside a church of 14.8 M triangles: full chunks draw
/// 1.70 times the triangles inside the frustum, quarter ones 1.26 times.
constexpr std::uint32_t chunk_vertices_for(std::size_t model_vertices) {
  constexpr std::uint32_t kFinerFrom = 4;  // chunks
  return model_vertices > kFinerFrom * std::size_t{kMaxChunkVertices} ? 16384 : kMaxChunkVertices;
}

/// Splits by material, then by a kd tree over triangle centres until every chunk fits.
/// Takes ownership of the mesh. Errors: kUnsupported "model.max-error" where one triangle is longer
/// than max_side.
Result<ChunkedMesh> chunk(TriMesh mesh, const ChunkOptions& options, Report& report);

/// As ChunkRecord has them.
struct ChunkBounds {
  glm::vec3 low{0.0f};
  glm::vec3 high{0.0f};
  glm::vec3 cone_axis{0.0f};
  float cone_cutoff = 2.0f;  ///< > 1: never culled
};

/// positions: decoded, as the device will have them. Triangles without area are invisible and do
/// not count.
ChunkBounds chunk_bounds(std::span<const glm::vec3> positions,
                         std::span<const std::uint16_t> indices);

}  // namespace modar
