// Welded triangles in [-1,1], and the placement that maps them back to source units.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/import/source_model.hpp"
#include "formats/base/error.hpp"

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
  Array<VertexBones> vertex_bones;
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

/// The error of a stage that has no triangle to work on. why: what became of them.
inline tl::unexpected<Error> no_triangle_left(const std::string& model, const char* why) {
  return fail(ExitCode::kInvalidInput, "model.empty", model,
              std::string("no triangle is left: ") + why,
              "check the model in a viewer and export it again");
}

/// Distance of uv outside [0,1] that counts as inside. Larger clamps textures that repeat by a
/// sliver; smaller repeats those with rounding errors.
inline constexpr double kUvSlack = 1e-4;

/// For each material SourceMaterial::beyond, 0 where none of its triangles samples outside of
/// [0,1].
inline std::vector<std::uint32_t> repeating_materials(const TriMesh& mesh) {
  std::vector<std::uint32_t> repeats(mesh.materials.size(), 0);
  if (mesh.uvs.empty()) return repeats;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      const glm::dvec2& uv = mesh.uvs[v];
      if (uv.x < -kUvSlack || uv.y < -kUvSlack || uv.x > 1 + kUvSlack || uv.y > 1 + kUvSlack) {
        const std::uint32_t material = mesh.triangle_material[t];
        repeats[material] = mesh.materials[material].beyond;
      }
    }
  }
  return repeats;
}

}  // namespace modar
