// Samples cells of prints and of frames and correlates them.
#include "photometry.hpp"

#include <algorithm>
#include <cmath>

namespace modar::tracker {
namespace {

/// A picture as seen by samples at this distance: between two levels of its pyramid, as textures
/// are filtered (Williams, "Pyramidal parametrics", 1983). The nearest level alone showed regular
/// print that is finer than the samples differently on each side of a comparison.
class Filtered {
 public:
  Filtered(std::span<const GrayImage> pyramid, double pixels) {
    std::size_t level = 0;
    double width = 1.0;
    for (; level + 1 < pyramid.size() && 2.0 * width <= pixels; width *= 2.0) ++level;
    fine_ = &pyramid[level];
    coarse_ = &pyramid[std::min(level + 1, pyramid.size() - 1)];
    fine_shrink_ = 1.0 / width;
    coarse_shrink_ = coarse_ == fine_ ? fine_shrink_ : 0.5 / width;
    share_ = static_cast<float>(std::clamp(pixels / width - 1.0, 0.0, 1.0));
  }
  /// At a place in pixels of the finest level, from its edge; beyond the border the border.
  [[nodiscard]] float at(double x, double y) const {
    const float fine = on(*fine_, fine_shrink_, x, y);
    return fine + share_ * (on(*coarse_, coarse_shrink_, x, y) - fine);
  }

 private:
  static float on(const GrayImage& image, double shrink, double x, double y) {
    return sample(image, static_cast<float>(std::clamp(x * shrink - 0.5, 0.0, image.width - 1.001)),
                  static_cast<float>(std::clamp(y * shrink - 0.5, 0.0, image.height - 1.001)));
  }
  const GrayImage* fine_;
  const GrayImage* coarse_;
  double fine_shrink_ = 1;
  double coarse_shrink_ = 1;
  float share_ = 0;
};

// Cells along a side of a box's face. Fewer per face never confirm a face that is seen alone.
constexpr int kFaceCellSide = 4;
constexpr int kFaceCells = kFaceCellSide * kFaceCellSide;

// Share of a pattern's cells that agree with a shifted copy, from which it is regular. Lower
// examines the details of more prints, higher confuses grids.
constexpr double kRegularShare = 0.6;
// Cells that must agree for that, at least.
constexpr int kLeastShifted = 12;
// Samples of the longest shift that is tried, of 48.
constexpr int kMostShift = 33;

int cells_of(const TrackedPattern& pattern) {
  const auto faces = static_cast<int>(pattern.surface.faces().size());
  return faces > 0 ? kFaceCells * faces : kCells;
}

/// Pattern pixels between samples.
double step_of(const TrackedPattern& pattern, int side) {
  if (!pattern.surface.faces().empty()) {
    const auto& place = pattern.surface.faces()[0].place;
    return std::max(place[2], place[3]) / static_cast<double>(kFaceCellSide * kCellSamples);
  }
  return std::max(pattern.width(), pattern.height()) / static_cast<double>(side * kCellSamples);
}

/// The place of a sample of a cell, in shares of width and height, of `side` by `side` cells.
glm::dvec2 share_at(int cell, int k, int side) {
  return {
      (cell % side * kCellSamples + k % kCellSamples + 0.5) / (side * kCellSamples),
      (static_cast<int>(cell / side) * kCellSamples + static_cast<int>(k / kCellSamples) + 0.5) /
          (side * kCellSamples)};
}

/// The same of a pattern's cell. Those of a box are ordered by face and not mirrored: the neighbour
/// of a face in the picture is another one.
glm::dvec2 place_of(const TrackedPattern& pattern, int cell, int k, const Mirror* mirror,
                    int side) {
  if (!pattern.surface.faces().empty()) {
    const auto faces = pattern.surface.faces();
    const auto& face =
        faces[std::min(static_cast<std::size_t>(cell / kFaceCells), faces.size() - 1)].place;
    const glm::dvec2 share = share_at(cell % kFaceCells, k, kFaceCellSide);
    return {(face[0] + share.x * face[2]) / pattern.width(),
            (face[1] + share.y * face[3]) / pattern.height()};
  }
  glm::dvec2 place = share_at(cell, k, side);
  if (mirror != nullptr) {
    double& share = mirror->upright ? place.x : place.y;
    share = 2.0 * mirror->at - share;
  }
  return place;
}

}  // namespace

bool Mirror::keeps(int cell) const {
  const int along = upright ? cell % kCellSide : cell / kCellSide;
  const double share = 2.0 * at - (along + 0.5) / kCellSide;
  return share >= 0.0 && share <= 1.0;
}

glm::dmat3 Mirror::pixels_of(const TrackedPattern& pattern) const {
  const int axis = upright ? 0 : 1;
  glm::dmat3 swapped(1.0);
  swapped[axis][axis] = -1.0;
  swapped[2][axis] = 2.0 * at * (upright ? pattern.width() : pattern.height()) - 1.0;
  return swapped;
}

CellGrid::CellGrid(const TrackedPattern& pattern, const PlaneMap& map,
                   std::span<const GrayImage> pyramid, int side)
    : pattern_(pattern),
      map_(map),
      pyramid_(pyramid),
      side_(side),
      step_(step_of(pattern, side)),
      scale_(std::max(scale_of(pattern, map), 1e-6)) {}

double CellGrid::spread(int cell) const {
  if (!pattern_.fine_cells) pattern_.fine_cells = fine_cells(pattern_);
  const bool fine = cell < kCells && (*pattern_.fine_cells >> cell & 1) != 0;
  return spread_from(fine ? kFootprint : 1.0);
}

double CellGrid::spread_from(double least) const {
  return std::max(least, 1.0 / (step_ * scale_));
}

bool CellGrid::see(int cell, CellSamples& seen, const Mirror* mirror, double spread) const {
  const double pixels = (spread > 0.0 ? spread : this->spread(cell)) * step_ * scale_;
  const Filtered frame(pyramid_, pixels);
  const GrayImage& whole = pyramid_[0];
  for (int k = 0; k < kCellSamples * kCellSamples; ++k) {
    const glm::dvec2 share = place_of(pattern_, cell, k, mirror, side_);
    bool in_front = false;
    const glm::dvec2 p =
        map_.at({share.x * pattern_.width() - 0.5, share.y * pattern_.height() - 0.5}, in_front);
    const double margin = 0.5 * pixels;
    if (!in_front || !(p.x >= margin && p.y >= margin && p.x < whole.width - 1 - margin &&
                       p.y < whole.height - 1 - margin)) {
      return false;
    }
    seen[static_cast<std::size_t>(k)] = frame.at(p.x + 0.5, p.y + 0.5);
  }
  return true;
}

void CellGrid::expect(const TrackedPattern& print, int cell, CellSamples& expected,
                      const Mirror* mirror, double spread, int side) {
  const Filtered picture(print.pyramid(), spread * step_of(print, side));
  for (int k = 0; k < kCellSamples * kCellSamples; ++k) {
    const glm::dvec2 share = place_of(print, cell, k, mirror, side);
    expected[static_cast<std::size_t>(k)] =
        picture.at(share.x * print.width(), share.y * print.height());
  }
}

std::uint64_t fine_cells(const TrackedPattern& pattern) {
  std::uint64_t fine = 0;
  CellSamples whole{};
  CellSamples sharp{};
  for (int cell = 0; cell < kCells; ++cell) {
    CellGrid::expect(pattern, cell, whole);
    CellGrid::expect(pattern, cell, sharp, nullptr, kFootprint);
    fine |= std::uint64_t{compare(whole, sharp).correlation < kAliased} << cell;
  }
  return fine;
}

CellMatch compare(const CellSamples& expected, const CellSamples& seen) {
  float sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    sa += expected[i];
    sb += seen[i];
    saa += expected[i] * expected[i];
    sbb += seen[i] * seen[i];
    sab += expected[i] * seen[i];
  }
  const float n = static_cast<float>(expected.size());
  CellMatch match;
  match.expected_contrast = saa / n - sa / n * sa / n;
  match.seen_contrast = sbb / n - sb / n * sb / n;
  if (!(match.expected_contrast > 0.0f) || !(match.seen_contrast > 0.25f)) return match;
  match.correlation =
      (sab / n - sa / n * sb / n) / std::sqrt(match.expected_contrast * match.seen_contrast);
  return match;
}

PhotometricCheck check_photometry(const TrackedPattern& pattern, const PlaneMap& map,
                                  std::span<const GrayImage> pyramid) {
  const CellGrid grid(pattern, map, pyramid);
  PhotometricCheck check;
  CellSamples expected{};
  CellSamples seen{};
  for (int cell = 0; cell < cells_of(pattern); ++cell) {
    if (!grid.see(cell, seen)) continue;
    CellGrid::expect(pattern, cell, expected, nullptr, grid.spread(cell));
    const CellMatch match = compare(expected, seen);
    if (!match.textured()) continue;
    ++check.cells;
    check.correlation += static_cast<double>(std::max(0.0f, match.correlation));
    if (!match.agrees()) continue;
    ++check.matching;
    if (!pattern.surface.faces().empty())
      ++check.of_face[static_cast<std::size_t>(cell / kFaceCells)];
  }
  if (check.cells > 0) check.correlation /= check.cells;
  return check;
}

PrintDifference compare_prints(const TrackedPattern& first, const TrackedPattern& second,
                               const PlaneMap& map, std::span<const GrayImage> pyramid) {
  const CellGrid grid(first, map, pyramid);
  PrintDifference difference;
  CellSamples expected{};
  CellSamples seen{};
  for (int cell = 0; cell < kCells; ++cell) {
    if (!grid.see(cell, seen)) continue;
    CellGrid::expect(first, cell, expected, nullptr, grid.spread(cell));
    const CellMatch one = compare(expected, seen);
    CellGrid::expect(second, cell, expected, nullptr, grid.spread(cell));
    const CellMatch other = compare(expected, seen);
    difference.first += one.agrees() && other.disagrees() ? 1 : 0;
    difference.second += other.agrees() && one.disagrees() ? 1 : 0;
  }
  return difference;
}

namespace {

constexpr int kPatternSide = kCellSide * kCellSamples;
using PatternSamples = std::array<float, kPatternSide * kPatternSide>;

/// The samples of a pattern's cells, row by row; turned if upright is false.
PatternSamples rows_of(const TrackedPattern& pattern, bool upright) {
  PatternSamples rows;
  CellSamples samples{};
  for (int cell = 0; cell < kCells; ++cell) {
    CellGrid::expect(pattern, cell, samples);
    for (int k = 0; k < kCellSamples * kCellSamples; ++k) {
      const int x = cell % kCellSide * kCellSamples + k % kCellSamples;
      const int y = cell / kCellSide * kCellSamples + k / kCellSamples;
      rows[static_cast<std::size_t>(upright ? y * kPatternSide + x : x * kPatternSide + y)] =
          samples[static_cast<std::size_t>(k)];
    }
  }
  return rows;
}

/// The cell whose rows of samples begin at `own`, compared with what begins at `other` and
/// continues in steps of 1, or of -1 in a mirror.
CellMatch compare_rows(const float* own, const float* other, int step) {
  CellSamples here{};
  CellSamples there{};
  for (int k = 0; k < kCellSamples * kCellSamples; ++k) {
    const int x = k % kCellSamples;
    const int row = k / kCellSamples * kPatternSide;
    here[static_cast<std::size_t>(k)] = own[row + x];
    there[static_cast<std::size_t>(k)] = other[row + step * x];
  }
  return compare(here, there);
}

}  // namespace

Mirror most_alike_mirror(const TrackedPattern& pattern, bool upright,
                         const std::array<bool, kCells>& those) {
  // Turned so that the mirror swaps cells along a row.
  const PatternSamples rows = rows_of(pattern, upright);
  // Mirrors at the samples and half-way between, from the middle outwards: of equally good ones the
  // first. Cells behind the mirror are compared with those before it.
  int best = kPatternSide;
  int most = 0;
  for (int i = 0; i < 2 * (kPatternSide - kCellSamples); ++i) {
    const int sum = kPatternSide + (i % 2 == 0 ? -i / 2 : (i + 1) / 2);
    int alike = 0;
    for (int left = 0; left < kPatternSide; left += kCellSamples) {
      const int low = sum - left - kCellSamples;
      if (low < 0 || low > left) continue;
      for (int top = 0; top < kPatternSide; top += kCellSamples) {
        const int across = left / kCellSamples;
        const int down = top / kCellSamples;
        const int cell = upright ? down * kCellSide + across : across * kCellSide + down;
        if (!those[static_cast<std::size_t>(cell)]) continue;
        const float* row = rows.data() + top * kPatternSide;
        alike += compare_rows(row + left, row + sum - 1 - left, -1).agrees() ? 1 : 0;
      }
    }
    if (alike > most) {
      most = alike;
      best = sum;
    }
  }
  return {upright, 0.5 * best / kPatternSide};
}

bool regular(const TrackedPattern& pattern) {
  const PatternSamples rows = rows_of(pattern, true);
  for (int shift = 2 * kCellSamples; shift < 2 * kMostShift; ++shift) {
    // To the side and down in turns.
    const int x = shift % 2 == 0 ? shift / 2 : 0;
    const int y = shift % 2 == 0 ? 0 : shift / 2;
    int textured = 0;
    int alike = 0;
    for (int top = 0; top + y + kCellSamples <= kPatternSide; top += kCellSamples) {
      for (int left = 0; left + x + kCellSamples <= kPatternSide; left += kCellSamples) {
        const float* own = &rows[static_cast<std::size_t>(top * kPatternSide + left)];
        const CellMatch match = compare_rows(own, own + y * kPatternSide + x, 1);
        textured += match.textured() ? 1 : 0;
        alike += match.agrees() ? 1 : 0;
      }
    }
    if (textured >= kLeastShifted && alike >= kRegularShare * textured) return true;
  }
  return false;
}

bool related(const TrackedPattern& a, const TrackedPattern& b) {
  constexpr double kSameShape = 0.03;  // share by which the ratio of the sides may differ
  const double ratio = 1.0 * a.width() * b.height() / (1.0 * a.height() * b.width());
  if (std::abs(ratio - 1.0) > kSameShape) return false;
  int textured = 0;
  int alike = 0;
  CellSamples one{};
  CellSamples other{};
  for (int cell = 0; cell < kCells; ++cell) {
    CellGrid::expect(a, cell, one);
    CellGrid::expect(b, cell, other);
    const CellMatch match = compare(one, other);
    textured += match.textured() ? 1 : 0;
    alike += match.agrees() ? 1 : 0;
  }
  return 4 * alike >= textured && alike > 0;
}

}  // namespace modar::tracker
