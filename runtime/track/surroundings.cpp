// The map of points around a pattern: their depth, their alignment with a frame, what comes and
// goes.
#include "surroundings.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Widest level that frames are read on, pixels. Larger is more exact and slower.
constexpr int kMaxWidth = 400;
// And first this many levels coarser against the frame before: patches find their place from some 3
// pixels away, which are 12 there.
constexpr int kCoarser = 2;
// Cells of a frame across, each with one point at most. More take time, fewer are lost behind a
// hand.
constexpr int kColumns = 10;
// The same down.
constexpr int kRows = 8;
// Cells that each frame searches for new points. More learn faster and take time. [3, 12] tuned:
// extended
constexpr int kCellsAFrame = 6;
// Misses in a row after which a new point is dropped. More keep moving points. [4, 16] tuned:
// extended
constexpr int kMissesOfNew = 8;
// The same for a steady point. Fewer lose points behind a passer-by.
constexpr int kMissesOfSteady = 90;
// Hits from which a point is steady. Fewer trust moving points, more learn slowly. [4, 16] tuned:
// extended
constexpr int kSteadyHits = 8;
// Inverse depth over its standard deviation from which a point is steady. Lower follows a still
// camera's surroundings. [5, 10] tuned: extended
constexpr double kSteadyDepth = 5.0;
// Pixels of the level that a steady point must have moved. Lower accepts static clutter while the
// pattern trembles in a hand.
constexpr double kSteadyTravel = 5.0;
// Hits from which a point is used that was learned without the pattern: a turning camera shows no
// depths, and soon none of the older points.
constexpr int kUsableHits = 3;
// Steady points in view at least. Fewer follow longer and tell a pose badly.
constexpr int kLeastPoints = 8;
// Frames that the last motion bridges without them. More show guesses.
constexpr int kBridged = 10;
// Weight of points learned without the pattern, which may belong to an occluder. Higher follows
// longer and may leave with the occluder. [0.03, 1]
constexpr double kNewWeight = 0.3;
// Other points needed in each half of the frame for that. [2, 10] tuned: extended
constexpr int kEnoughSteady = 5;
// Hits from which a point is known, in addition to those learned from the pattern.
constexpr int kKnownHits = 30;
// Known points in view from which the next limit applies.
constexpr int kLeastKnown = 8;
// Reject a large moving foreground: this fraction of the known points in view must agree. [0.17,
// 0.7] tuned: extended
constexpr double kKnownShare = 0.35;
// Information of a patch's equations, per square pixel; see kHonest. [0.5, 2] tuned: extended
constexpr double kInformation = 1.0;
// Share of a frame's information that a depth gains: consecutive frames repeat their error. [0.06,
// 0.25] tuned: extended
constexpr double kDepthGain = 0.125;
// Pixels of accuracy that no baseline exceeds. [0.08, 0.3] tuned: extended
constexpr double kDepthAccuracy = 0.15;
// Pixels of the level by which a point may miss its prediction. Higher follows moving points, lower
// loses far ones. [0.75, 3] tuned: extended
constexpr double kMaxOffset = 1.5;
// Factor on the equations' standard deviations, which ignore shared errors of depths and anchors.
// Lower states too much certainty.
constexpr double kHonest = 4.0;
// Standard deviation of a gyroscope's turn, radians per frame. Larger trusts the points more.
// [0.00025, 0.001] tuned: extended
constexpr double kTurnSigma = 0.0005;
// Relative error of the gyroscope's scale. Larger trusts the points more. [0.005, 0.02] tuned:
// extended
constexpr double kTurnScale = 0.01;

Pose compose(const Pose& a, const Pose& b) {
  return {a.rotation * b.rotation, a.rotation * b.translation + a.translation};
}

Pose inverse(const Pose& pose) {
  const glm::dmat3 back = glm::transpose(pose.rotation);
  return {back, -(back * pose.translation)};
}

/// The place of a point in a frame.
struct Projection {
  glm::dvec3 direction{};  ///< camera axes: the point times its inverse depth
  glm::dvec2 pixel{};      ///< of the level
  glm::dmat2 warp{};       ///< template pixels to pixels of the level
  glm::dmat2 unwarp{};
  glm::dvec2 by_depth{};  ///< pixels of the level per unit of inverse depth
};

/// False if it is behind the camera, or is seen too differently from its patch.
bool place(const Camera& camera, const MapPoint& point, const Pose& pose, int level,
           Projection& out) {
  const double shrink = 1.0 / static_cast<double>(1 << level);
  const Pose relative = compose(pose, inverse(point.anchor));
  const glm::dvec3 q =
      relative.rotation * glm::dvec3(point.ray, 1.0) + point.inverse_depth * relative.translation;
  constexpr double kLeastDepth = 0.1;  // of the depth that it had; nearer, it looks different
  if (!(q.z > kLeastDepth)) return false;
  out.direction = q;
  out.pixel = (project(camera, q) + 0.5) * shrink - 0.5;
  const double fx = camera.fx * shrink / q.z;
  const double fy = camera.fy * shrink / q.z;
  const double x = q.x / q.z;
  const double y = q.y / q.z;
  const auto image_of = [&](const glm::dvec3& v) {
    return glm::dvec2{fx * (v.x - x * v.z), fy * (v.y - y * v.z)};
  };
  out.warp[0] = image_of(relative.rotation[0]) / (camera.fx * shrink);
  out.warp[1] = image_of(relative.rotation[1]) / (camera.fy * shrink);
  out.by_depth = image_of(relative.translation);
  const double area = out.warp[0].x * out.warp[1].y - out.warp[0].y * out.warp[1].x;
  constexpr double kMaxScale = 2.5;  // of areas; templates are not resampled
  if (!(area > 1.0 / kMaxScale && area < kMaxScale)) return false;
  out.unwarp = glm::inverse(out.warp);
  return true;
}

bool observe(const FrameView& frame, const MapPoint& point, const Projection& at, int level,
             glm::dvec2 offset, float tukey, PatchNormalEquations& out) {
  const PatchPlace where{
      static_cast<float>(at.pixel.x + offset.x), static_cast<float>(at.pixel.y + offset.y),
      static_cast<float>(at.warp[0].x),          static_cast<float>(at.warp[0].y),
      static_cast<float>(at.warp[1].x),          static_cast<float>(at.warp[1].y)};
  return observe_patch_at(point.patch, where, frame.pyramid[static_cast<std::size_t>(level)],
                          frame.kernels, tukey, out);
}

// ---- The pose from all points ----

struct PoseSystem {
  double jtj[6][6] = {};
  double jtr[6] = {};

  /// Adds a point's equations, its depth eliminated.
  void add(const MapPointEquations& one, double weight) {
    const double w = weight * kInformation;
    double g[2][2] = {
        {w * static_cast<double>(one.patch.xx), w * static_cast<double>(one.patch.xy)},
        {w * static_cast<double>(one.patch.xy), w * static_cast<double>(one.patch.yy)}};
    double e[2] = {w * static_cast<double>(one.patch.ex), w * static_cast<double>(one.patch.ey)};
    const glm::dvec2 j = one.by_depth;
    const double gj[2] = {g[0][0] * j.x + g[0][1] * j.y, g[1][0] * j.x + g[1][1] * j.y};
    const double pivot = one.point->information + j.x * gj[0] + j.y * gj[1];
    const double along = (j.x * e[0] + j.y * e[1]) / pivot;
    for (int row = 0; row < 2; ++row) {
      for (int column = 0; column < 2; ++column) g[row][column] -= gj[row] * gj[column] / pivot;
      e[row] -= gj[row] * along;
    }
    const double* jx = one.by_pose.data();
    const double* jy = jx + 6;
    for (int row = 0; row < 6; ++row) {
      const double x = g[0][0] * jx[row] + g[0][1] * jy[row];
      const double y = g[1][0] * jx[row] + g[1][1] * jy[row];
      for (int column = 0; column <= row; ++column) {
        jtj[row][column] += x * jx[column] + y * jy[column];
      }
      jtr[row] += jx[row] * e[0] + jy[row] * e[1];
    }
  }

  void expect_rotation(const glm::dvec3& rest, double weight) {
    for (int row = 0; row < 3; ++row) {
      jtj[row][row] += weight;
      jtr[row] += weight * rest[row];
    }
  }

  [[nodiscard]] Matrix6 matrix() const {
    Matrix6 out = Matrix6::Zero();
    double trace = 0;
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column <= row; ++column) out(row, column) = jtj[row][column];
      trace += jtj[row][row];
    }
    out.diagonal().array() += 1e-9 * trace;
    return out;
  }
};

/// What a point's patch still asks for after a change of the pose and of its own depth, template
/// pixels.
glm::dvec2 rest_of(const MapPointEquations& one, const Vector6& change) {
  glm::dvec2 moved(0.0);
  for (int k = 0; k < 6; ++k) {
    moved.x += one.by_pose[static_cast<std::size_t>(k)] * change(k);
    moved.y += one.by_pose[static_cast<std::size_t>(6 + k)] * change(k);
  }
  const glm::dmat2 g{{one.patch.xx, one.patch.xy}, {one.patch.xy, one.patch.yy}};
  glm::dvec2 e = glm::dvec2{one.patch.ex, one.patch.ey} - g * moved;
  const glm::dvec2 gj = g * one.by_depth;
  e -= gj * (glm::dot(one.by_depth, e) /
             (one.point->information / kInformation + glm::dot(one.by_depth, gj)));
  PatchNormalEquations left = one.patch;
  left.ex = static_cast<float>(e.x);
  left.ey = static_cast<float>(e.y);
  return displacement(left);
}

/// Tukey's weight by that rest: a point that moved by itself asks for another place.
double robust_weight(const MapPointEquations& one, const Vector6& change) {
  // Template pixels beyond noise. Lower drops true points, higher keeps moving ones. [0.75, 3]
  // tuned: extended
  constexpr double kFar = 1.5;
  const glm::dvec2 rest = rest_of(one, change);
  const double far = std::min(1.0, glm::dot(rest, rest) / (kFar * kFar));
  return (1.0 - far) * (1.0 - far);
}

struct MapFit {
  int visible = 0;
  int inliers = 0;
  double weight = 0;  ///< of the visible
  int known = 0;      ///< of the visible
};

/// Observes the points at a pose.
MapFit linearise(const Camera& camera, const FrameView& frame, std::span<const MapPoint> points,
                 double new_weight, int level, float tukey, const Pose& pose,
                 std::vector<MapPointEquations>& out) {
  const double shrink = 1.0 / static_cast<double>(1 << level);
  MapFit fit;
  out.clear();
  for (const MapPoint& point : points) {
    Projection at;
    MapPointEquations one;
    if (!point.usable() || !place(camera, point, pose, level, at) ||
        !observe(frame, point, at, level, glm::dvec2(0.0), tukey, one.patch)) {
      continue;
    }
    one.weight = point.of_pattern ? 1.0 : new_weight;
    fit.weight += one.weight;
    ++fit.visible;
    fit.known += point.known() ? 1 : 0;
    if (one.patch.correlation >= kInlierCorrelation) ++fit.inliers;
    if (one.patch.xx == 0.0f && one.patch.yy == 0.0f) continue;
    const glm::dvec3& q = at.direction;
    const glm::dvec3 turned = q - point.inverse_depth * pose.translation;
    const double fx = camera.fx * shrink / q.z;
    const double fy = camera.fy * shrink / q.z;
    const double x = q.x / q.z;
    const double y = q.y / q.z;
    const double d = point.inverse_depth;
    const double jx[6] = {
        -fx * x * turned.y, fx * (turned.z + x * turned.x), -fx * turned.y, fx * d, 0.0,
        -fx * x * d};
    const double jy[6] = {-fy * (turned.z + y * turned.y),
                          fy * y * turned.x,
                          fy * turned.x,
                          0.0,
                          fy * d,
                          -fy * y * d};
    for (std::size_t k = 0; k < 6; ++k) {
      const glm::dvec2 column = at.unwarp * glm::dvec2{jx[k], jy[k]};
      one.by_pose[k] = column.x;
      one.by_pose[6 + k] = column.y;
    }
    one.by_depth = at.unwarp * at.by_depth;
    one.point = &point;
    out.push_back(one);
  }
  return fit;
}

/// One Gauss-Newton step. Returns the way of the patch that moves furthest, template pixels;
/// negative if none exists.
double step_pose(const std::vector<MapPointEquations>& equations, const ExpectedRotation& expected,
                 bool robust, Pose& pose, PoseSystem& system) {
  Vector6 change = Vector6::Zero();
  for (int pass = 0; pass < (robust ? 2 : 1); ++pass) {
    system = {};
    for (const MapPointEquations& one : equations) {
      system.add(one, pass == 0 ? one.weight : one.weight * robust_weight(one, change));
    }
    if (expected.weight > 0) {
      system.expect_rotation(rotation_vector(expected.rotation * glm::transpose(pose.rotation)),
                             expected.weight);
    }
    change = solve_symmetric(system.matrix(), Vector6(Eigen::Map<Vector6>(system.jtr)));
    if (!change.allFinite() || change.head<3>().norm() > kMaxRotation) return -1.0;
  }
  double most = 0;
  for (const MapPointEquations& one : equations) {
    glm::dvec2 way(0.0);
    for (int k = 0; k < 6; ++k) {
      way.x += one.by_pose[static_cast<std::size_t>(k)] * change(k);
      way.y += one.by_pose[static_cast<std::size_t>(6 + k)] * change(k);
    }
    most = std::max(most, glm::length(way));
  }
  pose.rotation = rotation_matrix({change(0), change(1), change(2)}) * pose.rotation;
  pose.translation += glm::dvec3(change(3), change(4), change(5));
  return most;
}

// ---- One point's own place and depth ----

/// Follows the patch to its place in the frame, from its last offset.
bool find_offset(const FrameView& frame, const Projection& at, int level, MapPoint& point,
                 PatchNormalEquations& equations) {
  constexpr int kFindSteps = 3;
  constexpr double kSettled = 0.3;  // pixels
  constexpr double kLost = 3.0;     // a patch reaches no further
  glm::dvec2 offset = point.offset;
  for (int step = 0; step < kFindSteps; ++step) {
    if (!observe(frame, point, at, level, offset, kTukeyFirst, equations)) return false;
    const glm::dvec2 way = at.warp * glm::dvec2(displacement(equations));
    offset += way;
    const double length = glm::length(way);
    if (length > kLost) return false;
    if (length > kSettled) continue;
    point.offset = offset;
    return equations.correlation >= kInlierCorrelation;
  }
  return false;
}

/// What of the offset a change of the depth explains, goes into the depth.
void refine_depth(const Projection& at, const PatchNormalEquations& equations, MapPoint& point) {
  const glm::dvec2 j = at.unwarp * at.by_depth;
  const glm::dvec2 seen = at.unwarp * point.offset;
  const double gain = kDepthGain * kInformation;
  const glm::dvec2 gj{
      static_cast<double>(equations.xx) * j.x + static_cast<double>(equations.xy) * j.y,
      static_cast<double>(equations.xy) * j.x + static_cast<double>(equations.yy) * j.y};
  const double added = gain * glm::dot(gj, j);
  const double change = gain * glm::dot(gj, seen) / (point.information + added);
  const double before = point.inverse_depth;
  point.inverse_depth = std::max(0.0, before + change);
  point.offset -= at.by_depth * (point.inverse_depth - before);
  point.widest = std::max(point.widest, glm::length(at.by_depth));
  const double most = point.widest / kDepthAccuracy;
  const double least = point.information;
  point.information = std::max(least, std::min(point.information + added, most * most));
}

}  // namespace

bool MapPoint::steady() const {
  return hits >= kSteadyHits && travel >= kSteadyTravel &&
         inverse_depth * inverse_depth * information >= kSteadyDepth * kSteadyDepth;
}

bool MapPoint::known() const {
  return steady() && (of_pattern || hits >= kKnownHits);
}

bool MapPoint::usable() const {
  return steady() || (!of_pattern && hits >= kUsableHits && travel >= kSteadyTravel);
}

[[gnu::cold]] Surroundings::Surroundings(const Camera& camera) : camera_(camera) {
  while ((camera.width >> level_) > kMaxWidth) ++level_;
  coarse_ = level_ + kCoarser;
  points_.reserve(kMaxPoints);
  coarse_points_.reserve(kColumns * kRows);
  equations_.reserve(kMaxPoints);
  const auto side = [](int pixels, int cells) {
    return static_cast<std::size_t>(pixels / cells + 1);
  };
  gradients_.reserve(side(camera.width >> level_, kColumns) * side(camera.height >> level_, kRows));
  before_pixels_.reserve(static_cast<std::size_t>(camera.width >> coarse_) *
                         static_cast<std::size_t>(camera.height >> coarse_));
}

void Surroundings::clear() {
  points_.clear();
  turned_known_ = false;
  known_ = 0;
  unknown_ = 0;
  position_variance_ = rotation_variance_ = 0;
}

void Surroundings::remember(const FrameView& frame, const Pose& pose) {
  before_ = now_;
  now_ = {orthonormal(pose.rotation), pose.translation};
  known_ = std::min(known_ + 1, 2);
  if (static_cast<std::size_t>(coarse_) >= frame.pyramid.size()) return;
  const GrayImage& image = frame.pyramid[static_cast<std::size_t>(coarse_)];
  before_pixels_.resize(static_cast<std::size_t>(image.width) *
                        static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    std::copy_n(image.pixels + y * image.stride, image.width,
                before_pixels_.begin() + y * image.width);
  }
  before_image_ = {before_pixels_.data(), image.width, image.height, image.width};
}

Pose Surroundings::predict(const glm::dvec3* turn) const {
  if (known_ < 2 && turn == nullptr) return now_;
  const Pose from = known_ < 2 ? now_ : before_;
  const glm::dvec3 centre = inverse(now_).translation;
  const glm::dvec3 way = centre - inverse(from).translation;
  Pose next;
  next.rotation = turn != nullptr ? rotation_matrix(*turn) * now_.rotation
                                  : now_.rotation * glm::transpose(from.rotation) * now_.rotation;
  next.rotation = orthonormal(next.rotation);
  next.translation = -(next.rotation * (centre + way));
  return next;
}

void Surroundings::align_coarse(const FrameView& frame, const glm::dvec3* turn, Pose& pose) {
  constexpr int kCoarseSteps = 5;
  constexpr double kConverged = 0.1;
  constexpr int kMinPoints = 6;
  if (static_cast<std::size_t>(coarse_) >= frame.pyramid.size() || known_ == 0) return;
  coarse_points_.clear();
  const bool of_pattern = enough_of_pattern();
  const double grow = static_cast<double>(1 << coarse_);
  for (const MapPoint& point : points_) {
    Projection at;
    if (coarse_points_.size() == coarse_points_.capacity()) break;
    const bool used = of_pattern ? point.of_pattern && point.steady() : point.usable();
    if (!used || !point.in_view || point.misses > 0 || !place(camera_, point, now_, coarse_, at)) {
      continue;
    }
    const glm::dvec2 pixel = glm::floor(at.pixel + 0.5);
    MapPoint& seen = coarse_points_.emplace_back();
    if (!cut_patch(before_image_, static_cast<int>(pixel.x), static_cast<int>(pixel.y),
                   seen.patch)) {
      coarse_points_.pop_back();
      continue;
    }
    const glm::dvec2 ideal = undistort(camera_, (pixel + 0.5) * grow - 0.5);
    seen.anchor = now_;
    seen.ray = {(ideal.x - camera_.cx) / camera_.fx, (ideal.y - camera_.cy) / camera_.fy};
    seen.inverse_depth = point.inverse_depth / at.direction.z;
    seen.information = point.information * at.direction.z * at.direction.z;
    seen.of_pattern = false;
    seen.hits = kUsableHits;
    seen.travel = kSteadyTravel;
  }
  const ExpectedRotation expected{pose.rotation,
                                  turn != nullptr ? 1 / (kTurnSigma * kTurnSigma) : 0.0};
  const Pose start = pose;
  PoseSystem system;
  for (int step = 0; step < kCoarseSteps; ++step) {
    const MapFit fit = linearise(camera_, frame, coarse_points_, 1.0, coarse_,
                                 step == 0 ? kTukeyFirst : kTukey, pose, equations_);
    const double moved =
        fit.visible < kMinPoints ? -1.0 : step_pose(equations_, expected, step > 1, pose, system);
    if (moved < 0.0) {
      pose = start;
      return;
    }
    if (moved < kConverged) return;
  }
}

/// What the gyroscope's turns since the pattern was seen add up to, weighed against what the points
/// are known to.
ExpectedRotation Surroundings::expected_rotation() const {
  if (!turned_known_) return {};
  const double scale =
      kTurnScale * glm::length(rotation_vector(turned_ * glm::transpose(turned_from_)));
  return {turned_, doubt_ / (turned_variance_ + scale * scale)};
}

bool Surroundings::align_fine(const FrameView& frame, Pose& pose, ExtendedPose& out) {
  constexpr int kFineSteps = 8;
  constexpr double kConverged = 0.03;
  // Share of the points in view that must agree; others are hidden. Lower follows wrong poses,
  // higher loses true ones. [0.17, 0.7] tuned: extended
  constexpr double kLeastShare = 0.35;
  constexpr double kPlaced = 0.8;  // template pixels that a point in its place still asks for
  const ExpectedRotation expected = expected_rotation();
  const double new_weight = enough_of_pattern() ? kNewWeight : 1.0;
  PoseSystem system;
  MapFit fit;
  double moved = 0;
  for (int step = 0; step < kFineSteps; ++step) {
    fit = linearise(camera_, frame, points_, new_weight, level_, step == 0 ? kTukeyFirst : kTukey,
                    pose, equations_);
    if (fit.inliers < kLeastPoints && step > 1) return false;
    moved = step_pose(equations_, expected, step > 0, pose, system);
    if (moved < 0.0) return false;
    if (moved < kConverged && step > 0) break;
  }
  int placed = 0;
  int known_placed = 0;
  double placed_weight = 0;
  double anchor_position = 0;
  double anchor_rotation = 0;
  for (const MapPointEquations& one : equations_) {
    if (one.patch.correlation < kInlierCorrelation) continue;
    if (glm::length(rest_of(one, Vector6::Zero())) > kPlaced) continue;
    ++placed;
    known_placed += one.point->known() ? 1 : 0;
    placed_weight += one.weight;
    anchor_position += one.point->anchor_position;
    anchor_rotation += one.point->anchor_rotation;
  }
  if (placed < kLeastPoints || placed_weight < kLeastShare * fit.weight) {
    return false;
  }
  if (fit.known >= kLeastKnown && known_placed < kKnownShare * fit.known) return false;
  const Matrix6 fused = solve_symmetric(system.matrix(), Matrix6(Matrix6::Identity()));
  system.expect_rotation(glm::dvec3(0.0), -expected.weight);
  const Matrix6 seen = solve_symmetric(system.matrix(), Matrix6(Matrix6::Identity()));
  // The errors that the points of one time share count once; of the equations, which take them for
  // exact, less is known by as much.
  doubt_ = 1 + anchor_rotation / placed / seen.diagonal().head<3>().sum();
  out.pose = pose;
  rotation_variance_ = doubt_ * fused.diagonal().head<3>().sum();
  position_variance_ = fused.diagonal().tail<3>().sum() + anchor_position / placed;
  // Someone who hides most of the points, and moves, is followed by some of them for a few frames:
  // poses on 36 to 43 % of the points were off by 3.5 of the deviations that these give alone.
  const double doubtful = kHonest * fit.weight / placed_weight;
  out.rotation_sigma = doubtful * std::sqrt(rotation_variance_);
  out.position_sigma = doubtful * std::sqrt(position_variance_);
  return true;
}

/// Compares every point with the frame: where it is, what that says of its depth, whether it stays.
void Surroundings::measure(const FrameView& frame, const Pose& pose) {
  for (std::size_t i = 0; i < points_.size();) {
    MapPoint& point = points_[i];
    Projection at;
    PatchNormalEquations equations;
    point.in_view = place(camera_, point, pose, level_, at) &&
                    observe(frame, point, at, level_, glm::dvec2(0.0), kTukeyFirst, equations);
    if (!point.in_view) {
      point.offset = glm::dvec2(0.0);
      ++i;
      continue;
    }
    bool hit = find_offset(frame, at, level_, point, equations);
    if (hit) {
      refine_depth(at, equations, point);
      hit = glm::length(point.offset) <= kMaxOffset;
    } else {
      point.offset = glm::dvec2(0.0);
    }
    point.place = at.pixel + point.offset;
    if (hit) point.travel = std::max(point.travel, glm::length(point.place - point.origin));
    point.hits += hit ? 1 : 0;
    point.misses = hit ? 0 : point.misses + 1;
    if (point.misses > (point.steady() ? kMissesOfSteady : kMissesOfNew)) {
      if (i + 1 < points_.size()) points_[i] = points_.back();
      points_.pop_back();
      continue;
    }
    ++i;
  }
}

double Surroundings::expected_inverse_depth(const Pose& pose, glm::dvec2 pixel) const {
  double sum = 0;
  double weights = 0;
  for (const MapPoint& point : points_) {
    Projection at;
    if (!point.in_view || !point.steady() || !place(camera_, point, pose, level_, at)) continue;
    const glm::dvec2 way = at.pixel - pixel;
    const double weight = 1.0 / (1.0 + glm::dot(way, way));
    sum += weight * point.inverse_depth / at.direction.z;
    weights += weight;
  }
  if (weights > 0.0) return sum / weights;
  return 1.0 / std::max(pose.translation.z, 1e-3);
}

/// The strongest corner of a cell, by the smaller eigenvalue of its gradients; -1 if it has none.
glm::ivec2 Surroundings::best_corner(const GrayImage& image, int cell) {
  constexpr int kReach = 7;  // a patch, its ring, and a pixel
  constexpr int kStride = 2;
  const int x0 = std::max(kReach, image.width * (cell % kColumns) / kColumns);
  const int x1 = std::min(image.width - kReach, image.width * (cell % kColumns + 1) / kColumns);
  const int y0 = std::max(kReach, image.height * (cell / kColumns) / kRows);
  const int y1 = std::min(image.height - kReach, image.height * (cell / kColumns + 1) / kRows);
  const int columns = (x1 - x0) / kStride;
  const int rows = (y1 - y0) / kStride;
  glm::ivec2 best(-1);
  if (columns < 3 || rows < 3) return best;
  gradients_.clear();
  for (int y = 0; y < rows; ++y) {
    const std::uint8_t* p = image.pixels + (y0 + kStride * y) * image.stride + x0;
    for (int x = 0; x < columns; ++x, p += kStride) {
      const int right = p[1] - p[-1];
      const int down = p[image.stride] - p[-image.stride];
      gradients_.push_back({right * right, right * down, down * down});
    }
  }
  // Gray values squared: the smaller eigenvalue of nine gradients of 6.
  double most = 9.0 * 6 * 6;
  for (int y = 1; y + 1 < rows; ++y) {
    for (int x = 1; x + 1 < columns; ++x) {
      double sums[3] = {0, 0, 0};
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto& one = gradients_[static_cast<std::size_t>((y + dy) * columns + x + dx)];
          for (std::size_t k = 0; k < 3; ++k) sums[k] += one[k];
        }
      }
      const double half = 0.5 * (sums[0] + sums[2]);
      const double difference = 0.5 * (sums[0] - sums[2]);
      const double smaller = half - std::sqrt(difference * difference + sums[1] * sums[1]);
      if (smaller <= most) continue;
      most = smaller;
      best = {x0 + kStride * x, y0 + kStride * y};
    }
  }
  return best;
}

/// Room for a point: of those out of view, the least known is dropped if no cell is free.
MapPoint* Surroundings::free_slot() {
  if (points_.size() < kMaxPoints) return &points_.emplace_back();
  constexpr int kOfPattern = 1000;  // hits that the truth of the pattern is worth
  MapPoint* least = nullptr;
  int least_worth = 0;
  for (MapPoint& point : points_) {
    const int worth = point.hits + (point.of_pattern ? kOfPattern : 0);
    if (point.in_view || (least != nullptr && worth >= least_worth)) continue;
    least = &point;
    least_worth = worth;
  }
  return least;
}

bool Surroundings::add_point(const FrameView& frame, const Pose& pose, int column, int row,
                             bool of_pattern) {
  MapPoint point;
  const GrayImage& image = frame.pyramid[static_cast<std::size_t>(level_)];
  if (!cut_patch(image, column, row, point.patch)) return false;
  const double grow = static_cast<double>(1 << level_);
  const glm::dvec2 pixel(column, row);
  const glm::dvec2 ideal = undistort(camera_, (pixel + 0.5) * grow - 0.5);
  point.anchor = pose;
  point.ray = {(ideal.x - camera_.cx) / camera_.fx, (ideal.y - camera_.cy) / camera_.fy};
  point.inverse_depth = expected_inverse_depth(pose, pixel);
  constexpr double kDoubt = 0.5;  // of the depth of its neighbours
  point.information = 1.0 / (kDoubt * kDoubt * point.inverse_depth * point.inverse_depth);
  point.of_pattern = of_pattern;
  if (!of_pattern) {
    point.anchor_position = position_variance_;
    point.anchor_rotation = rotation_variance_;
  }
  point.place = point.origin = pixel;
  point.in_view = true;
  MapPoint* slot = free_slot();
  if (slot == nullptr) return false;
  *slot = point;
  return true;
}

namespace {

/// Whether a pixel is in the outline of the pattern, or so near that a patch touches it.
bool near_outline(const std::array<glm::dvec2, 4>& corners, glm::dvec2 pixel, double margin) {
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 side = corners[(i + 1) % 4] - corners[i];
    const glm::dvec2 way = pixel - corners[i];
    // Corners run clockwise in the frame: inside is to the right.
    if (side.x * way.y - side.y * way.x < -margin * glm::length(side)) return false;
  }
  return true;
}

}  // namespace

void Surroundings::add_points(const FrameView& frame, const Pose& pose,
                              const std::array<glm::dvec2, 4>* corners) {
  const GrayImage& image = frame.pyramid[static_cast<std::size_t>(level_)];
  const double grow = static_cast<double>(1 << level_);
  std::array<bool, kColumns * kRows> taken{};
  for (const MapPoint& point : points_) {
    if (!point.in_view) continue;
    const int x = static_cast<int>(point.place.x * kColumns / image.width);
    const int y = static_cast<int>(point.place.y * kRows / image.height);
    if (x >= 0 && x < kColumns && y >= 0 && y < kRows)
      taken[static_cast<std::size_t>(y * kColumns + x)] = true;
  }
  for (int i = 0; i < kCellsAFrame; ++i) {
    // Every cell in turn, far from the last one.
    next_cell_ = (next_cell_ + 23) % (kColumns * kRows);
    if (taken[static_cast<std::size_t>(next_cell_)]) continue;
    const glm::ivec2 corner = best_corner(image, next_cell_);
    if (corner.x < 0) continue;
    const glm::dvec2 pixel = (glm::dvec2(corner) + 0.5) * grow - 0.5;
    if (corners != nullptr && near_outline(*corners, pixel, grow * (kPatchHalf + 2))) continue;
    add_point(frame, pose, corner.x, corner.y, corners != nullptr);
  }
}

/// Adds a turn to those since the pattern was seen.
void Surroundings::add_turn(const glm::dvec3* turn) {
  turned_known_ = turned_known_ && turn != nullptr;
  if (!turned_known_) return;
  turned_ = orthonormal(rotation_matrix(*turn) * turned_);
  turned_variance_ += kTurnSigma * kTurnSigma;
}

/// The pattern says the rotation as well, in each frame with an error of its own.
void Surroundings::level_turns(const Pose& pose, int patches) {
  const double sigma = seen_sigma(patches);
  if (!turned_known_) {
    turned_ = turned_from_ = pose.rotation;
    turned_variance_ = sigma * sigma;
    turned_known_ = true;
    return;
  }
  const double gain = turned_variance_ / (turned_variance_ + sigma * sigma);
  const glm::dvec3 rest = rotation_vector(pose.rotation * glm::transpose(turned_));
  turned_ = turned_from_ = orthonormal(rotation_matrix(gain * rest) * turned_);
  turned_variance_ *= 1 - gain;
}

void Surroundings::learn(const FrameView& frame, const Pose& pose,
                         const std::array<glm::dvec2, 4>& corners, int patches,
                         const glm::dvec3* turn) {
  if (static_cast<std::size_t>(level_) >= frame.pyramid.size()) return;
  position_variance_ = rotation_variance_ = 0;
  unknown_ = 0;
  doubt_ = 1;
  add_turn(turn);
  level_turns(pose, patches);
  measure(frame, pose);
  add_points(frame, pose, &corners);
  remember(frame, pose);
}

bool Surroundings::enough_of_pattern() const {
  const glm::dvec2 middle = 0.5 * glm::dvec2(camera_.width >> level_, camera_.height >> level_);
  int left = 0;
  int right = 0;
  int upper = 0;
  int lower = 0;
  for (const MapPoint& point : points_) {
    if (!point.in_view || point.misses > 0 || !point.of_pattern || !point.steady()) continue;
    ++(point.place.x < middle.x ? left : right);
    ++(point.place.y < middle.y ? upper : lower);
  }
  return std::min({left, right, upper, lower}) >= kEnoughSteady;
}

bool Surroundings::ready() const {
  int in_view = 0;
  int seen = 0;
  for (const MapPoint& point : points_) {
    if (!point.in_view || !point.steady()) continue;
    ++in_view;
    seen += point.misses == 0 ? 1 : 0;
  }
  return seen >= kLeastPoints && 3 * seen >= in_view;
}

double Surroundings::agreement(const FrameView& frame, const Pose& pose) const {
  int expected = 0;
  int placed = 0;
  for (const MapPoint& point : points_) {
    if (!point.in_view || point.misses > 0 || !point.steady()) continue;
    ++expected;
    Projection at;
    PatchNormalEquations equations;
    if (!place(camera_, point, pose, level_, at) ||
        !observe(frame, point, at, level_, glm::dvec2(0.0), kTukeyFirst, equations)) {
      continue;
    }
    const bool near = glm::length(displacement(equations)) <= static_cast<float>(kMaxOffset);
    placed += near && equations.correlation >= kInlierCorrelation ? 1 : 0;
  }
  return expected > 0 ? 1.0 * placed / expected : 1.0;
}

bool Surroundings::follow(const FrameView& frame, const glm::dvec3* turn, ExtendedPose& out) {
  if (known_ == 0 || static_cast<std::size_t>(level_) >= frame.pyramid.size()) return false;
  add_turn(turn);
  Pose pose = predict(turn);
  const Pose predicted = pose;
  align_coarse(frame, turn, pose);
  out.expected = {predicted, pose};
  if (!align_fine(frame, pose, out)) {
    remember(frame, predicted);
    if (++unknown_ > kBridged) clear();
    return false;
  }
  unknown_ = 0;
  measure(frame, pose);
  add_points(frame, pose, nullptr);
  remember(frame, pose);
  return true;
}

void Surroundings::correct(const Pose& followed, const Pose& seen) {
  const Pose change = compose(inverse(followed), seen);
  for (MapPoint& point : points_) {
    if (point.of_pattern) continue;
    point.anchor = compose(point.anchor, change);
    point.of_pattern = true;
  }
}

}  // namespace modar::tracker
