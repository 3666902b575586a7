// How a frame looks where a pattern should be, cell by cell: the photometric check of a pose, and
// what tells a print from another one. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "modar/image.hpp"
#include "plane_geometry.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// 8x8 cells of 6x6 samples: smaller cells agree by chance, larger ones are hidden in part too
/// often.
inline constexpr int kCellSide = 8;
inline constexpr int kCells = kCellSide * kCellSide;
inline constexpr int kCellSamples = 6;
using CellSamples = std::array<float, kCellSamples * kCellSamples>;

/// Variance below which a cell of the pattern shows nothing. Lower compares noise. [8, 32] tuned:
/// pose
inline constexpr float kTexturedCell = 16.0f;
// Correlation from which a cell agrees. Lower accepts clutter, higher loses blurred prints. [0.35,
// 0.7] tuned: pose
inline constexpr float kAgreeingCell = 0.5f;
// Correlation below which a cell disagrees; values between say nothing.
inline constexpr float kDisagreeingCell = 0.3f;

/// Correlation between earlier and current contents of a cell: from kSamePrint on they are the
/// same, below kChanged they differ.
inline constexpr float kSamePrint = 0.7f;
inline constexpr float kChanged = 0.5f;
/// Cosine of the least angle between two views in which an object above the paper covers different
/// cells.
inline constexpr float kElsewhere = 0.9945f;

/// Distances between samples that each averages, where the frame resolves it. Higher aliases fine
/// regular print, lower needs truer poses. [0.25, 1]
inline constexpr double kFootprint = 0.5;
/// Correlation of a cell with itself at that, below which its samples alias at their distance.
/// Lower doubts pages of text, higher needs flatter paper. [0.9, 0.98]
inline constexpr float kAliased = 0.96f;

/// A line in which a print's mirror image swaps its sides: u becomes 2 at - u, of the share u of
/// the width, or of the height if `upright` is false.
struct Mirror {
  bool upright = true;
  double at = 0.5;
  /// Whether the centre of a cell's mirror image is in the outline.
  [[nodiscard]] bool keeps(int cell) const;
  /// Pixels of the pattern's image to those of its mirror image.
  [[nodiscard]] glm::dmat3 pixels_of(const TrackedPattern& pattern) const;
};

/// The outline of a pattern in a frame, divided into cells.
class CellGrid {
 public:
  /// The arguments must outlive it. side: cells along a side of a flat pattern.
  CellGrid(const TrackedPattern& pattern, const PlaneMap& map, std::span<const GrayImage> pyramid,
           int side = kCellSide);
  /// Samples of a cell in the frame, and of its mirror image if there is one, which may be outside
  /// the outline; false if that is not in the frame. spread: 0: that of the cell.
  bool see(int cell, CellSamples& seen, const Mirror* mirror = nullptr, double spread = 0) const;
  /// What a sample averages, in distances between samples: more where the frame resolves less.
  [[nodiscard]] double spread(int cell) const;
  [[nodiscard]] double spread_from(double least) const;
  /// What a print, or its mirror image, of any size shows there that fills the outline, to a frame
  /// of that spread().
  static void expect(const TrackedPattern& print, int cell, CellSamples& expected,
                     const Mirror* mirror = nullptr, double spread = 1, int side = kCellSide);

 private:
  const TrackedPattern& pattern_;
  const PlaneMap& map_;
  std::span<const GrayImage> pyramid_;
  int side_;
  double step_;   ///< between samples, of the pattern's pixels
  double scale_;  ///< of these to the frame's
};

/// The cells, as bits, of a flat pattern that look different when each sample averages kFootprint.
std::uint64_t fine_cells(const TrackedPattern& pattern);

/// Two cells compared: correlation, 0 where one of them is flat, and the variance of each.
struct CellMatch {
  float correlation = 0;
  float expected_contrast = 0;
  float seen_contrast = 0;
  [[nodiscard]] bool textured() const { return expected_contrast >= kTexturedCell; }
  [[nodiscard]] bool agrees() const { return textured() && correlation >= kAgreeingCell; }
  [[nodiscard]] bool disagrees() const { return correlation < kDisagreeingCell; }
};
CellMatch compare(const CellSamples& expected, const CellSamples& seen);

/// Textured cells of the pattern in the frame, and how many of them correlate.
struct PhotometricCheck {
  int cells = 0;
  int matching = 0;
  double correlation = 0;                     ///< mean of the cells, negative ones counted as 0
  std::array<int, kMaxShapeFaces> of_face{};  ///< matching ones, of a box
};
PhotometricCheck check_photometry(const TrackedPattern& pattern, const PlaneMap& map,
                                  std::span<const GrayImage> pyramid);

/// Cells that agree with one of two prints in the same outline and disagree with the other.
struct PrintDifference {
  int first = 0;
  int second = 0;
};
/// map: of the pattern `first`.
PrintDifference compare_prints(const TrackedPattern& first, const TrackedPattern& second,
                               const PlaneMap& map, std::span<const GrayImage> pyramid);

/// The mirror in which most of those cells of the pattern agree with others.
Mirror most_alike_mirror(const TrackedPattern& pattern, bool upright,
                         const std::array<bool, kCells>& those);

/// Whether a flat pattern looks like itself a step to the side or down, as grids and keyboards do.
bool regular(const TrackedPattern& pattern);

/// Whether two patterns have one shape and much of their picture in common, as a series' prints do:
/// a quarter of the textured cells.
bool related(const TrackedPattern& a, const TrackedPattern& b);

}  // namespace modar::tracker
