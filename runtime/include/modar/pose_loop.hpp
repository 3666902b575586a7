// The pose loop: detects a pattern once, then tracks it. Needs no OpenCV.
#pragma once

#if __cplusplus < 202002L
#error "modar's headers for C++ need C++20 (-std=c++20); <modar/modar.h> is C99"
#endif

#include <memory>

#include <glm/vec3.hpp>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"
#include "modar/image.hpp"
#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"

namespace modar {

struct PoseLoopOptions {
  DetectOptions detect;
  bool track = true;  ///< false: every frame is searched anew
  /// Frames between searches for further patterns while one is tracked: trades the time of a
  /// search, some fifteen times that of tracking, for how soon a second pattern appears. Set by
  /// hand.
  int search_every = 10;
  /// Searches on a thread of its own, on the latest frame, while tracking goes on: no frame waits,
  /// but what is found depends on timing. False: the same frames always give the same results.
  bool async_search = false;
  /// ARMv7 instructions that a frame may take, in millions, 0: no limit; without async_search. A
  /// search goes on over several frames then, and what it found is brought to the present one.
  /// Smaller budgets find later, and lose fast motion while they search. Counted, not clocked: the
  /// same frames give the same results. 12 or more: the longest step takes 5, tracking a pattern 3.
  int budget = 0;
  /// Learns what stands still around the pattern that shows largest, and goes on from it when the
  /// pattern is hidden or leaves the frame: Detection::extended. Costs some 0.4 MB. The camera has
  /// to move before: depth comes from motion.
  bool extended = false;
  /// The camera is a guess. Its focal length, and the aspects of flat patterns, are estimated from
  /// the frames (TrackResult::camera), and no print is hidden because it seems bent: a wrong camera
  /// bends, too.
  bool estimate_camera = false;
};

/// Reads the patterns' tracker records and shapes (section types 258 and 261) from the bundle's
/// mapped bytes, which must outlive it. Allocates nothing per frame once a TrackResult has grown.
class PoseLoop {
 public:
  /// Errors: kInvalidInput "tracker.no-patterns" if no pattern has a tracker record,
  /// "tracker.record"; kUnsupported "tracker.record-version".
  static Result<std::unique_ptr<PoseLoop>> create(const BundleView& bundle, const Camera& camera,
                                                  const PoseLoopOptions& options = {});
  PoseLoop(const PoseLoop&) = delete;
  PoseLoop& operator=(const PoseLoop&) = delete;
  ~PoseLoop();

  /// One frame of the camera's size.
  /// Errors: kInvalidInput "tracker.frame-size".
  Result<TrackResult> step(const GrayImage& frame);
  /// The same into a result of the caller's, whose memory is reused.
  Result<void> step(const GrayImage& frame, TrackResult& result);
  /// How the camera turned from the last frame to the next one, as a gyroscope says: a rotation
  /// vector, radians, in the camera's axes (x right, y down, z forward; the axes of a phone's
  /// sensors are others). Helps `extended`; not given, it is estimated.
  void set_turn(const glm::dvec3& rotation);
  /// Forgets all tracks, and the surroundings.
  void reset();

 private:
  struct State;
  explicit PoseLoop(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
