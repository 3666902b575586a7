// The result of tracking a frame, and the two-frame rule of the ModAR paper.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>

#include "modar/camera.hpp"
#include "modar/pose.hpp"

namespace modar {

/// Why nothing is visible in a frame. A value, not an error.
enum class Reason : std::uint8_t {
  kVisible,
  kNoFeatures,  ///< the frame has no corners to describe
  kFewMatches,  ///< too few features match the pattern's
  kNoGeometry,  ///< "not in view": some features match, as in any picture, but no pose agrees
  kFailedVerification,  ///< the homography is impossible, or the frame does not match it
  kLostByBlur,          ///< it was tracked and should be in view, but does not match
  kOutOfView,           ///< it was tracked and left the frame
  kOtherPrint,   ///< a part of it is in view: another print of its series, or its mirror image
  kCurved,       ///< it is in view, but its paper is too curved for a planar pose
  kTooSmall,     ///< a part of it may be in view, too small to be found
  kTooDark,      ///< the frame is
  kBlurred,      ///< the frame is, and nothing was tracked
  kOverexposed,  ///< the frame is
  kGlare,        ///< light covers the place where it may be
  kAtTheEdge,    ///< most of the place where it may be is outside the frame
};
/// "visible", "no features", "few matches", ...
const char* to_string(Reason reason);
/// How many stages a pattern passed, 1 to 7: a frame reports the reason of the one with most.
int progress(Reason reason);

/// A pattern measured in this frame.
struct Detection {
  std::uint32_t pattern = 0;
  std::uint32_t copy = 0;  ///< of the print; kept while it is tracked and where it is found again
  std::array<glm::dvec2, 4>
      corners{};  ///< frame pixels: top-left, top-right, bottom-right, bottom-left; including
                  ///< hidden ones of a curved pattern; of a box those of its first face
  Pose pose;
  /// Of a flat pattern, while the camera is a guess: the part of its picture's place that no pose
  /// explains, as the lens and the picture's proportions are unknown. Content on the picture is
  /// drawn by gl_view(pose, stretch): X_camera = rotation * (stretch * (X_world, 1)) + translation.
  glm::dmat4x3 stretch{1.0};
  int matches = 0;  ///< features that match, or patches in view if tracked
  int inliers = 0;  ///< of those, the ones that agree with the pose
  /// Share of the pattern's textured cells (of 8x8) in view that match it, and their mean
  /// correlation, each 0 to 1; for a tracked pattern over the last 16 frames.
  double agreeing = 0;
  double likeness = 0;
  /// It is covered or out of the frame: the pose is derived from its surroundings, with these
  /// standard deviations of its position (pattern units) and rotation (radians). Also while the
  /// pose is blended back to a pattern that has become visible again.
  bool extended = false;
  double position_sigma = 0;
  double rotation_sigma = 0;
};

/// Milliseconds of the stages of one frame (wall clock of the calling thread).
struct TrackTimes {
  double detect = 0;
  double describe = 0;
  double match = 0;
  double homography = 0;
  double pose = 0;
};

/// The focal length with which a frame's poses were measured, in pixels, and its standard deviation
/// if it is estimated.
struct CameraEstimate {
  double focal = 0;
  double sigma = 0;
  bool estimated = false;
};

struct TrackResult {
  std::vector<Detection> visible;       ///< in the order of the bundle's patterns and their copies
  Reason reason = Reason::kNoFeatures;  ///< of the pattern that passed most stages
  int features = 0;                     ///< keypoints of the frame
  std::int32_t crowded = -1;  ///< a pattern with more copies in view than are tracked; -1: none
  TrackTimes times;
  CameraEstimate camera;
};

/// The two-frame rule of the ModAR paper: a model is shown once its pattern was seen in two
/// consecutive frames, and stays for two frames after its loss. During these its motion between the
/// last two frames that saw it continues: a print that leaves the frame fast takes its model with
/// it.
class Hysteresis {
 public:
  /// predict: false leaves the model of a lost pattern in place, as the paper does. stills: a
  /// model is shown in the first frame that sees its pattern. copies: of each pattern.
  explicit Hysteresis(std::size_t pattern_count, bool predict = true, bool stills = false,
                      std::size_t copies = 1);

  struct State {
    bool shown = false;     ///< draw the model, at `pose`
    bool measured = false;  ///< the pose is measured in this frame, not predicted
    Pose pose;
    glm::dmat4x3 stretch{1.0};  ///< Detection::stretch
  };
  /// Takes a frame's detections; returns one state per pattern, then those of the second copies,
  /// and so on, valid until the next call.
  std::span<const State> step(std::span<const Detection> visible);

 private:
  struct Counter {
    int seen = 0;         ///< consecutive frames with a detection
    int missed = 0;       ///< consecutive frames without
    bool moving = false;  ///< `previous` is the pose of the frame before that of `state`
    Pose previous;
    State state;
  };
  std::size_t pattern_count_;
  std::vector<Counter> counters_;
  std::vector<State> states_;
  bool predict_ = true;
  int frames_to_show_;
};

}  // namespace modar
