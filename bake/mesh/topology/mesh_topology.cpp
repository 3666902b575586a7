// Topology by vertex links: a triangle at a vertex is an edge between its two other vertices, and
// all counts can be read off that small graph. OpenMesh walks the borders of its half-edge mesh.
#include "bake/mesh/topology/mesh_topology.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "formats/base/parallel.hpp"

namespace modar {
namespace {

// What OpenMesh's half-edge mesh makes of the triangles.

/// Links alone: no normals, no status.
struct TopologyTraits : OpenMesh::DefaultTraits {
  HalfedgeAttributes(OpenMesh::Attributes::None);
};
using TopologyMesh = OpenMesh::TriMesh_ArrayKernelT<TopologyTraits>;

/// Number of borders. A walk ends where it began: the next half-edge of a border is on the border.
std::uint64_t count_loops(const TopologyMesh& mesh) {
  std::vector<bool> walked(mesh.n_halfedges(), false);
  std::uint64_t loops = 0;
  for (const auto start : mesh.halfedges()) {
    if (!mesh.is_boundary(start) || walked[static_cast<std::size_t>(start.idx())]) continue;
    ++loops;
    TopologyMesh::HalfedgeHandle at = start;
    do {
      walked[static_cast<std::size_t>(at.idx())] = true;
      at = mesh.next_halfedge_handle(at);
    } while (at != start);
  }
  return loops;
}

HalfEdgeCount count_half_edges(std::size_t vertex_count, std::span<const std::uint32_t> indices) {
  omerr().disable();  // it writes to stderr for every face it refuses
  TopologyMesh mesh;
  mesh.reserve(vertex_count, indices.size() / 2, indices.size() / 3);
  for (std::size_t v = 0; v < vertex_count; ++v) mesh.new_vertex();
  HalfEdgeCount count;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    std::array<TopologyMesh::VertexHandle, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      face[k] = TopologyMesh::VertexHandle(static_cast<int>(indices[i + k]));
    }
    if (mesh.add_face(face.data(), 3).is_valid()) continue;
    for (TopologyMesh::VertexHandle& vertex : face) vertex = mesh.new_vertex();
    mesh.add_face(face.data(), 3);
    ++count.copied_faces;
    count.copied_vertices += 3;
  }
  count.boundary_loops = count_loops(mesh);
  return count;
}

// Figures by the links of vertices.

/// Bytes of OpenMesh's mesh per triangle: 1.5 edges of two linked half-edges, a face, half a
/// vertex.
constexpr std::uint64_t kHalfEdgeBytes = 64;
/// Vertices that a thread takes at a time: a million make 62 parts, so that eight threads wait for
/// each other by an eighth of the time at most.
constexpr std::size_t kVerticesPerPart = 1u << 14;

/// Triangles by the positions that they refer to.
struct Surface {
  std::size_t position_count = 0;
  Array<std::uint32_t> corners;  ///< 3 a triangle
  Array<std::uint32_t> first;    ///< of each position: where its triangles begin in `around`
  Array<std::uint32_t> around;   ///< triangles
};

Surface make_surface(const TriMesh& mesh) {
  Surface surface;
  surface.position_count =
      mesh.source_positions.empty() ? mesh.positions.size() : mesh.source_vertex_count;
  surface.corners.resize(3 * mesh.triangles.size());
  surface.first.assign(surface.position_count + 1, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t p = mesh.source_position(mesh.triangles[t][i]);
      surface.corners[3 * t + i] = p;
      ++surface.first[p + std::size_t{1}];
    }
  }
  for (std::size_t p = 0; p < surface.position_count; ++p) surface.first[p + 1] += surface.first[p];
  surface.around.resize(surface.corners.size());
  Array<std::uint32_t> next(surface.first);
  for (std::size_t i = 0; i < surface.corners.size(); ++i) {
    surface.around[next[surface.corners[i]]++] = static_cast<std::uint32_t>(i / 3);
  }
  return surface;
}

/// A neighbour of the current vertex, once for each triangle that has both.
struct VertexLink {
  std::uint32_t neighbour = 0;
  std::uint32_t triangle = 0;  ///< number among the vertex's own
  bool leaves = false;         ///< the triangle walks the edge from the vertex to the neighbour
};

/// An end of a boundary edge: the edge, and the number of the fan it belongs to at this end.
struct BoundaryEnd {
  std::uint64_t edge = 0;
  std::uint32_t fan = 0;
};

/// The sums of one range of vertices.
struct Part {
  MeshTopology sums;
  std::vector<BoundaryEnd> ends;  ///< fans are counted from 0 in each part
  std::uint32_t fans = 0;         ///< that have ends
};

/// Reads the links of one vertex after another; each thread has its own.
class LinkReader {
 public:
  LinkReader(const Surface& surface, Part& part)
      : surface_(surface), sums_(part.sums), part_(part) {}

  void read(std::uint32_t vertex) {
    const std::uint32_t begin = surface_.first[vertex];
    const std::uint32_t count = surface_.first[vertex + std::size_t{1}] - begin;
    if (count == 0) return;
    ++sums_.vertices;
    gather(vertex, std::span(surface_.around.data() + begin, count));
    fans_.resize(count);
    std::iota(fans_.begin(), fans_.end(), 0u);
    const bool crowded = read_edges(vertex);
    bool several = false;
    for (std::uint32_t t = 0; t < count; ++t) several = several || fan_of(t) != fan_of(0);
    if (crowded || several) ++sums_.non_manifold_vertices;
    add_boundary(vertex);
  }

 private:
  void gather(std::uint32_t vertex, std::span<const std::uint32_t> triangles) {
    spokes_.clear();
    pairs_.clear();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const std::uint32_t* c = surface_.corners.data() + 3 * std::size_t{triangles[t]};
      const int at = c[0] == vertex ? 0 : (c[1] == vertex ? 1 : 2);
      const std::uint32_t ahead = c[(at + 1) % 3];
      const std::uint32_t behind = c[(at + 2) % 3];
      spokes_.push_back({ahead, t, true});
      spokes_.push_back({behind, t, false});
      // Copies of a triangle are counted at its lowest vertex.
      if (vertex < ahead && vertex < behind) {
        pairs_.push_back(std::uint64_t{std::min(ahead, behind)} << 32 | std::max(ahead, behind));
      }
    }
    std::sort(spokes_.begin(), spokes_.end(), [](const VertexLink& a, const VertexLink& b) {
      return a.neighbour != b.neighbour ? a.neighbour < b.neighbour : a.triangle < b.triangle;
    });
    std::sort(pairs_.begin(), pairs_.end());
    for (std::size_t i = 1; i < pairs_.size(); ++i) {
      if (pairs_[i] == pairs_[i - 1]) ++sums_.duplicate_triangles;
    }
  }

  /// Joins the triangles at each edge of the vertex; counts the edges whose lower end it is.
  /// Returns whether one has more than two triangles.
  bool read_edges(std::uint32_t vertex) {
    bool crowded = false;
    for (std::size_t i = 0; i < spokes_.size();) {
      std::size_t end = i;
      std::size_t leaving = 0;
      for (; end < spokes_.size() && spokes_[end].neighbour == spokes_[i].neighbour; ++end) {
        leaving += spokes_[end].leaves ? 1u : 0u;
        fans_[fan_of(spokes_[end].triangle)] = fan_of(spokes_[i].triangle);
      }
      const std::size_t faces = end - i;
      crowded = crowded || faces > 2;
      if (vertex < spokes_[i].neighbour) {
        ++sums_.edges;
        sums_.boundary_edges += faces == 1 ? 1u : 0u;
        sums_.non_manifold_edges += faces > 2 ? 1u : 0u;
        sums_.flipped_edges += faces == 2 && leaving != 1 ? 1u : 0u;
      }
      i = end;
    }
    return crowded;
  }

  /// Boundary edges of the vertex, by the fan that each of them ends.
  void add_boundary(std::uint32_t vertex) {
    numbers_.assign(fans_.size(), kNoIndex);
    for (std::size_t i = 0; i < spokes_.size(); ++i) {
      const std::uint32_t other = spokes_[i].neighbour;
      const bool alone = (i == 0 || spokes_[i - 1].neighbour != other) &&
                         (i + 1 == spokes_.size() || spokes_[i + 1].neighbour != other);
      if (!alone) continue;
      std::uint32_t& number = numbers_[fan_of(spokes_[i].triangle)];
      if (number == kNoIndex) number = part_.fans++;
      part_.ends.push_back(
          {std::uint64_t{std::min(vertex, other)} << 32 | std::max(vertex, other), number});
    }
  }

  std::uint32_t fan_of(std::uint32_t triangle) {
    while (fans_[triangle] != triangle) {
      fans_[triangle] = fans_[fans_[triangle]];
      triangle = fans_[triangle];
    }
    return triangle;
  }

  const Surface& surface_;
  MeshTopology& sums_;
  Part& part_;
  std::vector<VertexLink> spokes_;
  std::vector<std::uint64_t> pairs_;
  std::vector<std::uint32_t> fans_;
  std::vector<std::uint32_t> numbers_;
};

/// Disjoint sets of numbers (union-find).
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  /// The lowest number of a set.
  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  Array<std::uint32_t> parent_;
};

/// Loops: what the two ends of each boundary edge and the fans at them join.
std::uint64_t count_loops(std::vector<Part>& parts) {
  std::vector<BoundaryEnd> ends;
  std::uint32_t fans = 0;
  for (Part& part : parts) {
    for (const BoundaryEnd& end : part.ends) ends.push_back({end.edge, fans + end.fan});
    fans += part.fans;
    part.ends = {};
  }
  std::sort(ends.begin(), ends.end(), [](const BoundaryEnd& a, const BoundaryEnd& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.fan < b.fan;
  });
  DisjointSets sets(fans);
  for (std::size_t i = 0; i + 1 < ends.size(); i += 2) sets.join(ends[i].fan, ends[i + 1].fan);
  std::uint64_t loops = 0;
  for (std::uint32_t f = 0; f < fans; ++f) loops += sets.root(f) == f ? 1u : 0u;
  return loops;
}

/// Components: parts of the surface that share no position.
std::uint64_t count_components(const Surface& surface) {
  DisjointSets sets(surface.position_count);
  for (std::size_t i = 0; i < surface.corners.size(); i += 3) {
    sets.join(surface.corners[i], surface.corners[i + 1]);
    sets.join(surface.corners[i], surface.corners[i + 2]);
  }
  std::uint64_t components = 0;
  for (std::uint32_t v = 0; v < surface.position_count; ++v) {
    if (sets.root(v) == v && surface.first[v] != surface.first[v + std::size_t{1}]) ++components;
  }
  return components;
}

void add(MeshTopology& sum, const MeshTopology& part) {
  sum.vertices += part.vertices;
  sum.edges += part.edges;
  sum.boundary_edges += part.boundary_edges;
  sum.non_manifold_edges += part.non_manifold_edges;
  sum.flipped_edges += part.flipped_edges;
  sum.non_manifold_vertices += part.non_manifold_vertices;
  sum.duplicate_triangles += part.duplicate_triangles;
}

void add_diagnostics(const TriMesh& mesh, const MeshTopology& topology, Report& report) {
  const auto add = [&](std::uint64_t count, const char* id, const std::string& message,
                       const char* cure) {
    if (count == 0) return;
    report.diagnostics.push_back({id, DiagnosticSeverity::kInfo, mesh.name, 0, message, cure});
  };
  add(topology.non_manifold_edges + topology.non_manifold_vertices, "model.non-manifold",
      std::to_string(topology.non_manifold_edges) + " edges have more than two triangles and " +
          std::to_string(topology.non_manifold_vertices) +
          " vertices are where surfaces meet or touch",
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

MeshTopology measure_topology(const TriMesh& mesh, const TopologyOptions& options, Report& report) {
  StageTimer timer(report, "topology");
  MeshTopology topology;
  topology.model = mesh.name;
  Surface surface = make_surface(mesh);
  std::vector<Part> parts((surface.position_count + kVerticesPerPart - 1) / kVerticesPerPart);
  parallel_rows(static_cast<std::uint32_t>(parts.size()), options.jobs, [&](std::uint32_t s) {
    LinkReader reader(surface, parts[s]);
    const std::size_t end =
        std::min(surface.position_count, (s + std::size_t{1}) * kVerticesPerPart);
    for (std::size_t v = s * kVerticesPerPart; v < end; ++v)
      reader.read(static_cast<std::uint32_t>(v));
  });
  for (const Part& part : parts) add(topology, part.sums);
  topology.triangles = mesh.triangles.size();
  topology.boundary_loops = count_loops(parts);
  topology.components = count_components(surface);
  surface.around.release();
  surface.first.release();
  const bool fits = options.half_edge_bytes == 0 ||
                    mesh.triangles.size() * kHalfEdgeBytes <= options.half_edge_bytes;
  if (fits) {
    topology.half_edges = count_half_edges(
        surface.position_count, std::span(surface.corners.data(), surface.corners.size()));
  }
  add_diagnostics(mesh, topology, report);
  timer.done(topology.triangles, topology.components);
  return topology;
}

}  // namespace modar
