// Simplifies a whole mesh with meshoptimizer and measures the distance from its source.
#include "bake/mesh/lod/reduce.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <unordered_map>

#include <glm/geometric.hpp>

#include "bake/mesh/rays/triangle_tree.hpp"

namespace modar {
namespace {

/// Of the source, spread evenly over its vertices. Each costs some 2 us, all 0.4 s.
constexpr std::size_t kDistanceSamples = 200000;

/// Corners numbered so that each number belongs to one vertex and one material: the simplifier,
/// which knows nothing of materials, takes their borders for seams.
struct MaterialCorners {
  Array<std::uint32_t> indices;
  Array<std::uint32_t> vertices;   ///< of the mesh, by number
  Array<std::uint32_t> materials;  ///< by number
};

MaterialCorners number_corners(const TriMesh& mesh) {
  MaterialCorners corners;
  corners.indices.reserve(3 * mesh.triangles.size());
  Array<std::uint32_t> first(mesh.positions.size(), kNoIndex);  // number of a vertex' first use
  std::unordered_map<std::uint64_t, std::uint32_t> further;     // by vertex and material
  const auto add = [&](std::uint32_t vertex, std::uint32_t material) {
    corners.vertices.push_back(vertex);
    corners.materials.push_back(material);
    return static_cast<std::uint32_t>(corners.vertices.size() - 1);
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t material = mesh.triangle_material[t];
    for (const std::uint32_t v : mesh.triangles[t]) {
      std::uint32_t& number = first[v];
      if (number == kNoIndex) number = add(v, material);
      if (corners.materials[number] == material) {
        corners.indices.push_back(number);
        continue;
      }
      const auto [found, added] = further.try_emplace(std::uint64_t{material} << 32 | v, 0);
      if (added) found->second = add(v, material);
      corners.indices.push_back(found->second);
    }
  }
  return corners;
}

/// Indices of the remaining triangles, in the order of the source.
Array<std::uint32_t> simplify(const TriMesh& mesh, const MaterialCorners& corners,
                              std::size_t most_triangles) {
  Array<float> positions(3 * corners.vertices.size());
  for (std::size_t i = 0; i < corners.vertices.size(); ++i) {
    const glm::dvec3& p = mesh.positions[corners.vertices[i]];
    for (int k = 0; k < 3; ++k)
      positions[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p[k]);
  }
  Array<std::uint32_t> left(corners.indices.size());
  constexpr float kAnyError = 1.0f;
  left.resize(meshopt_simplify(left.data(), corners.indices.data(), corners.indices.size(),
                               positions.data(), corners.vertices.size(), 3 * sizeof(float),
                               3 * most_triangles, kAnyError, 0, nullptr));
  return left;
}

template <class T>
void take_over(const Array<T>& from, std::size_t at, Array<T>& to) {
  if (!from.empty()) to.push_back(from[at]);
}

/// The vertices and triangles that are left, vertices in the order of their first use.
TriMesh mesh_of(const TriMesh& source, const MaterialCorners& corners,
                const Array<std::uint32_t>& left) {
  TriMesh mesh;
  mesh.name = source.name;
  mesh.placement = source.placement;
  mesh.source_min = source.source_min;
  mesh.source_max = source.source_max;
  mesh.materials = source.materials;
  mesh.source_vertex_count = source.source_vertex_count;
  mesh.source_face_count = source.source_face_count;
  Array<std::uint32_t> places(source.positions.size(), kNoIndex);
  for (std::size_t i = 0; i < left.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = corners.vertices[left[i + k]];
      if (places[v] == kNoIndex) {
        places[v] = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(source.positions[v]);
        mesh.source_positions.push_back(source.source_position(v));
        take_over(source.normals, v, mesh.normals);
        take_over(source.uvs, v, mesh.uvs);
        take_over(source.colours, v, mesh.colours);
        take_over(source.vertex_bones, v, mesh.vertex_bones);
      }
      triangle[k] = places[v];
    }
    mesh.triangles.push_back(triangle);
    mesh.triangle_material.push_back(corners.materials[left[i]]);
  }
  return mesh;
}

/// Distances of the source's vertices from the mesh, model space.
struct Loss {
  double greatest = 0;
  double rms = 0;
  std::size_t samples = 0;
};

Loss measure_loss(const TriMesh& source, const TriMesh& mesh) {
  TriangleTree tree({mesh.positions.data(), mesh.positions.size()},
                    {mesh.triangles.begin(), mesh.triangles.end()});
  const std::size_t count = source.positions.size();
  const std::size_t step = (count + kDistanceSamples - 1) / kDistanceSamples;
  Loss found;
  double sum = 0;
  for (std::size_t v = 0; v < count; v += step, ++found.samples) {
    const double square = tree.nearest(source.positions[v]);
    found.greatest = std::max(found.greatest, square);
    sum += square;
  }
  found.greatest = std::sqrt(found.greatest);
  found.rms = std::sqrt(sum / static_cast<double>(found.samples));
  return found;
}

Diagnostic what_was_lost(const TriMesh& source, const TriMesh& mesh, std::size_t most_triangles,
                         const Loss& lost) {
  const double scale = source.placement.scale;
  const double diagonal = glm::length(source.source_max - source.source_min);
  char text[256];
  std::snprintf(text, sizeof text,
                "reduced from %zu to %zu triangles: at %zu vertices of the source, the surface is "
                "off by at most %.3g (%.3g %% of the diagonal), rms %.3g",
                source.triangles.size(), mesh.triangles.size(), lost.samples, lost.greatest * scale,
                diagonal > 0 ? 100 * lost.greatest * scale / diagonal : 0.0, lost.rms * scale);
  if (mesh.triangles.size() <= most_triangles) {
    return {"model.reduced",           DiagnosticSeverity::kInfo, source.name, 0, text,
            "a higher tier keeps more"};
  }
  return {"model.reduced",
          DiagnosticSeverity::kWarning,
          source.name,
          0,
          std::string(text) + "; " + std::to_string(most_triangles) +
              " were requested, but its seams, pieces and faults allow no fewer",
          "join its pieces and weld its seams, or bake a simpler model"};
}

}  // namespace

TriMesh reduce(TriMesh mesh, std::size_t most_triangles, Report& report) {
  if (mesh.triangles.size() <= most_triangles) return mesh;
  StageTimer timer(report, "reduce");
  const MaterialCorners corners = number_corners(mesh);
  const Array<std::uint32_t> left = simplify(mesh, corners, most_triangles);
  if (left.empty()) return mesh;
  TriMesh reduced = mesh_of(mesh, corners, left);
  const Loss lost = measure_loss(mesh, reduced);
  report.diagnostics.push_back(what_was_lost(mesh, reduced, most_triangles, lost));
  timer.done(mesh.triangles.size(), reduced.triangles.size(), lost.greatest * mesh.placement.scale);
  return reduced;
}

}  // namespace modar
