// The result of tracking a frame, and the two-frame rule of the ModAR paper.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "modar/camera.hpp"
#include "modar/pose.hpp"

namespace modar {

/// Why nothing is visible in a frame. A value, not an error.
enum class Reason : std::uint8_t {
  kVisible,
  kNoFeatures,  ///< the frame has no corners to describe
  kFewMatches,  ///< too few features match the pattern's
  kNoGeometry,  ///< "not in view": some features match, as in any picture, and no place agrees
  kFailedVerification,  ///< the homography is impossible, or the frame does not look like it
  kLostByBlur,          ///< it was tracked, should be in view, and does not fit
  kOutOfView,           ///< it was tracked and left the frame
  kOtherPrint,          ///< it is there in part: another print of its series, or its mirror image
  kCurved,              ///< it is there, on paper too bent for a plane's pose
};
/// "visible", "no features", "few matches", ...
const char* to_string(Reason reason);
/// How far a pattern came, 1 to 7: a frame reports the reason of the one that came furthest.
int progress(Reason reason);

/// A pattern measured in this frame.
struct Detection {
  std::uint32_t pattern = 0;
  std::array<glm::dvec2, 4>
      corners{};  ///< frame pixels: top-left, top-right, bottom-right, bottom-left; of a curved
                  ///< pattern hidden ones, too; of a box those of its first face
  Pose pose;
  int matches = 0;  ///< features that match, or patches in view if tracked
  int inliers = 0;  ///< of those, the ones that agree with the pose
  /// Share of the pattern's textured cells (of 8x8) in view that look like it, and their mean
  /// correlation, each 0 to 1; of a tracked pattern as the last 16 frames saw them.
  double agreeing = 0;
  double likeness = 0;
  /// It is hidden or out of the frame: the pose follows from its surroundings, with these standard
  /// deviations of its position (pattern units) and rotation (radians). Also while the pose is
  /// brought back to a pattern that is seen again.
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

/// The focal length by which a frame's poses were measured, pixels, and while it is estimated its
/// standard deviation.
struct CameraEstimate {
  double focal = 0;
  double sigma = 0;
  bool estimated = false;
};

struct TrackResult {
  std::vector<Detection> visible;       ///< in the order of the bundle's patterns
  Reason reason = Reason::kNoFeatures;  ///< of the pattern that came furthest
  int features = 0;                     ///< keypoints of the frame
  TrackTimes times;
  CameraEstimate camera;
};

/// The two-frame rule of the ModAR paper: a model is shown once its pattern was seen in two
/// consecutive frames, and stays for two frames after its loss. There it goes on as it moved
/// between the last two frames that saw it: a print that leaves the frame fast takes its model
/// along.
class Hysteresis {
 public:
  /// predict: false leaves the model of a lost pattern where it was, as the paper does.
  explicit Hysteresis(std::size_t pattern_count, bool predict = true);

  struct State {
    bool shown = false;     ///< draw the model, at `pose`
    bool measured = false;  ///< the pose is of this frame, not predicted from those before
    Pose pose;
  };
  /// Takes a frame's detections; returns one state per pattern, valid until the next call.
  std::span<const State> step(std::span<const Detection> visible);

 private:
  struct Counter {
    int seen = 0;         ///< consecutive frames with a detection
    int missed = 0;       ///< consecutive frames without
    bool moving = false;  ///< `previous` is the pose of the frame before that of `state`
    Pose previous;
    State state;
  };
  std::vector<Counter> counters_;
  std::vector<State> states_;
  bool predict_ = true;
};

}  // namespace modar
