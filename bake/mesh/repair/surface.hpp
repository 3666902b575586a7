// Triangles over positions, and what defects are found by: edges, components, open edges.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "bake/memory/array.hpp"
#include "bake/mesh/tri_mesh.hpp"
#include "bake/report.hpp"

namespace modar::repair {

inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// Half-edge 3 t + i leads from corner i of triangle t to the next corner.
inline std::uint32_t next(std::uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}
inline std::uint32_t previous(std::uint32_t h) {
  return h % 3 == 0 ? h + 2 : h - 1;
}

/// Box of points.
struct PointBox {
  glm::dvec3 low{std::numeric_limits<double>::infinity()};
  glm::dvec3 high{-std::numeric_limits<double>::infinity()};
  void add(const glm::dvec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  [[nodiscard]] double diagonal() const { return low.x > high.x ? 0 : glm::length(high - low); }
};

/// Positions of triangles, three corners each. Does not own them.
struct Faces {
  std::span<const std::uint32_t> corners;
  std::span<const glm::dvec3> positions;

  [[nodiscard]] std::size_t triangles() const { return corners.size() / 3; }
  [[nodiscard]] const glm::dvec3& at(std::size_t corner) const {
    return positions[corners[corner]];
  }
  /// Perpendicular to a triangle, as long as its area.
  [[nodiscard]] glm::dvec3 area_vector(std::size_t t) const {
    const glm::dvec3& a = at(3 * t);
    return 0.5 * glm::cross(at(3 * t + 1) - a, at(3 * t + 2) - a);
  }
  [[nodiscard]] double area(std::size_t t) const { return glm::length(area_vector(t)); }
};

/// A mesh over the positions of its source, where vertices that differ in uv or normal are one.
struct SourceFaces {
  explicit SourceFaces(const TriMesh& mesh);
  [[nodiscard]] Faces surface() const {
    return {std::span(corners.data(), corners.size()), positions};
  }

  Array<std::uint32_t> corners;
  Array<glm::dvec3> own;  ///< empty: the mesh's are used
  std::span<const glm::dvec3> positions;
};

/// The corners at each position.
struct Around {
  explicit Around(const Faces& surface);
  [[nodiscard]] std::span<const std::uint32_t> at(std::uint32_t position) const {
    return {corners.data() + first[position], first[position + std::size_t{1}] - first[position]};
  }
  Array<std::uint32_t> first;
  Array<std::uint32_t> corners;
};

/// Calls visit(half-edges) once for each edge whose lower end is wanted: wanted(position).
template <class Wanted, class Visit>
void for_each_edge(const Faces& surface, const Around& around, const Wanted& wanted,
                   const Visit& visit) {
  std::vector<std::array<std::uint32_t, 2>> spokes;  // the other end, half-edge
  std::vector<std::uint32_t> edge;
  for (std::uint32_t v = 0; v < surface.positions.size(); ++v) {
    if (!wanted(v)) continue;
    spokes.clear();
    for (const std::uint32_t c : around.at(v)) {
      const std::uint32_t ahead = surface.corners[next(c)];
      const std::uint32_t behind = surface.corners[previous(c)];
      if (ahead > v) spokes.push_back({ahead, c});
      if (behind > v) spokes.push_back({behind, previous(c)});
    }
    std::sort(spokes.begin(), spokes.end());
    for (std::size_t i = 0, end = 0; i < spokes.size(); i = end) {
      edge.clear();
      for (; end < spokes.size() && spokes[end][0] == spokes[i][0]; ++end) {
        edge.push_back(spokes[end][1]);
      }
      visit(std::span<const std::uint32_t>(edge));
    }
  }
}

/// Calls visit(corner) for triangles that repeat another one in its winding, or in any, of those
/// around the lowest of their positions.
template <class Visit>
void each_repeated(const Faces& surface, std::span<const std::uint32_t> corners,
                   std::uint32_t position, const Visit& visit, bool any_winding = false) {
  std::vector<std::array<std::uint32_t, 3>> others;  // positions ahead and behind, corner
  for (const std::uint32_t c : corners) {
    const std::uint32_t ahead = surface.corners[next(c)];
    const std::uint32_t behind = surface.corners[previous(c)];
    if (position >= ahead || position >= behind) continue;
    others.push_back({ahead, behind, c});
    if (any_winding && ahead > behind) others.back() = {behind, ahead, c};
  }
  std::sort(others.begin(), others.end());
  for (std::size_t i = 1; i < others.size(); ++i) {
    if (others[i][0] == others[i - 1][0] && others[i][1] == others[i - 1][1]) visit(others[i][2]);
  }
}

/// Whether a position's triangles are one closed fan of one winding: it has no defect.
bool regular(const Faces& surface, std::span<const std::uint32_t> corners);

/// The half-edges that no other triangle has, of wanted positions.
template <class Wanted>
std::vector<std::uint32_t> open_edges(const Faces& surface, const Around& around,
                                      const Wanted& wanted) {
  std::vector<std::uint32_t> open;
  for_each_edge(surface, around, wanted, [&](std::span<const std::uint32_t> edge) {
    if (edge.size() == 1) open.push_back(edge[0]);
  });
  return open;
}
inline std::vector<std::uint32_t> open_edges(const Faces& surface, const Around& around) {
  return open_edges(surface, around, [](std::uint32_t) { return true; });
}

/// Gives open edges that were written twice, as texture seams are, one position. alike: whether two
/// positions of the same coordinates may become one. Returns how many corners moved.
template <class Alike>
std::size_t join_open_edges(std::span<std::uint32_t> corners, std::span<const glm::dvec3> positions,
                            const Around& around, const Array<std::uint8_t>& clean,
                            const Alike& alike) {
  const Faces surface{corners, positions};
  std::vector<std::uint32_t> open;
  for (const std::uint32_t h :
       open_edges(surface, around, [&](std::uint32_t v) { return clean[v] == 0; })) {
    open.push_back(corners[h]);
    open.push_back(corners[next(h)]);
  }
  const auto key = [&](std::uint32_t v) {
    const glm::dvec3& p = positions[v];
    return std::array<double, 3>{p.x, p.y, p.z};
  };
  std::sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto p = key(a);
    const auto q = key(b);
    return p != q ? p < q : a < b;
  });
  open.erase(std::unique(open.begin(), open.end()), open.end());
  std::size_t moved = 0;
  for (std::size_t i = 0, end = 0; i < open.size(); i = end) {
    for (end = i + 1; end < open.size() && key(open[end]) == key(open[i]); ++end) {
      if (!alike(open[i], open[end])) continue;
      for (const std::uint32_t c : around.at(open[end])) corners[c] = open[i];
      moved += around.at(open[end]).size();
    }
  }
  return moved;
}

/// Disjoint sets of numbers; the lowest names a set.
class Sets {
 public:
  explicit Sets(std::size_t count) { reset(count); }
  void reset(std::size_t count) {
    parent_.resize(count);
    for (std::uint32_t v = 0; v < count; ++v) parent_[v] = v;
  }
  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    if (parent_[a] == parent_[b]) return;
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  Array<std::uint32_t> parent_;
};

/// The edges at a position, and the fans that they make of its triangles. Reads one after another.
struct Fans {
  /// An edge of a triangle; those of one edge are next to each other.
  struct Spoke {
    std::uint32_t neighbour = 0;  ///< position at its other end
    std::uint32_t number = 0;     ///< of the triangle, among those at the position
    std::uint32_t half_edge = 0;
  };
  void read(const Faces& surface, std::span<const std::uint32_t> corners);

  std::vector<Spoke> spokes;
  Sets sets{0};           ///< of the numbers of triangles
  std::size_t count = 0;  ///< fans
};

/// Parts of a surface that share no position.
class Components {
 public:
  struct Part {
    PointBox box;
    std::uint64_t triangles = 0;
    std::uint64_t open = 0;  ///< edges
    double area = 0;         ///< once islands() has asked
  };
  /// open: half-edges.
  Components(const Faces& surface, std::span<const std::uint32_t> open);
  [[nodiscard]] std::uint32_t of(std::uint32_t position) const { return part_[position]; }
  [[nodiscard]] const Part& at(std::size_t number) const { return parts_[number]; }
  [[nodiscard]] std::size_t count() const { return parts_.size(); }
  /// Whether each part is debris: small, and open or of few triangles. None where the model has no
  /// main part, or where they are too much of the area, see `many`.
  [[nodiscard]] std::vector<bool> islands(bool& many);

 private:
  void add(std::uint32_t position, std::uint32_t root);

  Faces surface_;
  Array<std::uint32_t> part_;  // of each position
  std::vector<Part> parts_;    // that have triangles, in the order of these
};

/// Open edges that touch.
struct Loop {
  PointBox box;
  glm::dvec3 area{0.0};  ///< of the surface that it bounds, as a vector
};
/// By their lowest positions. open: half-edges.
std::map<std::uint32_t, Loop> open_loops(const Faces& surface, std::span<const std::uint32_t> open);

/// Whether an open loop is a hole of a part, and not its rim.
bool small_hole(const PointBox& loop, const PointBox& part);

/// What OpenMesh makes of a surface.
HalfEdgeCount count_half_edges(const Faces& surface);

/// See MeshDefects::backs. turned: a half-edge of each change of winding. materials: of triangles.
/// viewer: as for count_defects().
std::vector<bool> seen_backs(const Faces& surface, const Components& components,
                             const std::map<std::uint32_t, Loop>& loops,
                             std::span<const std::uint32_t> turned,
                             std::span<const std::uint32_t> materials, const glm::dvec3& viewer);

}  // namespace modar::repair
