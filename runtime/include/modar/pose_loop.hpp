// The pose loop: detects a pattern once, then tracks it. Needs no OpenCV.
#pragma once

#if __cplusplus < 202002L
#error "modar's headers for C++ need C++20 (-std=c++20); <modar/modar.h> is C99"
#endif

#include <cstddef>
#include <memory>
#include <span>

#include <glm/vec3.hpp>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/camera.hpp"
#include "modar/image.hpp"
#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"

namespace modar {

/// How many copies of a pattern are tracked: see PoseLoopOptions::max_instances.
std::uint32_t copies_of(const BundleView& bundle, std::uint32_t pattern, int max_instances);
/// The most of them of any pattern.
std::uint32_t most_copies(const BundleView& bundle, int max_instances);

struct PoseLoopOptions {
  DetectOptions detect;
  bool track = true;  ///< false: search every frame
  /// Frames between searches for more patterns while one is tracked: trades the time of a search,
  /// about fifteen times that of tracking, for how soon a second pattern appears. Chosen without a
  /// measurement.
  int search_every = 10;
  /// Searches on a separate thread, on the latest frame, while tracking continues: no frame waits,
  /// but results depend on timing. False: the same frames always give the same results.
  bool async_search = false;
  /// Limit of ARMv7 instructions per frame, in millions, for async_search = false; 0: no limit. A
  /// search is then spread over several frames, and its result is carried to the current one.
  /// Smaller budgets find patterns later, and lose fast ones during a search. Counted, not clocked:
  /// the same frames give the same results. At least 12: the longest step takes 5, tracking 3.
  int budget = 0;
  /// Learns the static surroundings of the largest pattern in view, and continues from them while
  /// the pattern is covered or out of the frame: Detection::extended. Takes about 0.4 MB. The
  /// camera must move beforehand: depth comes from motion.
  bool extended = false;
  /// Copies of one print that are tracked at once, each with its own pose: 1 to kMaxCopies; 0: as
  /// many as the bundle states. Searches continue until all of them are found.
  int max_instances = 1;
  /// The camera is a guess: its focal length and the aspects of flat patterns are estimated from
  /// the frames (TrackResult::camera), and no print is hidden for being curved, since a wrong
  /// camera makes flat prints look curved.
  bool estimate_camera = false;
};

/// A picture that is no pattern of the bundle, made by make_tracker_record(). Aligned to 8.
using OwnRecord = std::span<const std::byte>;

/// Reads the patterns' tracker records and shapes (kTrackerRecord, kPatternShape) from the bundle's
/// mapped bytes, which must outlive it. Allocates nothing per frame once a TrackResult has grown.
class PoseLoop {
 public:
  /// own: further patterns, flat, with the numbers after the bundle's; their bytes must outlive it.
  /// Errors: kInvalidInput "tracker.no-patterns" if no pattern has a tracker record,
  /// "tracker.record"; kUnsupported "tracker.record-version".
  static Result<std::unique_ptr<PoseLoop>> create(const BundleView& bundle, const Camera& camera,
                                                  const PoseLoopOptions& options = {},
                                                  std::span<const OwnRecord> own = {});
  PoseLoop(const PoseLoop&) = delete;
  PoseLoop& operator=(const PoseLoop&) = delete;
  ~PoseLoop();

  /// One frame of the camera's size.
  /// Errors: kInvalidInput "tracker.frame-size".
  Result<TrackResult> step(const GrayImage& frame);
  /// The same, writing to a result of the caller, whose memory is reused.
  Result<void> step(const GrayImage& frame, TrackResult& result);
  /// The camera's rotation from the last frame to the next one, from a gyroscope: a rotation vector
  /// in radians, in the camera's axes (x right, y down, z forward; those of a phone's sensors
  /// differ). Helps `extended`; without it, the rotation is estimated.
  void set_turn(const glm::dvec3& rotation);
  /// Forgets all tracks, and the surroundings.
  void reset();

 private:
  struct State;
  explicit PoseLoop(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
