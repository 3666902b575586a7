// Extended tracking: where a pattern is that is covered or out of the frame, by its surroundings.
// Internal to runtime/track.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "frame_tracker.hpp"
#include "modar/pose_loop.hpp"
#include "surroundings.hpp"

namespace modar::tracker {

/// Learns what surrounds the anchor, the largest pattern in view, and derives its pose from that
/// while it is not seen.
class ExtendedTracking {
 public:
  /// All of these must outlive it: one track a pattern; frames: holds the present frame.
  ExtendedTracking(const Camera& camera, std::span<const TrackedPattern> patterns,
                   std::span<Track> tracks, const FrameTracker& frames)
      : camera_(camera),
        patterns_(patterns),
        tracks_(tracks),
        frames_(frames),
        surroundings_(camera) {}

  /// Once a frame, after its patterns: corrects the anchor's detection in the result, or adds the
  /// one that its surroundings give. turn: of what the camera sees since the last frame, as a
  /// rotation vector in radians; may be null.
  void step(TrackResult& result, const glm::dvec3* turn);
  /// Whether the last frame followed the surroundings.
  [[nodiscard]] bool following() const { return following_; }
  /// Forgets everything learned with another focal length.
  void forget_surroundings() { surroundings_.clear(); }
  /// Forgets everything learned and shown.
  void reset();

 private:
  /// A correction of the shown pose that is spread over several frames.
  struct PoseBlend {
    double share = 0;       ///< of the correction that is not yet applied, 1 to 0
    double step = 0;        ///< decrease of `share` per frame
    glm::dvec3 rotation{};  ///< rotation vector, radians
    glm::dvec3 translation{};
  };

  Detection* choose_anchor(TrackResult& result);
  [[nodiscard]] bool doubts(const Detection& seen) const;
  bool follow_surroundings(bool shown, const glm::dvec3* turn, Detection& detection);
  void find_again(const Pose& followed);
  bool corners_of(const Pose& pose, std::array<glm::dvec2, 4>& corners) const;
  bool seen_twice(const Detection& seen, const Detection& followed);
  void smooth_correction(const ExtendedPose& extended, const std::array<glm::dvec2, 4>& corners);
  [[nodiscard]] Pose blended(const Pose& pose) const;
  void start_blend(const Pose& from, const Pose& to);
  void continue_blend(Detection& detection);

  const Camera& camera_;
  std::span<const TrackedPattern> patterns_;
  std::span<Track> tracks_;
  const FrameTracker& frames_;
  Surroundings surroundings_;  ///< of the pattern `anchor_`
  std::size_t anchor_ = 0;
  double usual_patches_ = 0;  ///< patches of it that fitted in the last second
  int frames_unseen_ = 0;
  bool following_ = false;  ///< the last frame followed the surroundings
  bool guessed_ = false;    ///< and showed the pose that they gave
  PoseBlend blend_;
  /// Offset of the anchor's corners in the last frame from their place by the surroundings.
  std::optional<std::array<glm::dvec2, 4>> last_offset_;
};

}  // namespace modar::tracker
