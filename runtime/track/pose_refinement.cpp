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

namespace {

float correlation(std::span<const float> a, std::span<const float> b, float& contrast) {
  float sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i];
    sb += b[i];
    saa += a[i] * a[i];
    sbb += b[i] * b[i];
    sab += a[i] * b[i];
  }
  const float n = static_cast<float>(a.size());
  const float va = saa / n - sa / n * sa / n;
  const float vb = sbb / n - sb / n * sb / n;
  contrast = va;
  if (!(va > 0.0f) || !(vb > 0.25f)) return 0.0f;
  return (sab / n - sa / n * sb / n) / std::sqrt(va * vb);
}

}  // namespace

PhotometricCheck check_photometry(const TrackedPattern& pattern, const PlaneMap& map,
                                  std::span<const GrayImage> pyramid) {
  // 8x8 cells of 6x6 samples: smaller cells agree by chance, larger ones are hidden in part too
  // often. Contrast is a variance: below it a cell of the pattern shows nothing. All set by hand;
  // kMatching with kMinPercent.
  constexpr int kCells = 8;
  constexpr int kSamples = 6;
  constexpr float kMinContrast = 16.0f;
  constexpr float kMatching = 0.5f;
  const glm::dmat2 d = map.derivative({0.5 * pattern.width(), 0.5 * pattern.height()});
  const double step =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(kCells * kSamples);
  const double scale = std::sqrt(std::abs(d[0].x * d[1].y - d[0].y * d[1].x));
  const auto level_of = [](double pixels, int count) {
    return std::clamp(nearest_octave(std::max(pixels, 1.0)), 0, count - 1);
  };
  const auto pattern_level = static_cast<std::size_t>(level_of(step, pattern.level_count));
  const auto frame_level =
      static_cast<std::size_t>(level_of(step * scale, static_cast<int>(pyramid.size())));
  const GrayImage& templates = pattern.levels[pattern_level];
  const GrayImage& image = pyramid[frame_level];
  const double template_shrink = 1.0 / static_cast<double>(1u << pattern_level);
  const double shrink = 1.0 / static_cast<double>(1u << frame_level);
  PhotometricCheck check;
  std::array<float, kSamples * kSamples> expected{};
  std::array<float, kSamples * kSamples> seen{};
  for (int cell = 0; cell < kCells * kCells; ++cell) {
    bool complete = true;
    for (int k = 0; k < kSamples * kSamples && complete; ++k) {
      const double u =
          ((cell % kCells) * kSamples + k % kSamples + 0.5) / (kCells * kSamples) * pattern.width();
      const double v =
          (static_cast<int>(cell / kCells) * kSamples + static_cast<int>(k / kSamples) + 0.5) /
          (kCells * kSamples) * pattern.height();
      bool in_front = false;
      const glm::dvec2 p = map.at({u - 0.5, v - 0.5}, in_front);
      const double x = (p.x + 0.5) * shrink - 0.5;
      const double y = (p.y + 0.5) * shrink - 0.5;
      complete = in_front && x >= 0.0 && y >= 0.0 && x < image.width - 1 && y < image.height - 1;
      if (!complete) break;
      const auto at = static_cast<std::size_t>(k);
      seen[at] = sample(image, static_cast<float>(x), static_cast<float>(y));
      const double tx = std::clamp(u * template_shrink - 0.5, 0.0, templates.width - 1.001);
      const double ty = std::clamp(v * template_shrink - 0.5, 0.0, templates.height - 1.001);
      expected[at] = sample(templates, static_cast<float>(tx), static_cast<float>(ty));
    }
    if (!complete) continue;
    float contrast = 0;
    const float fit = correlation(expected, seen, contrast);
    if (contrast < kMinContrast) continue;
    ++check.cells;
    if (fit >= kMatching) ++check.matching;
  }
  return check;
}

int photometric_percent(const TrackedPattern& pattern, const FrameView& frame, const Pose& pose,
                        int min_cells) {
  const PhotometricCheck check =
      check_photometry(pattern, map_of_pose(pattern, frame.camera, pose), frame.pyramid);
  return check.matching >= min_cells ? check.matching * 100 / check.cells : 0;
}

int map_photometric_percent(const TrackedPattern& pattern, const FrameView& frame,
                            const PlaneMap& map) {
  // A map has two parameters more than a pose to bend to what it sees; set by hand.
  constexpr int kMinMapPercent = 50;
  const PhotometricCheck check = check_photometry(pattern, map, frame.pyramid);
  if (check.matching < 2 * kMinCells) return 0;
  const int percent = check.matching * 100 / check.cells;
  return percent >= kMinMapPercent ? percent : 0;
}

// ---- From coarse levels to the finest ----

namespace {

// Side of the pattern on the coarsest level that refinement starts on, pixels: smaller images hold
// no patches. By hand.
constexpr double kMinSide = 24.0;
// Ratio of distances between frames; larger changes are patches that slid to other texture. By
// hand.
constexpr double kMaxZoom = 1.35;
// Share of a coarser level's inlier ratio that a finer one must keep: under blur its patches fit
// along the motion only, and draw the pose away from what coarse ones found. By hand, on blurred
// paths of `modar bench pose`.
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
            PatchFit& fit) {
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, frame.camera, pose), levels);
  const double depth = pose.translation.z;
  Pose accepted = pose;
  bool found = false;
  for (int level = coarsest_level(pattern, best, levels, levels_of(radius));
       level >= best.frame_level; --level) {
    Pose next = pose;
    const PatchFit now = align(pattern, frame, level, kSteps, level == best.frame_level, next);
    const double zoom = next.translation.z / depth;
    if (!(zoom < kMaxZoom && zoom * kMaxZoom > 1.0)) return false;
    if (now.good() && (!found || now.inlier_ratio() >= kMinKept * fit.inlier_ratio())) {
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

bool refine_map(const TrackedPattern& pattern, const FrameView& frame, PlaneMap& map,
                PatchFit& fit) {
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = finest(pattern, map, levels);
  const int above = levels_of(SearchRadius::kFrame);
  for (int level = coarsest_level(pattern, best, levels, above); level >= best.frame_level;
       --level) {
    fit = align_map(pattern, frame, level, kMapSteps, map);
  }
  return fit.good() && map_photometric_percent(pattern, frame, map) > 0;
}

// ---- From the features of a part of the pattern ----

namespace {

constexpr std::size_t kPatches =
    80;  // of a level: about what tracking needs (patch_alignment.cpp), twice
constexpr int kCoarserLevels = 2;  // above the finest: predictions are good to a pixel there first
constexpr int kPointSteps = 4;     // over features alone
constexpr int kLevelSteps = 5;     // of a level: each lets patches further away take part
// Template pixels to which the pose must predict a patch for it to take part, and to which a patch
// that correlates by kMinCorrelation then measures its place. Larger predictions let patches in
// that settle on a neighbouring edge. The three set by hand on half-covered patterns, which went
// from 98.3 to 100 % right.
constexpr double kMaxUncertainty = 1.2;
constexpr double kPatchSigma = 0.4;
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

Jacobian jacobian_of(const Camera& camera, const Pose& pose, glm::dvec2 world, double scale) {
  const PoseJacobian rows = pose_jacobian(camera, pose, world, scale);
  Jacobian jacobian;
  jacobian.row(0) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(rows.x.data());
  jacobian.row(1) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(rows.y.data());
  return jacobian;
}

glm::dvec2 residual(const Camera& camera, const Pose& pose, const PlanePoints& points,
                    std::size_t i) {
  const glm::dvec3 p = pose.rotation * glm::dvec3(points.world[i], 0.0) + pose.translation;
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
  const PlaneMap map = map_of_pose(pattern, frame.camera, pose);
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  const double grown = static_cast<double>(1 << view.at.pattern_level) * shrink;
  for (std::size_t i = 0; i < view.patches.size(); i += view.stride) {
    const Patch& patch = view.patches[i];
    const glm::dmat2 back = glm::inverse(map.derivative(patch.centre) * grown);
    Eigen::Matrix2d to_template;
    to_template << back[0].x, back[1].x, back[0].y, back[1].y;
    const Jacobian jacobian =
        to_template * jacobian_of(frame.camera, pose, pattern.to_world(patch.centre), shrink);
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

}  // namespace modar::tracker
