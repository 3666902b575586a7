// Coarse-to-fine refinement, refinement from features and patches, and the photometric check.
#include "pose_refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {

// ---- The photometric check ----

int photometric_percent(const TrackedPattern& pattern, const FrameView& frame, const Pose& pose,
                        int min_cells) {
  const PhotometricCheck check =
      check_photometry(pattern, map_of_pose(pattern, frame.camera, pose), frame.pyramid);
  return check.matching >= min_cells ? check.matching * 100 / check.cells : 0;
}

int map_photometric_percent(const TrackedPattern& pattern, const FrameView& frame,
                            const PlaneMap& map) {
  // Percent of the cells for a map, which has two more parameters than a pose. Lower finds more and
  // more wrong ones. [25, 75] tuned: pose
  constexpr int kMinMapPercent = 50;
  const PhotometricCheck check = check_photometry(pattern, map, frame.pyramid);
  if (check.matching < 2 * kMinCells) return 0;
  const int percent = check.matching * 100 / check.cells;
  return percent >= kMinMapPercent ? percent : 0;
}

// ---- From coarse levels to the finest ----

namespace {

// Side of the pattern, pixels, on the coarsest level of refinement. Smaller images hold no patches.
// [12, 48] tuned: pose
constexpr double kMinSide = 24.0;
// Ratio of distances between frames; larger changes are patches that slid to other texture. Swept
// on tracking fast: flat from 1.15 to 1.7.
constexpr double kMaxZoom = 1.35;
// Share of a coarser level's inlier ratio that a finer one must keep. Lower follows motion blur,
// higher gives up accuracy. [0.6, 0.95] tuned: pose
constexpr double kMinKept = 0.85;
// Gauss-Newton steps of a level for a pose, and for a map.
constexpr int kSteps = 10;
constexpr int kMapSteps = 4;

/// The level to start on: at most `most` above the finest.
int coarsest_level(const TrackedPattern& pattern, const Resolution& best, int levels, int most) {
  int coarsest = best.frame_level;
  double side =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(1 << best.pattern_level);
  while (coarsest + 1 < levels && coarsest - best.frame_level < most && side > 2 * kMinSide &&
         best.pattern_level + coarsest + 1 - best.frame_level < pattern.level_count) {
    ++coarsest;
    side *= 0.5;
  }
  return coarsest;
}

/// Levels above the finest.
int levels_of(SearchRadius radius) {
  constexpr std::array<int, 4> kLevels = {0, 1, 2, 4};
  return kLevels[static_cast<std::size_t>(radius)];
}

}  // namespace

bool refine(const TrackedPattern& pattern, const FrameView& frame, SearchRadius radius, Pose& pose,
            PatchFit& fit, bool precise) {
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, frame.camera, pose), levels);
  const double depth = pose.translation.z;
  Pose accepted = pose;
  bool found = false;
  for (int level = coarsest_level(pattern, best, levels, levels_of(radius));
       level >= best.frame_level; --level) {
    Pose next = pose;
    const PatchFit now =
        align(pattern, frame, level, kSteps, precise && level == best.frame_level, next);
    const double zoom = next.translation.z / depth;
    if (!(zoom < kMaxZoom && zoom * kMaxZoom > 1.0)) return false;
    // Coarse levels have few patches, more of them by chance.
    const bool finest_level = level == best.frame_level;
    const bool enough = finest_level || now.inliers * 5 >= now.visible;
    if (enough && now.good() && (!found || now.inlier_ratio() >= kMinKept * fit.inlier_ratio())) {
      accepted = pose = next;
      fit = now;
      found = true;
      continue;
    }
    // Blur takes the fine levels first: what a coarser one found stays.
    if (found) break;
    pose = next;
  }
  pose = accepted;
  if (!found || fit.level == best.frame_level) return found;
  return photometric_percent(pattern, frame, pose) >= kMinPercent;
}

bool refine_map(const TrackedPattern& pattern, const FrameView& frame, PlaneMap& map, PatchFit& fit,
                SearchRadius radius) {
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map, levels);
  const int above = levels_of(radius);
  for (int level = coarsest_level(pattern, best, levels, above); level >= best.frame_level;
       --level) {
    fit = align_map(pattern, frame, level, kMapSteps, map);
  }
  return fit.good() && map_photometric_percent(pattern, frame, map) > 0;
}

bool refine_plane(TrackedPattern& pattern, const FrameView& frame, Pose& pose, PatchFit& fit) {
  // Of a level: a wrong focal length, or aspect, leaves a pose some pixels off.
  constexpr int kPlaneSteps = 3;
  constexpr int kCoveredSteps = 10;  // most end earlier
  constexpr std::size_t kCoarse = 40;
  constexpr std::size_t kFine = 128;
  TrackedPattern plane = pattern;
  Pose next = pose;
  PlaneChange change;
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, frame.camera, pose), levels);
  for (int level = coarsest_level(pattern, best, levels, 1); level >= best.frame_level; --level) {
    fit = align_plane(plane, frame, level, kPlaneSteps, level == best.frame_level ? kFine : kCoarse,
                      next, change);
  }
  // A pose of the wrong camera fits a part of what shows of a covered print: of 360 covered to 70
  // %, 76 were 5 to 74 pixels off. Steps over all patches spread from there over what shows.
  if (!fit.open()) {
    fit = align_plane(plane, frame, best.frame_level, kCoveredSteps, kMaxPatches, next, change);
  }
  if (pattern.surface.flat() && fit.inlier_ratio() < kLittleShown) {
    fit.residual_rms = residual_rms_of(frame.patches.last_linearisations());
  }
  if (!fit.good()) return false;
  pattern.shape = plane.shape;
  pose = next;
  return true;
}

// ---- From the features of a part of the pattern ----

namespace {

constexpr std::size_t kPatches =
    80;  // of a level: about what tracking needs (patch_alignment.cpp), twice
constexpr int kCoarserLevels = 2;  // above the finest: predictions are good to a pixel there first
constexpr int kPointSteps = 4;     // over features alone
constexpr int kLevelSteps = 5;     // of a level: each lets patches further away take part
// Template pixels to which the pose must predict a patch that takes part. Larger lets patches
// settle on neighbouring edges. [0.6, 2.4] tuned: pose
constexpr double kMaxUncertainty = 1.2;
// Template pixels to which a correlated patch measures its place. [0.2, 0.8] tuned: pose
constexpr double kPatchSigma = 0.4;
// Correlation from which a patch measures its place. [0.3, 0.8] tuned: pose
constexpr float kMinCorrelation = 0.6f;
constexpr double kOutlier = 3.0;  // sigmas
constexpr double kAtRest = 0.1;   // pixels: the pose moves no more
constexpr double kMinSigma =
    0.7;                        // of the points, in theirs: exact fits of few points mean nothing
constexpr double kHuber = 1.5;  // sigmas: beyond it a point's weight falls

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 2, 6>;

/// Normal equations of the pose in units of its information matrix.
struct PoseInformation {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 vector = Vector6::Zero();
  int patches = 0;
};

Jacobian jacobian_of(const Camera& camera, const Pose& pose, const glm::dvec3& world,
                     double scale) {
  const PoseJacobian rows = pose_jacobian(camera, pose, world, scale);
  Jacobian jacobian;
  jacobian.row(0) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(rows.x.data());
  jacobian.row(1) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(rows.y.data());
  return jacobian;
}

glm::dvec2 residual(const Camera& camera, const Pose& pose, const PlanePoints& points,
                    std::size_t i) {
  const glm::dvec3 p = pose.rotation * points.world[i] + pose.translation;
  return points.ideal[i] -
         glm::dvec2{camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

/// Adds a measurement of two rows: its information g, and e = g times its residual.
void add(const Jacobian& jacobian, const Eigen::Matrix2d& g, const Eigen::Vector2d& e,
         PoseInformation& sum) {
  const Jacobian weighted = g * jacobian;
  sum.matrix += jacobian.transpose() * weighted;
  sum.vector += jacobian.transpose() * e;
}

/// spread: standard deviation of the points, in their sigmas.
void add_points(const Camera& camera, const Pose& pose, const PlanePoints& points, double spread,
                PoseInformation& sum) {
  for (std::size_t i = 0; i < points.world.size(); ++i) {
    const glm::dvec2 miss = residual(camera, pose, points, i);
    const double sigma = spread * points.sigma[i];
    const double far = glm::length(miss) / sigma;
    const double weight = std::min(1.0, kHuber / std::max(far, 1e-9)) / (sigma * sigma);
    add(jacobian_of(camera, pose, points.world[i], 1.0), weight * Eigen::Matrix2d::Identity(),
        weight * Eigen::Vector2d(miss.x, miss.y), sum);
  }
}

/// Adds the patches of a view that the pose predicts well enough and that are found there.
void add_patches(const TrackedPattern& pattern, const FrameView& frame, const PatchView& view,
                 const Pose& pose, const Matrix6& covariance, PoseInformation& sum) {
  if (view.patches.empty()) return;  // the pattern's image has no such level
  frame.patches.count(view.patches.size() / view.stride);
  const PlaneMap map = map_of_pose(pattern, frame.camera, pose);
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  const double grown = static_cast<double>(1 << view.at.pattern_level) * shrink;
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    const Patch& patch = view.patches[i];
    const glm::dmat2 back = glm::inverse(map.derivative(patch.centre) * grown);
    Eigen::Matrix2d to_template;
    to_template << back[0].x, back[1].x, back[0].y, back[1].y;
    const Jacobian jacobian =
        to_template * jacobian_of(frame.camera, pose, pattern.on_surface(patch.centre), shrink);
    const double variance = (jacobian * covariance * jacobian.transpose()).trace();
    if (!(variance < kMaxUncertainty * kMaxUncertainty)) continue;
    PatchObservation seen;
    if (!observe_patch(view, map, patch, 1.0f, seen)) continue;
    const PatchNormalEquations& one = seen.equations;
    if (one.correlation < kMinCorrelation) continue;
    const double mean = 0.5 * static_cast<double>(one.xx + one.yy) * (kPatchSigma * kPatchSigma);
    if (!(mean > 0.0)) continue;
    Eigen::Matrix2d g;
    g << static_cast<double>(one.xx), static_cast<double>(one.xy), static_cast<double>(one.xy),
        static_cast<double>(one.yy);
    g /= mean;
    const Eigen::Vector2d e =
        Eigen::Vector2d(static_cast<double>(one.ex), static_cast<double>(one.ey)) / mean;
    if (!(static_cast<double>(glm::length(displacement(one))) <
          kOutlier * (std::sqrt(variance) + kPatchSigma))) {
      continue;
    }
    add(jacobian, g, e, sum);
    ++sum.patches;
  }
}

/// One Gauss-Newton step. Returns the displacement of the pattern's corners, frame pixels; negative
/// if the information determines nothing. covariance: of the pose.
double step(const TrackedPattern& pattern, const Camera& camera, PoseInformation& sum, Pose& pose,
            Matrix6& covariance) {
  sum.matrix.diagonal().array() += 1e-9 * sum.matrix.trace();
  const Vector6 change = solve_symmetric(sum.matrix, sum.vector);
  if (!change.allFinite() || change.head<3>().norm() > kMaxRotation) return -1.0;
  covariance = solve_symmetric(sum.matrix, Matrix6(Matrix6::Identity()));
  std::array<double, 6> by{};
  Eigen::Map<Vector6>(by.data()) = change;
  return move_pose(pattern, camera, 1.0, by, pose);
}

}  // namespace

double reprojection_rms(const Camera& camera, const Pose& pose, const PlanePoints& points) {
  double sum = 0.0;
  for (std::size_t i = 0; i < points.world.size(); ++i) {
    const glm::dvec2 miss = residual(camera, pose, points, i) / points.sigma[i];
    sum += glm::dot(miss, miss);
  }
  return std::sqrt(sum / static_cast<double>(points.world.size()));
}

void refine_from_inliers(const TrackedPattern& pattern, const FrameView& frame,
                         const PlanePoints& points, Pose& pose) {
  const Camera& camera = frame.camera;
  Pose now = pose;
  Matrix6 covariance = Matrix6::Zero();
  for (int k = 0; k < kPointSteps; ++k) {
    PoseInformation sum;
    add_points(camera, now, points, std::max(kMinSigma, reprojection_rms(camera, now, points)),
               sum);
    const double moved = step(pattern, camera, sum, now, covariance);
    if (moved < 0.0) return;
    if (moved < kAtRest) break;
  }
  const double spread = std::max(kMinSigma, reprojection_rms(camera, now, points));
  pose = now;
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, camera, now), levels);
  for (int level = std::min(best.frame_level + kCoarserLevels, levels - 1);
       level >= best.frame_level; --level) {
    const PatchView view =
        view_of(pattern, frame, level, map_of_pose(pattern, camera, now), kPatches);
    int patches = 0;
    for (int k = 0; k < kLevelSteps; ++k) {
      PoseInformation sum;
      add_points(camera, now, points, spread, sum);
      add_patches(pattern, frame, view, now, covariance, sum);
      const double moved = step(pattern, camera, sum, now, covariance);
      if (moved < 0.0) return;
      if (moved < kAtRest * (1 << level) && sum.patches <= patches) break;
      patches = sum.patches;
    }
  }
  pose = now;
}

// ---- Drawing on a picture ----

namespace {

using Corners3 = std::array<glm::dvec3, 4>;  // of a picture, pattern axes

/// Moves the pose so that its outline is nearest to these pixels. False if a corner is
/// behind the camera.
bool fit_outline(const Camera& camera, const Corners3& world,
                 const std::array<glm::dvec2, 4>& pixels, Pose& pose) {
  // Quadratic from some pixels away: most frames take three.
  constexpr int kOutlineSteps = 5;
  constexpr double kStill = 1e-4;  // radians, and of the distance
  const std::array<double, 4> sigma = {1, 1, 1, 1};
  Pose now = pose;
  for (int k = 0; k < kOutlineSteps; ++k) {
    PoseInformation sum;
    for (std::size_t i = 0; i < world.size(); ++i) {
      if (!((now.rotation * world[i] + now.translation).z > 0.0)) return false;
      const glm::dvec2 miss = residual(camera, now, {world, pixels, sigma}, i);
      add(jacobian_of(camera, now, world[i], 1.0), Eigen::Matrix2d::Identity(), {miss.x, miss.y},
          sum);
    }
    const Vector6 change = solve_symmetric(sum.matrix, sum.vector);
    if (!change.allFinite() || change.head<3>().norm() > kMaxRotation) return false;
    now.rotation = rotation_matrix({change(0), change(1), change(2)}) * now.rotation;
    now.translation += glm::dvec3(change(3), change(4), change(5));
    if (change.cwiseAbs().maxCoeff() < kStill) break;
  }
  if (!(now.translation.z > 0.0)) return false;
  pose = now;
  return true;
}

}  // namespace

DrawnPose drawn_pose(const TrackedPattern& pattern, const Camera& camera, const Pose& pose,
                     double aspect) {
  Corners3 print;
  Corners3 picture;
  std::array<glm::dvec2, 4> pixels;
  const auto corners = pattern_corners(pattern.width(), pattern.height());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    picture[i] = {corners[i], 0.0};
    print[i] = {corners[i].x, aspect * corners[i].y, 0.0};
    const glm::dvec3 p =
        pose.rotation * glm::dvec3(pattern.shape * corners[i], 0.0) + pose.translation;
    if (!(p.z > 0.0)) return {pose};
    pixels[i] = {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
  }
  Pose upright = pose;
  if (!fit_outline(camera, print, pixels, upright)) return {pose};
  DrawnPose out{upright};
  if (!fit_outline(camera, picture, pixels, out.pose)) return {pose};
  // The plane's axes and middle as the homography has them, as near to the pose as its scale lets.
  const glm::dmat3 back = glm::transpose(out.pose.rotation);
  const double scale = out.pose.translation.z / pose.translation.z;
  for (int column = 0; column < 2; ++column) {
    const glm::dvec2 axis = pattern.shape[column];
    out.stretch[column] = scale * (back * (pose.rotation * glm::dvec3(axis, 0.0)));
  }
  out.stretch[2] = back * upright.rotation[2];
  out.stretch[3] = back * (scale * pose.translation - out.pose.translation);
  return out;
}

// ---- Bent prints ----

namespace {

using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
using BendJacobian = Eigen::Matrix<double, 2, 8>;

/// A print that bulges by `across` x^2 + `along` y^2 over the plane of its pose.
struct BentPose {
  Pose pose;
  double across = 0;
  double along = 0;

  [[nodiscard]] glm::dvec3 at(glm::dvec2 world) const {
    const double height = across * world.x * world.x + along * world.y * world.y;
    return pose.rotation * glm::dvec3(world, height) + pose.translation;
  }
};

/// The level on which the print's longer side has at most this many pixels: there patches reach
/// several frame pixels away.
int bend_level(const TrackedPattern& pattern, const Resolution& best, int levels, double most) {
  int level = best.frame_level;
  double side =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(1 << best.pattern_level);
  while (side > most && level + 1 < levels &&
         best.pattern_level + level + 1 - best.frame_level < pattern.level_count) {
    ++level;
    side *= 0.5;
  }
  return level;
}

/// Of a world point's pixel by a step of the pose and by the two bulges.
BendJacobian bend_jacobian(const Camera& camera, const Pose& pose, glm::dvec2 world, double scale) {
  BendJacobian out;
  out.leftCols<6>() = jacobian_of(camera, pose, {world, 0.0}, scale);
  const Eigen::Vector3d normal(pose.rotation[2].x, pose.rotation[2].y, pose.rotation[2].z);
  const Eigen::Vector2d by_height = out.middleCols<3>(3) * normal;
  out.col(6) = by_height * (world.x * world.x);
  out.col(7) = by_height * (world.y * world.y);
  return out;
}

constexpr std::size_t kBendPatches = 96;

/// A patch compared with the frame where the bent print has it; false if it is not there.
/// map: of the bent print's pose.
bool observe_bent(const TrackedPattern& pattern, const Camera& camera, const PatchView& view,
                  const PlaneMap& map, const BentPose& bent, const Patch& patch,
                  PatchObservation& seen) {
  const glm::dvec2 world = pattern.to_world(patch.centre);
  const glm::dvec3 flat = BentPose{bent.pose}.at(world);
  const glm::dvec3 there = bent.at(world);
  if (!(flat.z > 0.0) || !(there.z > 0.0)) return false;
  PlaneMap moved = map;
  const glm::dvec2 by{camera.fx * (there.x / there.z - flat.x / flat.z),
                      camera.fy * (there.y / there.z - flat.y / flat.z)};
  for (int column = 0; column < 3; ++column) {
    moved.homography[column].x += by.x * moved.homography[column].z;
    moved.homography[column].y += by.y * moved.homography[column].z;
  }
  return observe_patch(view, moved, patch, 1.0f, seen);
}

/// Mean correlation of the patches in view, negative ones counted as 0. observe(patch, seen): false
/// if the patch is not in the frame.
template <class Observe>
double mean_correlation(const PatchView& view, Observe&& observe) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    PatchObservation seen;
    if (!observe(view.patches[i], seen)) continue;
    sum += static_cast<double>(std::max(0.0f, seen.equations.correlation));
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

/// By how much the patches of a level correlate more with the bent print than with the pose, and
/// than with the homography that fits best: that takes up what a wrong focal length or aspect makes
/// of a flat print.
struct BendGain {
  double over_pose = 0;
  double over_map = 0;
};

BendGain gain_of_bend(const TrackedPattern& pattern, const FrameView& frame, int level,
                      const Pose& flat, const BentPose& bent) {
  constexpr int kFreeSteps = 6;
  const PlaneMap bent_map = map_of_pose(pattern, frame.camera, bent.pose);
  const PlaneMap flat_map = map_of_pose(pattern, frame.camera, flat);
  PlaneMap free_map = flat_map;
  align_map(pattern, frame, level, kFreeSteps, free_map);
  const PatchView view = view_of(pattern, frame, level, flat_map, kBendPatches);
  const auto fit_of = [&](const PlaneMap& map) {
    return mean_correlation(view, [&](const Patch& patch, PatchObservation& seen) {
      return observe_patch(view, map, patch, 1.0f, seen);
    });
  };
  const double fit = mean_correlation(view, [&](const Patch& patch, PatchObservation& seen) {
    return observe_bent(pattern, frame.camera, view, bent_map, bent, patch, seen);
  });
  return {fit - fit_of(flat_map), fit - fit_of(free_map)};
}

/// One Gauss-Newton step over the patches of a level; false if they determine none.
bool step_bent(const TrackedPattern& pattern, const FrameView& frame, int level, BentPose& bent) {
  constexpr int kMinPatches = 16;  // with at least this correlation:
  constexpr float kCorrelated = 0.5f;
  const PlaneMap map = map_of_pose(pattern, frame.camera, bent.pose);
  const PatchView view = view_of(pattern, frame, level, map, kBendPatches);
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  Matrix8 matrix = Matrix8::Zero();
  Vector8 vector = Vector8::Zero();
  int count = 0;
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    const Patch& patch = view.patches[i];
    PatchObservation seen;
    if (!observe_bent(pattern, frame.camera, view, map, bent, patch, seen)) continue;
    const PatchNormalEquations& one = seen.equations;
    if (one.correlation < kCorrelated) continue;
    const glm::dvec2 world = pattern.to_world(patch.centre);
    const glm::dmat2 to_template = glm::inverse(seen.jacobian);
    Eigen::Matrix2d back;
    back << to_template[0].x, to_template[1].x, to_template[0].y, to_template[1].y;
    const BendJacobian jacobian = back * bend_jacobian(frame.camera, bent.pose, world, shrink);
    Eigen::Matrix2d g;
    g << static_cast<double>(one.xx), static_cast<double>(one.xy), static_cast<double>(one.xy),
        static_cast<double>(one.yy);
    matrix += jacobian.transpose() * g * jacobian;
    vector += jacobian.transpose() *
              Eigen::Vector2d(static_cast<double>(one.ex), static_cast<double>(one.ey));
    ++count;
  }
  if (count < kMinPatches) return false;
  matrix.diagonal().array() += 1e-9 * matrix.trace();
  const Vector8 change = solve_symmetric(matrix, vector);
  if (!change.allFinite() || change.head<3>().norm() > kMaxRotation) return false;
  std::array<double, 6> by{};
  std::copy_n(change.data(), by.size(), by.begin());
  bent.across += change(6);
  bent.along += change(7);
  return move_pose(pattern, frame.camera, 1.0, by, bent.pose) >= 0.0;
}

/// Mean distance of the four corners, frame pixels; the lens left aside.
double corners_apart(const TrackedPattern& pattern, const Camera& camera, const BentPose& a,
                     const BentPose& b) {
  const double right = pattern.width() - 0.5;
  const double bottom = pattern.height() - 0.5;
  double sum = 0.0;
  for (const glm::dvec2 corner :
       {glm::dvec2{-0.5, -0.5}, {right, -0.5}, {-0.5, bottom}, {right, bottom}}) {
    const glm::dvec2 world = pattern.to_world(corner);
    const glm::dvec3 p = a.at(world);
    const glm::dvec3 q = b.at(world);
    if (!(p.z > 0.0) || !(q.z > 0.0)) return 0.0;
    sum += 0.25 * glm::length(glm::dvec2(camera.fx * (p.x / p.z - q.x / q.z),
                                         camera.fy * (p.y / p.z - q.y / q.z)));
  }
  return sum;
}

}  // namespace

double bend_of(const TrackedPattern& pattern, const FrameView& frame, const Pose& pose,
               double least) {
  // Pixels of the first step below which a print is flat.
  constexpr double kFlat = 0.2;
  // Min. correlation gain for a bend. Checked after every step: steps that recover a 30 px offset
  // may lose it again.
  constexpr double kGain = 0.055;
  // The same on the finer level. Lower bends hidden parts of flat prints, higher misses bent ones.
  constexpr double kFineGain = 0.05;
  constexpr std::array<double, 6> kSides = {160.0, 160.0, 160.0, 320.0, 320.0, 320.0};
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, frame.camera, pose), levels);
  const BentPose flat{pose};
  BentPose bent = flat;
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    const int level = bend_level(pattern, best, levels, kSides[i]);
    if (!step_bent(pattern, frame, level, bent)) break;
    const double apart = corners_apart(pattern, frame.camera, flat, bent);
    if (i == 0 && apart < kFlat) break;
    if (!(apart >= least)) continue;
    const BendGain gain = gain_of_bend(pattern, frame, level, pose, bent);
    // Flat prints of an aspect that was off by up to 6 % had -0.11 and less, bent ones 0.01 and
    // more.
    if (!(gain.over_map > 0.0)) continue;
    if (gain.over_pose >= (kSides[i] == kSides.front() ? kGain : kFineGain)) return apart;
  }
  return 0.0;
}

}  // namespace modar::tracker
