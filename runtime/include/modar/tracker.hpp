// What the pose loop answers for a frame.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"
#include "modar/image.hpp"
#include "modar/pose.hpp"

namespace modar {

/// Why nothing is visible in a frame. A value, never an error.
enum class Reason : std::uint8_t {
  kVisible,
  kNoFeatures,          ///< the frame has no corners to describe
  kFewMatches,          ///< fewer than min_matches survive cross-check and the distance limit
  kNoGeometry,          ///< no homography, or fewer than min_inliers agree with it
  kFailedVerification,  ///< a homography that no camera before a plane can see
  kLostByBlur,
  kOutOfView,
};
/// "visible", "no features", "few matches", ...
const char* to_string(Reason reason);
/// How far a pattern came before that reason: of several patterns the frame answers the farthest's.
int progress(Reason reason);

/// A pattern measured in this frame.
struct Detection {
  std::uint32_t pattern = 0;
  std::array<glm::dvec2, 4>
      corners{};  ///< frame pixels: top-left, top-right, bottom-right, bottom-left
  Pose pose;
  int matches = 0;
  int inliers = 0;
};

/// Milliseconds of the stages of one frame (wall clock of the calling thread).
struct TrackTimes {
  double detect = 0;
  double describe = 0;
  double match = 0;
  double homography = 0;
  double pose = 0;
};

struct TrackResult {
  std::vector<Detection> visible;       ///< in the order of the bundle's patterns
  Reason reason = Reason::kNoFeatures;  ///< of the pattern that came furthest
  int features = 0;                     ///< keypoints of the frame
  TrackTimes times;
};

/// The article's pipeline (inventory C to F), with OpenCV: detect, describe, match by brute force
/// with cross-check, RANSAC homography, Levenberg-Marquardt, corners, pose. The reference that ours
/// is measured against; nothing of ours ever improves it.
class PaperTracker {
 public:
  /// Reads the patterns described with parameter set `set_id` from the bundle's mapped twins.
  /// Errors: kInvalidInput "tracker.no-patterns" if the bundle has none.
  static Result<std::unique_ptr<PaperTracker>> create(const BundleView& bundle,
                                                      std::uint32_t set_id, const Camera& camera);
  PaperTracker(const PaperTracker&) = delete;
  PaperTracker& operator=(const PaperTracker&) = delete;
  ~PaperTracker();

  /// One frame of the camera's size. Errors: kInvalidInput "tracker.frame-size", kInternal
  /// "tracker.opencv".
  Result<TrackResult> step(const GrayImage& frame);

 private:
  struct State;
  explicit PaperTracker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The article's two-frame rule (inventory G 37): a model is shown once its pattern was seen in two
/// frames in sequence, and stays for at least two frames more when it is lost.
class Hysteresis {
 public:
  explicit Hysteresis(std::size_t pattern_count);

  struct State {
    bool shown = false;     ///< draw the model, at `pose`
    bool measured = false;  ///< the pose is of this frame
    Pose pose;              ///< the newest pose that was measured
  };
  /// Takes a frame's detections; answers one state a pattern, valid until the next call.
  std::span<const State> step(std::span<const Detection> visible);

 private:
  struct Counter {
    int seen = 0;    ///< frames in sequence with a detection
    int missed = 0;  ///< frames in sequence without
    State state;
  };
  std::vector<Counter> counters_;
  std::vector<State> states_;
};

}  // namespace modar
