// OpenMesh's decimater on one chunk, with faster tests and our own quadric module.
#include "bake/mesh/lod/chunk_decimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
// Needs the vector traits of the mesh.
#include <OpenMesh/Core/Geometry/QuadricT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModBaseT.hh>
#include <glm/geometric.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/triangle_tree.hpp"

namespace modar {
namespace {

struct Projection {
  const KeptTriangle* face = nullptr;
  Foot foot;
};

Projection nearest_of(const ChunkVertices& vertices, std::uint16_t vertex,
                      std::span<const KeptTriangle> faces) {
  Projection nearest;
  for (const KeptTriangle& face : faces) {
    const auto& [a, b, c] = face.corners;
    const Foot foot =
        nearest_foot(vertices.positions[vertex],
                     {vertices.positions[a], vertices.positions[b], vertices.positions[c]});
    if (nearest.face == nullptr || foot.square < nearest.foot.square) nearest = {&face, foot};
  }
  return nearest;
}

double shift_at(const ChunkVertices& vertices, std::uint16_t vertex, const Projection& projection) {
  const auto& [a, b, c] = projection.face->corners;
  const std::span<const glm::dvec2> uvs = vertices.uvs;
  const glm::dvec2 there =
      uvs[a] + projection.foot.b * (uvs[b] - uvs[a]) + projection.foot.c * (uvs[c] - uvs[a]);
  return glm::length(there - uvs[vertex]);
}

}  // namespace

double uv_shift_of(const ChunkVertices& vertices, std::uint16_t vertex,
                   std::span<const KeptTriangle> faces) {
  return shift_at(vertices, vertex, nearest_of(vertices, vertex, faces));
}

RemovedVertexMap::RemovedVertexMap(const ChunkVertices& vertices, std::size_t faces)
    : vertices_(vertices),
      face_of_(vertices.positions.size(), kNoIndex),
      first_(faces, kNoIndex),
      next_(vertices.positions.size(), kNoIndex),
      uv_shifts_(faces, 0.0) {}

void RemovedVertexMap::detach_triangle(std::uint32_t face) {
  for (std::uint32_t v = first_[face]; v != kNoIndex; v = next_[v]) {
    detached_.push_back(static_cast<std::uint16_t>(v));
  }
  first_[face] = kNoIndex;
  uv_shifts_[face] = 0;
}

void RemovedVertexMap::reattach(std::span<const KeptTriangle> faces) {
  for (const std::uint16_t vertex : detached_) {
    const Projection projection = nearest_of(vertices_, vertex, faces);
    const std::uint32_t face = projection.face->face;
    face_of_[vertex] = face;
    next_[vertex] = first_[face];
    first_[face] = vertex;
    if (vertices_.uvs.empty()) continue;
    uv_shifts_[face] = std::max(uv_shifts_[face], shift_at(vertices_, vertex, projection));
  }
  detached_.clear();
}
namespace {

/// Square of the cosine of 60 degrees: no face may turn by more in one collapse.
constexpr double kLeastTurn = 0.25;

struct Traits : OpenMesh::DefaultTraitsDouble {
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge | OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};
using Kernel = OpenMesh::TriMesh_ArrayKernelT<Traits>;

std::size_t at(OpenMesh::BaseHandle handle) {
  return static_cast<std::size_t>(handle.idx());
}

/// The tests of a collapse that the decimater asks for most, which OpenMesh's library answers
/// through asserts that compare names of properties: half of the time of a decimation.
class Mesh : public Kernel {
 public:
  /// That of TriConnectivity, for a vertex v0 that is inside the surface (others are locked).
  bool is_collapse_ok(HalfedgeHandle v0v1) {
    if (status(edge_handle(v0v1)).deleted()) return false;
    const VertexHandle v0 = from_vertex_handle(v0v1);
    const VertexHandle v1 = to_vertex_handle(v0v1);
    if (status(v0).deleted() || status(v1).deleted()) return false;
    mark_ring(v0);
    // The two triangles that vanish have a common neighbour each; with another, the surface folds.
    std::size_t common = 0;
    HalfedgeHandle h = opposite_halfedge_handle(v0v1);
    const HalfedgeHandle first = h;
    do {
      if (marks_[at(to_vertex_handle(h))] == mark_) ++common;
      h = opposite_halfedge_handle(prev_halfedge_handle(h));
    } while (h != first);
    return common == 2;
  }

  HalfedgeHandle find_halfedge(VertexHandle from, VertexHandle to) const {
    const HalfedgeHandle first = halfedge_handle(from);
    HalfedgeHandle h = first;
    do {
      if (to_vertex_handle(h) == to) return h;
      h = opposite_halfedge_handle(prev_halfedge_handle(h));
    } while (h != first);
    return HalfedgeHandle();
  }

  void collapse(HalfedgeHandle v0v1) {
    marked_ = VertexHandle();
    Kernel::collapse(v0v1);
  }

 private:
  void mark_ring(VertexHandle v) {
    if (v == marked_) return;
    marked_ = v;
    marks_.resize(n_vertices());
    ++mark_;
    const HalfedgeHandle first = halfedge_handle(v);
    HalfedgeHandle h = first;
    do {
      marks_[at(to_vertex_handle(h))] = mark_;
      h = opposite_halfedge_handle(prev_halfedge_handle(h));
    } while (h != first);
  }

  std::vector<std::uint32_t> marks_;  // mark_ where a vertex is a neighbour of marked_
  std::uint32_t mark_ = 0;
  VertexHandle marked_;
};
using Decimater = OpenMesh::Decimater::DecimaterT<Mesh>;

/// Planes of triangles, each as heavy as its area: squares of distances from them.
struct Planes {
  OpenMesh::Geometry::Quadricd squares;
  double area = 0;
};

/// What the texture's shift counts in the price of a collapse beside the surface's own.
constexpr double kShiftWeight = 0.25;

/// Prices and judges collapses: squares of distances from all planes that the vertices stand for
/// (Garland and Heckbert), and of the texture's shift.
class Quadrics : public OpenMesh::Decimater::ModBaseT<Mesh> {
 public:
  using Base = OpenMesh::Decimater::ModBaseT<Mesh>;
  using Handle = OpenMesh::Decimater::ModHandleT<Quadrics>;
  DECIMATER_MODNAME(Quadrics)

  explicit Quadrics(Mesh& mesh) : Base(mesh, false) {}

  /// ours: of each vertex. All but the limits must outlive the module.
  void set(const ChunkVertices& vertices, const DecimateLimits& limits,
           std::span<const std::uint16_t> ours, RemovedVertexMap& removed) {
    vertices_ = vertices;
    limits_ = limits;
    ours_ = ours;
    removed_ = &removed;
  }

  void initialize() override {
    planes_.assign(mesh().n_vertices(), {});
    for (const auto face : mesh().faces()) {
      std::array<Mesh::VertexHandle, 3> v;
      std::size_t count = 0;
      for (const auto corner : mesh().fv_range(face)) v[count++] = corner;
      const Mesh::Point& origin = mesh().point(v[0]);
      const Mesh::Point normal = (mesh().point(v[1]) - origin) % (mesh().point(v[2]) - origin);
      const double twice = normal.norm();
      if (!(twice > 0)) continue;
      Planes plane{{normal / twice, origin}, 0.5 * twice};
      plane.squares *= plane.area;
      for (const auto corner : v) add(planes_[at(corner)], plane);
    }
  }

  /// The decimater looks for the cheapest collapse of one vertex after another: what costs no less
  /// than one that this vertex has is not looked into.
  float collapse_priority(const CollapseInfo& info) override {
    if (info.v0 != vertex_) {
      vertex_ = info.v0;
      least_ = std::numeric_limits<float>::max();
    }
    const Planes& from = planes_[at(info.v0)];
    const Planes& to = planes_[at(info.v1)];
    double price = std::max(0.0, from.squares(info.p1) + to.squares(info.p1));
    if (price > limits_.max_error * limits_.max_error * (from.area + to.area) ||
        static_cast<float>(price) >= least_ || turns(info)) {
      return ILLEGAL_COLLAPSE;
    }
    if (!vertices_.uvs.empty()) {
      const double shift = shift_after(info);
      if (shift > limits_.max_uv_shift) return ILLEGAL_COLLAPSE;
      const double slide = shift * limits_.length_of_uv;
      price += kShiftWeight * from.area * slide * slide;
      if (static_cast<float>(price) >= least_) return ILLEGAL_COLLAPSE;
    }
    least_ = static_cast<float>(price);
    return least_;
  }

  void preprocess_collapse(const CollapseInfo& info) override {
    removed_->detach_vertex(ours_[at(info.v0)]);
    for (const auto face : mesh().vf_range(info.v0)) {
      removed_->detach_triangle(static_cast<std::uint32_t>(face.idx()));
    }
    collect(info);
  }

  void postprocess_collapse(const CollapseInfo& info) override {
    vertex_ = Mesh::VertexHandle();
    add(planes_[at(info.v1)], planes_[at(info.v0)]);
    removed_->reattach(faces_);
  }

 private:
  static void add(Planes& to, const Planes& planes) {
    to.squares += planes.squares;
    to.area += planes.area;
  }

  /// Calls back with each triangle around v0 that stays, and its corners beside v0, in order; ends
  /// where the answer is false.
  template <typename Callback>
  void around(const CollapseInfo& info, const Callback& callback) {
    const Mesh& m = mesh();
    const Mesh::HalfedgeHandle first = m.halfedge_handle(info.v0);
    Mesh::HalfedgeHandle h = first;
    do {
      const Mesh::FaceHandle face = m.face_handle(h);
      if (face != info.fl && face != info.fr &&
          !callback(face, m.to_vertex_handle(h), m.to_vertex_handle(m.next_halfedge_handle(h)))) {
        return;
      }
      h = m.opposite_halfedge_handle(m.prev_halfedge_handle(h));
    } while (h != first);
  }

  /// Would a triangle that stays turn too far, or lose its area?
  bool turns(const CollapseInfo& info) {
    bool found = false;
    around(info, [&](Mesh::FaceHandle, Mesh::VertexHandle v, Mesh::VertexHandle w) {
      const Mesh::Point& a = mesh().point(v);
      const Mesh::Point& b = mesh().point(w);
      const Mesh::Point before = (a - info.p0) % (b - info.p0);
      const Mesh::Point after = (a - info.p1) % (b - info.p1);
      const double dot = before | after;
      found = !(dot > 0) || dot * dot < kLeastTurn * before.sqrnorm() * after.sqrnorm();
      return !found;
    });
    return found;
  }

  /// The triangles that stay, as they are after the collapse.
  void collect(const CollapseInfo& info) {
    faces_.clear();
    around(info, [&](Mesh::FaceHandle face, Mesh::VertexHandle v, Mesh::VertexHandle w) {
      faces_.push_back({static_cast<std::uint32_t>(face.idx()),
                        {ours_[at(info.v1)], ours_[at(v)], ours_[at(w)]}});
      return true;
    });
  }

  /// The uv_shift that the collapse may lead to: that of v0, beside what its triangles are off by.
  double shift_after(const CollapseInfo& info) {
    double before = 0;
    for (const auto face : mesh().vf_range(info.v0)) {
      before = std::max(before, removed_->uv_shift(static_cast<std::uint32_t>(face.idx())));
    }
    collect(info);
    return before + uv_shift_of(vertices_, ours_[at(info.v0)], faces_);
  }

  std::vector<Planes> planes_;  // of each vertex
  ChunkVertices vertices_;
  DecimateLimits limits_;
  std::span<const std::uint16_t> ours_;
  RemovedVertexMap* removed_ = nullptr;
  Mesh::VertexHandle vertex_;  // the one whose collapses are priced
  float least_ = 0;
  std::vector<KeptTriangle> faces_;  // what stays of the triangles around a vertex that goes
};

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
  mesh.reserve(positions.size(), indices.size() / 2, indices.size() / 3);
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

CoarserTriangles remaining(const HalfEdges& edges, const RemovedVertexMap& removed,
                           std::size_t vertices) {
  CoarserTriangles result;
  const Mesh& mesh = edges.mesh;
  result.nearby.assign(vertices, kNoIndex);
  std::vector<std::uint32_t> numbers(mesh.n_faces(), kNoIndex);
  for (const auto face : mesh.faces()) {
    if (mesh.status(face).deleted()) continue;
    const auto number = static_cast<std::uint32_t>(result.indices.size() / 3);
    numbers[at(face)] = number;
    for (const auto v : mesh.fv_range(face)) {
      result.indices.push_back(edges.ours[at(v)]);
      result.nearby[edges.ours[at(v)]] = number;
    }
  }
  for (std::uint32_t face = 0; face < numbers.size(); ++face) {
    if (numbers[face] == kNoIndex) continue;
    result.uv_shift = std::max(result.uv_shift, removed.uv_shift(face));
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    const std::uint32_t face = removed.face_of(static_cast<std::uint16_t>(v));
    if (face != kNoIndex) result.nearby[v] = numbers[face];
  }
  return result;
}

/// Keeps what is left whenever a target is reached, so that one run makes all levels.
class Snapshots : public OpenMesh::Decimater::Observer {
 public:
  Snapshots(const HalfEdges& edges, const RemovedVertexMap& removed, std::size_t vertices,
            std::span<const std::size_t> targets)
      : Observer(1), edges_(edges), removed_(removed), vertices_(vertices), targets_(targets) {}

  /// A collapse inside the surface takes two triangles.
  void notify(std::size_t collapses) override {
    while (taken.size() < targets_.size() &&
           edges_.mesh.n_faces() <= targets_[taken.size()] + 2 * collapses) {
      take();
    }
  }

  void take() { taken.push_back(remaining(edges_, removed_, vertices_)); }

  std::vector<CoarserTriangles> taken;

 private:
  const HalfEdges& edges_;
  const RemovedVertexMap& removed_;
  std::size_t vertices_;
  std::span<const std::size_t> targets_;
};

}  // namespace

std::vector<CoarserTriangles> decimate_chunk(const ChunkVertices& vertices,
                                             std::span<const std::uint16_t> indices,
                                             std::span<const std::uint8_t> locked,
                                             std::span<const std::size_t> targets,
                                             const DecimateLimits& limits) {
  // OpenMesh tells stderr of every face that it refuses.
  omerr().disable();
  HalfEdges edges;
  build(vertices.positions, indices, edges);
  Mesh& mesh = edges.mesh;
  for (const auto v : mesh.vertices()) {
    const auto ours = edges.ours[at(v)];
    if (locked[ours] != 0 || mesh.is_boundary(v) || !mesh.is_manifold(v)) {
      mesh.status(v).set_locked(true);
    }
  }
  Decimater decimater(mesh);
  Quadrics::Handle quadrics;
  decimater.add(quadrics);
  RemovedVertexMap removed(vertices, mesh.n_faces());
  decimater.module(quadrics).set(vertices, limits, edges.ours, removed);
  Snapshots snapshots(edges, removed, vertices.positions.size(), targets);
  decimater.set_observer(&snapshots);
  if (targets.empty() || !decimater.initialize()) return {};
  decimater.decimate_to_faces(0, targets.back());
  // What could be done where a target was out of reach.
  if (snapshots.taken.size() < targets.size()) snapshots.take();
  return std::move(snapshots.taken);
}

}  // namespace modar
