// Brings four clicks into order.
#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "spot_pattern.hpp"

namespace modar {
namespace {

double cross(glm::dvec2 a, glm::dvec2 b) {
  return a.x * b.y - a.y * b.x;
}

}  // namespace

Result<std::array<glm::dvec2, 4>> ordered_corners(const std::array<glm::dvec2, 4>& clicked) {
  constexpr double kLeastSide = 24;
  std::array<glm::dvec2, 4> corners = clicked;
  const glm::dvec2 centre = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  const auto angle = [centre](glm::dvec2 p) { return std::atan2(p.y - centre.y, p.x - centre.x); };
  // y points down, so that growing angles go clockwise on the screen.
  std::sort(corners.begin(), corners.end(),
            [&](glm::dvec2 a, glm::dvec2 b) { return angle(a) < angle(b); });
  const auto top_left =
      std::min_element(corners.begin(), corners.end(),
                       [](glm::dvec2 a, glm::dvec2 b) { return a.x + a.y < b.x + b.y; });
  std::rotate(corners.begin(), top_left, corners.end());
  bool good = true;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 side = corners[(i + 1) % 4] - corners[i];
    const glm::dvec2 next = corners[(i + 2) % 4] - corners[(i + 1) % 4];
    // Twice a triangle's area against its sides: three points in a row make no corner.
    good = good && glm::length(side) >= kLeastSide &&
           cross(side, next) > 0.1 * glm::length(side) * glm::length(next);
  }
  if (good) return corners;
  return fail(ExitCode::kUsage, "spot.corners", "", "the four clicks make no four-sided figure",
              "click the corners of the pattern, at least 24 pixels apart");
}

}  // namespace modar
