// The point of a surface that is nearest to a given one.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace modar {

using Triangle = std::array<std::uint32_t, 3>;

/// The point of triangle a, b, c that is nearest to p (Ericson, "Real-Time Collision Detection",
/// 2005, 5.1.5). Triangles without area are right, too.
glm::dvec3 nearest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                               const glm::dvec3& c);

/// A bounding volume tree over triangles, split at medians of their centres.
class TriangleTree {
 public:
  /// At least one triangle; both must outlive the tree.
  TriangleTree(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles);

  struct Nearest {
    double distance = 0;
    std::uint32_t triangle = 0;
    glm::dvec3 point{0.0};
  };
  [[nodiscard]] Nearest nearest(const glm::dvec3& point) const;

 private:
  struct Node {
    glm::dvec3 low;
    glm::dvec3 high;
    std::uint32_t first = 0;  // of order_, or the second child
    std::uint32_t count = 0;  // 0: an inner node, whose first child is the next node
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t end);

  std::span<const glm::dvec3> positions_;
  std::span<const Triangle> triangles_;
  std::vector<glm::dvec3> centres_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace modar
