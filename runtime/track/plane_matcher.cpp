// Matches codes, lets every match vote for an affine map, and fits homographies to the best votes.
#include "plane_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <Eigen/Core>
#include <Eigen/LU>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "symmetric_solver.hpp"

namespace modar::tracker {
namespace {

constexpr int kMostBits = 72;       // a match is no further away
constexpr int kHalfBits = 44;       // of the first half of a code
constexpr int kRatio = 90;          // percent of the second best that lies elsewhere
constexpr double kElsewhere = 6.0;  // pattern pixels
constexpr std::size_t kHypotheses = 96;
constexpr std::size_t kFewest = 6;
constexpr int kAttempts = 8;  // votes that are followed up

glm::dvec2 place(const TrackerFeatureRecord& record) {
  return {record.x / 64.0 - 0.5, record.y / 64.0 - 0.5};
}

/// Similarity that brings points to mean 0 and a mean distance of 1.
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

PlaneMatch match_of(const TrackerFeatureRecord& record, const TrackerFeature& feature) {
  PlaneMatch match;
  match.pattern = place(record);
  match.ideal = {static_cast<double>(feature.x), static_cast<double>(feature.y)};
  match.sigma = static_cast<double>(1 << feature.level);
  // Back from the oriented patch to the frame: turn by the feature's angle, grow by its level.
  const double c = static_cast<double>(feature.cosine) * match.sigma / 4096.0;
  const double s = static_cast<double>(feature.sine) * match.sigma / 4096.0;
  const std::int16_t* w = record.warp;
  match.affine[0] = {c * w[0] - s * w[2], s * w[0] + c * w[2]};
  match.affine[1] = {c * w[1] - s * w[3], s * w[1] + c * w[3]};
  return match;
}

bool agrees(const PlaneMatch& hypothesis, const PlaneMatch& other) {
  const glm::dmat2& a = hypothesis.affine;
  const glm::dvec2 away = a * (other.pattern - hypothesis.pattern);
  const glm::dvec2 miss = away + hypothesis.ideal - other.ideal;
  const double reach = 4.0 * other.sigma + 0.25 * glm::length(away);
  if (!(glm::dot(miss, miss) < reach * reach)) return false;
  const glm::dmat2 gap = other.affine - a;
  const double size = glm::dot(a[0], a[0]) + glm::dot(a[1], a[1]);
  return glm::dot(gap[0], gap[0]) + glm::dot(gap[1], gap[1]) < 0.36 * size;
}

PlaneMatcher::PlaneMatcher(const Camera& camera, const Kernels& kernels, std::size_t most_features,
                           std::size_t most_codes)
    : camera_(camera), kernels_(kernels), distances_(most_codes + kSlack) {
  for (PlaneFind& find : finds_) find.mask.reserve(most_features);
  matches_.reserve(most_features);
  mask_.reserve(most_features);
  explained_.reserve(most_features);
  supporters_.reserve(most_features);
  order_.reserve(most_features);
  inlier_world_.reserve(most_features);
  inlier_ideal_.reserve(most_features);
  inlier_sigma_.reserve(most_features);
}

/// Lowe's ratio test, where a second best at the same place of the pattern (from another view) is
/// no rival. Answers the best one's index.
bool PlaneMatcher::unique(const TrackedPattern& pattern, std::size_t first, std::size_t count,
                          int best, std::size_t& at) const {
  const auto limit = static_cast<std::uint8_t>(best * 100 / kRatio);
  const auto* nearest =
      static_cast<const std::uint8_t*>(std::memchr(distances_.data(), best, count));
  at = static_cast<std::size_t>(nearest - distances_.data());
  const glm::dvec2 here = place(pattern.features[first + at]);
  // Few of a block's codes are that near, and most blocks hold none.
  for (std::size_t block = 0; block < count; block += kBlockCodes) {
    const std::uint8_t* distances = distances_.data() + block;
    unsigned any = 0;
    for (std::size_t i = 0; i < kBlockCodes; ++i) any |= distances[i] <= limit ? 1u : 0u;
    if (any == 0) continue;
    for (std::size_t i = 0; i < kBlockCodes; ++i) {
      if (distances[i] > limit) continue;
      if (glm::length(place(pattern.features[first + block + i]) - here) > kElsewhere) return false;
    }
  }
  at += first;
  return true;
}

void PlaneMatcher::match(const TrackedPattern& pattern, std::span<const TrackerFeature> features) {
  matches_.clear();
  const Camera* lens = camera_.distortion == std::array<double, 5>{} ? nullptr : &camera_;
  for (const TrackerFeature& feature : features) {
    const std::size_t first = feature.dark != 0 ? pattern.bright_count : 0;
    const std::size_t last = feature.dark != 0 ? pattern.features.size() : pattern.bright_count;
    if (first == last) continue;
    const int best = kernels_.distances(feature.code.data(), pattern.codes + first * kCodeBytes,
                                        (last - first) / kBlockCodes, kHalfBits, distances_.data());
    std::size_t at = 0;
    if (best > kMostBits || !unique(pattern, first, last - first, best, at)) continue;
    PlaneMatch& match = matches_.emplace_back(match_of(pattern.features[at], feature));
    if (lens != nullptr) match.ideal = undistort(*lens, match.ideal);
    match.distance = best;
  }
}

/// Matches that agree with one match's affine map in place and in shape.
std::size_t PlaneMatcher::support(const PlaneMatch& hypothesis,
                                  std::vector<std::uint8_t>* mask) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    const bool one = agrees(hypothesis, matches_[i]);
    count += one ? 1 : 0;
    if (mask != nullptr) (*mask)[i] = one ? 1 : 0;
  }
  return count;
}

std::size_t PlaneMatcher::collect(const glm::dmat3& homography, double reach,
                                  std::vector<std::uint8_t>& mask) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    const glm::dvec3 p = homography * glm::dvec3(matches_[i].pattern, 1.0);
    const glm::dvec2 miss = glm::dvec2(p) / p.z - matches_[i].ideal;
    const double limit = reach * matches_[i].sigma;
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
  // The weighted means are not quite those of the scaling; the offset takes that up.
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
  using Vector8 = Eigen::Matrix<double, 8, 1>;
  const Scaling from = scaling_of(mask, [&](std::size_t i) { return matches_[i].pattern; });
  const Scaling to = scaling_of(mask, [&](std::size_t i) { return matches_[i].ideal; });
  if (!(from.scale > 0.0) || !(to.scale > 0.0)) return false;
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  Vector8 right = Vector8::Zero();
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    const glm::dvec2 p = from.apply(matches_[i].pattern);
    const glm::dvec2 q = to.apply(matches_[i].ideal);
    // Divided by the depth of the map at hand, the algebraic error is the geometric one.
    const double depth = (homography * glm::dvec3(matches_[i].pattern, 1.0)).z;
    const double w = 1.0 / (matches_[i].sigma * matches_[i].sigma * depth * depth);
    Vector8 row_x;
    Vector8 row_y;
    row_x << p.x, p.y, 1, 0, 0, 0, -q.x * p.x, -q.x * p.y;
    row_y << 0, 0, 0, p.x, p.y, 1, -q.y * p.x, -q.y * p.y;
    normal += w * (row_x * row_x.transpose() + row_y * row_y.transpose());
    right += w * (q.x * row_x + q.y * row_y);
  }
  // A trace of damping keeps the perspective of few or crowded points near none.
  normal(6, 6) += 1e-3 * normal(0, 0);
  normal(7, 7) += 1e-3 * normal(1, 1);
  const Vector8 h = solve_symmetric(normal, right);
  if (!h.allFinite()) return false;
  glm::dmat3 m;
  m[0] = {h(0), h(3), h(6)};
  m[1] = {h(1), h(4), h(7)};
  m[2] = {h(2), h(5), 1.0};
  m = unscaled(m, from, to);
  homography = m;
  return true;
}

std::size_t PlaneMatcher::fit(const PlaneMatch& hypothesis, glm::dmat3& homography) {
  std::size_t count = support(hypothesis, &mask_);
  if (count < kFewest) return 0;
  if (!fit_affine(mask_, homography)) return 0;
  for (const double reach : {16.0, 10.0}) {
    count = collect(homography, reach, mask_);
    if (count < kFewest || !fit_affine(mask_, homography)) return 0;
  }
  for (const double reach : {10.0, 6.0, 4.0, 3.0, 3.0}) {
    count = collect(homography, reach, mask_);
    if (count < kFewest || !fit_homography(mask_, homography)) return 0;
  }
  return collect(homography, 3.0, mask_);
}

std::span<const PlaneFind> PlaneMatcher::find(const TrackedPattern& pattern,
                                              std::span<const TrackerFeature> features) {
  match(pattern, features);
  if (matches_.size() < kFewest) return {};
  mask_.assign(matches_.size(), 0);
  explained_.assign(matches_.size(), 0);
  supporters_.assign(matches_.size(), 0);
  order_.clear();
  for (std::uint32_t i = 0; i < matches_.size(); ++i) order_.push_back(i);
  std::sort(order_.begin(), order_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return matches_[a].distance != matches_[b].distance
               ? matches_[a].distance < matches_[b].distance
               : a < b;
  });
  if (order_.size() > kHypotheses) order_.resize(kHypotheses);
  for (const std::uint32_t i : order_) {
    supporters_[i] =
        static_cast<std::uint8_t>(std::min<std::size_t>(support(matches_[i], nullptr), 255));
  }
  std::size_t count = 0;
  for (int attempt = 0; attempt < kAttempts && count < finds_.size(); ++attempt) {
    std::uint32_t chosen = order_.front();
    int votes = -1;
    for (const std::uint32_t i : order_) {
      if (explained_[i] == 0 && supporters_[i] > votes) {
        votes = supporters_[i];
        chosen = i;
      }
    }
    if (votes < static_cast<int>(kFewest)) break;
    PlaneFind& find = finds_[count];
    find.inliers = static_cast<int>(fit(matches_[chosen], find.homography));
    find.mask.assign(mask_.begin(), mask_.end());
    explained_[chosen] = 1;
    int fresh = 0;
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      fresh += mask_[i] & ~explained_[i];
      explained_[i] |= mask_[i];
    }
    // Most votes left over by a find lead back to it.
    if (4 * fresh < find.inliers || find.inliers == 0) continue;
    ++count;
    for (std::size_t i = count - 1; i > 0 && finds_[i - 1].inliers < finds_[i].inliers; --i) {
      std::swap(finds_[i - 1], finds_[i]);
    }
  }
  return std::span(finds_).first(count);
}

void PlaneMatcher::choose(const TrackedPattern& pattern, const PlaneFind& find) {
  inlier_world_.clear();
  inlier_ideal_.clear();
  inlier_sigma_.clear();
  for (std::size_t i = 0; i < find.mask.size(); ++i) {
    if (find.mask[i] == 0) continue;
    inlier_world_.push_back(pattern.to_world(matches_[i].pattern));
    inlier_ideal_.push_back(matches_[i].ideal);
    inlier_sigma_.push_back(matches_[i].sigma);
  }
}

}  // namespace modar::tracker
