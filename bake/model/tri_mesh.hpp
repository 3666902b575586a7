// Welded triangles in [-1,1], and the way back to source units.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/model/source_model.hpp"
#include "formats/error.hpp"

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
  Placement placement;
  glm::dvec3 source_min{0.0};
  glm::dvec3 source_max{0.0};
  std::vector<glm::dvec3> positions;           ///< in [-1,1]
  std::vector<std::uint32_t> source_position;  ///< index of the source position of each vertex
  std::vector<glm::dvec3> normals;             ///< unit length
  std::vector<glm::dvec2> uvs;
  std::vector<glm::u8vec4> colours;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> triangle_material;
  std::vector<SourceMaterial> materials;
  std::uint64_t source_vertex_count = 0;
  std::uint64_t source_face_count = 0;
};

/// Triangulates (concave polygons by ear clipping), drops what has no area, welds on index triples,
/// makes missing normals (angle-weighted, smoothing groups respected), normalises to [-1,1].
/// Findings of dropped and made things go to report.findings.
/// Errors: kInvalidInput "model.empty" where no triangle is left.
Result<TriMesh> weld(const SourceModel& source, Report& report);

}  // namespace modar
