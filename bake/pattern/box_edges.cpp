#include "bake/pattern/box_edges.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/gray_mat.hpp"

namespace modar {
namespace {

// Samples along an edge. Looser limits than the following correct sides whose pictures are
// unrelated.
constexpr int kEdgeSamples = 200;
constexpr int kSlow = 20;  // samples to either side whose mean is taken off: shading is no print
// Shares of a picture at which its edge is read: the outermost pixels may show the background.
constexpr std::array<double, 4> kReadAt = {0.005, 0.02, 0.035, 0.05};
constexpr double kMaxCorrection = 0.03;  // share of a side by which an edge is moved
constexpr double kShiftStep = 0.005;     // shares that are tried, then refined by a quarter
constexpr int kShiftSteps = 14;          // to either side: two edges, both cut too far in or out
// Correlation, at the best shift, from which print runs over an edge.
constexpr double kEdgesAlike = 0.85;
constexpr double kLeastContrast = 30;  // variance
// Edges that must agree. One alone may agree by chance.
constexpr std::size_t kLeastEdges = 2;
constexpr double kContradicts = 0.012;  // share by which an edge may disagree with the others
// Weight of "nothing is off" against an edge, among shifts that agree.
constexpr double kNothingOff =
    0.02;  // weight of "nothing is off" next to an edge: among all that agree
constexpr double kMeets = 0.004;  // share below which nothing is corrected

using Profile = std::array<double, kEdgeSamples>;

/// An end of a side: left, top, right, bottom.
constexpr int kLeftEnd = 0;
constexpr int kTopEnd = 1;
constexpr int kRightEnd = 2;
constexpr int kBottomEnd = 3;

/// An edge that two sides share, read in the same direction.
struct SharedEdge {
  int side[2];
  int end[2];     ///< of the side, where the edge is
  bool reversed;  ///< for the second, from its right or its bottom
};

/// By the order front, right, back, left, top, bottom, seen from outside.
constexpr std::array<SharedEdge, 12> kEdges = {{{{0, 1}, {kRightEnd, kLeftEnd}, false},
                                                {{1, 2}, {kRightEnd, kLeftEnd}, false},
                                                {{2, 3}, {kRightEnd, kLeftEnd}, false},
                                                {{3, 0}, {kRightEnd, kLeftEnd}, false},
                                                {{0, 4}, {kTopEnd, kBottomEnd}, false},
                                                {{0, 5}, {kBottomEnd, kTopEnd}, false},
                                                {{2, 4}, {kTopEnd, kTopEnd}, true},
                                                {{2, 5}, {kBottomEnd, kBottomEnd}, true},
                                                {{1, 4}, {kTopEnd, kRightEnd}, true},
                                                {{1, 5}, {kBottomEnd, kRightEnd}, false},
                                                {{3, 4}, {kTopEnd, kLeftEnd}, false},
                                                {{3, 5}, {kBottomEnd, kLeftEnd}, true}}};

/// What a picture shows along one of its ends, from left to right or from top to bottom, without
/// what changes slowly.
Profile profile_of(const GrayPicture& picture, int end, double depth) {
  const bool upright = end == kLeftEnd || end == kRightEnd;
  const double across = end == kLeftEnd || end == kTopEnd ? depth : 1 - depth;
  const cv::Mat image = as_mat(picture.view());
  const int at = static_cast<int>(across * (upright ? image.cols : image.rows));
  const cv::Mat line = upright ? cv::Mat(image.col(at).t()) : image.row(at);
  cv::Mat wide;
  line.convertTo(wide, CV_32F);
  cv::Mat_<float> raw;
  cv::resize(wide, raw, {kEdgeSamples, 1}, 0, 0,
             line.cols > kEdgeSamples ? cv::INTER_AREA : cv::INTER_LINEAR);
  Profile out{};
  for (int i = 0; i < kEdgeSamples; ++i) {
    const int first = std::max(0, i - kSlow);
    const int last = std::min(kEdgeSamples, i + kSlow + 1);
    double sum = 0;
    for (int k = first; k < last; ++k) sum += static_cast<double>(raw(0, k));
    out[static_cast<std::size_t>(i)] = static_cast<double>(raw(0, i)) - sum / (last - first);
  }
  return out;
}

/// Correlation of a with b at i + shift, which goes from `start` to `finish`; 0 where too little is
/// left or either shows nothing.
double correlation(const Profile& a, const Profile& b, double start, double finish) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  int count = 0;
  for (int i = 0; i < kEdgeSamples; ++i) {
    const double t = (i + 0.5) / kEdgeSamples;
    const double at = (t + start * (1 - t) + finish * t) * kEdgeSamples - 0.5;
    const int k = static_cast<int>(std::floor(at));
    if (k < 0 || k + 1 >= kEdgeSamples) continue;
    const double share = at - k;
    const double y =
        b[static_cast<std::size_t>(k)] * (1 - share) + b[static_cast<std::size_t>(k) + 1] * share;
    const double x = a[static_cast<std::size_t>(i)];
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
    ++count;
  }
  if (count < kEdgeSamples * 3 / 4) return 0;
  const double va = saa / count - sa / count * sa / count;
  const double vb = sbb / count - sb / count * sb / count;
  if (va < kLeastContrast || vb < kLeastContrast) return 0;
  return (sab / count - sa / count * sb / count) / std::sqrt(va * vb);
}

/// Shares by which the second picture's edge is off from the first's, at its start and its finish.
struct EdgeShift {
  double start = 0;
  double finish = 0;
  double alike = 0;
};

void improve(const Profile& a, const Profile& b, double start, double finish, EdgeShift& best) {
  const double alike = correlation(a, b, start, finish);
  if (alike > best.alike) best = {start, finish, alike};
}

EdgeShift shift_of(const std::array<GrayPicture, 6>& pictures, const SharedEdge& edge) {
  EdgeShift best;
  for (const double first_depth : kReadAt) {
    const Profile a =
        profile_of(pictures[static_cast<std::size_t>(edge.side[0])], edge.end[0], first_depth);
    for (const double second_depth : kReadAt) {
      Profile b =
          profile_of(pictures[static_cast<std::size_t>(edge.side[1])], edge.end[1], second_depth);
      if (edge.reversed) std::reverse(b.begin(), b.end());
      EdgeShift here;
      for (int i = -kShiftSteps; i <= kShiftSteps; ++i) {
        for (int k = -kShiftSteps; k <= kShiftSteps; ++k)
          improve(a, b, i * kShiftStep, k * kShiftStep, here);
      }
      const EdgeShift coarse = here;
      for (int i = -3; i <= 3; ++i) {
        for (int k = -3; k <= 3; ++k) {
          improve(a, b, coarse.start + 0.25 * i * kShiftStep, coarse.finish + 0.25 * k * kShiftStep,
                  here);
        }
      }
      if (here.alike > best.alike) best = here;
    }
  }
  return best;
}

constexpr int kUnknowns = 24;  // shares by which each end of each side is too far out

/// An equation for two of them: what the first less the second is.
struct Difference {
  int first = 0;
  int second = 0;
  double share = 0;
};

/// What an edge says at its start and its finish.
std::array<Difference, 2> equations_of(const SharedEdge& edge, const EdgeShift& shift) {
  const auto ends = [](int side, int end, bool reversed) {
    const bool upright = end == kLeftEnd || end == kRightEnd;
    std::array<int, 2> at = {4 * side + (upright ? kTopEnd : kLeftEnd),
                             4 * side + (upright ? kBottomEnd : kRightEnd)};
    if (reversed) std::swap(at[0], at[1]);
    return at;
  };
  const auto a = ends(edge.side[0], edge.end[0], false);
  const auto b = ends(edge.side[1], edge.end[1], edge.reversed);
  return {{{b[0], a[0], shift.start}, {a[1], b[1], shift.finish}}};
}

/// The smallest crops that meet the equations.
std::array<double, kUnknowns> solve(const std::vector<std::array<Difference, 2>>& equations) {
  cv::Mat normal = kNothingOff * cv::Mat::eye(kUnknowns, kUnknowns, CV_64F);
  cv::Mat right = cv::Mat::zeros(kUnknowns, 1, CV_64F);
  for (const auto& edge : equations) {
    for (const Difference& one : edge) {
      normal.at<double>(one.first, one.first) += 1;
      normal.at<double>(one.second, one.second) += 1;
      normal.at<double>(one.first, one.second) -= 1;
      normal.at<double>(one.second, one.first) -= 1;
      right.at<double>(one.first) += one.share;
      right.at<double>(one.second) -= one.share;
    }
  }
  cv::Mat solved;
  cv::solve(normal, right, solved, cv::DECOMP_CHOLESKY);
  std::array<double, kUnknowns> out{};
  for (int i = 0; i < kUnknowns; ++i) out[static_cast<std::size_t>(i)] = solved.at<double>(i);
  return out;
}

double residual(const std::array<Difference, 2>& edge, const std::array<double, kUnknowns>& crops) {
  double worst = 0;
  for (const Difference& one : edge) {
    worst = std::max(worst, std::fabs(crops[static_cast<std::size_t>(one.first)] -
                                      crops[static_cast<std::size_t>(one.second)] - one.share));
  }
  return worst;
}

/// The picture between its side's edges; beyond its own edges its last pixel is repeated.
GrayPicture cut_to_edges(const GrayPicture& picture, const double* crop) {
  const double across = 1 / (1 + crop[kLeftEnd] + crop[kRightEnd]);
  const double down = 1 / (1 + crop[kTopEnd] + crop[kBottomEnd]);
  GrayPicture out{picture.width, picture.height, std::vector<std::uint8_t>(picture.pixels.size())};
  cv::Mat there(out.height, out.width, CV_8UC1, out.pixels.data());
  const cv::Matx23d map(across, 0, (0.5 + crop[kLeftEnd] * out.width) * across - 0.5, 0, down,
                        (0.5 + crop[kTopEnd] * out.height) * down - 0.5);
  cv::warpAffine(as_mat(picture.view()), there, map, there.size(),
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return out;
}

}  // namespace

CorrectedBox correct_crops(const std::array<GrayPicture, 6>& pictures) {
  CorrectedBox out{.pictures = pictures};
  std::vector<std::array<Difference, 2>> equations;
  for (const SharedEdge& edge : kEdges) {
    if (pictures[static_cast<std::size_t>(edge.side[0])].pixels.empty() ||
        pictures[static_cast<std::size_t>(edge.side[1])].pixels.empty()) {
      continue;
    }
    const EdgeShift shift = shift_of(pictures, edge);
    if (shift.alike >= kEdgesAlike) equations.push_back(equations_of(edge, shift));
  }
  auto crops = solve(equations);
  std::erase_if(equations, [&](const auto& edge) { return residual(edge, crops) > kContradicts; });
  if (equations.size() < kLeastEdges) return out;
  crops = solve(equations);
  double most = 0;
  for (double& crop : crops) {
    out.beyond = out.beyond || std::fabs(crop) > kMaxCorrection;
    crop = std::clamp(crop, -kMaxCorrection, kMaxCorrection);
    most = std::max(most, std::fabs(crop));
  }
  if (most < kMeets) return out;
  out.most = most;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!pictures[i].pixels.empty()) out.pictures[i] = cut_to_edges(pictures[i], &crops[4 * i]);
  }
  return out;
}

}  // namespace modar
