// Builds OpenMesh's half-edge mesh and walks its borders.
#include "bake/mesh/topology/half_edge_topology.hpp"

#include <array>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

namespace modar {
namespace {

/// Links alone: no normals, no status.
struct Traits : OpenMesh::DefaultTraits {
  HalfedgeAttributes(OpenMesh::Attributes::None);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

/// Borders, each walked once. A walk ends where it began: next half-edges of a border are a border.
std::uint64_t count_loops(const Mesh& mesh) {
  std::vector<bool> walked(mesh.n_halfedges(), false);
  std::uint64_t loops = 0;
  for (const auto start : mesh.halfedges()) {
    if (!mesh.is_boundary(start) || walked[static_cast<std::size_t>(start.idx())]) continue;
    ++loops;
    Mesh::HalfedgeHandle at = start;
    do {
      walked[static_cast<std::size_t>(at.idx())] = true;
      at = mesh.next_halfedge_handle(at);
    } while (at != start);
  }
  return loops;
}

}  // namespace

HalfEdgeCount count_half_edges(std::size_t vertex_count, std::span<const std::uint32_t> indices) {
  omerr().disable();  // it tells stderr of every face that it refuses
  Mesh mesh;
  mesh.reserve(vertex_count, indices.size() / 2, indices.size() / 3);
  for (std::size_t v = 0; v < vertex_count; ++v) mesh.new_vertex();
  HalfEdgeCount count;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    std::array<Mesh::VertexHandle, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      face[k] = Mesh::VertexHandle(static_cast<int>(indices[i + k]));
    }
    if (mesh.add_face(face.data(), 3).is_valid()) continue;
    for (Mesh::VertexHandle& vertex : face) vertex = mesh.new_vertex();
    mesh.add_face(face.data(), 3);
    ++count.copied_faces;
    count.copied_vertices += 3;
  }
  count.boundary_loops = count_loops(mesh);
  return count;
}

}  // namespace modar
