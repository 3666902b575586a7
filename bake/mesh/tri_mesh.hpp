// Welded triangles in [-1,1], and the placement that maps them back to source units.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/import/source_model.hpp"

namespace modar {

/// source = center + scale * normalised. Taken in double before anything is rounded.
struct Placement {
  glm::dvec3 center{0.0};
  double scale = 1.0;
};

/// Vertices are unique (position, uv, normal) index triples of the source. Attribute arrays are
/// empty or as long as positions. uv: v down (row 0 of the image at v = 0), as GL samples our
/// textures.
struct TriMesh {
  std::string name;
  Upright up;  ///< as the source says it; see find_up()
  Placement placement;
  glm::dvec3 source_min{0.0};  ///< of the vertices that triangles use
  glm::dvec3 source_max{0.0};
  Array<glm::dvec3> positions;  ///< in [-1,1]
  /// Index of the source position of each vertex; empty where vertex v is position v.
  Array<std::uint32_t> source_positions;
  Array<glm::vec3> normals;  ///< unit length
  Array<glm::dvec2> uvs;
  /// Where make_atlases() moved uvs: those on the pictures before, in the same unit (times the
  /// longer side of the texture: texels), so that neighbours on one picture are still neighbours.
  Array<glm::dvec2> picture_uvs;
  Array<glm::u8vec4> colours;
  Array<std::uint8_t> occlusion;  ///< see measure_occlusion(); only where it was measured
  Array<std::array<std::uint32_t, 3>> triangles;
  Array<std::uint32_t> triangle_material;
  std::vector<SourceMaterial> materials;
  std::uint64_t source_vertex_count = 0;
  std::uint64_t source_face_count = 0;
  std::uint64_t cut_vertices = 0;  ///< of positions that the source does not have, the last ones

  [[nodiscard]] std::uint32_t source_position(std::uint32_t vertex) const {
    return source_positions.empty() ? vertex : source_positions[vertex];
  }
};

}  // namespace modar
