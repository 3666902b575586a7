// Gauss-Newton over focal length, aspects and poses, the poses eliminated view by view.
#include "camera_estimator.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "patch_alignment.hpp"
#include "plane_geometry.hpp"

namespace modar::tracker {
namespace {

constexpr std::size_t kMaxViews = 24;  // bounds time and memory
constexpr int kViewSteps = 3;          // of a new view: the poses of the others hardly move
// Prior standard deviation of the focal length, relative to the longer side. Smaller distrusts
// unusual lenses, larger needs more views.
constexpr double kFocalSpread = 0.3;
// Prior standard deviation of a print's aspect. Larger lets a lens's distortion pass for an aspect.
constexpr double kAspectSpread = 0.03;
// Of a corner that a free homography measures, frame pixels of 640: lens distortion and paper that
// is not quite flat weigh more than noise.
constexpr double kPlaceSigma = 1.0;
// Largest difference of two outlines' corners, after the similarity that aligns them, in
// mean distances of a corner from the middle: below it they are one view.
constexpr double kAlike = 0.04;
constexpr double kSame = 0.01;
constexpr double kMostStep = 0.2;  // of a focal length or aspect

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;

/// sinh(ln q): about the logarithm of a ratio near 1, without a libm's.
double log_ratio(double q) {
  return 0.5 * (q - 1.0 / q);
}
double log_ratio_derivative(double q) {
  return 0.5 * (q + 1.0 / q);
}

using Outline = std::array<glm::dvec2, 4>;

/// Normalises an outline: middle 0, mean distance from it 1, first diagonal upright.
Outline shape_of(const Outline& corners) {
  const glm::dvec2 middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  double size = 0;
  for (const glm::dvec2& corner : corners) size += 0.25 * glm::length(corner - middle);
  const glm::dvec2 along = corners[2] - corners[0];
  const double length = glm::length(along) * size;
  Outline shape{};
  if (!(length > 0)) return shape;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 p = corners[i] - middle;
    shape[i] = {glm::dot(along, p) / length, (along.x * p.y - along.y * p.x) / length};
  }
  return shape;
}

double apart(const Outline& a, const Outline& b) {
  const Outline one = shape_of(a);
  const Outline other = shape_of(b);
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) most = std::max(most, glm::length(one[i] - other[i]));
  return most;
}

}  // namespace

[[gnu::cold]] CameraEstimator::CameraEstimator(const Camera& camera, std::size_t patterns)
    : camera_(camera),
      start_(camera.fx),
      sigma_(kPlaceSigma / 640.0 * std::max(camera.width, camera.height)),
      aspects_(patterns) {
  views_.reserve(kMaxViews);
  clear();
}

void CameraEstimator::clear() {
  views_.clear();
  std::fill(aspects_.begin(), aspects_.end(), Aspect{});
  camera_.fx = camera_.fy = start_;
  estimate_ = {start_, kFocalSpread * start_, true};
}

bool CameraEstimator::is_new(std::size_t pattern, const Outline& corners) const {
  return std::none_of(views_.begin(), views_.end(), [&](const KeptView& kept) {
    return kept.view.pattern == pattern && apart(kept.view.pixels, corners) < kSame;
  });
}

void CameraEstimator::add(const View& view) {
  KeptView* nearest = nullptr;
  double least = 0;
  for (KeptView& kept : views_) {
    if (kept.view.pattern != view.pattern) continue;
    const double way = apart(kept.view.pixels, view.pixels);
    if (nearest != nullptr && way >= least) continue;
    nearest = &kept;
    least = way;
  }
  if (nearest != nullptr && (least < kAlike || views_.size() == kMaxViews)) {
    nearest->view = view;
  } else if (views_.size() < kMaxViews) {
    views_.push_back({view, {}, 0});
  } else {
    return;
  }
  for (int i = 0; i < kViewSteps; ++i) {
    if (!step()) break;
  }
}

/// Adds what a view says of the shared numbers, its pose eliminated.
void CameraEstimator::linearise(KeptView& kept, double& matrix, double& vector) {
  const View& view = kept.view;
  Aspect& aspect = aspects_[view.pattern];
  Matrix6 pose = Matrix6::Zero();
  Matrix63 right = Matrix63::Zero();  // by the residual, the focal length and the aspect
  double shared[2][2] = {};
  double residual[2] = {};
  kept.cost = 0;
  const double weight = 1.0 / (sigma_ * sigma_);
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec3 world{view.world[i].x, view.world[i].y * aspect.value, 0.0};
    const glm::dvec3 p = view.pose.rotation * world + view.pose.translation;
    const glm::dvec2 from_middle{camera_.fx * p.x / p.z, camera_.fy * p.y / p.z};
    const glm::dvec2 miss = view.pixels[i] - glm::dvec2(camera_.cx, camera_.cy) - from_middle;
    const PoseJacobian rows = pose_jacobian(camera_, view.pose, world, 1.0);
    const glm::dvec3 up = view.pose.rotation[1] * world.y;
    const glm::dvec2 by_aspect = (camera_.fx * glm::dvec2(up) - from_middle * up.z) / p.z;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Map<const Eigen::Matrix<double, 6, 1>> j((axis == 0 ? rows.x : rows.y).data());
      const double by[2] = {from_middle[axis], by_aspect[axis]};
      pose += weight * j * j.transpose();
      right.col(0) += weight * miss[axis] * j;
      for (int a = 0; a < 2; ++a) {
        right.col(1 + a) += weight * by[a] * j;
        residual[a] += weight * by[a] * miss[axis];
        for (int b = 0; b < 2; ++b) shared[a][b] += weight * by[a] * by[b];
      }
      kept.cost += weight * miss[axis] * miss[axis];
    }
  }
  pose.diagonal().array() += 1e-9 * pose.trace();
  const Matrix63 solved = solve_symmetric(pose, right);
  std::copy_n(solved.data(), 18, kept.pose_by_shared.begin());
  // What the pose does not take up; a view that contradicts the others counts less (Cauchy).
  const double left = std::max(0.0, kept.cost - right.col(0).dot(solved.col(0)));
  constexpr double kContradiction = 9.0;
  const double trust = 1.0 / (1.0 + left / kContradiction);
  kept.cost = trust * left;
  matrix += trust * (shared[0][0] - right.col(1).dot(solved.col(1)));
  vector += trust * (residual[0] - right.col(1).dot(solved.col(0)));
  aspect.matrix += trust * (shared[1][1] - right.col(2).dot(solved.col(2)));
  aspect.mixed += trust * (shared[0][1] - right.col(1).dot(solved.col(2)));
  aspect.vector += trust * (residual[1] - right.col(2).dot(solved.col(0)));
}

/// One joint step; false once it hardly moves.
bool CameraEstimator::step() {
  const double ratio = camera_.fx / start_;
  const double slope = log_ratio_derivative(ratio) / (kFocalSpread * kFocalSpread);
  double matrix = slope * log_ratio_derivative(ratio);
  double vector = -slope * log_ratio(ratio);
  for (Aspect& aspect : aspects_) {
    const double by = log_ratio_derivative(aspect.value) / (kAspectSpread * kAspectSpread);
    aspect.matrix = by * log_ratio_derivative(aspect.value);
    aspect.vector = -by * log_ratio(aspect.value);
    aspect.mixed = 0;
  }
  for (KeptView& kept : views_) linearise(kept, matrix, vector);
  for (const Aspect& aspect : aspects_) {
    matrix -= aspect.mixed * aspect.mixed / aspect.matrix;
    vector -= aspect.mixed * aspect.vector / aspect.matrix;
  }
  const double focal_step = std::clamp(vector / matrix, -kMostStep, kMostStep);
  if (!std::isfinite(focal_step)) return false;
  camera_.fx = camera_.fy = camera_.fx * (1.0 + focal_step);
  for (Aspect& aspect : aspects_) {
    aspect.vector = std::clamp((aspect.vector - aspect.mixed * focal_step) / aspect.matrix,
                               -kMostStep, kMostStep);
    aspect.value *= 1.0 + aspect.vector;
  }
  double most = std::abs(focal_step);
  for (KeptView& kept : views_) {
    const double aspect_step = aspects_[kept.view.pattern].vector;
    const auto& by = kept.pose_by_shared;
    std::array<double, 6> change{};
    for (std::size_t k = 0; k < 6; ++k) {
      change[k] = by[k] - by[6 + k] * focal_step - by[12 + k] * aspect_step;
    }
    most = std::max(most, std::abs(aspect_step));
    Pose& pose = kept.view.pose;
    const glm::dvec3 moved = pose.translation + glm::dvec3(change[3], change[4], change[5]);
    if (!(moved.z > 0.0)) continue;
    pose.translation = moved;
    pose.rotation = rotation_matrix({change[0], change[1], change[2]}) * pose.rotation;
  }
  double cost = 0;
  for (const KeptView& kept : views_) cost += kept.cost;
  // Of two numbers a view: more than that is no noise of places.
  const double widened =
      std::sqrt(std::max(1.0, cost / (2.0 * static_cast<double>(views_.size()))));
  estimate_ = {camera_.fx, widened * camera_.fx / std::sqrt(matrix), true};
  constexpr double kSettled = 1e-4;
  return most > kSettled;
}

}  // namespace modar::tracker
