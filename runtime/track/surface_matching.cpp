// From the part of a curved or boxed pattern that a homography explains to the pose of all of it.
#include <algorithm>
#include <optional>
#include <span>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "pattern_matching.hpp"

namespace modar::tracker {
namespace {

// Multiples of a feature's pixel within which matches join, by round: the tangent plane's pose is
// right near its matches only. Not swept.
constexpr std::array<double, 6> kRounds = {12.0, 8.0, 5.0, 4.0, 3.0, 3.0};
// Share of the better pose's matches below which its mirror image is ruled out.
constexpr double kMirrorShare = 0.75;

/// The pose of the pattern whose tangent plane at a place the homography shows.
std::optional<Pose> touching_pose(const TrackedPattern& pattern, const Camera& camera,
                                  const glm::dmat3& homography, glm::dvec2 place) {
  const SurfacePoint point = pattern.surface.at(place.x, place.y);
  const double right = glm::length(vector_of(point.right));
  const double down = glm::length(vector_of(point.down));
  glm::dmat3 axes;
  axes[0] = vector_of(point.right) / right;
  axes[1] = vector_of(point.down) / -down;
  axes[2] = glm::cross(axes[0], axes[1]);
  glm::dmat3 pixels(1.0);  // of a place of the plane, in pattern units
  pixels[0] = {1.0 / right, 0.0, 0.0};
  pixels[1] = {0.0, -1.0 / down, 0.0};
  pixels[2] = {place, 1.0};
  const auto plane = pose_from_homography(camera, homography * pixels);
  if (!plane) return std::nullopt;
  Pose pose;
  pose.rotation = plane->rotation * glm::transpose(axes);
  pose.translation = plane->translation - pose.rotation * vector_of(point.at);
  return pose;
}

}  // namespace

Pose mirrored_about(const TrackedPattern& pattern, glm::dvec2 place, const Pose& pose) {
  const SurfacePoint point = pattern.surface.at(place.x, place.y);
  const glm::dvec3 normal =
      glm::normalize(glm::cross(vector_of(point.down), vector_of(point.right)));
  const glm::dvec3 across = glm::normalize(vector_of(point.right));
  glm::dmat3 axes;
  axes[0] = across;
  axes[1] = glm::cross(normal, across);
  axes[2] = normal;
  Pose plane;
  plane.rotation = pose.rotation * axes;
  plane.translation = pose.rotation * vector_of(point.at) + pose.translation;
  const Pose other = mirrored(plane);
  Pose out;
  out.rotation = other.rotation * glm::transpose(axes);
  out.translation = other.translation - out.rotation * vector_of(point.at);
  return out;
}

namespace {

/// Leaves of the matches in a mask those on one face of a box, on which most of them are: that is
/// all that a homography explains, and a match by chance on another face turned the pose by 30
/// degrees.
void keep_one_face(const PatternSurface& surface, std::span<const FeatureMatch> matches,
                   std::span<std::uint8_t> mask) {
  const auto faces = surface.faces();
  if (faces.empty()) return;
  const auto lies_on = [&](std::size_t i, const ShapeFaceRecord& face) {
    const glm::dvec2 at = matches[i].pattern + 0.5 - glm::dvec2(face.place[0], face.place[1]);
    return at.x >= 0.0 && at.y >= 0.0 && at.x < face.place[2] && at.y < face.place[3];
  };
  const ShapeFaceRecord* fullest = nullptr;
  int most = -1;
  for (const ShapeFaceRecord& face : faces) {
    int count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) count += mask[i] != 0 && lies_on(i, face) ? 1 : 0;
    if (count <= most) continue;
    most = count;
    fullest = &face;
  }
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (!lies_on(i, *fullest)) mask[i] = 0;
  }
}

}  // namespace

/// The matches that a pose explains, where the surface faces the camera.
std::size_t PlaneMatcher::collect_on_surface(const TrackedPattern& pattern, const Pose& pose,
                                             double pixels, std::vector<std::uint8_t>& mask) const {
  PlaneMap map = map_of_pose(pattern, camera_, pose);
  map.lens = nullptr;
  std::size_t count = 0;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    bool visible = false;
    const glm::dvec2 miss = map.at(matches_[i].pattern, visible) - matches_[i].ideal;
    const double limit = pixels * matches_[i].sigma;
    mask[i] = visible && glm::dot(miss, miss) < limit * limit ? 1 : 0;
    count += mask[i];
  }
  return count;
}

/// Fits a pose to the matches of mask_, then to those that it explains, round by round. Returns how
/// many are left in mask_; 0 where too few are.
std::size_t PlaneMatcher::spread_pose(const TrackedPattern& pattern, Pose& pose) {
  std::size_t count = 0;
  for (const double pixels : kRounds) {
    inlier_world_.clear();
    inlier_ideal_.clear();
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      if (mask_[i] == 0) continue;
      inlier_world_.push_back(pattern.on_surface(matches_[i].pattern));
      inlier_ideal_.push_back(matches_[i].ideal);
    }
    pose = refine_pose(camera_, inlier_world_, inlier_ideal_, pose);
    count = collect_on_surface(pattern, pose, pixels, mask_);
    if (count < kMinMatches) return 0;
  }
  return count;
}

int PlaneMatcher::spread(const TrackedPattern& pattern, std::size_t hypothesis,
                         std::array<Pose, 2>& poses) {
  HomographyHypothesis& one = hypotheses_[hypothesis];
  keep_one_face(pattern.surface, matches_, one.mask);
  glm::dvec2 middle(0.0);
  double matched = 0.0;
  for (std::size_t i = 0; i < one.mask.size(); ++i) {
    if (one.mask[i] == 0) continue;
    middle += matches_[i].pattern;
    matched += 1.0;
  }
  middle /= std::max(matched, 1.0);
  const auto touching = touching_pose(pattern, camera_, one.homography, middle);
  if (!touching) return 0;
  std::array<Pose, 2> found = {*touching, mirrored_about(pattern, middle, *touching)};
  std::array<std::size_t, 2> counts{};
  explained_.assign(one.mask.begin(), one.mask.end());
  for (std::size_t k = 0; k < 2; ++k) {
    mask_.assign(explained_.begin(), explained_.end());
    counts[k] = spread_pose(pattern, found[k]);
    const bool best = k == 0 ? counts[0] > 0 : counts[1] > counts[0];
    if (best) one.mask.assign(mask_.begin(), mask_.end());
  }
  const std::size_t first = counts[1] > counts[0] ? 1 : 0;
  if (counts[first] == 0) return 0;
  one.inliers = static_cast<int>(counts[first]);
  poses = {found[first], found[1 - first]};
  const double other = static_cast<double>(counts[1 - first]);
  return other >= kMirrorShare * static_cast<double>(counts[first]) ? 2 : 1;
}

}  // namespace modar::tracker
