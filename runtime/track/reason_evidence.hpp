// What a frame without a find looks like, and the reason that it gives. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <glm/vec2.hpp>

#include "modar/image.hpp"
#include "modar/tracker.hpp"
#include "pattern_matching.hpp"

namespace modar::tracker {

/// Where a pattern may be that is not shown.
struct LikelyPlace {
  static constexpr int kSeen = 1000;  ///< votes of where it was a moment ago, or small
  glm::dvec2 corner{};                ///< top left, frame pixels
  glm::dvec2 right{};                 ///< from there to the top right one
  glm::dvec2 down{};                  ///< to the bottom left one
  glm::dvec2 step{};                  ///< by which it moves until the next frame
  int votes = 0;                      ///< features that agree on it, maybe by chance; 0: nowhere
  int frames = 0;                     ///< since then
  /// To the next frame, a little less far each time.
  void move();
};
LikelyPlace seen_at(const std::array<glm::dvec2, 4>& corners);
LikelyPlace place_of(const TrackedPattern& pattern, const FeatureMatch& match);

/// Of a print too small to be found, a feature or two of a frame match by more than chance: over
/// many frames they agree on one place.
class SmallVotes {
 public:
  /// Adds the matches of one search, those for small places.
  void add(const TrackedPattern& pattern, std::span<const FeatureMatch> matches);
  /// The place that different features of the pattern agree on, if there is one.
  void find(const TrackedPattern& pattern, LikelyPlace& place) const;

 private:
  struct Vote {
    LikelyPlace place;
    std::uint32_t pattern = 0;
    std::uint64_t part = 0;  ///< bit of the part of the pattern, of 8 x 8, that casts it
  };
  std::array<Vote, 512> votes_;  ///< the newest
  std::size_t count_ = 0;        ///< of all so far
};

struct ReasonEvidence {
  // Of the frame:
  double brightness = 128;  ///< mean gray value
  double saturated = 0;     ///< share of its pixels
  /// Of the strongest edges: gradient between pixels, and between pixels eight times as large; each
  /// in the direction that is blurred more.
  int edge = 0;
  int coarse_edge = 0;
  // Of the place:
  int votes = 0;
  double side = 0;    ///< of a square of its area, as a share of the frame's longer side
  double inside = 0;  ///< share of it in the frame,
  double glare = 0;   ///< of which this share is saturated
};

/// Levels of the frame's pyramid that the evidence is taken from, at least.
inline constexpr std::size_t kEvidenceLevels = 4;
void look_at_frame(std::span<const GrayImage> pyramid, ReasonEvidence& evidence);
void look_at_place(std::span<const GrayImage> pyramid, const LikelyPlace& place,
                   ReasonEvidence& evidence);
/// The reason that the evidence gives, where it tells more than the tracker's own.
Reason reason_of(Reason own, const ReasonEvidence& evidence);

}  // namespace modar::tracker
