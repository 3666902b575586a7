// A pattern's loop record as mapped arrays. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

#include "formats/error.hpp"
#include "formats/tracker_record.hpp"
#include "modar/image.hpp"

namespace modar::tracker {

struct TrackedPattern {
  std::uint32_t index = 0;  ///< of the bundle's patterns
  std::uint32_t bright_count = 0;
  std::span<const TrackerFeatureRecord> features;
  const std::uint8_t* codes = nullptr;
  std::array<std::span<const TrackerPatchRecord>, kMaxLoopImageLevels> patches;  ///< by level
  std::array<GrayImage, kMaxLoopImageLevels> levels;
  int level_count = 0;

  [[nodiscard]] int width() const { return levels[0].width; }
  [[nodiscard]] int height() const { return levels[0].height; }
  /// Image pixels (centres at integers) to the pattern plane (ModAR Eq. 1), and back.
  [[nodiscard]] glm::dvec2 to_world(glm::dvec2 pixel) const;
  [[nodiscard]] glm::dmat3 world_from_pixels() const;
};

/// Views a section's bytes, which must outlive the pattern. Every count and offset is checked, and
/// every feature and patch lies within the image, so that nothing later needs to look again.
/// Errors: kInvalidInput "tracker.record"; kUnsupported "tracker.record-version".
Result<TrackedPattern> view_loop_pattern(std::span<const std::byte> bytes, std::uint32_t index);

}  // namespace modar::tracker
