// Pyramid, corners, orientation and 256-bit rotated BRIEF codes of a frame.
#include "modar/tracker_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "corner_finder.hpp"
#include "kernels.hpp"

namespace modar {
namespace {

using tracker::Corner;
using tracker::kSlack;

constexpr int kAngles = 64;  // orientations for which the tests are turned in advance
constexpr int kTests = 256;
constexpr int kTestRadius = 14;  // pixels of a level; turned and rounded it stays within 15
constexpr int kMomentRadius = 14;
constexpr int kPyramidLevels = kTrackerLevels + 2;
constexpr int kSmallestSide = 16;
constexpr int kSure = 40;  // score of a corner that noise and light leave where it is

struct Point {
  int x = 0;
  int y = 0;
};

/// The tests' end points: BRIEF's isotropic normal distribution (Calonder et al., 2010), drawn from
/// a fixed sequence, at least 4 pixels apart.
std::array<Point, 2 * kTests> test_points() {
  std::array<Point, 2 * kTests> points{};
  std::uint64_t state = 0x9E3779B97F4A7C15ull;
  const auto uniform = [&state]() {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<int>(state >> 33) % 2048;
  };
  const auto normal = [&uniform]() {  // standard deviation 5.9 pixels
    int sum = 0;
    for (int i = 0; i < 4; ++i) sum += uniform() - 1024;
    return static_cast<double>(sum) / 200.0;
  };
  for (std::size_t i = 0; i < points.size();) {
    const Point a{static_cast<int>(std::lround(normal())), static_cast<int>(std::lround(normal()))};
    const Point b{static_cast<int>(std::lround(normal())), static_cast<int>(std::lround(normal()))};
    const int apart = (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
    const auto outside = [](const Point& p) {
      return p.x * p.x + p.y * p.y > kTestRadius * kTestRadius;
    };
    if (apart < 16 || outside(a) || outside(b)) continue;
    points[i++] = a;
    points[i++] = b;
  }
  return points;
}

/// Offsets of all end points for every orientation, in a buffer of that stride.
std::vector<std::int32_t> test_offsets(int stride) {
  const auto points = test_points();
  // cos and sin of 2 pi / 64, multiplied up: no library's last digit decides a rounding.
  constexpr double kCos = 0.99518472667219688624;
  constexpr double kSin = 0.09801714032956060199;
  double c = 1.0;
  double s = 0.0;
  std::vector<std::int32_t> offsets;
  offsets.reserve(static_cast<std::size_t>(kAngles) * points.size());
  for (int angle = 0; angle < kAngles; ++angle) {
    for (const Point& p : points) {
      const int x = static_cast<int>(std::floor(c * p.x - s * p.y + 0.5));
      const int y = static_cast<int>(std::floor(s * p.x + c * p.y + 0.5));
      offsets.push_back(y * stride + x);
    }
    const double next = c * kCos - s * kSin;
    s = c * kSin + s * kCos;
    c = next;
  }
  return offsets;
}

/// Angle of a direction in 64ths of a turn, by plain arithmetic that rounds alike everywhere.
int angle_bin(float x, float y) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float most = std::max(ax, ay);
  if (most == 0.0f) return 0;
  const float r = std::min(ax, ay) / most;
  // Polynomial arc tangent on [0, 1], within 0.0015 radians.
  const float r2 = r * r;
  float turn = r * (0.9953545f + r2 * (-0.2887679f + r2 * 0.0793390f));
  if (ay > ax) turn = 1.57079633f - turn;
  if (x < 0) turn = 3.14159265f - turn;
  if (y < 0) turn = 6.28318531f - turn;
  return static_cast<int>(turn * (64.0f / 6.28318531f) + 0.5f) & (kAngles - 1);
}

}  // namespace

struct FeatureExtractor::State {
  DetectOptions options;
  int pitch = 0;  ///< of all smoothed levels, so that one table of offsets serves them
  std::vector<GrayImage> levels;
  std::vector<std::vector<std::uint8_t>> halves;
  std::vector<std::vector<std::uint8_t>> smooth;
  std::vector<std::uint16_t> columns;
  std::vector<std::int32_t> tests;
  std::vector<Point> moment_points;
  std::vector<std::int32_t> moment_offsets;
  tracker::CornerFinder finder;
  std::vector<Corner> corners;
  std::vector<std::uint8_t> weights;  ///< of the corners, where there are too many
  std::vector<TrackerFeature> features;

  State(int width, const DetectOptions& with) : options(with), finder(width, with) {}
  void smooth_level(std::size_t level);
  void weigh();
  void strongest();
  void describe(const Corner& corner);
};

FeatureExtractor::FeatureExtractor(std::unique_ptr<State> state) : state_(std::move(state)) {}
FeatureExtractor::~FeatureExtractor() = default;

std::unique_ptr<FeatureExtractor> FeatureExtractor::create(int width, int height,
                                                           const DetectOptions& options) {
  auto state = std::make_unique<State>(width, options);
  state->pitch = (width + kSlack + 63) / 64 * 64;
  std::size_t cells = 0;
  for (int level = 0, w = width, h = height; level < kPyramidLevels; ++level, w /= 2, h /= 2) {
    if (level > 0 && std::min(w, h) < kSmallestSide) break;
    state->levels.push_back({nullptr, w, h, 0});
    if (level > 0) {
      state->halves.emplace_back(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) +
                                 kSlack);
    }
    if (level >= kTrackerLevels) continue;
    state->smooth.emplace_back(
        static_cast<std::size_t>(state->pitch) * static_cast<std::size_t>(h) + kSlack);
    cells += static_cast<std::size_t>((w / options.cell + 1) * (h / options.cell + 1));
  }
  state->columns.resize(static_cast<std::size_t>(state->pitch) + 2 * kSlack);
  state->tests = test_offsets(state->pitch);
  for (int y = -kMomentRadius; y <= kMomentRadius; y += 2) {
    for (int x = -kMomentRadius; x <= kMomentRadius; x += 2) {
      if (x * x + y * y > kMomentRadius * kMomentRadius) continue;
      state->moment_points.push_back({x, y});
      state->moment_offsets.push_back(y * state->pitch + x);
    }
  }
  state->corners.reserve(cells * static_cast<std::size_t>(options.per_cell));
  state->weights.reserve(state->corners.capacity());
  state->features.reserve(static_cast<std::size_t>(options.max_features));
  return std::unique_ptr<FeatureExtractor>(new FeatureExtractor(std::move(state)));
}

void FeatureExtractor::set_frame(const GrayImage& frame) {
  State& state = *state_;
  state.levels[0] = frame;
  const tracker::Kernels& run = tracker::kernels(state.options.simd);
  for (std::size_t level = 1; level < state.levels.size(); ++level) {
    const GrayImage& from = state.levels[level - 1];
    GrayImage& to = state.levels[level];
    std::uint8_t* out = state.halves[level - 1].data();
    to.stride = to.width;
    to.pixels = out;
    for (int y = 0; y < to.height; ++y) {
      const std::uint8_t* top = from.pixels + 2 * y * from.stride;
      run.halve_row(top, top + from.stride, out + y * to.stride, to.width);
    }
  }
}

std::span<const GrayImage> FeatureExtractor::pyramid() const {
  return state_->levels;
}

void FeatureExtractor::State::smooth_level(std::size_t level) {
  const GrayImage& image = levels[level];
  const tracker::Kernels& run = tracker::kernels(options.simd);
  std::uint16_t* sums = columns.data() + kSlack;
  for (int y = 2; y < image.height - 2; ++y) {
    const std::uint8_t* rows[5];
    for (int k = 0; k < 5; ++k) rows[k] = image.pixels + (y + k - 2) * image.stride;
    run.blur_columns(rows, sums, image.width);
    // The two columns at each side are smoothed with what lies beyond: nothing reads them.
    run.blur_row(sums, smooth[level].data() + static_cast<std::ptrdiff_t>(y) * pitch, image.width);
  }
}

/// Scores decide up to the one that makes a corner sure; of sure ones the best of each cell go
/// first. So what has the greatest contrast, a page of print, cannot take all features of a frame.
/// Cells lie side by side in `corners`.
void FeatureExtractor::State::weigh() {
  const auto cell_of = [this](const Corner& corner) {
    return std::array<int, 3>{corner.level, corner.y / options.cell, corner.x / options.cell};
  };
  weights.clear();
  for (std::size_t first = 0, last = 0; first < corners.size(); first = last) {
    const auto cell = cell_of(corners[first]);
    while (last < corners.size() && cell_of(corners[last]) == cell) ++last;
    for (std::size_t i = first; i < last; ++i) {
      int rank = 0;
      for (std::size_t k = first; k < last; ++k) {
        rank +=
            corners[k].score > corners[i].score || (corners[k].score == corners[i].score && k < i)
                ? 1
                : 0;
      }
      const int score = corners[i].score;
      weights.push_back(static_cast<std::uint8_t>(
          score < kSure ? score : std::clamp(kSure + options.per_cell - rank, kSure, 255)));
    }
  }
}

void FeatureExtractor::State::strongest() {
  const std::size_t most = static_cast<std::size_t>(options.max_features);
  if (corners.size() <= most) return;
  weigh();
  std::array<std::size_t, 256> histogram{};
  for (const std::uint8_t weight : weights) ++histogram[weight];
  std::size_t above = 0;
  int cut = 255;
  while (cut > 0 && above + histogram[static_cast<std::size_t>(cut)] <= most) {
    above += histogram[static_cast<std::size_t>(cut)];
    --cut;
  }
  std::size_t ties = most - above;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (weights[i] < cut || (weights[i] == cut && ties == 0)) continue;
    if (weights[i] == cut) --ties;
    corners[kept++] = corners[i];
  }
  corners.resize(kept);
}

void FeatureExtractor::State::describe(const Corner& corner) {
  const std::uint8_t* at =
      smooth[corner.level].data() + static_cast<std::ptrdiff_t>(corner.y) * pitch + corner.x;
  int mx = 0;
  int my = 0;
  for (std::size_t i = 0; i < moment_points.size(); ++i) {
    const int gray = at[moment_offsets[i]];
    mx += moment_points[i].x * gray;
    my += moment_points[i].y * gray;
  }
  TrackerFeature& feature = features.emplace_back();
  const float fx = static_cast<float>(mx);
  const float fy = static_cast<float>(my);
  const float length = std::sqrt(fx * fx + fy * fy);
  if (length > 0.0f) {
    feature.cosine = fx / length;
    feature.sine = fy / length;
  }
  const std::int32_t* test = tests.data() + angle_bin(fx, fy) * (2 * kTests);
  for (std::size_t byte = 0; byte < feature.code.size(); ++byte) {
    unsigned bits = 0;
    for (unsigned bit = 0; bit < 8; ++bit, test += 2) {
      bits |= static_cast<unsigned>(at[test[0]] < at[test[1]]) << bit;
    }
    feature.code[byte] = static_cast<std::uint8_t>(bits);
  }
  const float scale = static_cast<float>(1 << corner.level);
  feature.x = (static_cast<float>(corner.x) + 0.5f) * scale - 0.5f;
  feature.y = (static_cast<float>(corner.y) + 0.5f) * scale - 0.5f;
  feature.level = corner.level;
  feature.dark = corner.dark;
  feature.score = corner.score;
}

std::span<const TrackerFeature> FeatureExtractor::features() {
  State& state = *state_;
  state.corners.clear();
  state.features.clear();
  const std::size_t levels = std::min<std::size_t>(state.levels.size(), kTrackerLevels);
  for (std::size_t level = 0; level < levels; ++level) {
    state.finder.find(state.levels[level], static_cast<std::uint8_t>(level), state.corners);
  }
  state.strongest();
  std::size_t next = 0;
  for (std::size_t level = 0; level < levels; ++level) {
    if (next == state.corners.size() || state.corners[next].level != level) continue;
    state.smooth_level(level);
    for (; next < state.corners.size() && state.corners[next].level == level; ++next) {
      state.describe(state.corners[next]);
    }
  }
  return state.features;
}

}  // namespace modar
