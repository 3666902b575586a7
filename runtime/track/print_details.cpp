// Printed differences, cell by cell.
#include "print_details.hpp"

#include <algorithm>
#include <bit>

#include <glm/geometric.hpp>

namespace modar::tracker {
namespace {

// Variance from which a cell has detail. Lower compares noise. Not swept.
constexpr float kDetailed = 200.0f;
// Correlation from which a detail agrees. Lower misses small differences, higher doubts true
// prints.
constexpr float kDetailAgrees = 0.8f;
// Variance below which the frame shows nothing in a cell with detail. Lower: a thumb on paper
// passes for blank.
constexpr float kBlank = 9.0f;
// Variance below which the frame shows only noise in a cell without detail.
constexpr float kPlainSeen = 40.0f;
// Factor by which a frame may be less sharp than its samples. Higher compares blurred details.
constexpr double kBlur = 2.0;
// Correlation of a cell with itself at that sharpness, below which its detail is too fine to
// compare. Lower confuses tables of figures.
constexpr float kCoarse = 0.9f;
// Number of looks that must have shown the same.
constexpr int kLooks = 3;
constexpr std::uint32_t kDetailStride = 97;  // spreads the cells; coprime to their number
// Printed cells from which all connected ones differ, too. Lower lets noise spread, higher misses
// letters of another title.
constexpr int kSurePrinted = 2;
// Cells with detail below which their mean says nothing.
constexpr int kLeastDetails = 12;

/// Border cells: whether the outer half shows the pattern, or nothing where the pattern shows
/// nothing: then what differs in the cell does not reach in from outside. True away from the edge,
/// false in a corner.
bool edge_agrees(int at, const CellSamples& expected, const CellSamples& seen) {
  const int x = at % PrintDetails::kDetailSide;
  const int y = at / PrintDetails::kDetailSide;
  const bool left = x == 0;
  const bool right = x == PrintDetails::kDetailSide - 1;
  const bool top = y == 0;
  const bool bottom = y == PrintDetails::kDetailSide - 1;
  const int sides = left + right + top + bottom;
  if (sides != 1) return sides == 0;
  // The inner half is a copy of the outer one, so that both count alike.
  constexpr int kLast = kCellSamples - 1;
  CellSamples outer_expected{};
  CellSamples outer_seen{};
  for (int v = 0; v < kCellSamples; ++v) {
    for (int u = 0; u < kCellSamples; ++u) {
      const int from_u = left ? std::min(u, kLast - u) : right ? std::max(u, kLast - u) : u;
      const int from_v = top ? std::min(v, kLast - v) : bottom ? std::max(v, kLast - v) : v;
      const auto to = static_cast<std::size_t>(v * kCellSamples + u);
      const auto source = static_cast<std::size_t>(from_v * kCellSamples + from_u);
      outer_expected[to] = expected[source];
      outer_seen[to] = seen[source];
    }
  }
  const CellMatch match = compare(outer_expected, outer_seen);
  return match.correlation >= kDetailAgrees ||
         (match.expected_contrast < kTexturedCell && match.seen_contrast < kPlainSeen);
}

/// The cell, among those of half the size, that is this quarter of a cell.
int quarter_of(int at, int quarter) {
  const int x = 2 * (at % PrintDetails::kDetailSide) + quarter % 2;
  const int y =
      2 * static_cast<int>(at / PrintDetails::kDetailSide) + static_cast<int>(quarter / 2);
  return y * 2 * PrintDetails::kDetailSide + x;
}

}  // namespace

void PrintDetails::update(Cell& cell, const CellMatch& match, bool coarse, const CellSamples& seen,
                          const glm::vec3& from) {
  if (match.correlation >= kDetailAgrees) {
    cell.state = CellState::kAgrees;
    return;
  }
  if (match.expected_contrast < kTexturedCell && match.seen_contrast < kPlainSeen) {
    cell.state = CellState::kPlain;
    return;
  }
  if (!coarse || match.expected_contrast < kDetailed || match.seen_contrast < kBlank) {
    cell.state = CellState::kForeign;
    return;
  }
  const bool before = cell.state == CellState::kDiffers || cell.state == CellState::kPrinted;
  CellSamples shown{};
  std::copy(cell.shown.begin(), cell.shown.end(), shown.begin());
  const float alike = before ? compare(shown, seen).correlation : 0.0f;
  if (alike < kChanged) {
    cell.state = CellState::kDiffers;
    cell.looks = 1;
    cell.from = from;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      cell.shown[k] = static_cast<std::uint8_t>(seen[k] + 0.5f);
    }
  } else if (alike >= kSamePrint) {
    cell.looks = static_cast<std::uint8_t>(std::min(cell.looks + 1, kLooks));
    if (cell.looks >= kLooks && glm::dot(cell.from, from) < kElsewhere)
      cell.state = CellState::kPrinted;
  }
}

/// Continues where the compared cells say no more; a cell agrees as its last quarter does.
void PrintDetails::next_quarter(Cell& cell) {
  if (cell.state == CellState::kDiffers || cell.state == CellState::kPrinted) return;
  const bool last = cell.quarter == 4;
  const bool done = cell.state == CellState::kAgrees || cell.state == CellState::kPlain;
  cell.state = last && done ? CellState::kAgrees : CellState::kForeign;
  cell.quarter = static_cast<std::uint8_t>(last ? 1 : cell.quarter + 1);
}

void PrintDetails::look(const TrackedPattern& print, const PlaneMap& map,
                        std::span<const GrayImage> pyramid, const glm::vec3& from, int count,
                        bool all) {
  if (!print.surface.flat()) return;
  const CellGrid whole(print, map, pyramid, kDetailSide);
  if (whole.spread_from(1.0) > 1.0) return;
  const CellGrid quarters(print, map, pyramid, 2 * kDetailSide);
  const bool closer = quarters.spread_from(1.0) <= 1.0;
  CellSamples expected{};
  CellSamples blurred{};
  CellSamples sharp{};
  CellSamples sharp_seen{};
  CellSamples seen{};
  for (int tried = 0; tried < kDetailCells && count > 0; ++tried, ++next_) {
    const std::uint32_t at = next_ * kDetailStride % kDetailCells;
    Cell& cell = cells_[at];
    const bool done = cell.state == CellState::kAgrees || cell.state == CellState::kPlain;
    if (done && !all) continue;
    const bool part = cell.quarter > 0 && !all;
    if (part && !closer) continue;
    --count;
    const int side = part ? 2 * kDetailSide : kDetailSide;
    const int which =
        part ? quarter_of(static_cast<int>(at), cell.quarter - 1) : static_cast<int>(at);
    const CellGrid& grid = part ? quarters : whole;
    if (!grid.see(which, seen, nullptr, 1.0)) continue;
    CellGrid::expect(print, which, expected, nullptr, 1.0, side);
    CellMatch match = compare(expected, seen);
    bool coarse = true;
    if (match.correlation < kDetailAgrees && match.expected_contrast >= kDetailed) {
      CellGrid::expect(print, which, blurred, nullptr, kBlur, side);
      match.correlation = std::max(match.correlation, compare(blurred, seen).correlation);
      coarse = compare(expected, blurred).correlation >= kCoarse;
    }
    if (match.correlation < kDetailAgrees) {  // where samples alias, sharper ones decide
      CellGrid::expect(print, which, sharp, nullptr, kFootprint, side);
      if (compare(expected, sharp).correlation < kAliased &&
          grid.see(which, sharp_seen, nullptr, kFootprint)) {
        match = compare(sharp, sharp_seen);
        seen = sharp_seen;
      }
    }
    if (!part && match.expected_contrast >= kDetailed) {
      cell.likeness = static_cast<std::uint8_t>(1.0f + 99.0f * std::max(0.0f, match.correlation));
    }
    if (all && (done || cell.quarter > 0)) continue;
    update(cell, match, coarse, seen, from);
    if (!part && cell.state != CellState::kAgrees && !cell.edge_agrees) {
      cell.edge_agrees = edge_agrees(static_cast<int>(at), expected, seen);
    }
    // At the print's edge the half there must agree before, or a quarter would let in all that is
    // connected with it.
    if (part || (!coarse && closer && cell.edge_agrees)) next_quarter(cell);
  }
}

double PrintDetails::likeness(const std::array<bool, kCells>& those) const {
  int sum = 0;
  int count = 0;
  for (std::size_t at = 0; at < cells_.size(); ++at) {
    const std::size_t cell = at / kDetailSide / 2 * kCellSide + at % kDetailSide / 2;
    if (!those[cell] || cells_[at].likeness == 0) continue;
    sum += cells_[at].likeness;
    ++count;
  }
  return count < kLeastDetails ? 1.0 : 0.01 * sum / count;
}

namespace {

using Rows = std::array<std::uint32_t, PrintDetails::kDetailSide>;  // of cells, as bits

/// Adds to `cells` those of `within` that are connected with them.
void grow(const Rows& within, Rows& cells) {
  for (bool grown = true; grown;) {
    grown = false;
    for (std::size_t y = 0; y < cells.size(); ++y) {
      std::uint32_t near = cells[y];
      if (y > 0) near |= cells[y - 1];
      if (y + 1 < cells.size()) near |= cells[y + 1];
      const std::uint32_t now = within[y] & (near | near << 1 | near >> 1);
      grown = grown || now != cells[y];
      cells[y] = now;
    }
  }
}

}  // namespace

int PrintDetails::differences() const {
  Rows open{};     // cells that do not agree,
  Rows reached{};  // those of them connected with the edge,
  Rows printed{};
  constexpr std::uint32_t kSides = 1u | 1u << (kDetailSide - 1);
  for (std::size_t y = 0; y < kDetailSide; ++y) {
    for (std::size_t x = 0; x < kDetailSide; ++x) {
      const Cell& cell = cells_[y * kDetailSide + x];
      const bool passes = cell.state != CellState::kAgrees && cell.state != CellState::kPlain;
      open[y] |= passes ? 1u << x : 0u;
      reached[y] |= passes && !cell.edge_agrees ? 1u << x : 0u;
      printed[y] |= cell.state == CellState::kPrinted ? 1u << x : 0u;
    }
    if (y > 0 && y < kDetailSide - 1) reached[y] &= kSides;
  }
  grow(open, reached);
  int count = 0;
  for (std::size_t y = 0; y < kDetailSide; ++y) {
    open[y] &= ~reached[y];
    printed[y] &= open[y];
  }
  for (std::size_t y = 0; y < kDetailSide; ++y) {
    while ((printed[y] & open[y]) != 0) {
      Rows part{};
      part[y] = printed[y] & open[y];
      part[y] &= ~part[y] + 1u;
      grow(open, part);
      int of_part = 0;
      int cells = 0;
      std::uint32_t at_edge = part.front() | part.back();
      for (std::size_t k = 0; k < kDetailSide; ++k) {
        of_part += std::popcount(printed[k] & part[k]);
        cells += std::popcount(part[k]);
        at_edge |= part[k] & kSides;
        open[k] &= ~part[k];
      }
      count += of_part >= kSurePrinted && at_edge == 0 ? cells : of_part;
    }
  }
  return count;
}

}  // namespace modar::tracker
