// Whether what is tracked is the pattern itself, and flat: what contradicts is counted over several
// frames. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "frame_tracker.hpp"
#include "modar/tracker.hpp"
#include "photometry.hpp"

namespace modar::tracker {

/// Looks at the cells of found and tracked patterns: a few in each frame, all of them within 16.
///
/// A covered print and another print of its series look alike in one frame: some cells agree,
/// others do not. They differ by time. What covers stands before the paper: seen from elsewhere, it
/// hides another place, and a hand moves. What another print shows in a cell stays there, sharp,
/// from wherever it is seen. So a contradiction counts once a disagreeing cell with texture of its
/// own was seen alike from two directions. What lies flat on the print and does not move counts as
/// printed, too; the limits leave room for fingers that hold a page.
/// A mirror image, and another pattern of the bundle in the same place, show themselves at once: by
/// the cells that agree with them and disagree with the pattern. A search finds a mirror image
/// where a part of the pattern is its own one, so the mirror is taken to lie there.
class PrintJudge {
 public:
  /// The patterns must outlive it. Allocates nothing later.
  /// known_camera: else a bend hides nothing.
  explicit PrintJudge(std::span<const TrackedPattern> patterns, bool known_camera = true);

  struct Verdict {
    Reason reason = Reason::kVisible;  ///< or kOtherPrint, kCurved: it is not to be shown
    double agreeing = 0;               ///< share of the textured cells in view that agree, 0 to 1
    double likeness = 0;               ///< mean correlation of these cells, 0 to 1
    std::int32_t rival = -1;           ///< a pattern that the frame shows in its place
  };
  /// A pattern that a search found in this frame. again: it was lost a moment ago, and what was
  /// seen then counts.
  Verdict meet(std::size_t pattern, const FrameView& frame, const Track& track, bool again);
  /// Whether a pose has slipped from the pattern that frames before saw there: many cells that
  /// agree do so less than they did. What covers a pattern takes cells away, and leaves the others
  /// alone.
  [[nodiscard]] bool slipped(std::size_t pattern, const FrameView& frame, const Track& track) const;
  /// A pattern tracked to this frame.
  Verdict follow(std::size_t pattern, const FrameView& frame, const Track& track);

 private:
  enum class CellState : std::uint8_t {
    kUnseen,  ///< not in the frame, or without texture
    kAgrees,
    kDoubtful,  ///< or the frame shows no texture there
    kDiffers,   ///< `shown` is what it showed instead
    kPrinted,   ///< and showed again from another direction
  };
  struct Cell {
    CellState state = CellState::kUnseen;
    std::uint8_t flips = 0;     ///< kFlip bits: agrees with a mirror image alone, or against it
    std::uint8_t likeness = 0;  ///< correlation, percent
    glm::vec3 from{};           ///< direction from which `shown` was seen
    std::array<std::uint8_t, kCellSamples * kCellSamples> shown{};
  };
  struct Evidence {
    std::array<Cell, kCells> cells;
    std::uint32_t next_cell = 0;
    std::uint32_t next_rival = 0;
    bool other_print = false;
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
  std::int32_t rival_of(std::size_t pattern, const FrameView& frame, const Track& track, int work);
  bool related_to(std::size_t a, std::size_t b, int& work);
  static double agreeing_share(const Evidence& seen);
  static void forget_mirrors(Evidence& seen);
  static Verdict judge(Evidence& seen);

  std::span<const TrackedPattern> patterns_;
  bool known_camera_;
  std::vector<Evidence> evidence_;       ///< by pattern
  std::vector<std::uint8_t> relations_;  ///< by two patterns: 0 not known yet, 1 none, 2 related
  /// By pattern: an upright mirror and one that is not, as place_mirrors() left them.
  std::vector<std::array<Mirror, 2>> mirrors_;
};

}  // namespace modar::tracker
