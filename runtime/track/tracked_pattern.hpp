// A pattern's tracker record as views of the mapped bundle. Internal to runtime/track.
//
// What runtime/track offers inside, each header building on those before it:
//   kernels.hpp           loops over pixels and bits, one table per SIMD level
//   tracked_pattern.hpp   a pattern's record: features, codes, patches, image
//   plane_geometry.hpp    maps between pattern and frame, poses from points, motion model
//   patch_alignment.hpp   Gauss-Newton over small patches
//   pose_refinement.hpp   coarse to fine, from features to a pose, photometric check
//   pattern_matching.hpp  features to homographies of one pattern, from there over a curved one; an
//                         index over all patterns
//   pattern_search.hpp    finds patterns in a frame, also on a thread of its own
//   camera_estimator.hpp  the focal length and the aspects of patterns from views of them
//   frame_tracker.hpp     tracks patterns from frame to frame
//   surroundings.hpp      the pose from what stands around a pattern that is not seen
// Others include the public headers only: modar/pose_loop.hpp drives all of it;
// modar/tracker_features.hpp, pose.hpp, camera.hpp, and pose_smoother.hpp offer parts.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "formats/base/error.hpp"
#include "formats/pattern_shape.hpp"
#include "formats/tracker_record.hpp"
#include "modar/image.hpp"

namespace modar::tracker {

/// Patterns from which on only places that the index names are matched, one find a search. Lower
/// bounds the time of smaller bundles, too.
inline constexpr std::size_t kMany = 8;

/// Halvings of a pattern's image, which the record does not hold.
struct PatternPyramid {
  std::mutex making;
  std::atomic<bool> made = false;
  std::array<GrayImage, kMaxTrackerImageLevels> levels;
  std::vector<std::uint8_t> pixels;  ///< of all but the first
};

struct TrackedPattern {
  std::uint32_t index = 0;  ///< of the bundle's patterns
  /// Copies of the print are tracked by a TrackedPattern each, over the same bytes: which of them
  /// this is, how many there are, and the place of the first among the loop's.
  std::uint32_t copy = 0;
  std::uint32_t copies = 1;
  std::uint32_t first = 0;
  std::uint32_t bright_count = 0;
  std::span<const TrackerFeatureRecord> features;
  const std::uint8_t* codes = nullptr;
  std::array<std::span<const TrackerPatchRecord>, kMaxTrackerImageLevels> patches;  ///< by level
  GrayImage image;                    ///< the record's
  int level_count = 0;                ///< of pyramid()
  PatternPyramid* coarser = nullptr;  ///< of the image; copies share it
  /// Those whose samples alias, see photometry.hpp; of many patterns measured at the first use.
  mutable std::optional<std::uint64_t> fine_cells;
  PatternSurface surface;
  /// Of a flat pattern: its plane relative to its picture, by the middle (the axes of
  /// to_world()). Not of the record: while the camera is a guess, what a pose leaves of a measured
  /// homography.
  glm::dmat2 shape{1.0};

  [[nodiscard]] int width() const { return image.width; }
  /// The image and its halvings, finest first; made at the first call, which any thread may make.
  [[nodiscard]] std::span<const GrayImage> pyramid() const;
  /// Whether a detection is of this copy.
  [[nodiscard]] bool shown_by(std::uint32_t pattern, std::uint32_t its_copy) const {
    return pattern == index && its_copy == copy;
  }
  [[nodiscard]] int height() const { return image.height; }
  /// Image pixels (centres at integers) to the pattern plane (ModAR Eq. 1), and back.
  [[nodiscard]] glm::dvec2 to_world(glm::dvec2 pixel) const;
  [[nodiscard]] glm::dmat3 world_from_pixels() const;
  /// Image pixels to where the pattern's surface has them: (to_world(), 0) of a flat one.
  [[nodiscard]] glm::dvec3 on_surface(glm::dvec2 pixel) const;
};

/// How many of them are no further copies; these come first.
inline std::size_t count_of_prints(std::span<const TrackedPattern> patterns) {
  std::size_t count = 0;
  while (count < patterns.size() && patterns[count].copy == 0) ++count;
  return count;
}

/// Views a section's bytes, which must outlive the pattern, as must `coarser`, its own. Every count
/// and offset is validated, and every feature and patch is within the image: nothing later checks
/// again. Errors: kInvalidInput "tracker.record"; kUnsupported "tracker.record-version". shape: of
/// a SectionType::kPatternShape section; none: flat.
Result<TrackedPattern> view_tracked_pattern(std::span<const std::byte> bytes, std::uint32_t index,
                                            PatternPyramid& coarser,
                                            std::span<const std::byte> shape = {});

}  // namespace modar::tracker
