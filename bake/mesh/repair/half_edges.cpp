// What OpenMesh's half-edge mesh makes of the triangles.
#include <array>
#include <cstdint>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "bake/mesh/repair/surface.hpp"

namespace modar::repair {
namespace {

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

}  // namespace

HalfEdgeCount count_half_edges(const Faces& surface) {
  omerr().disable();  // it writes to stderr for every face it refuses
  TopologyMesh mesh;
  mesh.reserve(surface.positions.size(), surface.corners.size() / 2, surface.triangles());
  for (std::size_t v = 0; v < surface.positions.size(); ++v) mesh.new_vertex();
  HalfEdgeCount count;
  for (std::size_t i = 0; i < surface.corners.size(); i += 3) {
    std::array<TopologyMesh::VertexHandle, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      face[k] = TopologyMesh::VertexHandle(static_cast<int>(surface.corners[i + k]));
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

}  // namespace modar::repair
