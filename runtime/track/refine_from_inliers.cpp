// Gauss-Newton over features and, as far as the pose is known, patches.
#include "refine_from_inliers.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "patch_equations.hpp"
#include "symmetric_solver.hpp"

namespace modar::tracker {
namespace {

constexpr std::size_t kLooked = 80;  // patches of a level
constexpr int kCoarser = 2;          // levels above the finest that it starts on
constexpr int kSteps = 5;            // of a level
constexpr double kReach = 1.2;       // template pixels to which a patch's place must be known
constexpr float kSeen = 0.6f;        // correlation of a patch that is found
constexpr double kTold = 0.4;        // template pixels to which it then tells its place
constexpr double kStill = 0.1;       // pixels: it moves no more
constexpr double kOutlier = 3.0;     // sigmas

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Slope = Eigen::Matrix<double, 2, 6>;

/// What is known of a pose: its information, and where it pulls.
struct Known {
  Matrix6 weight = Matrix6::Zero();
  Vector6 pull = Vector6::Zero();
  int patches = 0;
};

Slope slope_of(const Camera& camera, const Pose& pose, glm::dvec2 world, double scale) {
  const PoseSlope rows = pose_slope(camera, pose, world, scale);
  Slope slope;
  slope.row(0) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(rows.x.data());
  slope.row(1) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(rows.y.data());
  return slope;
}

glm::dvec2 miss_of(const Camera& camera, const Pose& pose, const PlanePoints& points,
                   std::size_t i) {
  const glm::dvec3 p = pose.rotation * glm::dvec3(points.world[i], 0.0) + pose.translation;
  return points.ideal[i] -
         glm::dvec2{camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

/// Adds what two rows tell: g weighs them, e is their pull by those weights.
void add(const Slope& slope, const Eigen::Matrix2d& g, const Eigen::Vector2d& e, Known& known) {
  const Slope weighed = g * slope;
  known.weight += slope.transpose() * weighed;
  known.pull += slope.transpose() * e;
}

/// spread: of the points, in their sigmas.
void add_points(const Camera& camera, const Pose& pose, const PlanePoints& points, double spread,
                Known& known) {
  for (std::size_t i = 0; i < points.world.size(); ++i) {
    const glm::dvec2 miss = miss_of(camera, pose, points, i);
    const double sigma = spread * points.sigma[i];
    const double far = glm::length(miss) / sigma;
    const double weight = std::min(1.0, 1.5 / std::max(far, 1e-9)) / (sigma * sigma);
    add(slope_of(camera, pose, points.world[i], 1.0), weight * Eigen::Matrix2d::Identity(),
        weight * Eigen::Vector2d(miss.x, miss.y), known);
  }
}

/// Adds the patches of a view whose place is known well enough, and that are found there.
void add_patches(const TrackedPattern& pattern, const Scene& scene, const View& view,
                 const Pose& pose, const Matrix6& spread, Known& known) {
  const PlaneMap map = map_of_pose(pattern, scene.camera, pose);
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  const double grown = static_cast<double>(1 << view.at.pattern_level) * shrink;
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    const Patch& patch = view.patches[i];
    const glm::dmat2 back = glm::inverse(map.derivative(patch.centre) * grown);
    Eigen::Matrix2d to_template;
    to_template << back[0].x, back[1].x, back[0].y, back[1].y;
    const Slope slope =
        to_template * slope_of(scene.camera, pose, pattern.to_world(patch.centre), shrink);
    const double unsure = (slope * spread * slope.transpose()).trace();
    if (!(unsure < kReach * kReach)) continue;
    Glance at;
    if (!glance(view, map, patch, 1.0f, at) || at.pull.correlation < kSeen) continue;
    const Pull& pull = at.pull;
    const double mean = 0.5 * static_cast<double>(pull.xx + pull.yy) * (kTold * kTold);
    if (!(mean > 0.0)) continue;
    Eigen::Matrix2d g;
    g << static_cast<double>(pull.xx), static_cast<double>(pull.xy), static_cast<double>(pull.xy),
        static_cast<double>(pull.yy);
    g /= mean;
    const Eigen::Vector2d e =
        Eigen::Vector2d(static_cast<double>(pull.ex), static_cast<double>(pull.ey)) / mean;
    if (!(static_cast<double>(glm::length(way_of(pull))) <
          kOutlier * (std::sqrt(unsure) + kTold))) {
      continue;
    }
    add(slope, g, e, known);
    ++known.patches;
  }
}

/// Moves the pose to where all that is known of it pulls. Answers the frame pixels by which the
/// pattern's corners move, at most; negative where nothing is known. spread: of the pose.
double step(const TrackedPattern& pattern, const Camera& camera, Known& known, Pose& pose,
            Matrix6& spread) {
  known.weight.diagonal().array() += 1e-9 * known.weight.trace();
  const Vector6 change = solve_symmetric(known.weight, known.pull);
  if (!change.allFinite() || change.head<3>().norm() > 0.5) return -1.0;
  spread = solve_symmetric(known.weight, Matrix6(Matrix6::Identity()));
  std::array<double, 6> by{};
  Eigen::Map<Vector6>(by.data()) = change;
  return move(pattern, camera, 1.0, by, pose);
}

}  // namespace

double misfit(const Camera& camera, const Pose& pose, const PlanePoints& points) {
  double sum = 0.0;
  for (std::size_t i = 0; i < points.world.size(); ++i) {
    const glm::dvec2 miss = miss_of(camera, pose, points, i) / points.sigma[i];
    sum += glm::dot(miss, miss);
  }
  return std::sqrt(sum / static_cast<double>(points.world.size()));
}

void grow(const TrackedPattern& pattern, const Scene& scene, const PlanePoints& points,
          Pose& pose) {
  Pose now = pose;
  Matrix6 spread = Matrix6::Zero();
  for (int k = 0; k < 4; ++k) {
    Known known;
    add_points(scene.camera, now, points, std::max(0.7, misfit(scene.camera, now, points)), known);
    const double way = step(pattern, scene.camera, known, now, spread);
    if (way < 0.0) return;
    if (way < kStill) break;
  }
  const double rest = std::max(0.7, misfit(scene.camera, now, points));
  pose = now;
  const int levels = static_cast<int>(scene.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, scene.camera, now), levels);
  for (int level = std::min(best.frame_level + kCoarser, levels - 1); level >= best.frame_level;
       --level) {
    const View view =
        view_of(pattern, scene, level, map_of_pose(pattern, scene.camera, now), kLooked);
    int patches = 0;
    for (int k = 0; k < kSteps; ++k) {
      Known known;
      add_points(scene.camera, now, points, rest, known);
      add_patches(pattern, scene, view, now, spread, known);
      const double way = step(pattern, scene.camera, known, now, spread);
      if (way < 0.0) return;
      if (way < kStill * (1 << level) && known.patches <= patches) break;
      patches = known.patches;
    }
  }
  pose = now;
}

}  // namespace modar::tracker
