// Sums over a coarse level of the frame, its strongest edges, and the place of a pattern in it.
#include "reason_evidence.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace modar::tracker {
namespace {

// Gray value from which a pixel of the coarse level is saturated.
constexpr int kSaturated = 250;
// Mean gray value below which a frame is too dark. Prints were found down to 18.
constexpr double kDark = 16;
// Share of saturated pixels from which a frame is overexposed. Lower takes bright walls for it.
constexpr double kOverexposed = 0.6;
// Ratio of the gradients of the strongest edges below which a frame is blurred. Higher takes soft
// photos for it.
constexpr double kBlurredEdges = 0.36;
// The same of a frame that lost a print in its middle.
constexpr double kLostEdges = 0.47;
// Gradient that noise adds to the finer ones.
constexpr double kNoiseEdge = 7;
// Votes from which a place tells anything, and those that a glare leaves.
constexpr int kPlaceVotes = 6;
constexpr int kGlareVotes = 4;
// Saturated share of a place from which glare hides it; half of it where more votes agree. Lower
// takes white paper for it.
constexpr double kGlare = 0.3;
constexpr int kSureVotes = 8;
// Saturated share of a frame that explains why a place failed its verification.
constexpr double kGlareInFrame = 0.08;
// Share of a place in the frame up to which it is at the edge.
constexpr double kEdgeInside = 0.5;
// The same of one that was seen a moment ago, below which it is out of view.
constexpr double kOutInside = 0.04;
// Factor per frame of the way of a place that was seen a moment ago. Higher loses what stops.
constexpr double kSlowing = 0.6;
// Side of a place, as a share of the frame's longer one, above which chance has found it.
constexpr double kLargest = 0.7;
// Side up to which a print that was seen a moment ago is too small.
constexpr double kSmall = 0.15;
// Pixels of the side of a place that is too small to be found. More takes chance for it.
constexpr double kSmallest = 12;
constexpr double kLargestSmall = 90;
// Votes that agree on one, and parts of the pattern that cast them. Lower takes chance for it.
constexpr int kSmallVotes = 15;
constexpr int kSmallParts = 6;
// Share of its side by which their corners differ at most.
constexpr double kSmallWay = 0.6;

/// The gradient that a hundredth of the pixels exceed, of some rows; down: to the row above.
int strongest_edge(const GrayImage& image, bool down) {
  constexpr int kRows = 48;
  std::array<int, 256> counts{};
  int left = 0;
  const std::ptrdiff_t back = down ? image.stride : 1;
  for (int y = 1; y < image.height; y += std::max(1, image.height / kRows)) {
    const std::uint8_t* row = image.pixels + y * image.stride;
    for (int x = 1; x < image.width; ++x) {
      ++counts[static_cast<std::size_t>(std::abs(row[x] - row[x - back]))];
    }
    left += image.width - 1;
  }
  left /= 100;
  int edge = 255;
  while (edge > 0 && (left -= counts[static_cast<std::size_t>(edge)]) >= 0) --edge;
  return edge;
}

double side_of(const LikelyPlace& place) {
  return std::sqrt(std::abs(place.right.x * place.down.y - place.right.y * place.down.x));
}

}  // namespace

void LikelyPlace::move() {
  corner += step;
  step *= kSlowing;
  ++frames;
}

LikelyPlace seen_at(const std::array<glm::dvec2, 4>& corners) {
  LikelyPlace place;
  place.corner = corners[0];
  place.right = corners[1] - corners[0];
  place.down = corners[3] - corners[0];
  place.votes = LikelyPlace::kSeen;
  return place;
}

LikelyPlace place_of(const TrackedPattern& pattern, const FeatureMatch& match) {
  LikelyPlace place;
  place.corner = match.ideal - match.affine * match.pattern;
  place.right = match.affine[0] * static_cast<double>(pattern.width());
  place.down = match.affine[1] * static_cast<double>(pattern.height());
  return place;
}

void SmallVotes::add(const TrackedPattern& pattern, std::span<const FeatureMatch> matches) {
  for (const FeatureMatch& match : matches) {
    const LikelyPlace place = place_of(pattern, match);
    const double side = side_of(place);
    if (!(side > kSmallest && side < kLargestSmall)) continue;
    const auto column = static_cast<int>(8 * match.pattern.x / pattern.width());
    const auto row = static_cast<int>(8 * match.pattern.y / pattern.height());
    votes_[count_++ % votes_.size()] = {place, pattern.index,
                                        std::uint64_t{1} << ((8 * row + column) & 63)};
  }
}

void SmallVotes::find(const TrackedPattern& pattern, LikelyPlace& place) const {
  constexpr std::size_t kTried = 64;
  const std::size_t known = std::min(count_, votes_.size());
  for (std::size_t i = 1; i <= std::min(kTried, known); ++i) {
    const Vote& one = votes_[(count_ - i) % votes_.size()];
    if (one.pattern != pattern.index) continue;
    const double far = kSmallWay * side_of(one.place);
    const auto near = [far](glm::dvec2 way) {
      return std::max(std::abs(way.x), std::abs(way.y)) < far;
    };
    int agreeing = 0;
    std::uint64_t parts = 0;
    for (const Vote& other : std::span(votes_).first(known)) {
      const glm::dvec2 way = other.place.corner - one.place.corner;
      if (!near(way) || !near(way + other.place.right - one.place.right) ||
          !near(way + other.place.down - one.place.down) || other.pattern != one.pattern) {
        continue;
      }
      ++agreeing;
      parts |= other.part;
    }
    if (agreeing < kSmallVotes || std::popcount(parts) < kSmallParts) continue;
    place = one.place;
    place.votes = LikelyPlace::kSeen;
    return;
  }
}

void look_at_frame(std::span<const GrayImage> pyramid, ReasonEvidence& evidence) {
  const GrayImage& coarse = pyramid[2];
  int sum = 0;
  int saturated = 0;
  for (int y = 0; y < coarse.height; ++y) {
    const std::uint8_t* row = coarse.pixels + y * coarse.stride;
    for (int x = 0; x < coarse.width; ++x) {
      sum += row[x];
      saturated += row[x] >= kSaturated ? 1 : 0;
    }
  }
  const double all = 1.0 * coarse.width * coarse.height;
  evidence.brightness = sum / all;
  evidence.saturated = saturated / all;
  for (const bool down : {false, true}) {
    const int edge = strongest_edge(pyramid[1], down);
    const int coarse_edge = strongest_edge(pyramid[3], down);
    if (down && edge * evidence.coarse_edge >= evidence.edge * coarse_edge) continue;
    evidence.edge = edge;
    evidence.coarse_edge = coarse_edge;
  }
}

void look_at_place(std::span<const GrayImage> pyramid, const LikelyPlace& place,
                   ReasonEvidence& evidence) {
  const GrayImage& frame = pyramid[0];
  const GrayImage& coarse = pyramid[2];
  constexpr int kSide = 12;
  evidence.votes = place.votes;
  evidence.side = side_of(place) / std::max(frame.width, frame.height);
  const double scale = 1.0 * coarse.width / frame.width;
  int inside = 0;
  int saturated = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double u = i % kSide + 0.5;
    const double v = static_cast<int>(i / kSide) + 0.5;
    const glm::dvec2 at =
        scale * (place.corner + (u / kSide) * place.right + (v / kSide) * place.down);
    if (!(at.x >= 0 && at.y >= 0 && at.x < coarse.width && at.y < coarse.height)) continue;
    ++inside;
    const std::uint8_t pixel =
        coarse.pixels[static_cast<int>(at.y) * coarse.stride + static_cast<int>(at.x)];
    saturated += pixel >= kSaturated ? 1 : 0;
  }
  evidence.inside = 1.0 * inside / (kSide * kSide);
  evidence.glare = 1.0 * saturated / std::max(inside, 1);
}

Reason reason_of(Reason own, const ReasonEvidence& evidence) {
  if (own == Reason::kVisible || own == Reason::kOtherPrint || own == Reason::kCurved) return own;
  if (evidence.brightness < kDark) return Reason::kTooDark;
  if (evidence.saturated > kOverexposed) return Reason::kOverexposed;
  const bool seen = evidence.votes == LikelyPlace::kSeen;
  if (own == Reason::kNoFeatures || (own == Reason::kOutOfView && !seen)) return own;
  // Features that agree on a pose, though a wrong one, show that a part is in view.
  const bool failed = own == Reason::kFailedVerification;
  if (seen && evidence.inside < kOutInside && !failed) return Reason::kOutOfView;
  const double glare = evidence.votes >= kSureVotes ? 0.5 * kGlare : kGlare;
  if (evidence.votes >= kGlareVotes && evidence.glare >= glare) return Reason::kGlare;
  const bool lost = seen && evidence.inside > kEdgeInside && evidence.side > kSmall;
  const double coarse = (lost ? kLostEdges : kBlurredEdges) * evidence.coarse_edge;
  if (coarse > kNoiseEdge &&
      evidence.edge * evidence.edge - kNoiseEdge * kNoiseEdge < coarse * coarse) {
    return seen ? Reason::kLostByBlur : Reason::kBlurred;
  }
  if (evidence.votes >= kPlaceVotes && evidence.inside <= kEdgeInside &&
      evidence.side <= kLargest) {
    return Reason::kAtTheEdge;
  }
  if (seen && evidence.side <= kSmall) return Reason::kTooSmall;
  return failed && evidence.saturated >= kGlareInFrame ? Reason::kGlare : own;
}

}  // namespace modar::tracker
