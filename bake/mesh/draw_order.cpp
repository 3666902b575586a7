// Trees of planes; the first one, of a whole material, only tells where to cut.
#include "bake/mesh/draw_order.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Model space. Points this near are in a plane: half floats move vertices by up to 2.4e-4.
constexpr double kThickness = 3e-4;
/// Larger sets are halved by planes of an axis, which cost no look at each pair: at kTries planes
/// of this many triangles, a node costs 4,096 comparisons.
constexpr std::size_t kMostCompared = 512;
/// Cuts of a material, in addition to an eighth of its triangles; each adds one or two triangles.
constexpr std::size_t kFreeCuts = 256;
/// Planes that are tried at a node.
constexpr std::size_t kTries = 8;

using Corners = std::array<glm::dvec3, 3>;

struct Plane {
  glm::dvec3 normal{0.0};
  double offset = 0;
  [[nodiscard]] double distance(const glm::dvec3& p) const { return glm::dot(normal, p) + offset; }
};

glm::dvec3 middle_of(const Corners& t) {
  return (t[0] + t[1] + t[2]) / 3.0;
}

/// False for a triangle without area.
bool plane_of(const Corners& t, Plane& plane) {
  const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double length = glm::length(normal);
  if (!(length > 1e-12)) return false;
  plane.normal = normal / length;
  plane.offset = -glm::dot(plane.normal, t[0]);
  return true;
}

bool crosses(const Plane& plane, const Corners& t) {
  const double a = plane.distance(t[0]);
  const double b = plane.distance(t[1]);
  const double c = plane.distance(t[2]);
  return std::min({a, b, c}) < -kThickness && std::max({a, b, c}) > kThickness;
}

class PlaneTree {
 public:
  /// Cuts a triangle of the tree at a plane; answers the pieces other than the first, which takes
  /// its place.
  using Cut = std::function<std::vector<Corners>(std::uint32_t triangle, const Plane& plane,
                                                 Corners& first)>;

  explicit PlaneTree(std::vector<Corners> triangles, std::size_t cuts = 0, Cut cut = {})
      : triangles_(std::move(triangles)), cuts_(cuts), cut_(std::move(cut)) {}

  std::vector<DrawOrderRecord> build() {
    std::vector<std::uint32_t> all(triangles_.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    add(std::move(all));
    return std::move(nodes_);
  }

 private:
  void add(std::vector<std::uint32_t> set) {
    if (set.empty()) return;
    Plane plane;
    std::uint32_t owner = kNone;
    std::vector<std::uint32_t> behind;
    std::vector<std::uint32_t> before;
    if (set.size() > kMostCompared) {
      plane = halving_plane(set);
      divide(set, plane, owner, behind, before);
    }
    if (behind.empty() || before.empty()) {
      owner = choose(set, plane);
      behind.clear();
      before.clear();
      divide(set, plane, owner, behind, before);
    }
    const std::size_t at = nodes_.size();
    DrawOrderRecord node{};
    for (int i = 0; i < 3; ++i) node.plane[i] = static_cast<float>(plane.normal[i]);
    node.plane[3] = static_cast<float>(plane.offset);
    node.triangle = owner;
    nodes_.push_back(node);
    set = {};
    add(std::move(behind));
    nodes_[at].behind = static_cast<std::uint32_t>(nodes_.size() - at - 1);
    add(std::move(before));
  }

  [[nodiscard]] Plane halving_plane(const std::vector<std::uint32_t>& set) const {
    std::vector<glm::dvec3> middles;
    for (const std::uint32_t t : set) middles.push_back(middle_of(triangles_[t]));
    glm::dvec3 low = middles[0];
    glm::dvec3 high = middles[0];
    for (const glm::dvec3& p : middles) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    const glm::dvec3 side = high - low;
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
    const auto half = middles.begin() + static_cast<std::ptrdiff_t>(middles.size() / 2);
    std::nth_element(middles.begin(), half, middles.end(),
                     [&](const glm::dvec3& a, const glm::dvec3& b) { return a[axis] < b[axis]; });
    Plane plane;
    plane.normal[axis] = 1.0;
    plane.offset = -(*half)[axis];
    return plane;
  }

  /// The triangle in whose plane the fewest others have to be cut, and of those the one with the
  /// most even halves.
  std::uint32_t choose(const std::vector<std::uint32_t>& set, Plane& chosen) const {
    std::uint32_t owner = set[0];
    std::size_t least = ~std::size_t{0};
    const std::size_t step = std::max<std::size_t>(1, set.size() / kTries);
    for (std::size_t i = 0; i < set.size(); i += step) {
      Plane plane;
      if (!plane_of(triangles_[set[i]], plane)) continue;
      std::size_t cut = 0;
      std::size_t behind = 0;
      for (const std::uint32_t t : set) {
        cut += crosses(plane, triangles_[t]);
        behind += plane.distance(middle_of(triangles_[t])) < 0;
      }
      const std::size_t price = 8 * cut + std::max(behind, set.size() - behind);
      if (price >= least) continue;
      least = price;
      owner = set[i];
      chosen = plane;
    }
    return owner;
  }

  void divide(const std::vector<std::uint32_t>& set, const Plane& plane, std::uint32_t owner,
              std::vector<std::uint32_t>& behind, std::vector<std::uint32_t>& before) {
    const auto put = [&](std::uint32_t t) {
      (plane.distance(middle_of(triangles_[t])) < 0 ? behind : before).push_back(t);
    };
    for (const std::uint32_t t : set) {
      if (t == owner) continue;
      if (owner != kNone && cuts_ > 0 && crosses(plane, triangles_[t])) {
        --cuts_;
        const std::vector<Corners> more = cut_(t, plane, triangles_[t]);
        for (const Corners& piece : more) {
          triangles_.push_back(piece);
          put(static_cast<std::uint32_t>(triangles_.size() - 1));
        }
      }
      put(t);
    }
  }

  std::vector<Corners> triangles_;
  std::size_t cuts_;
  Cut cut_;
  std::vector<DrawOrderRecord> nodes_;
};

/// Cuts triangles of a mesh; triangles that share a cut edge share the vertex.
class MeshCutter {
 public:
  explicit MeshCutter(TriMesh& mesh) : mesh_(mesh) {}

  [[nodiscard]] Corners corners(std::uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    return {mesh_.positions[t[0]], mesh_.positions[t[1]], mesh_.positions[t[2]]};
  }

  /// Numbers of the new triangles; the old one becomes one of the pieces.
  std::vector<std::uint32_t> cut(std::uint32_t triangle, const Plane& plane) {
    const std::array<std::uint32_t, 3> old = mesh_.triangles[triangle];
    std::array<std::vector<std::uint32_t>, 2> sides;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = old[i];
      const std::uint32_t to = old[(i + 1) % 3];
      const double a = plane.distance(mesh_.positions[from]);
      const double b = plane.distance(mesh_.positions[to]);
      if (a >= -kThickness) sides[0].push_back(from);
      if (a <= kThickness) sides[1].push_back(from);
      if (std::min(a, b) >= -kThickness || std::max(a, b) <= kThickness) continue;
      const std::uint32_t between = vertex_between(from, to, a / (a - b));
      for (auto& side : sides) side.push_back(between);
    }
    std::vector<std::uint32_t> made;
    bool replaced = false;
    for (const auto& side : sides) {
      for (std::size_t i = 2; i < side.size(); ++i) {
        const std::array<std::uint32_t, 3> piece = {side[0], side[i - 1], side[i]};
        if (!replaced) {
          mesh_.triangles[triangle] = piece;
          replaced = true;
          continue;
        }
        made.push_back(static_cast<std::uint32_t>(mesh_.triangles.size()));
        mesh_.triangles.push_back(piece);
        const std::uint32_t material = mesh_.triangle_material[triangle];
        mesh_.triangle_material.push_back(material);
      }
    }
    return made;
  }

 private:
  std::uint32_t vertex_between(std::uint32_t from, std::uint32_t to, double share) {
    if (from > to) {
      std::swap(from, to);
      share = 1 - share;
    }
    const auto key = std::tuple(from, to, std::llround(share * 1e9));
    const auto known = made_.find(key);
    if (known != made_.end()) return known->second;
    const auto mean = [&](const auto& a, const auto& b) { return glm::mix(a, b, share); };
    const auto vertex = static_cast<std::uint32_t>(mesh_.positions.size());
    mesh_.positions.push_back(mean(mesh_.positions[from], mesh_.positions[to]));
    if (!mesh_.source_positions.empty()) {
      mesh_.source_positions.push_back(
          static_cast<std::uint32_t>(mesh_.source_vertex_count + mesh_.cut_vertices));
    }
    ++mesh_.cut_vertices;
    if (!mesh_.normals.empty()) {
      const glm::dvec3 sum = mean(glm::dvec3(mesh_.normals[from]), glm::dvec3(mesh_.normals[to]));
      const double length = glm::length(sum);
      mesh_.normals.push_back(length > 1e-6 ? glm::vec3(sum / length) : mesh_.normals[from]);
    }
    if (!mesh_.uvs.empty()) mesh_.uvs.push_back(mean(mesh_.uvs[from], mesh_.uvs[to]));
    if (!mesh_.colours.empty()) {
      const glm::dvec4 colour =
          mean(glm::dvec4(mesh_.colours[from]), glm::dvec4(mesh_.colours[to]));
      mesh_.colours.push_back(glm::u8vec4(glm::round(colour)));
    }
    made_[key] = vertex;
    return vertex;
  }

  TriMesh& mesh_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, long long>, std::uint32_t> made_;
};

}  // namespace

void cut_crossing(TriMesh& mesh, const std::vector<bool>& blended) {
  std::vector<std::vector<std::uint32_t>> of_material(blended.size());
  if (std::none_of(blended.begin(), blended.end(), [](bool is) { return is; })) return;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t material = mesh.triangle_material[t];
    if (blended[material]) of_material[material].push_back(t);
  }
  MeshCutter cutter(mesh);
  for (std::vector<std::uint32_t>& numbers : of_material) {
    if (numbers.size() < 2 || numbers.size() > kMostOrderedTriangles) continue;
    std::vector<Corners> corners;
    for (const std::uint32_t t : numbers) corners.push_back(cutter.corners(t));
    const auto cut = [&](std::uint32_t t, const Plane& plane, Corners& first) {
      std::vector<Corners> more;
      for (const std::uint32_t made : cutter.cut(numbers[t], plane)) {
        numbers.push_back(made);
        more.push_back(cutter.corners(made));
      }
      first = cutter.corners(numbers[t]);
      return more;
    };
    const std::size_t cuts = kFreeCuts + corners.size() / 8;
    PlaneTree(std::move(corners), cuts, cut).build();
  }
}

std::vector<DrawOrderRecord> draw_order(std::span<const std::array<glm::dvec3, 3>> triangles) {
  return PlaneTree({triangles.begin(), triangles.end()}).build();
}

}  // namespace modar
