// Finds small printed differences between a tracked print and its pattern: another title, another
// fruit on the same label. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

#include "photometry.hpp"

namespace modar::tracker {

/// Compares cells of half the verifier's size with the frame, a few in each frame.
///
/// A cell that is too fine to tell is compared quarter by quarter, where the frame resolves them.
/// A cell that agreed once is the pattern's. One that never does, but shows the same from two
/// directions, is a printed difference, if cells that agree surround it: what covers a print
/// reaches in from the print's edge, so cells that disagree and are connected with the edge say
/// nothing. Nor does a cell say anything that shows too little texture, as under glare, or a print
/// so far away that the frame resolves less than the cells' samples.
class PrintDetails {
 public:
  static constexpr int kDetailSide = 2 * kCellSide;
  static constexpr int kDetailCells = kDetailSide * kDetailSide;

  /// Compares `count` cells that do not agree yet; kDetailCells: all, for likeness(). from:
  /// direction from the pattern to the camera.
  void look(const TrackedPattern& print, const PlaneMap& map, std::span<const GrayImage> pyramid,
            const glm::vec3& from, int count, bool all = false);
  /// Mean correlation of what has detail in the verifier's cells of this mask, as last seen, 0 to
  /// 1; 1 where hardly any has.
  [[nodiscard]] double likeness(const std::array<bool, kCells>& those) const;
  /// Cells of printed differences that cells in agreement surround.
  [[nodiscard]] int differences() const;

 private:
  enum class CellState : std::uint8_t {
    kUnseen,
    kPlain,    ///< neither the pattern nor the frame has texture there
    kAgrees,   ///< or did once
    kForeign,  ///< one of them has none, or the pattern's is too fine to tell
    kDiffers,  ///< `shown` is what the frame showed instead
    kPrinted,  ///< and showed the same from another direction
  };
  struct Cell {
    CellState state = CellState::kUnseen;
    std::uint8_t looks = 0;     ///< that showed the same
    std::uint8_t likeness = 0;  ///< correlation where there is detail, percent; 0: none seen
    std::uint8_t quarter = 0;   ///< 1 to 4: that is compared, as the whole is too fine to tell
    bool edge_agrees = false;   ///< its half at the print's edge did once, or it has none
    glm::vec3 from{};           ///< direction from which `shown` was seen
    std::array<std::uint8_t, kCellSamples * kCellSamples> shown{};
  };
  static void update(Cell& cell, const CellMatch& match, bool coarse, const CellSamples& seen,
                     const glm::vec3& from);
  static void next_quarter(Cell& cell);

  std::array<Cell, kDetailCells> cells_;
  std::uint32_t next_ = 0;
};

}  // namespace modar::tracker
