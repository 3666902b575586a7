// Verifies over several frames that a tracked print is the pattern itself, and flat. Internal to
// runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "frame_tracker.hpp"
#include "modar/tracker.hpp"
#include "photometry.hpp"
#include "print_details.hpp"

namespace modar::tracker {

/// Compares the cells of found and tracked patterns with the frame: a few cells in each frame, all
/// of them within 16 frames.
///
/// In a single frame, a covered print and another print of its series look the same: some cells
/// agree, others do not. Over time they differ: an object in front of the paper covers another
/// place when seen from another direction, and a hand moves, whereas the contents of another print
/// stay in their cell, sharp, from every direction. Therefore a disagreeing cell with texture
/// counts as evidence once it looked the same from two directions. Flat objects that stay on the
/// print count as printed, too; the limits leave room for fingers that hold a page. A mirror image,
/// and another pattern of the bundle in the same place, are recognised at once: by the cells that
/// agree with them and disagree with the pattern. A search finds a mirror image where a part of the
/// pattern is symmetric, so the mirror axis is assumed there.
class PrintVerifier {
 public:
  /// The patterns must outlive it. Allocates nothing later.
  /// known_camera: false: curved prints do not fail the verification.
  explicit PrintVerifier(std::span<const TrackedPattern> patterns, bool known_camera = true);

  struct Verification {
    Reason reason = Reason::kVisible;  ///< or why it is not shown
    double agreeing = 0;               ///< share of the textured cells in view that agree, 0 to 1
    double likeness = 0;               ///< mean correlation of these cells, 0 to 1
    std::int32_t actual_pattern = -1;  ///< the pattern that the frame shows instead; -1: none
  };
  /// Verifies a pattern that a search found in this frame, without evidence from before: another
  /// print may be there now.
  Verification verify_found(std::size_t pattern, const FrameView& frame, const Track& track);
  /// Whether a pose has slipped off the pattern: many cells still agree, but less than in the
  /// frames before. (An object that covers the pattern removes cells, and leaves the others
  /// unchanged.)
  [[nodiscard]] bool has_slipped(std::size_t pattern, const FrameView& frame,
                                 const Track& track) const;
  /// Verifies a pattern that was tracked to this frame.
  Verification verify_tracked(std::size_t pattern, const FrameView& frame, const Track& track);

 private:
  enum class CellState : std::uint8_t {
    kUnseen,  ///< not in the frame, or without texture
    kAgrees,
    kDoubtful,  ///< or the frame shows no texture there
    kDiffers,   ///< `shown` is what the frame showed instead
    kPrinted,   ///< and showed the same again from another direction
  };
  struct Cell {
    CellState state = CellState::kUnseen;
    std::uint8_t flips =
        0;  ///< kFlip bits: agrees with a mirror image only, or with the pattern only
    std::uint8_t likeness = 0;  ///< correlation, percent
    glm::vec3 from{};           ///< direction from which `shown` was seen
    std::array<std::uint8_t, kCellSamples * kCellSamples> shown{};
  };
  struct Evidence {
    std::array<Cell, kCells> cells;
    PrintDetails details;
    std::uint32_t next_cell = 0;
    std::uint32_t next_other = 0;
    bool other_print = false;
    bool other_details = false;  ///< a small part of it differs
    bool at_large = false;       ///< lacks_detail() when that was measured last
    bool flipped = false;
    bool curved = false;
    bool was_bent = false;  ///< at the last measurement
  };

  void look(std::size_t pattern, const FrameView& frame, const Track& track, int count);
  [[nodiscard]] std::uint8_t flips_of(std::size_t pattern, const CellGrid& grid, int at) const;
  void look_for_mirrors(std::size_t pattern, const FrameView& frame, const Track& track, int count);
  void place_mirrors(std::size_t pattern);
  [[nodiscard]] bool fits_mirrored(std::size_t pattern, const FrameView& frame,
                                   const Track& track) const;
  void update(std::size_t pattern, const CellGrid& grid, const glm::vec3& from, int at,
              Cell& cell) const;
  void measure(const TrackedPattern& print, const FrameView& frame, const Track& track,
               bool at_once, Evidence& seen) const;
  std::int32_t find_actual_pattern(std::size_t pattern, const FrameView& frame, const Track& track,
                                   int work);
  bool related_to(std::size_t a, std::size_t b, int& work);
  bool is_regular(std::size_t pattern);
  static double agreeing_share(const Evidence& seen);
  static bool scattered(const Evidence& seen);
  static bool lacks_detail(const Evidence& seen);
  static void forget_mirrors(Evidence& seen);
  static Verification conclude(const TrackedPattern& print, Evidence& seen);

  std::span<const TrackedPattern> patterns_;
  std::size_t prints_;  ///< the first of them; the others are further copies
  bool known_camera_;
  std::vector<Evidence> evidence_;            ///< by pattern
  std::vector<std::optional<bool>> regular_;  ///< by pattern: whether it is regular()
  std::vector<std::uint8_t> relations_;       ///< by two prints: 0 not known yet, 1 none, 2 related
  /// By pattern: an upright mirror and one that is not, as place_mirrors() left them.
  std::vector<std::array<Mirror, 2>> mirrors_;
};

}  // namespace modar::tracker
