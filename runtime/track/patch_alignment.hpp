// Alignment of a pattern's plane with the frame by small patches: their templates, what one patch
// says of its displacement, and Gauss-Newton on a pose or on a plane map over all of them. Internal
// to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>

#include "kernels.hpp"
#include "modar/camera.hpp"
#include "modar/pose.hpp"
#include "plane_geometry.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// Most patches of one level, the strongest first, and as many as the bake writes by default:
/// trades the time of a frame's last steps for accuracy.
inline constexpr std::size_t kMaxPatches = 256;

/// Correlation from which a patch is an inlier. Lower accepts chance edges, higher loses blurred
/// patches. [0.35, 0.84] tuned: wild
inline constexpr float kInlierCorrelation = 0.7f;
/// Correlation from which a patch is a close match of its template.
inline constexpr float kCloseCorrelation = 0.9f;
// Close patches that confirm a place alone. Chance gave at most 7 in clutter.
inline constexpr int kClosePatches = 24;
/// 1 minus the correlation at which a patch loses its weight, first step. High, since patches that
/// hardly correlate still pull in the right direction.
inline constexpr float kTukeyFirst = 1.0f;
inline constexpr float kTukey = 0.7f;
/// The same in the last steps on a covered pattern, whose other patches correlate by chance.
inline constexpr float kTukeyCovered = 0.45f;
/// Radians, and the same of a homography's parameters: larger steps are not Gauss-Newton's to take.
inline constexpr double kMaxRotation = 0.5;

/// A patch of the pattern's image with the sums that do not depend on the frame: of gray values, of
/// their gradient, and of the products of the two.
struct Patch {
  glm::dvec2 centre{};  ///< pixels of the pattern's image
  glm::dvec2 blur{};    ///< of a curved pattern: the way that it is averaged along, pixels
  float t = 0, tt = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, tx = 0, ty = 0;
  PatchTemplate pixels{};
};

/// Normal equations of a patch's own displacement d, in template pixels: [xx xy; xy yy] d = e,
/// multiplied by the patch's weight.
struct PatchNormalEquations {
  float xx = 0, xy = 0, yy = 0;
  float ex = 0, ey = 0;
  float correlation = 0;
};

/// A patch's normal equations and the Jacobian of its displacement by the pose, in template pixels.
struct PatchLinearisation {
  PatchNormalEquations equations;
  std::array<double, 12> jacobian{};  ///< two rows of six
  glm::dvec2 world{};                 ///< of its centre, in the pattern's plane
};

/// Patches of the levels used last: six, for two levels of three patterns tracked at once.
/// Allocates nothing after construction.
class PatchCache {
 public:
  PatchCache();
  /// The patches of a level. Valid until the next call.
  std::span<Patch> of(const TrackedPattern& pattern, int level);
  /// Makes `blurred`, which may be the patch, from a patch whose image moves by `motion` pixels of
  /// the level during the exposure.
  static void motion_blur(const TrackedPattern& pattern, int level, const Patch& patch,
                          glm::dvec2 motion, Patch& blurred);
  /// Empty buffers of kMaxPatches, for blurred patches and for linearisations; valid until the next
  /// call.
  std::vector<Patch>& scratch();
  std::vector<PatchLinearisation>& linearisations();
  /// What the last user left in them.
  [[nodiscard]] std::span<const PatchLinearisation> last_linearisations() const {
    return linearisations_;
  }
  /// Patches compared with frames so far: most of the work of a refinement.
  [[nodiscard]] std::int64_t compared() const { return compared_; }
  void count(std::size_t patches) { compared_ += static_cast<std::int64_t>(patches); }

 private:
  struct Slot {
    std::uint32_t pattern = 0;
    int level = -1;
    std::uint64_t last_use = 0;
    std::vector<Patch> patches;
  };
  std::array<Slot, 6> slots_;
  std::vector<Patch> scratch_;
  std::vector<PatchLinearisation> linearisations_;
  std::uint64_t uses_ = 0;
  std::int64_t compared_ = 0;
};

/// The motion blur of a frame: during the exposure each point moves by this share of its way from
/// where `previous` projected it. Templates blurred alike are not drawn aside as sharp ones are
/// (after Park, Lepetit & Woo, "Handling motion-blur in 3D tracking and rendering for augmented
/// reality", 2012).
struct MotionBlur {
  Pose previous;
  double share = 0;  ///< 0 to 1
};

/// A frame, and what alignment needs to look at it.
struct FrameView {
  const Camera& camera;
  std::span<const GrayImage> pyramid;
  const Kernels& kernels;
  PatchCache& patches;
  const MotionBlur* blur = nullptr;  ///< null: sharp
};

/// The finest pyramid level on which the pattern's image is not magnified, and the level of the
/// pattern's image that has the same resolution there.
struct Resolution {
  int frame_level = 0;
  int pattern_level = 0;
};
Resolution finest(const TrackedPattern& pattern, const PlaneMap& map, int frame_levels);

/// Features that confirm a place alone, so that fewer cells suffice. Lower accepts clutter; chance
/// gave at most 10.
inline constexpr int kConfirmingFeatures = 16;

/// Inlier ratio of a flat pattern below which chance patches on an occluder may hold a wrong pose.
/// Higher tests more poses.
inline constexpr double kLittleShown = 0.35;
// Rms residual of the inliers, template pixels, above which such a pose is wrong. Lower rejects
// true poses, higher accepts wrong ones.
inline constexpr double kMaxResidual = 0.35;

/// How a pattern's patches fit the frame.
struct PatchFit {
  int visible = 0;                ///< patches that project into the frame
  int inliers = 0;                ///< of those, patches that correlate by kInlierCorrelation
  int close = 0;                  ///< of those, patches that correlate by kCloseCorrelation
  int level = 0;                  ///< pyramid level of the frame
  double correlation = 0;         ///< mean over the visible patches, negative ones counted as 0
  double inlier_correlation = 0;  ///< mean over the inliers
  double residual_rms =
      0;  ///< of a flat pattern of which little shows: rms of what the inliers ask for
  [[nodiscard]] double inlier_ratio() const { return visible > 0 ? 1.0 * inliers / visible : 0.0; }
  /// Enough patches fit to show that nothing covers much of the pattern. Swept on 70 % covered:
  /// 89.2 % right from 0.4 to 0.8.
  [[nodiscard]] bool open() const { return inlier_ratio() >= 0.6; }
  /// Few patches fit, but these do so as nothing blurred does: something covers the others. Swept
  /// on 70 % covered: 88.3, 89.2 and 85.8 % right with 0.7, 0.85 and 0.95.
  [[nodiscard]] bool covered() const { return !open() && inlier_correlation >= 0.85; }
  /// The patches that fit contradict each other: chance holds some of them, and the pose.
  [[nodiscard]] bool inconsistent() const { return residual_rms >= kMaxResidual; }
  /// Six inliers determine a pose with a margin of two; a ratio of 0.3 keeps chance agreement out,
  /// while thirty inliers may be a fifth: half-covered patterns went from 95 to 98.8 % right by
  /// that, with no false recognition in 20,000 cluttered frames; a seventh of 36 gave one. With
  /// kClosePatches an eighth is enough: patterns covered to 70 % went from 75 to 92 % right. An
  /// eighth that features confirm gave 85 %, and poses 20 to 50 pixels off where no patches were
  /// close.
  [[nodiscard]] bool good() const {
    const int part = close >= kClosePatches ? 8 : 5;
    return inliers >= 6 &&
           (inliers * 10 >= visible * 3 || (inliers >= 30 && inliers * part >= visible));
  }
};

/// Gauss-Newton on the pose over the patches of the level of the pattern's image that fits
/// `frame_level`. Each patch has its own gain and bias and is weighted by its correlation (Tukey);
/// after Baker & Matthews, "Lucas-Kanade 20 years on" (2004). At most `steps` steps over about 40
/// patches until the pose converges, then one more, or if `precise`, at most ten over all patches,
/// the last of them robust.
PatchFit align(const TrackedPattern& pattern, const FrameView& frame, int frame_level, int steps,
               bool precise, Pose& pose);

/// See PatchFit::residual_rms; each patch counts as two pixels at most.
double residual_rms_of(std::span<const PatchLinearisation> patches);

/// How the patches fit at a pose, without moving it.
PatchFit evaluate(const TrackedPattern& pattern, const FrameView& frame, int frame_level,
                  const Pose& pose);

/// How a flat pattern's pose follows a change of its shape.
struct PlaneChange {
  std::array<double, 2> shape{};           ///< (1 + a, b; b, 1 - a) on its left
  std::array<double, 12> pose_by_shape{};  ///< the pose's step by a, then by b, times -1
  /// Of this share of the change.
  [[nodiscard]] glm::dmat2 shape_after(const glm::dmat2& before, double share) const;
  [[nodiscard]] Pose pose_after(const Pose& before, double share) const;
};
/// Gauss-Newton on a flat pattern's pose together with two numbers of its shape, by which both are
/// a free homography's eight; all patches of the level, or about `count`, weighed by their
/// correlation, and where much is covered, by what they leave unexplained. change: from the shape
/// before, and how a pose that is weighed otherwise follows it.
PatchFit align_plane(TrackedPattern& pattern, const FrameView& frame, int frame_level, int steps,
                     std::size_t count, Pose& pose, PlaneChange& change);

/// The same alignment over the eight parameters of a homography, for a plane that no pose of the
/// given camera explains. Ignores the change of the lens distortion across the update.
PatchFit align_map(const TrackedPattern& pattern, const FrameView& frame, int frame_level,
                   int steps, PlaneMap& map);

// The parts, for refinement from features (pose_refinement.cpp).

/// The patch around a pixel of any picture; false if it or its ring crosses the border.
bool cut_patch(const GrayImage& image, int column, int row, Patch& patch);

/// What a patch says of its displacement at a place of a picture; false if it is not inside.
/// tukey: 1 minus the correlation at which its weight reaches zero.
bool observe_patch_at(const Patch& patch, const PatchPlace& place, const GrayImage& image,
                      const Kernels& kernels, float tukey, PatchNormalEquations& out);

/// The displacement that the equations ask for, in template pixels; zero without weight. A trace of
/// damping keeps it short along an edge, where a patch of a single edge knows nothing.
glm::vec2 displacement(const PatchNormalEquations& equations);

/// The patches of one level that alignment looks at: every stride-th.
struct PatchView {
  const GrayImage* image;
  const Kernels* kernels;
  Resolution at;
  std::span<const Patch> patches;
  std::size_t stride = 1;
};

/// The patches for a level of the frame, about `count` of them; none if the pattern's image has no
/// such level.
PatchView view_of(const TrackedPattern& pattern, const FrameView& frame, int frame_level,
                  const PlaneMap& map, std::size_t count);

/// A patch compared with the frame.
struct PatchObservation {
  PatchNormalEquations equations;
  glm::dvec2 pixel{};     ///< frame pixel of its centre
  glm::dmat2 jacobian{};  ///< template pixels to pixels of the level
};

/// False if the patch is not inside the level. tukey: 1 minus the correlation at which a
/// patch's weight reaches zero.
bool observe_patch(const PatchView& view, const PlaneMap& map, const Patch& patch, float tukey,
                   PatchObservation& out);

/// Jacobian of a world point's pixel by a small rotation on the left, then a translation.
struct PoseJacobian {
  std::array<double, 6> x{};
  std::array<double, 6> y{};
};
/// scale: pixels of the level per frame pixel.
PoseJacobian pose_jacobian(const Camera& camera, const Pose& pose, const glm::dvec3& world,
                           double scale);
/// Applies such a rotation and translation. Returns the largest displacement of the pattern's four
/// corners, pixels of the level: corners, since a visible part alone moves little where the rest
/// hangs on it like on a lever. Negative, and no change, if the pose would be behind the camera.
double move_pose(const TrackedPattern& pattern, const Camera& camera, double scale,
                 const std::array<double, 6>& change, Pose& pose);

}  // namespace modar::tracker
