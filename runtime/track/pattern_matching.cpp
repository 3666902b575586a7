// Matches codes, lets every match vote for an affine map, fits homographies to the best votes; and
// the index over all patterns.
#include "pattern_matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <Eigen/Core>
#include <Eigen/LU>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {
namespace {

// Bits of the largest distance of a match. Higher adds steep and blurred views, and chance matches.
// [56, 88] tuned: pose
constexpr int kMaxDistance = 72;
// Bits of a code's first half up to which a block of codes is compared in full. Higher finds more
// matches and takes time. [36, 52] tuned: pose
constexpr int kMaxHalfDistance = 44;
// Ratio test, percent of the second best: 90 after the study of detectors that this loop follows.
// Lower loses repeated texture, higher lets ambiguous matches through.
constexpr int kRatio = 90;
static_assert(kMaxDistance * 100 / kRatio < 128);  // what unambiguous() compares four at a time
// Pattern pixels within which the second best is the same point seen in another baked view.
constexpr double kSamePoint = 6.0;
// Votes that are fitted; those that lead to a hypothesis again are dropped. Bounds the time in
// clutter, where no vote leads anywhere.
constexpr int kMaxFits = 8;

glm::dvec2 place(const TrackerFeatureRecord& record) {
  return {record.x / 64.0 - 0.5, record.y / 64.0 - 0.5};
}

/// Similarity that normalises points to mean 0 and mean distance 1.
struct Scaling {
  glm::dvec2 mean{0.0};
  double scale = 1.0;
  [[nodiscard]] glm::dvec2 apply(glm::dvec2 p) const { return (p - mean) * scale; }
};

template <class Get>
Scaling scaling_of(std::span<const std::uint8_t> mask, Get&& get) {
  Scaling out;
  double count = 0.0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    out.mean += get(i);
    count += 1.0;
  }
  out.mean /= count;
  double distance = 0.0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] != 0) distance += glm::length(get(i) - out.mean);
  }
  out.scale = distance > 0.0 ? count / distance : 0.0;
  return out;
}

/// normal_to^-1 * h * normal_from.
glm::dmat3 unscaled(const glm::dmat3& h, const Scaling& from, const Scaling& to) {
  glm::dmat3 normal(1.0);
  normal[0][0] = normal[1][1] = from.scale;
  normal[2] = {-from.mean * from.scale, 1.0};
  glm::dmat3 back(1.0);
  back[0][0] = back[1][1] = 1.0 / to.scale;
  back[2] = {to.mean, 1.0};
  return back * h * normal;
}

}  // namespace

FeatureMatch match_of(const TrackerFeatureRecord& record, const TrackerFeature& feature) {
  FeatureMatch match;
  match.pattern = place(record);
  match.ideal = {static_cast<double>(feature.x), static_cast<double>(feature.y)};
  match.sigma = static_cast<double>(1 << feature.level);
  // From the oriented patch to the frame: rotate by the feature's angle, scale by its level.
  const double c = static_cast<double>(feature.cosine) * match.sigma / 4096.0;
  const double s = static_cast<double>(feature.sine) * match.sigma / 4096.0;
  const std::int16_t* w = record.warp;
  match.affine[0] = {c * w[0] - s * w[2], s * w[0] + c * w[2]};
  match.affine[1] = {c * w[1] - s * w[3], s * w[1] + c * w[3]};
  return match;
}

namespace {

/// Whether two maps differ by less than 0.6 of the first one's norm.
bool alike(const glm::dmat2& a, const glm::dmat2& b) {
  const glm::dmat2 gap = b - a;
  const double size = glm::dot(a[0], a[0]) + glm::dot(a[1], a[1]);
  return glm::dot(gap[0], gap[0]) + glm::dot(gap[1], gap[1]) < 0.36 * size;
}

}  // namespace

bool agrees(const FeatureMatch& hypothesis, const FeatureMatch& other) {
  const glm::dmat2& a = hypothesis.affine;
  if (!alike(a, other.affine)) return false;  // rules most out
  const glm::dvec2 away = a * (other.pattern - hypothesis.pattern);
  const glm::dvec2 miss = away + hypothesis.ideal - other.ideal;
  // Four pixels of the feature's level, and a quarter of the way for what orientation and scale of
  // one feature are off by, perspective included; in shape 0.6 of the map's norm. The
  // fit that follows sorts out what they let in. Swept on area 0.02-0.05: 54.2, 56.7 and 57.5 %
  // right with 2, 4 and 8 pixels. (a + b)^2 <= 2 a^2 + 2 b^2 rules others out without a root.
  const double missed = glm::dot(miss, miss);
  const double way = glm::dot(away, away);
  const double near = 4.0 * other.sigma;
  if (!(missed < 2.0 * near * near + 0.125 * way)) return false;
  const double limit = near + 0.25 * std::sqrt(way);
  return missed < limit * limit;
}

[[gnu::cold]] PlaneMatcher::PlaneMatcher(const Camera& camera, const Kernels& kernels,
                                         std::size_t max_features, std::size_t max_codes)
    : camera_(camera), kernels_(kernels), distances_(max_codes + kSlack) {
  for (HomographyHypothesis& one : hypotheses_) one.mask.reserve(max_features);
  matches_.reserve(max_features);
  mask_.reserve(max_features);
  explained_.reserve(max_features);
  supporters_.reserve(max_features);
  order_.reserve(max_features);
  inlier_world_.reserve(max_features);
  inlier_ideal_.reserve(max_features);
  inlier_sigma_.reserve(max_features);
}

/// Lowe's ratio test, where a second best at the same point of the pattern (from another view) is
/// no rival. at: index of the best.
bool PlaneMatcher::unambiguous(const TrackedPattern& pattern, std::size_t first, std::size_t count,
                               int best, std::size_t& at) const {
  const auto limit = static_cast<std::uint8_t>(best * 100 / kRatio);
  const auto* nearest =
      static_cast<const std::uint8_t*>(std::memchr(distances_.data(), best, count));
  at = static_cast<std::size_t>(nearest - distances_.data());
  const glm::dvec2 here = place(pattern.features[first + at]);
  // Most blocks hold no code that near: four bytes are compared at a time. A byte below n <= 128
  // leaves a top bit in (word - n in each byte) & ~word.
  const std::uint32_t below = 0x01010101u * (limit + 1u);
  for (std::size_t block = 0; block < count; block += kBlockCodes) {
    const std::uint8_t* distances = distances_.data() + block;
    std::uint32_t any = 0;
    for (std::size_t i = 0; i < kBlockCodes; i += sizeof any) {
      std::uint32_t four = 0;
      std::memcpy(&four, distances + i, sizeof four);
      any |= (four - below) & ~four;
    }
    if ((any & 0x80808080u) == 0) continue;
    for (std::size_t i = 0; i < kBlockCodes; ++i) {
      if (distances[i] > limit) continue;
      if (glm::length(place(pattern.features[first + block + i]) - here) > kSamePoint) return false;
    }
  }
  at += first;
  return true;
}

bool PlaneMatcher::match(const TrackedPattern& pattern, std::span<const TrackerFeature> features,
                         std::size_t count, std::size_t end, std::size_t& next,
                         std::int64_t& work) {
  constexpr std::int64_t kCodeCost = 10;  // instructions, as scripts/foreign.sh counts them
  constexpr std::int64_t kFeatureCost = 1000;
  if (next == 0) matches_.clear();
  const Camera* lens = camera_.distortion == std::array<double, 5>{} ? nullptr : &camera_;
  const std::size_t half = (count + 1) / 2;
  for (; next < end; ++next) {
    if (work <= 0) return false;
    const std::size_t in_order = next < half ? 2 * next : 2 * (next - half) + 1;
    const TrackerFeature& feature = features[next < count ? in_order : next];
    const std::size_t first = feature.dark != 0 ? pattern.bright_count : 0;
    const std::size_t last = feature.dark != 0 ? pattern.features.size() : pattern.bright_count;
    if (first == last) continue;
    work -= kFeatureCost + kCodeCost * static_cast<std::int64_t>(last - first);
    const int best =
        kernels_.distances(feature.code.data(), pattern.codes + first * kCodeBytes,
                           (last - first) / kBlockCodes, kMaxHalfDistance, distances_.data());
    std::size_t at = 0;
    if (best > kMaxDistance || !unambiguous(pattern, first, last - first, best, at)) continue;
    FeatureMatch& match = matches_.emplace_back(match_of(pattern.features[at], feature));
    if (lens != nullptr) match.ideal = undistort(*lens, match.ideal);
    match.distance = best;
  }
  return true;
}

/// Counts the matches that agree with one match's affine map.
std::size_t PlaneMatcher::support(const FeatureMatch& hypothesis,
                                  std::vector<std::uint8_t>* mask) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    const bool one = agrees(hypothesis, matches_[i]);
    count += one ? 1 : 0;
    if (mask != nullptr) (*mask)[i] = one ? 1 : 0;
  }
  return count;
}

std::size_t PlaneMatcher::collect(const glm::dmat3& homography, double pixels,
                                  std::vector<std::uint8_t>& mask) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    const glm::dvec3 p = homography * glm::dvec3(matches_[i].pattern, 1.0);
    const glm::dvec2 miss = glm::dvec2(p) / p.z - matches_[i].ideal;
    const double limit = pixels * matches_[i].sigma;
    mask[i] = p.z > 0.0 && glm::dot(miss, miss) < limit * limit ? 1 : 0;
    count += mask[i];
  }
  return count;
}

bool PlaneMatcher::fit_affine(std::span<const std::uint8_t> mask, glm::dmat3& homography) const {
  const Scaling from = scaling_of(mask, [&](std::size_t i) { return matches_[i].pattern; });
  const Scaling to = scaling_of(mask, [&](std::size_t i) { return matches_[i].ideal; });
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d right = Eigen::Matrix2d::Zero();
  // The scaling's means are unweighted; these are weighted.
  double weights = 0.0;
  Eigen::Vector2d mean_p = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_q = Eigen::Vector2d::Zero();
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t i = 0; i < mask.size(); ++i) {
      if (mask[i] == 0) continue;
      const double w = 1.0 / (matches_[i].sigma * matches_[i].sigma);
      const glm::dvec2 p = from.apply(matches_[i].pattern);
      const glm::dvec2 q = to.apply(matches_[i].ideal);
      if (pass == 0) {
        weights += w;
        mean_p += w * Eigen::Vector2d(p.x, p.y);
        mean_q += w * Eigen::Vector2d(q.x, q.y);
      } else {
        const Eigen::Vector2d dp = Eigen::Vector2d(p.x, p.y) - mean_p;
        const Eigen::Vector2d dq = Eigen::Vector2d(q.x, q.y) - mean_q;
        normal += w * dp * dp.transpose();
        right += w * dq * dp.transpose();
      }
    }
    if (pass == 0) {
      mean_p /= weights;
      mean_q /= weights;
    }
  }
  const double determinant = normal.determinant();
  if (!(determinant > 1e-9 * normal.trace() * normal.trace())) return false;
  Eigen::Matrix2d inverse;
  inverse << normal(1, 1), -normal(0, 1), -normal(1, 0), normal(0, 0);
  const Eigen::Matrix2d a = right * inverse / determinant;
  const Eigen::Vector2d b = mean_q - a * mean_p;
  glm::dmat3 h(1.0);
  h[0] = {a(0, 0), a(1, 0), 0.0};
  h[1] = {a(0, 1), a(1, 1), 0.0};
  h[2] = {b(0), b(1), 1.0};
  homography = unscaled(h, from, to);
  return true;
}

bool PlaneMatcher::fit_homography(std::span<const std::uint8_t> mask,
                                  glm::dmat3& homography) const {
  using Unknowns = Eigen::Matrix<double, 8, 1>;
  const Scaling from = scaling_of(mask, [&](std::size_t i) { return matches_[i].pattern; });
  const Scaling to = scaling_of(mask, [&](std::size_t i) { return matches_[i].ideal; });
  if (!(from.scale > 0.0) || !(to.scale > 0.0)) return false;
  // The normal equations of rows (p 0 -qx p) and (0 p -qy p), written out: most of them is 0.
  double pp[6] = {};      // of p p^T: xx, xy, x, yy, y, 1
  double qpp[3][6] = {};  // the same, times qx, qy and qx^2 + qy^2
  const auto add = [](double(&sums)[6], double w, glm::dvec2 p) {
    const double wx = w * p.x;
    const double wy = w * p.y;
    sums[0] += wx * p.x;
    sums[1] += wx * p.y;
    sums[2] += wx;
    sums[3] += wy * p.y;
    sums[4] += wy;
    sums[5] += w;
  };
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    const glm::dvec2 p = from.apply(matches_[i].pattern);
    const glm::dvec2 q = to.apply(matches_[i].ideal);
    // Divided by the depth under the current map, the algebraic error is the geometric one.
    const double depth = (homography * glm::dvec3(matches_[i].pattern, 1.0)).z;
    const double w = 1.0 / (matches_[i].sigma * matches_[i].sigma * depth * depth);
    add(pp, w, p);
    add(qpp[0], w * q.x, p);
    add(qpp[1], w * q.y, p);
    add(qpp[2], w * (q.x * q.x + q.y * q.y), p);
  }
  // The lower triangle, which is all that the solver reads.
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  Unknowns right = Unknowns::Zero();
  constexpr int kAt[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  for (int k = 0; k < 2; ++k) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column <= row; ++column) {
        normal(3 * k + row, 3 * k + column) = pp[kAt[row][column]];
      }
      right(3 * k + row) = qpp[k][kAt[row][2]];
      for (int of = 0; of < 2; ++of) normal(6 + of, 3 * k + row) = -qpp[k][kAt[row][of]];
    }
    for (int column = 0; column <= k; ++column) normal(6 + k, 6 + column) = qpp[2][kAt[k][column]];
    right(6 + k) = -qpp[2][kAt[k][2]];
  }
  // A trace of damping keeps the perspective of few or crowded points near zero.
  normal(6, 6) += 1e-3 * normal(0, 0);
  normal(7, 7) += 1e-3 * normal(1, 1);
  const Unknowns h = solve_symmetric(normal, right);
  if (!h.allFinite()) return false;
  glm::dmat3 m;
  m[0] = {h(0), h(3), h(6)};
  m[1] = {h(1), h(4), h(7)};
  m[2] = {h(2), h(5), 1.0};
  m = unscaled(m, from, to);
  homography = m;
  return true;
}

/// From a vote to a homography: affine first, which few points determine, then projective, with
/// limits that shrink from what one feature predicts to 3 pixels of a feature's level, the noise of
/// a corner. Swept on area 0.02-0.05: flat with 0.7 to 1.4 times the sequence.
std::size_t PlaneMatcher::fit(const FeatureMatch& hypothesis, glm::dmat3& homography) {
  std::size_t count = support(hypothesis, &mask_);
  if (count < kMinMatches) return 0;
  if (!fit_affine(mask_, homography)) return 0;
  for (const double pixels : {16.0, 10.0}) {
    count = collect(homography, pixels, mask_);
    if (count < kMinMatches || !fit_affine(mask_, homography)) return 0;
  }
  for (const double pixels : {10.0, 6.0, 4.0, 3.0, 3.0}) {
    count = collect(homography, pixels, mask_);
    if (count < kMinMatches || !fit_homography(mask_, homography)) return 0;
  }
  return collect(homography, 3.0, mask_);
}

void PlaneMatcher::forget(const PlaneMap& map) {
  // Pixels of a feature's level by which a copy's features may be off it. Higher hides copies that
  // overlap it. Not swept.
  constexpr double kExplained = 12.0;
  std::erase_if(matches_, [&](const FeatureMatch& match) {
    bool in_front = false;
    const glm::dvec2 miss = map.at(match.pattern, in_front) - match.ideal;
    const double limit = kExplained * match.sigma;
    return in_front && glm::dot(miss, miss) < limit * limit;
  });
}

void PlaneMatcher::begin_vote(std::size_t most) {
  order_.clear();
  for (std::uint32_t i = 0; i < matches_.size(); ++i) order_.push_back(i);
  std::sort(order_.begin(), order_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return matches_[a].distance != matches_[b].distance
               ? matches_[a].distance < matches_[b].distance
               : a < b;
  });
  if (order_.size() > most) order_.resize(most);
  supporters_.assign(matches_.size(), 0);
  voted_ = 0;
}

bool PlaneMatcher::vote(std::int64_t& work) {
  constexpr std::int64_t kMatchCost = 70;  // instructions, as scripts/foreign.sh counts them
  for (; voted_ < order_.size(); ++voted_) {
    if (work <= 0) return false;
    work -= kMatchCost * static_cast<std::int64_t>(matches_.size());
    const std::size_t count = support(matches_[order_[voted_]], nullptr);
    supporters_[order_[voted_]] = static_cast<std::uint8_t>(std::min<std::size_t>(count, 255));
  }
  return true;
}

std::span<const HomographyHypothesis> PlaneMatcher::find(const TrackedPattern& pattern,
                                                         std::span<const TrackerFeature> features) {
  std::size_t next = 0;
  std::int64_t work = std::numeric_limits<std::int64_t>::max();
  match(pattern, features, features.size(), features.size(), next, work);
  begin_vote(kVotes);
  vote(work);
  return hypotheses();
}

std::span<const HomographyHypothesis> PlaneMatcher::hypotheses() {
  if (matches_.size() < kMinMatches) return {};
  mask_.assign(matches_.size(), 0);
  explained_.assign(matches_.size(), 0);
  std::size_t count = 0;
  for (int attempt = 0; attempt < kMaxFits && count < hypotheses_.size(); ++attempt) {
    std::uint32_t chosen = order_.front();
    int votes = -1;
    for (const std::uint32_t i : order_) {
      if (explained_[i] == 0 && supporters_[i] > votes) {
        votes = supporters_[i];
        chosen = i;
      }
    }
    if (votes < static_cast<int>(kMinMatches)) break;
    HomographyHypothesis& one = hypotheses_[count];
    one.inliers = static_cast<int>(fit(matches_[chosen], one.homography));
    one.mask.assign(mask_.begin(), mask_.end());
    explained_[chosen] = 1;
    int fresh = 0;
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      fresh += mask_[i] & ~explained_[i];
      explained_[i] |= mask_[i];
    }
    // Most votes that a hypothesis leaves over lead back to it: it needs a quarter of new inliers.
    if (4 * fresh < one.inliers || one.inliers == 0) continue;
    ++count;
    for (std::size_t i = count - 1; i > 0 && hypotheses_[i - 1].inliers < hypotheses_[i].inliers;
         --i) {
      std::swap(hypotheses_[i - 1], hypotheses_[i]);
    }
  }
  return std::span(hypotheses_).first(count);
}

const FeatureMatch* PlaneMatcher::strongest(int& votes) const {
  if (matches_.size() < kMinMatches) return nullptr;
  const auto fewer = [this](std::uint32_t a, std::uint32_t b) {
    return supporters_[a] < supporters_[b];
  };
  const auto best = std::max_element(order_.begin(), order_.end(), fewer);
  if (best == order_.end()) return nullptr;
  votes = supporters_[*best];
  return &matches_[*best];
}

int PlaneMatcher::beside(const HomographyHypothesis& one, double near, double far) const {
  const PlaneMap map{one.homography};
  int count = 0;
  for (std::size_t i = 0; i < one.mask.size(); ++i) {
    const FeatureMatch& match = matches_[i];
    bool in_front = false;
    const double miss = glm::length(map.at(match.pattern, in_front) - match.ideal);
    if (one.mask[i] != 0 || !in_front || !(miss >= near && miss < far)) continue;
    count += alike(map.derivative(match.pattern), match.affine) ? 1 : 0;
  }
  return count;
}

void PlaneMatcher::select(const TrackedPattern& pattern, const HomographyHypothesis& hypothesis) {
  inlier_world_.clear();
  inlier_ideal_.clear();
  inlier_sigma_.clear();
  for (std::size_t i = 0; i < hypothesis.mask.size(); ++i) {
    if (hypothesis.mask[i] == 0) continue;
    inlier_world_.push_back(pattern.on_surface(matches_[i].pattern));
    inlier_ideal_.push_back(matches_[i].ideal);
    inlier_sigma_.push_back(matches_[i].sigma);
  }
}

// ---- The index over all patterns ----

namespace {

// Codes of a pattern and polarity in the index at least. More find steep views and take memory and
// time.
constexpr std::size_t kLeastIndexed = 128;
// Codes of all patterns in the index, if that gives each more than the least; 3 MB.
constexpr std::size_t kIndexedInAll = 43008;
// Codes of a pattern and polarity in the index at most.
constexpr std::size_t kMostIndexed = 1536;
// Bits beyond which a code casts no vote; tighter than a match, since all patterns' codes compete.
// [48, 72] tuned: many
constexpr int kMaxVoteDistance = 60;
// Votes of a pattern that its other votes are compared with; with more, every n-th. Bounds the time
// of a pattern that takes all votes.
constexpr std::size_t kCompared = 64;
constexpr std::uint32_t kNone = ~0u;
constexpr unsigned kWordBits = 20;  // of a word's number, below its distance
constexpr int kNoLimit = 255;       // of Kernels::distances(): leaves nothing out
constexpr std::size_t kBlockBytes = std::size_t{kBlockCodes} * kCodeBytes;

using Code = CodeIndex::Code;

Code code_at(const std::uint8_t* blocks, std::size_t i) {
  const std::uint8_t* block = blocks + i / kBlockCodes * kBlockBytes + i % kBlockCodes;
  Code code;
  for (std::size_t k = 0; k < code.size(); ++k) code[k] = block[k * kBlockCodes];
  return code;
}

void put_code(const Code& code, std::size_t i, std::uint8_t* blocks) {
  std::uint8_t* block = blocks + i / kBlockCodes * kBlockBytes + i % kBlockCodes;
  for (std::size_t k = 0; k < code.size(); ++k) block[k * kBlockCodes] = code[k];
}

std::size_t position_of(std::span<const std::uint8_t> distances, int wanted) {
  const void* at = std::memchr(distances.data(), wanted, distances.size());
  return static_cast<std::size_t>(static_cast<const std::uint8_t*>(at) - distances.data());
}

/// Where a pattern's features of a polarity begin and end.
std::array<std::size_t, 2> range_of(const TrackedPattern& pattern, bool dark) {
  if (dark) return {pattern.bright_count, pattern.features.size()};
  return {0, pattern.bright_count};
}

}  // namespace

[[gnu::cold]] CodeIndex::CodeIndex(std::span<const TrackedPattern> patterns, const Kernels& kernels,
                                   std::size_t max_features)
    : patterns_(patterns),
      kernels_(kernels),
      votes_(max_features),
      last_(patterns.size()),
      support_(patterns.size()),
      indexed_(std::clamp(kIndexedInAll / std::max<std::size_t>(patterns.size(), 1), kLeastIndexed,
                          kMostIndexed)) {}

bool CodeIndex::build(std::int64_t& work) {
  constexpr std::int64_t kCodeCost = 10;   // instructions, as PlaneMatcher::match() counts them
  constexpr std::int64_t kCopyCost = 300;  // of a code
  for (; group_ < groups_.size(); ++group_) {
    Group& group = groups_[group_];
    if (codes_.empty()) {
      collect(group, group_ == 1);
      work -= kCopyCost * static_cast<std::int64_t>(codes_.size());
    }
    const std::size_t words = group.words.size() / kCodeBytes;
    while (nearest_.size() < codes_.size()) {
      if (work <= 0) return false;
      const int least = kernels_.distances(codes_[nearest_.size()].data(), group.words.data(),
                                           words / kBlockCodes, kNoLimit, distances_.data());
      nearest_.push_back(
          static_cast<std::uint32_t>(position_of({distances_.data(), words}, least)));
      work -= kCodeCost * static_cast<std::int64_t>(words);
    }
    if (!codes_.empty()) sort_into_words(group);
    codes_.clear();
    nearest_.clear();
  }
  codes_ = {};
  owners_ = {};
  nearest_ = {};
  return true;
}

std::size_t CodeIndex::compared() const {
  std::size_t most = 1;
  for (const Group& group : groups_) {
    if (group.starts.empty()) continue;
    const std::size_t words = group.starts.size() - 1;
    most = std::max(most, words + kProbes * group.owners.size() / words);
  }
  return most;
}

/// A group's codes and words.
[[gnu::cold]] void CodeIndex::collect(Group& group, bool dark) {
  owners_.clear();
  for (std::uint32_t p = 0; p < patterns_.size(); ++p) {
    const auto [first, last] = range_of(patterns_[p], dark);
    for (std::size_t i = first; i < std::min(last, first + indexed_); ++i) {
      codes_.push_back(code_at(patterns_[p].codes, i));
      owners_.push_back(p * static_cast<std::uint32_t>(indexed_) +
                        static_cast<std::uint32_t>(i - first));
    }
  }
  if (codes_.empty()) return;
  // The number of words for which comparing with them and with the codes of a few costs about the
  // same.
  const double balanced = std::sqrt(2.0 * static_cast<double>(codes_.size()));
  const std::size_t words = (static_cast<std::size_t>(balanced) / kBlockCodes + 1) * kBlockCodes;
  group.words.resize(words * kCodeBytes);
  for (std::size_t w = 0; w < words; ++w) {
    put_code(codes_[w * codes_.size() / words], w, group.words.data());
  }
  distances_.resize(std::max(distances_.size(), words + kSlack));
}

/// Fills a group's lists: whole blocks, padded with the last code.
[[gnu::cold]] void CodeIndex::sort_into_words(Group& group) {
  const std::size_t words = group.words.size() / kCodeBytes;
  std::vector<std::uint32_t> ends(words);  // of a word's codes so far; at first their number
  for (const std::uint32_t word : nearest_) ++ends[word];
  group.starts.assign(1, 0);
  for (std::uint32_t& end : ends) {
    const std::size_t blocks = (end + kBlockCodes - 1) / kBlockCodes;
    end = static_cast<std::uint32_t>(group.starts.back() * kBlockCodes);
    group.starts.push_back(static_cast<std::uint32_t>(group.starts.back() + blocks));
    distances_.resize(std::max(distances_.size(), blocks * kBlockCodes + kSlack));
  }
  group.codes.resize(group.starts.back() * kBlockCodes * kCodeBytes);
  group.owners.resize(group.starts.back() * kBlockCodes);
  const auto put = [&](const Code& code, std::uint32_t owner, std::size_t at) {
    put_code(code, at, group.codes.data());
    group.owners[at] = owner;
  };
  for (std::size_t i = 0; i < codes_.size(); ++i) put(codes_[i], owners_[i], ends[nearest_[i]]++);
  for (std::size_t w = 0; w < words; ++w) {
    const std::size_t end = group.starts[w + 1] * kBlockCodes;
    for (std::size_t at = ends[w]; at < end; ++at) {
      put(code_at(group.codes.data(), ends[w] - 1), group.owners[ends[w] - 1], at);
    }
  }
}

/// The nearest words that have codes, by distance and number, then kNone.
std::array<std::uint32_t, CodeIndex::kProbes> CodeIndex::nearest_words(const Group& group,
                                                                       const Code& code) {
  const std::size_t words = group.starts.size() - 1;
  kernels_.distances(code.data(), group.words.data(), words / kBlockCodes, kNoLimit,
                     distances_.data());
  std::array<std::uint32_t, kProbes> near;
  near.fill(kNone);
  for (std::uint32_t w = 0; w < words; ++w) {
    std::uint32_t key = std::uint32_t{distances_[w]} << kWordBits | w;
    if (key >= near.back() || group.starts[w] == group.starts[w + 1]) continue;
    for (std::uint32_t& other : near) {
      if (key < other) std::swap(key, other);
    }
  }
  return near;
}

/// The owner of the nearest code of the nearest words; kNone if none is near.
std::uint32_t CodeIndex::nearest_owner(const Group& group, const Code& code) {
  std::uint32_t owner = kNone;
  int best = kMaxVoteDistance + 1;
  for (const std::uint32_t key : nearest_words(group, code)) {
    if (key == kNone) break;
    const std::uint32_t word = key & ((1u << kWordBits) - 1);
    const std::size_t first = std::size_t{group.starts[word]} * kBlockCodes;
    const std::size_t blocks = group.starts[word + 1] - group.starts[word];
    const int least = kernels_.distances(code.data(), group.codes.data() + first * kCodeBytes,
                                         blocks, best, distances_.data());
    if (least >= best) continue;
    best = least;
    owner = group.owners[first + position_of({distances_.data(), blocks * kBlockCodes}, least)];
  }
  return owner;
}

/// The most votes of a pattern that agree on one place; last: its last vote.
CodeIndex::Support CodeIndex::largest_agreement(std::uint32_t last, std::size_t count) const {
  Support most;
  const std::size_t stride = count / kCompared + 1;
  std::size_t k = 0;
  for (std::uint32_t i = last; i != kNone; i = votes_[i].previous, ++k) {
    if (k % stride != 0) continue;
    std::uint16_t agree = 0;
    for (std::uint32_t j = last; j != kNone; j = votes_[j].previous) {
      if (agrees(votes_[i].match, votes_[j].match)) ++agree;
    }
    if (agree > most.votes) most = {agree, votes_[i].match};
  }
  if (most.votes > 2) fit_place(last, most.place);
  return most;
}

/// From the place of one vote to that of all that agree with it: the affine map of their places,
/// kept near that of the one where these are few or in a line.
void CodeIndex::fit_place(std::uint32_t last, FeatureMatch& place) const {
  constexpr double kOwn = 32.0 * 32.0;  // square pixels of the places that weigh as much as its own
  double count = 0.0;
  glm::dvec2 pattern{0.0};
  glm::dvec2 ideal{0.0};
  glm::dmat2 both(0.0);
  glm::dmat2 square(0.0);
  for (std::uint32_t i = last; i != kNone; i = votes_[i].previous) {
    const FeatureMatch& vote = votes_[i].match;
    if (!agrees(place, vote)) continue;
    count += 1.0;
    pattern += vote.pattern;
    ideal += vote.ideal;
    both += glm::outerProduct(vote.ideal, vote.pattern);
    square += glm::outerProduct(vote.pattern, vote.pattern);
  }
  pattern /= count;
  ideal /= count;
  both += kOwn * place.affine - count * glm::outerProduct(ideal, pattern);
  square += glm::dmat2(kOwn) - count * glm::outerProduct(pattern, pattern);
  place.affine = both * glm::inverse(square);
  place.pattern = pattern;
  place.ideal = ideal;
}

std::span<const CodeIndex::Support> CodeIndex::vote(std::span<const TrackerFeature> features,
                                                    std::size_t first, std::size_t every) {
  std::fill(support_.begin(), support_.end(), Support{});
  std::fill(last_.begin(), last_.end(), kNone);
  std::uint32_t count = 0;
  for (std::size_t i = first; i < features.size() && count < votes_.size(); i += every) {
    const TrackerFeature& feature = features[i];
    const bool dark = feature.dark != 0;
    const Group& group = groups_[dark ? 1 : 0];
    if (group.starts.empty()) continue;
    const std::uint32_t owner = nearest_owner(group, feature.code);
    if (owner == kNone) continue;
    const std::uint32_t p = owner / static_cast<std::uint32_t>(indexed_);
    const std::size_t at = range_of(patterns_[p], dark)[0] + owner % indexed_;
    votes_[count] = {last_[p], match_of(patterns_[p].features[at], feature)};
    last_[p] = count++;
    ++support_[p].votes;
  }
  for (std::size_t p = 0; p < support_.size(); ++p) {
    support_[p] = largest_agreement(last_[p], support_[p].votes);
  }
  return support_;
}

}  // namespace modar::tracker
