// OpenMesh's quadric decimater on one chunk.
#include "bake/model/chunk_decimate.hpp"

#include <array>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

namespace modar {
namespace {

/// No face may turn by more in one collapse.
constexpr float kMaxTurnDegrees = 60.0f;

struct Traits : OpenMesh::DefaultTraitsDouble {
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge | OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Decimater = OpenMesh::Decimater::DecimaterT<Mesh>;

/// A mesh of OpenMesh's, and which of our vertices each of its own is.
struct HalfEdges {
  Mesh mesh;
  std::vector<std::uint16_t> ours;
};

Mesh::VertexHandle add_vertex(HalfEdges& edges, std::span<const glm::dvec3> positions,
                              std::uint16_t ours) {
  const glm::dvec3& p = positions[ours];
  edges.ours.push_back(ours);
  return edges.mesh.add_vertex(Mesh::Point(p.x, p.y, p.z));
}

void build(std::span<const glm::dvec3> positions, std::span<const std::uint16_t> indices,
           HalfEdges& edges) {
  Mesh& mesh = edges.mesh;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    add_vertex(edges, positions, static_cast<std::uint16_t>(v));
  }
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    std::array<Mesh::VertexHandle, 3> face;
    for (std::size_t k = 0; k < 3; ++k) face[k] = Mesh::VertexHandle(indices[i + k]);
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    if (mesh.add_face(face.data(), 3).is_valid()) continue;
    // A third triangle at an edge stands alone, on copies of its vertices, all of them border.
    for (std::size_t k = 0; k < 3; ++k) face[k] = add_vertex(edges, positions, indices[i + k]);
    mesh.add_face(face.data(), 3);
  }
}

std::vector<std::uint16_t> remaining(const HalfEdges& edges) {
  std::vector<std::uint16_t> indices;
  for (const auto face : edges.mesh.faces()) {
    if (edges.mesh.status(face).deleted()) continue;
    for (const auto v : edges.mesh.fv_range(face)) {
      indices.push_back(edges.ours[static_cast<std::size_t>(v.idx())]);
    }
  }
  return indices;
}

}  // namespace

std::vector<std::vector<std::uint16_t>> decimate_chunk(std::span<const glm::dvec3> positions,
                                                       std::span<const std::uint16_t> indices,
                                                       std::span<const std::uint8_t> locked,
                                                       std::span<const std::size_t> targets,
                                                       double max_error) {
  // OpenMesh tells stderr of every face that it refuses.
  omerr().disable();
  HalfEdges edges;
  build(positions, indices, edges);
  Mesh& mesh = edges.mesh;
  for (const auto v : mesh.vertices()) {
    const auto ours = edges.ours[static_cast<std::size_t>(v.idx())];
    if (locked[ours] != 0 || mesh.is_boundary(v) || !mesh.is_manifold(v)) {
      mesh.status(v).set_locked(true);
    }
  }
  mesh.update_face_normals();
  Decimater decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<Mesh>::Handle turn;
  decimater.add(quadric);
  decimater.add(turn);
  decimater.module(quadric).set_max_err(max_error * max_error, false);
  decimater.module(turn).set_max_normal_deviation(kMaxTurnDegrees);
  std::vector<std::vector<std::uint16_t>> results;
  if (!decimater.initialize()) return results;
  std::size_t alive = mesh.n_faces();
  for (const std::size_t target : targets) {
    // The decimater counts from all faces, those that it took out before among them.
    if (target < alive) decimater.decimate_to_faces(0, mesh.n_faces() - (alive - target));
    results.push_back(remaining(edges));
    alive = results.back().size() / 3;
  }
  return results;
}

}  // namespace modar
