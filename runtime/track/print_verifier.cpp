// Evidence from cells, mirror images, other patterns in the same place, and curved paper.
#include "print_verifier.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {
namespace {

// Cells compared per frame; all of them within 16 frames.
constexpr int kCellsOfFrame = 4;
constexpr std::uint32_t kCellStride = 23;  // spreads them; coprime to their number
// Frames between measurements of a bend, and of the details of what agrees at large only.
constexpr std::uint32_t kVerifyEvery = 16;
// Variance above which the frame's contents of a cell count as textured.
constexpr float kShownContrast = 9.0f;
// Cells with printed evidence from which it is another print. Lower hides true prints, higher shows
// other ones.
constexpr int kOtherCells = 6;
// The same as a share (1 / n) of the textured cells in view.
constexpr int kOtherShare = 8;
// Share (1 / n) of differing cells below which it is the pattern again.
constexpr int kAgainShare = 10;
// Details compared per frame. More detect another print sooner; all are compared within 32 frames.
constexpr int kDetailsOfFrame = 8;
// Printed differences from which it is another print. Lower hides true prints, higher shows other
// ones.
constexpr int kOtherDetails = 3;
// Printed differences below which it is the pattern again.
constexpr int kAgainDetails = 2;
// Margin in cells by which a mirror image, or another pattern, must agree better.
constexpr int kFlippedCells = 4;
constexpr double kSureShare = 0.6;  // share of agreeing textured cells that refutes a mirror image
constexpr double kItselfShare = 0.94;       // from here on fewer than kFlippedCells disagree
constexpr double kTriedMirrorShare = 0.75;  // no mirror image left a larger share in agreement
constexpr int kActualCells = 3;
// Relative drop of a cell's correlation, stored in percent, that counts as a change. Higher finds
// slips later, lower rejects true poses.
constexpr float kSlippedLikeness = 0.85f * 0.01f;
// Share (1 / n) of the agreeing cells that must have changed for a slipped pose.
constexpr int kSlippedShare = 4;
// Frame pixels by which curvature moves the corners of a print that counts as curved. Lower rejects
// flat prints, higher shows bent ones flat.
constexpr double kBentPixels = 5.0;
// The same for a map, since a wrong focal length looks like curvature.
constexpr double kMapBentPixels = 10.0;
// Share of textured cells that the map must explain to be judged by the smaller limit.
constexpr double kFlatMapShare = 0.9;

// Fraction of matching cells below which cells must also look like the print. Lower: false finds in
// clutter; higher: covered prints lost. [0.5, 0.7] tuned: clutter
constexpr double kPlainShare = 0.6;
// Likeness added per agreeing neighbour of a cell. Higher favours coherent parts, as occluders
// leave them.
constexpr double kNeighbour = 0.04;
// Mean likeness that the agreeing cells need. Lower confuses regular prints, higher loses covered
// ones.
constexpr double kOwnLook = 0.855;
// Likeness that few cells need in addition. Lower accepts chance, higher loses covered prints.
constexpr double kFewCellsPenalty = 1.0;
// Cells below which they are few. True prints showed more.
constexpr int kManyCells = 11;

// Mean correlation that a regular print's details need. Lower accepts grids of equal pitch, higher
// loses half-covered prints.
constexpr double kDetailLike = 0.78;
// Correlation by which the details may be below their cells'. Higher accepts other grids, lower
// loses true prints.
constexpr double kDetailLoss = 0.05;
// Share of agreeing cells from which details are compared.
constexpr double kMostCovered = 0.4;

constexpr std::uint8_t kForFlip[2] = {1, 2};
constexpr std::uint8_t kAgainstFlip[2] = {4, 8};

PlaneMap map_of_track(const TrackedPattern& pattern, const FrameView& frame, const Track& track) {
  return track.homography_only ? track.map : map_of_pose(pattern, frame.camera, track.pose);
}

/// From the pattern's centre to the camera, in the pattern's axes.
glm::vec3 direction_of(const Pose& pose) {
  return glm::vec3(glm::normalize(-(glm::transpose(pose.rotation) * pose.translation)));
}

}  // namespace

[[gnu::cold]] PrintVerifier::PrintVerifier(std::span<const TrackedPattern> patterns,
                                           bool known_camera)
    : patterns_(patterns),
      prints_(count_of_prints(patterns)),
      known_camera_(known_camera),
      evidence_(patterns.size()),
      regular_(patterns.size()),
      relations_(prints_ * prints_),
      mirrors_(patterns.size(), {Mirror{true}, Mirror{false}}) {
  for (std::size_t i = 0; prints_ < kMany && i < patterns.size(); ++i) is_regular(i);
}

bool PrintVerifier::is_regular(std::size_t pattern) {
  std::optional<bool>& known = regular_[pattern];
  const TrackedPattern& print = patterns_[pattern];
  if (!known) known = print.surface.flat() && regular(print);
  return *known;
}

/// kFlip bits of a cell. If the mirror image of the cell is inside the outline, pattern and mirror
/// image are both compared with the frame; otherwise each is tested where the other has no
/// contents.
std::uint8_t PrintVerifier::flips_of(std::size_t pattern, const CellGrid& grid, int at) const {
  const TrackedPattern& print = patterns_[pattern];
  CellSamples seen{};
  CellSamples expected{};
  CellGrid::expect(print, at, expected, nullptr, grid.spread(at));
  const bool there = grid.see(at, seen);
  const CellMatch match = there ? compare(expected, seen) : CellMatch{};
  std::uint8_t flips = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const Mirror& mirror = mirrors_[pattern][k];
    CellMatch other;
    if (mirror.keeps(at)) {
      if (!there) continue;
      CellSamples swapped{};
      CellGrid::expect(print, at, swapped, &mirror, grid.spread(at));
      other = compare(swapped, seen);
      if (other.agrees() && match.disagrees()) flips |= kForFlip[k];
    } else {
      CellSamples beside{};
      if (grid.see(at, beside, &mirror) && compare(expected, beside).agrees()) {
        flips |= kForFlip[k];
      }
    }
    if (match.agrees() && other.disagrees()) flips |= kAgainstFlip[k];
  }
  return flips;
}

void PrintVerifier::update(std::size_t pattern, const CellGrid& grid, const glm::vec3& from, int at,
                           Cell& cell) const {
  CellSamples expected{};
  CellSamples seen{};
  CellGrid::expect(patterns_[pattern], at, expected, nullptr, grid.spread(at));
  if (!grid.see(at, seen)) {
    cell = {};
    return;
  }
  const CellMatch match = compare(expected, seen);
  if (!match.textured()) {
    cell.state = CellState::kUnseen;
    return;
  }
  cell.likeness = static_cast<std::uint8_t>(100.0f * std::max(0.0f, match.correlation));
  if (!match.disagrees() || match.seen_contrast < kShownContrast) {
    cell.state = match.agrees() ? CellState::kAgrees : CellState::kDoubtful;
    return;
  }
  const bool before = cell.state == CellState::kDiffers || cell.state == CellState::kPrinted;
  CellSamples shown{};
  std::copy(cell.shown.begin(), cell.shown.end(), shown.begin());
  const float alike = before ? compare(shown, seen).correlation : 0.0f;
  if (alike < kChanged) {
    cell.state = CellState::kDiffers;
    cell.from = from;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      cell.shown[k] = static_cast<std::uint8_t>(seen[k] + 0.5f);
    }
  } else if (alike >= kSamePrint && glm::dot(cell.from, from) < kElsewhere) {
    cell.state = CellState::kPrinted;
  }
}

bool PrintVerifier::has_slipped(std::size_t pattern, const FrameView& frame,
                                const Track& track) const {
  const TrackedPattern& print = patterns_[pattern];
  const PlaneMap map = map_of_track(print, frame, track);
  const CellGrid grid(print, map, frame.pyramid);
  CellSamples expected{};
  CellSamples seen{};
  int agreeing = 0;
  int less = 0;
  for (int at = 0; at < kCells; ++at) {
    const Cell& before = evidence_[pattern].cells[static_cast<std::size_t>(at)];
    if (before.state != CellState::kAgrees || !grid.see(at, seen)) continue;
    CellGrid::expect(print, at, expected, nullptr, grid.spread(at));
    const CellMatch match = compare(expected, seen);
    if (!match.agrees()) continue;
    ++agreeing;
    less += match.correlation < kSlippedLikeness * static_cast<float>(before.likeness) ? 1 : 0;
  }
  return less * kSlippedShare >= agreeing && less > 0;
}

void PrintVerifier::look(std::size_t pattern, const FrameView& frame, const Track& track,
                         int count) {
  const TrackedPattern& print = patterns_[pattern];
  Evidence& seen = evidence_[pattern];
  const PlaneMap map = map_of_track(print, frame, track);
  const CellGrid grid(print, map, frame.pyramid);
  const glm::vec3 from = direction_of(track.pose);
  for (int k = 0; k < count; ++k, ++seen.next_cell) {
    const std::uint32_t at = seen.next_cell * kCellStride % kCells;
    update(pattern, grid, from, static_cast<int>(at), seen.cells[at]);
  }
  const bool all = count == kCells && is_regular(pattern);
  seen.details.look(print, map, frame.pyramid, from,
                    all ? PrintDetails::kDetailCells : kDetailsOfFrame, all);
  if (all) seen.at_large = lacks_detail(seen);
}

/// The same of mirror images, of the cells that were looked at last.
void PrintVerifier::look_for_mirrors(std::size_t pattern, const FrameView& frame,
                                     const Track& track, int count) {
  Evidence& seen = evidence_[pattern];
  const PlaneMap map = map_of_track(patterns_[pattern], frame, track);
  const CellGrid grid(patterns_[pattern], map, frame.pyramid);
  for (int k = 1; k <= count; ++k) {
    const std::uint32_t at =
        (seen.next_cell + kCells - static_cast<std::uint32_t>(k)) * kCellStride % kCells;
    seen.cells[at].flips = flips_of(pattern, grid, static_cast<int>(at));
  }
}

/// Whether a mirror image, fitted as the pattern was, agrees with more of the frame.
bool PrintVerifier::fits_mirrored(std::size_t pattern, const FrameView& frame,
                                  const Track& track) const {
  const TrackedPattern& print = patterns_[pattern];
  if (!print.surface.flat()) return false;
  const PlaneMap map = map_of_track(print, frame, track);
  const int own = check_photometry(print, map, frame.pyramid).matching;
  for (const Mirror& mirror : mirrors_[pattern]) {
    PlaneMap mirrored = map;
    mirrored.homography *= mirror.pixels_of(print);
    PatchFit fit;
    if (!refine_map(print, frame, mirrored, fit, SearchRadius::kFar)) continue;
    if (check_photometry(print, mirrored, frame.pyramid).matching >= own + kFlippedCells) {
      return true;
    }
  }
  return false;
}

/// A search finds a mirror image where a part of the pattern is its own one: the mirror is where
/// most of the agreeing cells are alike.
void PrintVerifier::place_mirrors(std::size_t pattern) {
  std::array<bool, kCells> agreeing{};
  for (std::size_t at = 0; at < agreeing.size(); ++at) {
    agreeing[at] = evidence_[pattern].cells[at].state == CellState::kAgrees;
  }
  mirrors_[pattern] = {most_alike_mirror(patterns_[pattern], true, agreeing),
                       most_alike_mirror(patterns_[pattern], false, agreeing)};
}

double PrintVerifier::agreeing_share(const Evidence& seen) {
  int textured = 0;
  int agreeing = 0;
  for (const Cell& cell : seen.cells) {
    textured += cell.state != CellState::kUnseen ? 1 : 0;
    agreeing += cell.state == CellState::kAgrees ? 1 : 0;
  }
  return textured > 0 ? 1.0 * agreeing / textured : 0.0;
}

/// Whether the cells of a flat print that agree do so here and there, and roughly.
bool PrintVerifier::scattered(const Evidence& seen) {
  if (agreeing_share(seen) >= kPlainShare) return false;
  double likeness = 0;
  int agreeing = 0;
  int neighbours = 0;
  for (int at = 0; at < kCells; ++at) {
    const Cell& cell = seen.cells[static_cast<std::size_t>(at)];
    if (cell.state != CellState::kAgrees) continue;
    ++agreeing;
    likeness += 0.01 * cell.likeness;
    --neighbours;  // the loop below counts the cell itself
    for (int y = std::max(0, at / kCellSide - 1); y <= std::min(kCellSide - 1, at / kCellSide + 1);
         ++y) {
      for (int x = std::max(0, at % kCellSide - 1);
           x <= std::min(kCellSide - 1, at % kCellSide + 1); ++x) {
        const Cell& near = seen.cells[static_cast<std::size_t>(y * kCellSide + x)];
        neighbours += near.state == CellState::kAgrees ? 1 : 0;
      }
    }
  }
  return likeness + kNeighbour * neighbours <
         kOwnLook * agreeing + (agreeing < kManyCells ? kFewCellsPenalty : 0.0);
}

/// Whether the cells that agree do so at large only: after a look at all of a regular print.
bool PrintVerifier::lacks_detail(const Evidence& seen) {
  std::array<bool, kCells> those{};
  double likeness = 0;
  int agreeing = 0;
  for (std::size_t at = 0; at < those.size(); ++at) {
    those[at] = seen.cells[at].state == CellState::kAgrees;
    if (!those[at]) continue;
    ++agreeing;
    likeness += 0.01 * seen.cells[at].likeness;
  }
  return agreeing_share(seen) >= kMostCovered &&
         seen.details.likeness(those) * agreeing <
             std::max(kDetailLike * agreeing, likeness - kDetailLoss * agreeing);
}

void PrintVerifier::forget_mirrors(Evidence& seen) {
  for (Cell& cell : seen.cells) cell.flips = 0;
  seen.flipped = false;
}

/// at_once: one measurement decides; else two do, one after the other.
void PrintVerifier::measure(const TrackedPattern& print, const FrameView& frame, const Track& track,
                            bool at_once, Evidence& seen) const {
  if (!known_camera_ || !print.surface.flat()) return;
  const bool flat = track.homography_only && agreeing_share(seen) >= kFlatMapShare;
  const double least = track.homography_only ? kMapBentPixels : kBentPixels;
  const bool bent = !flat && bend_of(print, frame, track.pose, least) > 0.0;
  if (at_once || bent == seen.was_bent) seen.curved = bent;
  seen.was_bent = bent;
}

PrintVerifier::Verification PrintVerifier::conclude(const TrackedPattern& print, Evidence& seen) {
  int textured = 0;
  int printed = 0;
  int differing = 0;
  int likeness = 0;
  int for_flip[2] = {0, 0};
  for (const Cell& cell : seen.cells) {
    for (int k = 0; k < 2; ++k) {
      for_flip[k] += (cell.flips & kForFlip[k]) != 0 ? 1 : 0;
      for_flip[k] -= (cell.flips & kAgainstFlip[k]) != 0 ? 1 : 0;
    }
    if (cell.state == CellState::kUnseen) continue;
    ++textured;
    likeness += cell.likeness;
    printed += cell.state == CellState::kPrinted ? 1 : 0;
    differing += cell.state == CellState::kDiffers ? 1 : 0;
  }
  if (printed >= kOtherCells && printed * kOtherShare >= textured) seen.other_print = true;
  if ((printed + differing) * kAgainShare < textured) seen.other_print = false;
  const int details = seen.details.differences();
  if (details >= kOtherDetails) seen.other_details = true;
  if (details < kAgainDetails) seen.other_details = false;
  const double agreeing = agreeing_share(seen);
  const int most = std::max(for_flip[0], for_flip[1]);
  if (most >= kFlippedCells) seen.flipped = true;
  if (most <= -kFlippedCells && agreeing >= kSureShare) seen.flipped = false;
  Verification verification;
  if (print.surface.flat() && (scattered(seen) || seen.at_large)) {
    verification.reason = Reason::kFailedVerification;
  }
  if (seen.curved) verification.reason = Reason::kCurved;
  if (seen.other_print || seen.other_details || seen.flipped)
    verification.reason = Reason::kOtherPrint;
  if (textured > 0) {
    verification.agreeing = agreeing;
    verification.likeness = 0.01 * likeness / textured;
  }
  return verification;
}

bool PrintVerifier::related_to(std::size_t a, std::size_t b, int& work) {
  std::uint8_t& known = relations_[a * prints_ + b];
  if (known == 0) {
    known = related(patterns_[a], patterns_[b]) ? 2 : 1;
    --work;
  }
  return known == 2;
}

/// The pattern that the frame shows instead of this one, or -1. work: number of patterns to
/// compare.
std::int32_t PrintVerifier::find_actual_pattern(std::size_t pattern, const FrameView& frame,
                                                const Track& track, int work) {
  Evidence& seen = evidence_[pattern];
  const PlaneMap map = map_of_track(patterns_[pattern], frame, track);
  std::int32_t actual_pattern = -1;
  int most = kActualCells - 1;
  const std::size_t first = patterns_[pattern].first;
  for (std::size_t tried = 1; tried < prints_ && work > 0; ++tried) {
    const std::size_t other = seen.next_other++ % prints_;
    if (other == first || !related_to(first, other, work)) continue;
    --work;
    const PrintDifference difference =
        compare_prints(patterns_[pattern], patterns_[other], map, frame.pyramid);
    if (difference.second - difference.first <= most) continue;
    most = difference.second - difference.first;
    actual_pattern = static_cast<std::int32_t>(other);
  }
  return actual_pattern;
}

PrintVerifier::Verification PrintVerifier::verify_found(std::size_t pattern, const FrameView& frame,
                                                        const Track& track) {
  Evidence& seen = evidence_[pattern] = {};
  look(pattern, frame, track, kCells);
  if (agreeing_share(seen) < kItselfShare) {
    place_mirrors(pattern);
    look_for_mirrors(pattern, frame, track, kCells);
    if (agreeing_share(seen) < kTriedMirrorShare && fits_mirrored(pattern, frame, track)) {
      seen.flipped = true;
    }
  } else {
    forget_mirrors(seen);
  }
  measure(patterns_[pattern], frame, track, true, seen);
  Verification verification = conclude(patterns_[pattern], seen);
  verification.actual_pattern = find_actual_pattern(pattern, frame, track, 8);
  return verification;
}

PrintVerifier::Verification PrintVerifier::verify_tracked(std::size_t pattern,
                                                          const FrameView& frame,
                                                          const Track& track) {
  Evidence& seen = evidence_[pattern];
  const bool in_turn = seen.next_cell / kCellsOfFrame % kVerifyEvery == 0;
  look(pattern, frame, track, seen.at_large && in_turn ? kCells : kCellsOfFrame);
  if (agreeing_share(seen) < kItselfShare) {
    look_for_mirrors(pattern, frame, track, kCellsOfFrame);
  } else {
    forget_mirrors(seen);
  }
  if (seen.next_cell / kCellsOfFrame % kVerifyEvery == 0) {
    measure(patterns_[pattern], frame, track, false, seen);
  }
  Verification verification = conclude(patterns_[pattern], seen);
  verification.actual_pattern = find_actual_pattern(pattern, frame, track, 1);
  return verification;
}

}  // namespace modar::tracker
