// Pyramid, corners, orientation and 256-bit rotated BRIEF codes of a frame.
#include "modar/tracker_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "kernels.hpp"

namespace modar::tracker {

struct Corner {
  std::int16_t x = 0;
  std::int16_t y = 0;
  std::uint8_t score = 0;
  std::uint8_t dark = 0;
  std::uint8_t level = 0;
  std::uint8_t cell = 0;  ///< a number that the cells before and after do not have
};

/// FAST-9 corners of one pyramid level with 3x3 suppression, the strongest few of each cell and as
/// many spare ones, the next: Rosten & Drummond, "Machine learning for high-speed corner detection"
/// (2006), with the score of its later implementation, the greatest threshold. Holds buffers for
/// levels up to a width.
class CornerFinder {
 public:
  CornerFinder(int width, const DetectOptions& options);
  /// Appends the corners of rows of a level, from `row` (0 at first) on, which it moves to the
  /// next; false once there are no more. Corners are ordered by rows of cells, never beyond the
  /// reserved capacity.
  bool find(const GrayImage& image, std::uint8_t level, int threshold, int rows, int& row,
            std::vector<Corner>& corners, std::vector<Corner>& spare);

 private:
  [[nodiscard]] int weakest(const Corner* slots) const;
  void keep(Corner corner, int cell);
  void flush(std::vector<Corner>& corners, std::vector<Corner>& spare);

  DetectOptions options_;
  int pitch_ = 0;
  std::vector<std::uint8_t> rows_;      ///< three rows of scores, three of bright scores, peaks
  std::vector<Corner> cells_;           ///< twice per_cell slots a cell of the current cell row
  std::vector<int> counts_;             ///< two a cell: of the strongest, and of the spare ones
  std::vector<int> weakest_;            ///< the same: the weakest, where there are per_cell
  std::vector<std::uint16_t> cell_of_;  ///< of a column: old phones have no division
  std::uint8_t cell_ = 0;               ///< of the corners flushed last
};

[[gnu::cold]] CornerFinder::CornerFinder(int width, const DetectOptions& options)
    : options_(options),
      pitch_(width + 2 * kSlack),
      rows_(static_cast<std::size_t>(pitch_) * 7),
      cells_(static_cast<std::size_t>((width / options.cell + 1) * 2 * options.per_cell)),
      counts_(static_cast<std::size_t>(width / options.cell + 1) * 2),
      weakest_(counts_.size()) {
  for (int x = 0; x < width; ++x) {
    cell_of_.push_back(static_cast<std::uint16_t>(x / options.cell));
  }
}

/// The weakest corner; of equally weak ones the last, so that ties go by row.
int CornerFinder::weakest(const Corner* slots) const {
  int at = 0;
  for (int i = 1; i < options_.per_cell; ++i) {
    if (slots[i].score <= slots[at].score) at = i;
  }
  return at;
}

/// Keeps a corner among a cell's strongest; weaker ones are among its spare features.
void CornerFinder::keep(Corner corner, int cell) {
  for (std::size_t list = 2 * static_cast<std::size_t>(cell);
       list / 2 == static_cast<std::size_t>(cell); ++list) {
    Corner* slots = cells_.data() + list * static_cast<std::size_t>(options_.per_cell);
    int& count = counts_[list];
    int& last = weakest_[list];
    if (count < options_.per_cell) {
      slots[count++] = corner;
      if (count == options_.per_cell) last = weakest(slots);
      return;
    }
    if (corner.score <= slots[last].score) continue;
    std::swap(corner, slots[last]);
    last = weakest(slots);
  }
}

void CornerFinder::flush(std::vector<Corner>& corners, std::vector<Corner>& spare) {
  for (std::size_t slot = 0; slot < counts_.size(); ++slot) {
    const int count = std::exchange(counts_[slot], 0);
    std::vector<Corner>& out = slot % 2 == 0 ? corners : spare;
    if (slot % 2 == 0 && count > 0) ++cell_;
    Corner* slots = cells_.data() + slot * static_cast<std::size_t>(options_.per_cell);
    for (int i = 0; i < count; ++i) {
      slots[i].cell = cell_;
      if (out.size() < out.capacity()) out.push_back(slots[i]);
    }
  }
}

bool CornerFinder::find(const GrayImage& image, std::uint8_t level, int threshold, int rows,
                        int& row, std::vector<Corner>& corners, std::vector<Corner>& spare) {
  const int count = image.width - 2 * kTrackerBorder;
  if (count <= 0 || image.height <= 2 * kTrackerBorder) return false;
  const Kernels& run = kernels(options_.simd);
  // The pixel before the range is compared too, and never a corner.
  const auto row_at = [&](int slot) {
    return rows_.data() + static_cast<std::size_t>(slot) * static_cast<std::size_t>(pitch_) +
           kSlack;
  };
  std::uint8_t* peak = row_at(6);
  if (row == 0) {
    std::fill(rows_.begin(), rows_.end(), std::uint8_t{0});
    row = kTrackerBorder;
  }
  const int last = image.height - kTrackerBorder;
  const int end = std::min(row + rows, last + 1);
  for (int y = row; y < end; ++y) {
    std::uint8_t* score = row_at(y % 3);
    std::uint8_t* bright = row_at(3 + y % 3);
    if (y < last) {
      run.corner_scores(image.pixels + y * image.stride + kTrackerBorder, image.stride, threshold,
                        count, bright, score);
      // Kernels write past the range; that is no neighbour.
      std::memset(score + count, 0, kSlack);
    } else {
      std::memset(score, 0, static_cast<std::size_t>(count) + kSlack);
    }
    const int centre = y - 1;
    if (centre < kTrackerBorder) continue;
    const std::uint8_t* middle = row_at(centre % 3);
    const std::uint8_t* middle_bright = row_at(3 + centre % 3);
    run.peaks(row_at((centre + 2) % 3), middle, score, count, peak);
    const int cell_row = centre / options_.cell;
    for (int i = 0; i < count; i += 8) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, peak + i, sizeof eight);
      if (eight == 0) continue;
      for (int x = i; x < std::min(i + 8, count); ++x) {
        if (peak[x] == 0) continue;
        const int column = x + kTrackerBorder;
        keep({static_cast<std::int16_t>(column), static_cast<std::int16_t>(centre), peak[x],
              static_cast<std::uint8_t>(middle_bright[x] == middle[x] ? 0 : 1), level},
             cell_of_[static_cast<std::size_t>(column)]);
      }
    }
    if (y == last || (centre + 1) / options_.cell != cell_row) flush(corners, spare);
  }
  row = end;
  return end <= last;
}

}  // namespace modar::tracker

namespace modar {
namespace {

using tracker::Corner;
using tracker::kSlack;

// The first four are part of kFeatureExtractorVersion: other values make other codes.
constexpr int kAngles = 64;        // orientations that the tests are rotated to in advance
constexpr int kTests = 256;        // bits of a code
constexpr int kTestRadius = 14;    // pixels of a level; rotated and rounded it stays within 15
constexpr int kMomentRadius = 14;  // the same, of the disk whose centroid is the orientation
// Two levels above the last one with features: tracking starts there (SearchRadius::kFar).
constexpr int kPyramidLevels = kTrackerLevels + 2;
constexpr int kMinSide = 16;
// Score from which a corner's rank in its cell decides instead of its contrast. Higher lets a page
// of print take all features.
constexpr int kSureScore = 40;
// Corners per megapixel below which a frame is dim and searched again with lower thresholds. Higher
// trades true corners of bright frames for weak ones.
constexpr std::int64_t kFewCorners = 400;
// Threshold of that search, standard deviations of the level's noise. Lower finds noise.
constexpr int kNoiseSigmas = 4;
constexpr int kLeastThreshold = 3;

struct Point {
  int x = 0;
  int y = 0;
};

/// The tests' end points: BRIEF's isotropic normal distribution (Calonder et al., "BRIEF", 2010),
/// from a fixed pseudo-random sequence, at least 4 pixels apart.
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
[[gnu::cold]] std::vector<std::int32_t> test_offsets(int stride) {
  const auto points = test_points();
  // cos and sin of 2 pi / 64, then the angle addition formula: no rounding depends on a libm.
  constexpr double kCos = 0.99518472667219688624;
  constexpr double kSin = 0.09801714032956060199;
  double c = 1.0;
  double s = 0.0;
  // Truncated above 0, since a processor without SSE 4.1 calls floor().
  const auto nearest = [](double value) {
    constexpr int kAbove = 4 * kTestRadius;
    return static_cast<int>(value + (kAbove + 0.5)) - kAbove;
  };
  std::vector<std::int32_t> offsets(static_cast<std::size_t>(kAngles) * points.size());
  std::int32_t* next_offset = offsets.data();
  for (int angle = 0; angle < kAngles; ++angle) {
    for (const Point& p : points) {
      *next_offset++ = nearest(s * p.x + c * p.y) * stride + nearest(c * p.x - s * p.y);
    }
    const double next = c * kCos - s * kSin;
    s = c * kSin + s * kCos;
    c = next;
  }
  return offsets;
}

/// Angle of a direction in 64ths of a turn, by arithmetic that rounds alike on every platform.
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
  std::vector<Corner> spare;          ///< of the same cells, weaker
  std::vector<std::uint8_t> weights;  ///< of the corners, where there are too many
  std::vector<TrackerFeature> features;
  std::array<int, kTrackerLevels> thresholds{};  ///< of corners, by level
  bool dim = false;             ///< the frame is searched for the second time, with lower ones
  std::size_t slice_level = 0;  ///< of begin() and extend(): where the next slice starts
  int row = 0;
  std::size_t next = 0;  ///< corner
  std::size_t next_spare = 0;
  bool described = true;
  unsigned smoothed = 0;  ///< a bit a level

  bool extend_corners(std::int64_t& work);
  bool describe_all(std::span<const Corner> all, std::size_t& at, std::int64_t& work);
  State(int width, const DetectOptions& with) : options(with), finder(width, with) {}
  void smooth_level(std::size_t level);
  [[nodiscard]] int noise_threshold(const GrayImage& image) const;
  bool search_dimmer();
  void weigh();
  void strongest(std::size_t most, std::vector<Corner>& of);
  void describe(const Corner& corner);
};

[[gnu::cold]] FeatureExtractor::FeatureExtractor(std::unique_ptr<State> state)
    : state_(std::move(state)) {}
[[gnu::cold]] FeatureExtractor::~FeatureExtractor() = default;

[[gnu::cold]] std::unique_ptr<FeatureExtractor> FeatureExtractor::create(
    int width, int height, const DetectOptions& options) {
  auto state = std::make_unique<State>(width, options);
  state->pitch = (width + kSlack + 63) / 64 * 64;
  std::size_t cells = 0;
  for (int level = 0, w = width, h = height; level < kPyramidLevels; ++level, w /= 2, h /= 2) {
    if (level > 0 && std::min(w, h) < kMinSide) break;
    state->levels.push_back({nullptr, w, h, 0});
    if (level > 0) {
      state->halves.emplace_back(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) +
                                 kSlack);
    }
    if (level >= std::min(kTrackerLevels, options.levels)) continue;
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
  state->spare.reserve(state->corners.capacity());
  state->weights.reserve(state->corners.capacity());
  state->features.reserve(static_cast<std::size_t>(options.max_features + options.max_spare));
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
    // The two columns at each side are smoothed with the pixels beyond; nothing reads them.
    run.blur_row(sums, smooth[level].data() + static_cast<std::ptrdiff_t>(y) * pitch, image.width);
  }
}

/// Weights for strongest(): scores up to kSureScore, above it by rank in the cell, so that what has
/// the greatest contrast, a page of print, cannot take all features of a frame. Corners of a cell
/// are adjacent in `corners`.
void FeatureExtractor::State::weigh() {
  weights.clear();
  for (std::size_t first = 0, last = 0; first < corners.size(); first = last) {
    while (last < corners.size() && corners[last].cell == corners[first].cell) ++last;
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
          score < kSureScore ? score
                             : std::clamp(kSureScore + options.per_cell - rank, kSureScore, 255)));
    }
  }
}

/// Leaves `most` of the corners, by `weights`.
void FeatureExtractor::State::strongest(std::size_t most, std::vector<Corner>& of) {
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
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (weights[i] < cut || (weights[i] == cut && ties == 0)) continue;
    if (weights[i] == cut) --ties;
    of[kept++] = of[i];
  }
  of.resize(kept);
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
  for (std::uint8_t& byte : feature.code) {
    std::uint32_t bits = 0;
#pragma GCC unroll 8
    for (int bit = 0; bit < 8; ++bit, test += 2) {
      // The sign of the difference: without a comparison, a third less of the time.
      const std::uint32_t less = std::uint32_t{at[test[0]]} - at[test[1]];
      bits = bits >> 1 | (less & 0x80000000u);
    }
    byte = static_cast<std::uint8_t>(bits >> 24);
  }
  const float scale = static_cast<float>(1 << corner.level);
  feature.x = (static_cast<float>(corner.x) + 0.5f) * scale - 0.5f;
  feature.y = (static_cast<float>(corner.y) + 0.5f) * scale - 0.5f;
  feature.level = corner.level;
  feature.dark = corner.dark;
  feature.score = corner.score;
}

void FeatureExtractor::begin() {
  State& state = *state_;
  state.corners.clear();
  state.spare.clear();
  state.features.clear();
  state.slice_level = 0;
  state.row = 0;
  state.next = state.next_spare = 0;
  state.described = false;
  state.smoothed = 0;
  state.dim = false;
  state.thresholds.fill(state.options.threshold);
}

/// False while corners are left to find.
bool FeatureExtractor::State::extend_corners(std::int64_t& work) {
  constexpr int kRows = 16;
  constexpr std::int64_t kPixelCost = 22;  // instructions, as scripts/foreign.sh counts them
  const std::size_t count = smooth.size();
  while (slice_level < count) {
    if (work <= 0) return false;
    work -= kPixelCost * kRows * levels[slice_level].width;
    if (finder.find(levels[slice_level], static_cast<std::uint8_t>(slice_level),
                    thresholds[slice_level], kRows, row, corners, spare))
      continue;
    row = 0;
    if (++slice_level == count && search_dimmer()) slice_level = 0;
  }
  return true;
}

/// The threshold that stays above a level's noise, as the median of the second differences along
/// some of its rows tells it: edges are few among them.
int FeatureExtractor::State::noise_threshold(const GrayImage& image) const {
  std::array<int, 256> histogram{};
  int count = 0;
  for (int y = 4; y < image.height - 4; y += 8) {
    const std::uint8_t* gray = image.pixels + y * image.stride;
    for (int x = 4; x < image.width - 4; x += 3, ++count) {
      const int bend = std::abs(gray[x - 2] - 2 * gray[x] + gray[x + 2]);
      ++histogram[static_cast<std::size_t>(std::min(bend, 255))];
    }
  }
  int median = 0;
  for (int below = histogram[0]; 2 * below < count;
       below += histogram[static_cast<std::size_t>(median)]) {
    ++median;
  }
  // Of a normal distribution the median of |a - 2b + c| is 1.65 sigma.
  const int threshold = (kNoiseSigmas * 100 * median + 82) / 165;
  return std::clamp(threshold, kLeastThreshold, options.threshold);
}

/// Whether a frame with few corners is to be searched again; sets the thresholds for that.
bool FeatureExtractor::State::search_dimmer() {
  const std::int64_t area = std::int64_t{levels[0].width} * levels[0].height;
  if (dim || static_cast<std::int64_t>(corners.size()) * 1'000'000 >= kFewCorners * area) {
    return false;
  }
  dim = true;
  corners.clear();
  spare.clear();
  for (std::size_t level = 0; level < smooth.size(); ++level) {
    thresholds[level] = noise_threshold(levels[level]);
  }
  return true;
}

/// Describes the corners from `at` on, which it moves; false while some are left.
bool FeatureExtractor::State::describe_all(std::span<const Corner> all, std::size_t& at,
                                           std::int64_t& work) {
  constexpr std::int64_t kSmoothCost = 7;       // instructions a pixel
  constexpr std::int64_t kDescribeCost = 4600;  // and a feature
  for (; at < all.size(); ++at) {
    if (work <= 0) return false;
    const std::size_t level = all[at].level;
    if ((smoothed >> level & 1) == 0) {
      smoothed |= 1u << level;
      smooth_level(level);
      work -= kSmoothCost * levels[level].width * levels[level].height;
    }
    describe(all[at]);
    work -= kDescribeCost;
  }
  return true;
}

bool FeatureExtractor::extend(std::int64_t& work) {
  State& state = *state_;
  if (!state.described) {
    if (!state.extend_corners(work)) return false;
    const auto most = static_cast<std::size_t>(state.options.max_features);
    if (state.corners.size() > most) {
      state.weigh();
      state.strongest(most, state.corners);
    }
    state.described = true;
  }
  return state.describe_all(state.corners, state.next, work);
}

bool FeatureExtractor::extend_spare(std::int64_t& work) {
  State& state = *state_;
  const auto most = static_cast<std::size_t>(state.options.max_spare);
  if (state.spare.size() > most) {
    state.weights.clear();
    for (const Corner& corner : state.spare) state.weights.push_back(corner.score);
    state.strongest(most, state.spare);
  }
  return state.describe_all(state.spare, state.next_spare, work);
}

std::span<const TrackerFeature> FeatureExtractor::found() const {
  return state_->features;
}

std::span<const TrackerFeature> FeatureExtractor::features() {
  begin();
  std::int64_t work = std::numeric_limits<std::int64_t>::max();
  extend(work);
  return found();
}

}  // namespace modar
