// Topology of a mesh, read off the edges and fans at each position.
#include <string>
#include <vector>

#include "bake/mesh/repair/repair.hpp"
#include "bake/mesh/repair/surface.hpp"

namespace modar {
namespace {

using namespace repair;

/// Bytes of OpenMesh's mesh per triangle: 1.5 edges of two linked half-edges, a face, half a
/// vertex.
constexpr std::uint64_t kHalfEdgeBytes = 64;

class TopologyReader {
 public:
  TopologyReader(const Faces& surface, MeshTopology& sums)
      : surface_(surface), around_(surface), sums_(sums), loops_(surface.corners.size()) {}

  void run() {
    for (std::uint32_t v = 0; v < surface_.positions.size(); ++v) {
      if (!around_.at(v).empty()) read(v);
    }
    sums_.boundary_edges = open_.size();
    for (const std::uint32_t h : open_) sums_.boundary_loops += loops_.root(h) == h ? 1u : 0u;
    sums_.components = Components(surface_, open_).count();
  }

 private:
  void read(std::uint32_t v) {
    const std::span<const std::uint32_t> corners = around_.at(v);
    ++sums_.vertices;
    fans_.read(surface_, corners);
    rims_.assign(corners.size(), repair::kNone);
    bool crowded = false;
    for (std::size_t i = 0, end = 0; i < fans_.spokes.size(); i = end) {
      const Fans::Spoke& spoke = fans_.spokes[i];
      while (end < fans_.spokes.size() && fans_.spokes[end].neighbour == spoke.neighbour) ++end;
      const std::size_t triangles = end - i;
      crowded = crowded || triangles > 2;
      if (triangles == 1) {
        std::uint32_t& rim = rims_[fans_.sets.root(spoke.number)];
        if (rim == repair::kNone) rim = spoke.half_edge;
        loops_.join(rim, spoke.half_edge);
      }
      if (spoke.neighbour > v) count_edge(std::span(fans_.spokes).subspan(i, triangles));
    }
    if (crowded || fans_.count > 1) ++sums_.non_manifold_vertices;
    each_repeated(
        surface_, corners, v, [&](std::uint32_t) { ++sums_.duplicate_triangles; }, true);
  }

  void count_edge(std::span<const Fans::Spoke> edge) {
    ++sums_.edges;
    if (edge.size() == 1) open_.push_back(edge[0].half_edge);
    if (edge.size() > 2) ++sums_.non_manifold_edges;
    if (edge.size() == 2 &&
        surface_.corners[edge[0].half_edge] == surface_.corners[edge[1].half_edge]) {
      ++sums_.flipped_edges;
    }
  }

  const Faces surface_;
  const Around around_;
  MeshTopology& sums_;
  Fans fans_;
  std::vector<std::uint32_t> rims_;  // of each fan: an open half-edge
  Sets loops_;                       // of open half-edges that one rim has
  std::vector<std::uint32_t> open_;  // half-edges
};

void add_diagnostics(const TriMesh& mesh, const MeshTopology& topology, Report& report) {
  const auto add = [&](std::uint64_t count, const char* id, const std::string& message,
                       const char* cure) {
    if (count == 0) return;
    report.diagnostics.push_back({id, DiagnosticSeverity::kInfo, mesh.name, 0, message, cure});
  };
  add(topology.non_manifold_edges + topology.non_manifold_vertices, "model.non-manifold",
      with_numbers(
          "{} edges have more than two triangles and {} vertices are where surfaces meet or touch",
          {topology.non_manifold_edges, topology.non_manifold_vertices}),
      "they are kept unchanged; levels of detail leave them in place");
  add(topology.duplicate_triangles, "model.duplicate-faces",
      std::to_string(topology.duplicate_triangles) + " triangles repeat an earlier one",
      "they are kept; remove them in a modelling program, they cost time and may flicker");
  add(topology.flipped_edges, "model.flipped",
      std::to_string(topology.flipped_edges) + " edges join triangles of opposite winding",
      "recalculate the normals in a modelling program if sides of the model are missing");
  if (!topology.half_edges) return;
  add(topology.half_edges->copied_faces, "model.copied-faces",
      std::to_string(topology.half_edges->copied_faces) +
          " faces fit in no half-edge mesh (three at an edge, or turned over)",
      "levels of detail keep them unchanged");
}

}  // namespace

MeshTopology measure_topology(const TriMesh& mesh, std::uint64_t half_edge_bytes, Report& report) {
  StageTimer timer(report, "topology");
  MeshTopology topology;
  topology.model = mesh.name;
  topology.triangles = mesh.triangles.size();
  const SourceFaces faces(mesh);
  TopologyReader(faces.surface(), topology).run();
  if (half_edge_bytes == 0 || topology.triangles * kHalfEdgeBytes <= half_edge_bytes) {
    topology.half_edges = count_half_edges(faces.surface());
  }
  add_diagnostics(mesh, topology, report);
  timer.done(topology.triangles, topology.components);
  return topology;
}

}  // namespace modar
