// Where a pattern is expected next.
#include "motion.hpp"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {

Pose continued(const Pose& before, const Pose& now) {
  const glm::dmat3 turn = now.rotation * glm::transpose(before.rotation);
  Pose next;
  // Squared up again: a pose fed back frame by frame would double its rounding error each time.
  const glm::dmat3 turned = turn * now.rotation;
  next.rotation[0] = glm::normalize(turned[0]);
  next.rotation[1] =
      glm::normalize(turned[1] - next.rotation[0] * glm::dot(next.rotation[0], turned[1]));
  next.rotation[2] = glm::cross(next.rotation[0], next.rotation[1]);
  next.translation = now.translation + (now.translation - before.translation);
  if (!(next.translation.z > 0.0)) return now;
  return next;
}

bool in_view(const TrackedPattern& pattern, const PlaneMap& map, const Camera& camera) {
  constexpr int kSide = 5;
  constexpr int kFewest = 4;  // of 25 places
  int inside = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    bool ahead = false;
    const glm::dvec2 p = map.at({(i % kSide + 0.5) / kSide * pattern.width(),
                                 (static_cast<int>(i / kSide) + 0.5) / kSide * pattern.height()},
                                ahead);
    inside += ahead && p.x >= 0 && p.y >= 0 && p.x < camera.width && p.y < camera.height ? 1 : 0;
  }
  return inside >= kFewest;
}

}  // namespace modar::tracker
