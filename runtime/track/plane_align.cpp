// Patch-wise Gauss-Newton alignment of a plane.
#include "plane_align.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "patch_equations.hpp"
#include "symmetric_solver.hpp"

namespace modar::tracker {
namespace {

constexpr double kSettled = 0.1;  // pixels of the level
constexpr std::size_t kFew = 40;  // patches that are enough on the way

/// Tukey's weight by the displacement that a patch itself asks for, once the others have settled: a
/// patch on the edge of what hides the pattern correlates well enough, but pulls elsewhere.
void distrust(Pull& pull) {
  constexpr float kFar = 1.2f;  // template pixels
  const glm::vec2 way = way_of(pull);
  const float far = std::min(1.0f, glm::dot(way, way) / (kFar * kFar));
  const float weight = (1.0f - far) * (1.0f - far);
  for (float* part : {&pull.xx, &pull.xy, &pull.yy, &pull.ex, &pull.ey}) *part *= weight;
}

/// Image pixels of a patch to template pixels.
Eigen::Matrix2d to_template(const glm::dmat2& d) {
  const double inverse = 1.0 / (d[0].x * d[1].y - d[0].y * d[1].x);
  Eigen::Matrix2d m;
  m << d[1].y * inverse, -d[1].x * inverse, -d[0].y * inverse, d[0].x * inverse;
  return m;
}

using Vector6 = Eigen::Matrix<double, 6, 1>;

Eigen::Matrix<double, 2, 6> pose_jacobian(const Camera& camera, const Pose& pose, glm::dvec2 world,
                                          double scale) {
  const PoseSlope slope = pose_slope(camera, pose, world, scale);
  Eigen::Matrix<double, 2, 6> j;
  j.row(0) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(slope.x.data());
  j.row(1) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(slope.y.data());
  return j;
}

/// One pass over the patches: normal equations of N parameters and how well the patches fit.
template <int N>
struct Pass {
  Eigen::Matrix<double, N, N> jtj = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> jtr = Eigen::Matrix<double, N, 1>::Zero();
  Fit fit;
};

/// jacobian(centre, seen): derivative of a pattern pixel's place in the level by the parameters.
template <int N, class Jacobian>
Pass<N> pass_over(const View& view, const PlaneMap& map, float forgiving, Jacobian&& jacobian) {
  Pass<N> pass;
  pass.fit.level = view.at.frame_level;
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    const Patch& patch = view.patches[i];
    Glance at;
    if (!glance(view, map, patch, forgiving, at)) continue;
    ++pass.fit.visible;
    Pull& pull = at.pull;
    if (pull.correlation >= kHeld) ++pass.fit.held;
    pass.fit.likeness += static_cast<double>(std::max(0.0f, pull.correlation));
    if (view.settled) distrust(pull);
    if (pull.xx == 0.0f && pull.yy == 0.0f) continue;
    const Eigen::Matrix<double, 2, N> j = to_template(at.slope) * jacobian(patch.centre, at.seen);
    Eigen::Matrix2d g;
    g << static_cast<double>(pull.xx), static_cast<double>(pull.xy), static_cast<double>(pull.xy),
        static_cast<double>(pull.yy);
    pass.jtj += j.transpose() * g * j;
    pass.jtr +=
        j.transpose() * Eigen::Vector2d(static_cast<double>(pull.ex), static_cast<double>(pull.ey));
  }
  if (pass.fit.visible > 0) pass.fit.likeness /= pass.fit.visible;
  return pass;
}

/// Gauss-Newton with a trace of damping; false where the equations tell nothing.
template <int N>
bool solve(Pass<N>& pass, Eigen::Matrix<double, N, 1>& change) {
  const double trace = pass.jtj.trace();
  if (pass.fit.visible < 4 || !(trace > 0.0)) return false;
  pass.jtj.diagonal().array() += 1e-9 * trace;
  change = solve_symmetric(pass.jtj, pass.jtr);
  return change.allFinite();
}

}  // namespace

Resolution finest(const TrackedPattern& pattern, const PlaneMap& map, int frame_levels) {
  const glm::dmat2 d = map.derivative({0.5 * pattern.width(), 0.5 * pattern.height()});
  // Frame pixels that a pattern's pixel takes up.
  const double scale = std::sqrt(std::abs(d[0].x * d[1].y - d[0].y * d[1].x));
  const int octaves = static_cast<int>(std::lround(std::log2(std::clamp(scale, 1e-3, 1e3))));
  Resolution out;
  out.frame_level = std::clamp(octaves, 0, frame_levels - 1);
  out.pattern_level = std::clamp(out.frame_level - octaves, 0, pattern.level_count - 1);
  return out;
}

namespace {

/// Puts smeared patches in the place of the sharp ones, where the smear is worth it.
void smear(const TrackedPattern& pattern, const Scene& scene, const Pose& pose, View& view) {
  constexpr double kLeast = 1.0;  // pixels of the level
  if (scene.smear == nullptr || scene.smear->share <= 0.0) return;
  const PlaneMap now = map_of_pose(pattern, scene.camera, pose);
  const PlaneMap then = map_of_pose(pattern, scene.camera, scene.smear->before);
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  const double grow = static_cast<double>(1 << view.at.pattern_level);
  std::vector<Patch>& smeared = scene.patches.room();
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    const Patch& patch = view.patches[i];
    bool ahead = false;
    bool was_ahead = false;
    const glm::dvec2 way = now.at(patch.centre, ahead) - then.at(patch.centre, was_ahead);
    if (!ahead || !was_ahead) continue;
    const glm::dvec2 motion = scene.smear->share * shrink * way;
    if (glm::length(motion) < kLeast) {
      smeared.push_back(patch);
      continue;
    }
    const Eigen::Vector2d turned = to_template(now.derivative(patch.centre) * (grow * shrink)) *
                                   Eigen::Vector2d(motion.x, motion.y);
    PatchCache::smear(pattern, view.at.pattern_level, patch, {turned.x(), turned.y()},
                      smeared.emplace_back());
  }
  view.patches = smeared;
  view.stride = 1;
}

/// One step of Gauss-Newton on the pose. Answers the pixels of the level that its corners moved by;
/// negative where it could not.
double step_pose(const TrackedPattern& pattern, const Scene& scene, const View& view,
                 float forgiving, Pose& pose, Fit& fit) {
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  Pass<6> pass =
      pass_over<6>(view, map_of_pose(pattern, scene.camera, pose), forgiving,
                   [&](glm::dvec2 centre, glm::dvec2) {
                     return pose_jacobian(scene.camera, pose, pattern.to_world(centre), shrink);
                   });
  fit = pass.fit;
  Vector6 change;
  if (!solve(pass, change) || change.head<3>().norm() > 0.5) return -1.0;
  std::array<double, 6> by{};
  Eigen::Map<Vector6>(by.data()) = change;
  return move(pattern, scene.camera, shrink, by, pose);
}

}  // namespace

Fit align(const TrackedPattern& pattern, const Scene& scene, int frame_level, int steps,
          bool precise, Pose& pose) {
  View view = view_of(pattern, scene, frame_level, map_of_pose(pattern, scene.camera, pose), kFew);
  Fit fit;
  fit.level = frame_level;
  if (view.patches.empty()) return fit;
  const View sharp = view;
  smear(pattern, scene, pose, view);
  double moved = 0.0;
  for (int step = 0; step < steps; ++step) {
    // While the pose is still off, patches that hardly correlate pull in the right direction too.
    moved = step_pose(pattern, scene, view, step == 0 ? 1.0f : 0.7f, pose, fit);
    if (moved < kSettled) break;
  }
  if (precise) {
    view = sharp;
    // Smeared ones are made anew in each frame: half of them will do.
    view.stride = scene.smear != nullptr ? 2 : 1;
    smear(pattern, scene, pose, view);
  }
  for (int step = 0; step < (precise ? 10 : 1) && moved >= 0.0; ++step) {
    // What was held is known of the pose before the step: a pose that is judged by it lies near.
    moved = step_pose(pattern, scene, view, 0.7f, pose, fit);
    if (view.settled || (!precise && moved < kSettled)) break;
    view.settled = precise && moved < kSettled;
  }
  return fit;
}

Fit look(const TrackedPattern& pattern, const Scene& scene, int frame_level, const Pose& pose) {
  Pose unchanged = pose;
  return align(pattern, scene, frame_level, 0, false, unchanged);
}

Fit align_map(const TrackedPattern& pattern, const Scene& scene, int frame_level, int steps,
              PlaneMap& map) {
  View view = view_of(pattern, scene, frame_level, map, kFew);
  view.stride = 1;
  Fit fit;
  fit.level = frame_level;
  if (view.patches.empty()) return fit;
  const Camera& camera = scene.camera;
  const double scale = camera.fx / static_cast<double>(1 << frame_level);
  const auto jacobian = [&](glm::dvec2, glm::dvec2 seen) {
    const double u = (seen.x - camera.cx) / camera.fx;
    const double v = (seen.y - camera.cy) / camera.fx;
    Eigen::Matrix<double, 2, 8> j;
    j << 1, u, v, 0, 0, 0, u * u, u * v, 0, 0, 0, 1, u, v, u * v, v * v;
    return Eigen::Matrix<double, 2, 8>(scale * j);
  };
  glm::dmat3 k(1.0);
  k[0][0] = k[1][1] = camera.fx;
  k[2] = {camera.cx, camera.cy, 1.0};
  for (int step = 0; step <= steps; ++step) {
    Pass<8> pass = pass_over<8>(view, map, step == 0 ? 1.0f : 0.7f, jacobian);
    fit = pass.fit;
    Eigen::Matrix<double, 8, 1> e;
    if (step == steps || !solve(pass, e) || e.norm() > 0.5) break;
    glm::dmat3 change(1.0);
    change[0] = {1.0 + e(1), e(4), -e(6)};
    change[1] = {e(2), 1.0 + e(5), -e(7)};
    change[2] = {e(0), e(3), 1.0};
    map.homography = k * change * glm::inverse(k) * map.homography;
  }
  return fit;
}

}  // namespace modar::tracker
