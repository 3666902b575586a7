// Lists of vertices, one a triangle.
#include "bake/model/landings.hpp"

#include <limits>

#include "bake/model/source_model.hpp"
#include "bake/model/triangle_tree.hpp"

namespace modar {

Landings::Landings(std::span<const glm::dvec3> positions, std::size_t faces)
    : positions_(positions),
      face_of_(positions.size(), kNoIndex),
      first_(faces, kNoIndex),
      next_(positions.size(), kNoIndex) {}

void Landings::lift(std::uint32_t face) {
  for (std::uint32_t v = first_[face]; v != kNoIndex; v = next_[v]) {
    hand_.push_back(static_cast<std::uint16_t>(v));
  }
  first_[face] = kNoIndex;
}

void Landings::settle(std::span<const LandingFace> faces) {
  for (const std::uint16_t vertex : hand_) {
    double best = std::numeric_limits<double>::infinity();
    std::uint32_t nearest = faces.front().face;
    for (const LandingFace& face : faces) {
      const double distance = distance_square(
          positions_[vertex],
          {positions_[face.corners[0]], positions_[face.corners[1]], positions_[face.corners[2]]},
          best);
      if (distance >= best) continue;
      best = distance;
      nearest = face.face;
    }
    face_of_[vertex] = nearest;
    next_[vertex] = first_[nearest];
    first_[nearest] = vertex;
  }
  hand_.clear();
}

}  // namespace modar
