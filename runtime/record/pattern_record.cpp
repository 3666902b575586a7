// Keeps those descriptors of a pattern's rendered views that random views repeat, and chooses
// patches to track.
#include "modar/pattern_record.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>
#include <utility>

#include "formats/base/parallel.hpp"
#include "modar/pattern_views.hpp"
#include "modar/tracker_features.hpp"
#include "runtime/record/record_parts.hpp"

namespace modar {
namespace {

using std::numbers::pi;

// Logarithm of the smallest scale of the trial views. Smaller favours distant patterns.
constexpr double kLogSmallest = -1.2039728043259361;
// Logarithm of the largest scale of the trial views. Larger takes time; coarser levels of frames
// show the same.
constexpr double kLogLargest = 0.34657359027997265;
// Degrees of the steepest trial view: a tilt of 4.4, just beyond the steepest baked one of 4.1.
constexpr double kSteepest = 77.0;
// View pixels between a trial's feature and the candidate that it repeats. Wider confirms
// neighbouring corners, narrower loses scattered ones. [2, 6] tuned: pose
constexpr int kNear = 3;
// Bits within which a candidate repeats a trial's feature. Fewer trade covered patterns for tilted
// ones. [48, 80] tuned: pose
constexpr int kRepeats = 64;
// Matches of a view at which one more counts half. Higher favours easy views, lower hard ones. [12,
// 48] tuned: pose
constexpr double kEnough = 24.0;

/// A trial's feature that a candidate repeats, and how well (0 to 1].
struct Hit {
  std::uint32_t feature = 0;
  float value = 0;
};

struct Trials {
  std::vector<std::vector<Hit>> hits;  // of each candidate
  std::vector<std::uint32_t> view_of;  // of each trial feature
  std::uint32_t views = 0;
};

bool within(const GrayImage& pattern, const std::array<double, 2>& p) {
  return p[0] >= -0.5 && p[1] >= -0.5 && p[0] < pattern.width - 0.5 && p[1] < pattern.height - 0.5;
}

/// Whether the neighbourhood of a place is on one side of a box: beyond its edge cameras see
/// something else than the picture. True of all other shapes.
bool on_one_face(const PatternSurface& surface, double x, double y, double reach) {
  if (surface.faces().empty()) return true;
  return std::any_of(
      surface.faces().begin(), surface.faces().end(), [&](const ShapeFaceRecord& face) {
        return x - reach >= face.place[0] - 0.5 && y - reach >= face.place[1] - 0.5 &&
               x + reach <= face.place[0] + face.place[2] - 0.5 &&
               y + reach <= face.place[1] + face.place[3] - 0.5;
      });
}

std::vector<RecordFeature> candidates_of(const std::vector<ViewLevel>& levels,
                                         const AffineView& view, const PatternSurface& surface) {
  constexpr double kReach = 10.0;  // view pixels around a corner that tell most of its code
  const double scale =
      std::sqrt(std::abs(view.linear[0] * view.linear[3] - view.linear[1] * view.linear[2]));
  std::vector<RecordFeature> candidates;
  const GrayPicture picture = render_view(levels, view, nullptr);
  const auto extractor = FeatureExtractor::create(picture.width, picture.height, baked_detection());
  extractor->set_frame(picture.view());
  for (const TrackerFeature& feature : extractor->features()) {
    const auto place =
        to_picture(view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    if (!within(levels[0].view(), place) ||
        !on_one_face(surface, place[0], place[1], kReach / scale)) {
      continue;
    }
    candidates.push_back(record_feature(view, feature, place));
  }
  return candidates;
}

std::vector<RecordFeature> find_candidates(const std::vector<ViewLevel>& levels,
                                           const PatternSurface& surface, unsigned jobs) {
  const std::vector<AffineView> views = baked_views(levels[0].width, levels[0].height);
  std::vector<std::vector<RecordFeature>> found(views.size());
  parallel_rows(static_cast<std::uint32_t>(views.size()), jobs,
                [&](std::uint32_t i) { found[i] = candidates_of(levels, views[i], surface); });
  std::vector<RecordFeature> candidates;
  for (const auto& some : found) candidates.insert(candidates.end(), some.begin(), some.end());
  return candidates;
}

/// Applies a random exposure and sensor noise, of 256 values drawn for the view.
void expose_trial(Random& random, GrayPicture& picture) {
  constexpr double kOne = 256.0;  // fixed point: the pixels are a tenth of the bake's time
  const double gain = random.uniform(0.6, 1.25);
  const double bias = random.uniform(-20.0, 20.0);
  std::array<int, 256> exposed;
  std::array<int, 256> noise;
  for (std::size_t i = 0; i < exposed.size(); ++i) {
    exposed[i] = static_cast<int>(kOne * (gain * static_cast<double>(i) + bias + 0.5));
    noise[i] = static_cast<int>(kOne * 3.0 * random.normal());
  }
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i, bits >>= 8) {
    if (i % sizeof bits == 0) bits = random.next();
    std::uint8_t& gray = picture.pixels[i];
    gray = static_cast<std::uint8_t>(std::clamp((exposed[gray] + noise[bits & 255]) >> 8, 0, 255));
  }
}

/// RecordFeatures by squares of the pattern, so that a trial's feature is compared with near ones
/// only.
class Grid {
 public:
  Grid(const GrayImage& pattern, const std::vector<RecordFeature>& candidates)
      : columns_(pattern.width / kSquare + 1),
        rows_(pattern.height / kSquare + 1),
        starts_(static_cast<std::size_t>(2 * columns_ * rows_) + 1),
        entries_(candidates.size()) {
    const auto cell = [this](const RecordFeature& candidate) {
      return index(square(candidate.x), square(candidate.y), candidate.dark);
    };
    for (const RecordFeature& candidate : candidates) ++starts_[cell(candidate) + 1];
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
    for (std::uint32_t i = 0; i < candidates.size(); ++i) {
      const RecordFeature& candidate = candidates[i];
      entries_[next[cell(candidate)]++] = {static_cast<float>(candidate.x),
                                           static_cast<float>(candidate.y), i};
      codes_.push_back(candidate.code);
    }
  }
  /// The candidates of the feature's polarity within the radius, and their codes' distances to its.
  void near(double x, double y, double radius, const TrackerFeature& feature,
            std::vector<std::uint32_t>& which, std::vector<int>& bits) const {
    const auto at_x = static_cast<float>(x);
    const auto at_y = static_cast<float>(y);
    const auto reach = static_cast<float>(radius * radius);
    which.clear();
    for (int row = std::max(0, square(y - radius)); row <= std::min(rows_ - 1, square(y + radius));
         ++row) {
      const int first = std::max(0, square(x - radius));
      const int last = std::min(columns_ - 1, square(x + radius));
      if (first > last) continue;
      const std::uint32_t end = starts_[index(last, row, feature.dark) + 1];
      for (std::uint32_t i = starts_[index(first, row, feature.dark)]; i < end; ++i) {
        const Entry& entry = entries_[i];
        const float dx = entry.x - at_x;
        const float dy = entry.y - at_y;
        if (dx * dx + dy * dy <= reach) which.push_back(entry.candidate);
      }
    }
    bits.resize(which.size());
    code_distances(feature.code, codes_.data(), which.data(), which.size(), bits.data());
  }

 private:
  static constexpr int kSquare = 4;  // pixels: about the radius of a query
  /// Positions next to the index, since most candidates of a square are too far away.
  struct Entry {
    float x;
    float y;
    std::uint32_t candidate;
  };
  static int square(double value) { return static_cast<int>(std::floor((value + 0.5) / kSquare)); }
  [[nodiscard]] std::size_t index(int column, int row, int dark) const {
    return static_cast<std::size_t>((dark * rows_ + row) * columns_ + column);
  }
  int columns_;
  int rows_;
  std::vector<std::uint32_t> starts_;  ///< of each square, then their number
  std::vector<Entry> entries_;         ///< a row's squares one after the other
  std::vector<TrackerCode> codes_;
};

/// What a random view shows of the pattern: (candidate, feature of the view) that match.
struct TrialView {
  std::uint32_t features = 0;
  std::vector<std::pair<std::uint32_t, Hit>> hits;
};

/// Adds a view's feature, seen at a place of the picture, and the candidates that it repeats.
class TrialTally {
 public:
  TrialTally(const Grid& grid, double mean_scale) : grid_(grid), mean_scale_(mean_scale) {}
  void add(const TrackerFeature& feature, double x, double y) {
    const std::uint32_t id = trial_.features++;
    const double radius = std::min(kNear * (1 << feature.level) / mean_scale_, 16.0);
    grid_.near(x, y, radius, feature, which_, bits_);
    for (std::size_t i = 0; i < which_.size(); ++i) {
      if (bits_[i] > kRepeats) continue;
      trial_.hits.push_back(
          {which_[i], {id, static_cast<float>(kRepeats + 8 - bits_[i]) / (kRepeats + 8)}});
    }
  }
  TrialView take() { return std::move(trial_); }

 private:
  const Grid& grid_;
  double mean_scale_;
  TrialView trial_;
  std::vector<std::uint32_t> which_;
  std::vector<int> bits_;
};

TrialView run_trial(const std::vector<ViewLevel>& levels, std::uint64_t seed, const Grid& grid) {
  Random random(seed);
  const double scale = exp_of(random.uniform(kLogSmallest, kLogLargest));
  const double tilt = 1.0 / turn_of(random.uniform(0.0, kSteepest) * pi / 180.0).cosine;
  const Turn direction = turn_of(random.uniform(0.0, pi));
  const Turn rotation = turn_of(random.uniform(0.0, 2 * pi));
  const AffineView view =
      make_view(levels[0].width, levels[0].height, scale, tilt, direction, rotation, kMargin + 8);
  const GrayPicture background = made_clutter(random, view.width, view.height);
  GrayPicture picture = render_view(levels, view, &background);
  expose_trial(random, picture);
  const auto extractor = FeatureExtractor::create(picture.width, picture.height, DetectOptions{});
  extractor->set_frame(picture.view());
  TrialTally tally(grid, scale / std::sqrt(tilt));
  for (const TrackerFeature& feature : extractor->features()) {
    const auto place =
        to_picture(view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    if (within(levels[0].view(), place)) tally.add(feature, place[0], place[1]);
  }
  return tally.take();
}

/// Axes of a camera that looks at a thing from `around` radians about its axis and `above` radians
/// above, rolled.
ViewAxes axes_of(double around, double above, double roll) {
  const Turn a = turn_of(around);
  const Turn b = turn_of(above);
  const Turn c = turn_of(roll);
  // Of the pattern's x and z after the turn about y, then up against down.
  const std::array<double, 3> right = {a.cosine, 0, -a.sine};
  const std::array<double, 3> down = {-b.sine * -a.sine, -b.cosine, b.sine * a.cosine};
  ViewAxes axes{};
  for (std::size_t i = 0; i < 3; ++i) {
    axes[0][i] = c.cosine * right[i] - c.sine * down[i];
    axes[1][i] = c.sine * right[i] + c.cosine * down[i];
  }
  return axes;
}

/// The same on a pattern's surface, from all sides of it.
TrialView run_surface_trial(const std::vector<ViewLevel>& levels, const PatternSurface& surface,
                            std::uint64_t seed, const Grid& grid) {
  constexpr double kAround = 85.0;  // degrees to either side; a box is seen from all sides
  constexpr double kAbove = 40.0;
  Random random(seed);
  const double scale = exp_of(random.uniform(kLogSmallest, kLogLargest));
  const double reach = surface.faces().empty() ? kAround : 180.0;
  const double around = random.uniform(-reach, reach) * pi / 180.0;
  const double above = random.uniform(-kAbove, kAbove) * pi / 180.0;
  const ViewAxes axes = axes_of(around, above, random.uniform(0.0, 2 * pi));
  CurvedView view = render_surface_view(
      levels, surface, axes, scale, kMargin + 8,
      [&random](int width, int height) { return made_clutter(random, width, height); });
  expose_trial(random, view.picture);
  const GrayPicture& picture = view.picture;
  const auto extractor = FeatureExtractor::create(picture.width, picture.height, DetectOptions{});
  extractor->set_frame(picture.view());
  TrialTally tally(grid, scale);
  for (const TrackerFeature& feature : extractor->features()) {
    const auto x = static_cast<std::size_t>(static_cast<double>(feature.x) + 0.5);
    const auto y = static_cast<std::size_t>(static_cast<double>(feature.y) + 0.5);
    const auto& place = view.places[y * static_cast<std::size_t>(picture.width) + x];
    if (place[0] == CurvedView::kNoPlace) continue;
    tally.add(feature, place[0] / 64.0 - 0.5, place[1] / 64.0 - 0.5);
  }
  return tally.take();
}

Trials run_trials(const std::vector<ViewLevel>& levels, const PatternSurface& surface,
                  const std::vector<RecordFeature>& candidates, std::uint32_t count,
                  unsigned jobs) {
  const Grid grid(levels[0].view(), candidates);
  std::vector<TrialView> views(count);
  parallel_rows(count, jobs, [&](std::uint32_t i) {
    views[i] = surface.flat() ? run_trial(levels, 1000 + i, grid)
                              : run_surface_trial(levels, surface, 1000 + i, grid);
  });
  Trials trials;
  trials.hits.resize(candidates.size());
  for (const TrialView& view : views) {
    const auto first = static_cast<std::uint32_t>(trials.view_of.size());
    for (const auto& [candidate, hit] : view.hits) {
      trials.hits[candidate].push_back({first + hit.feature, hit.value});
    }
    trials.view_of.insert(trials.view_of.end(), view.features, trials.views++);
  }
  return trials;
}

/// Greedy cover: each step takes the candidate that adds most to the trials' matches, where a view
/// that has many already counts less. Gains only fall, so stale ones are recomputed lazily.
std::vector<std::uint32_t> choose(const Trials& trials, std::uint32_t count, double& repeated) {
  std::vector<float> best(trials.view_of.size(), 0.0f);
  std::vector<double> have(trials.views, 0.0);
  const auto gain = [&](std::uint32_t i) {
    double sum = 0.0;
    for (const Hit& hit : trials.hits[i]) {
      const double more = static_cast<double>(hit.value - best[hit.feature]);
      if (more > 0) sum += more / (1.0 + have[trials.view_of[hit.feature]] / kEnough);
    }
    return sum;
  };
  using Entry = std::pair<double, std::int64_t>;  // gain, minus the index: ties go to the first
  std::priority_queue<Entry> queue;
  for (std::uint32_t i = 0; i < trials.hits.size(); ++i) {
    if (!trials.hits[i].empty()) queue.emplace(gain(i), -static_cast<std::int64_t>(i));
  }
  std::vector<std::uint32_t> chosen;
  while (!queue.empty() && chosen.size() < count) {
    const Entry top = queue.top();
    queue.pop();
    const auto i = static_cast<std::uint32_t>(-top.second);
    const double now = gain(i);
    if (now <= 0.0) continue;
    if (!queue.empty() && now < queue.top().first) {
      queue.emplace(now, top.second);
      continue;
    }
    chosen.push_back(i);
    for (const Hit& hit : trials.hits[i]) {
      if (hit.value <= best[hit.feature]) continue;
      have[trials.view_of[hit.feature]] += static_cast<double>(hit.value - best[hit.feature]);
      best[hit.feature] = hit.value;
    }
  }
  repeated = std::accumulate(have.begin(), have.end(), 0.0) / std::max(1u, trials.views);
  return chosen;
}

// Rms gradient, grey values per pixel, that a patch needs in every direction. Lower accepts flat
// patches, which slide. [1.5, 6] tuned: pose
constexpr double kWeakestPatch = 3.0;

struct PatchPlace {
  int x = 0;
  int y = 0;
  double score = 0;
};

std::vector<PatchPlace> patch_places(const GrayPicture& picture, const PatternSurface& surface,
                                     double scale) {
  std::vector<PatchPlace> places;
  for (int y = kPatchBorder; y < picture.height - kPatchBorder; y += kPatchStep) {
    for (int x = kPatchBorder; x < picture.width - kPatchBorder; x += kPatchStep) {
      if (!on_one_face(surface, (x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5,
                       (kPatchBorder + 0.5) * scale)) {
        continue;
      }
      const double score = patch_score(picture, x, y);
      if (score >= kWeakestPatch) places.push_back({x, y, score});
    }
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const PatchPlace& a, const PatchPlace& b) { return a.score > b.score; });
  return places;
}

/// The best places, as far apart as `count` of them can be: distances from a quarter of the picture
/// down to 4 pixels are tried, each 0.8 of the one before.
std::vector<PatchPlace> spread_patches(const std::vector<PatchPlace>& places, std::uint32_t count,
                                       double side) {
  std::vector<PatchPlace> kept;
  for (double apart = side / 4; apart >= 4.0; apart *= 0.8) {
    kept.clear();
    for (const PatchPlace& place : places) {
      const bool free = std::none_of(kept.begin(), kept.end(), [&](const PatchPlace& other) {
        const double dx = place.x - other.x;
        const double dy = place.y - other.y;
        return dx * dx + dy * dy < apart * apart;
      });
      if (free) kept.push_back(place);
      if (kept.size() == count) return kept;
    }
  }
  return kept;
}

/// At most `count` patches a level, spread over the picture, by level and then by score.
std::vector<TrackerPatchRecord> choose_patches(const std::vector<ViewLevel>& levels,
                                               const PatternSurface& surface, std::uint32_t count) {
  std::vector<TrackerPatchRecord> patches;
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const GrayPicture& picture = levels[level];
    const auto scale = static_cast<double>(1u << level);
    for (const PatchPlace& place : spread_patches(patch_places(picture, surface, scale), count,
                                                  std::max(picture.width, picture.height))) {
      const TrackerPatchRecord record = patch_record(place.x, place.y, level, place.score);
      patches.push_back(record);
    }
  }
  return patches;
}

}  // namespace

Result<void> TrackerRecordOptions::validate() const {
  if (features < 32 || features > 32768 || trial_views < 1 || trial_views > 10000 ||
      patches_per_level < 8 || patches_per_level > 256) {
    return fail(ExitCode::kUsage, "pattern.loop-options", "", "an option is out of range",
                "features 32 to 32768, trial views 1 to 10000, patches 8 to 256");
  }
  return {};
}

Result<std::vector<std::byte>> make_tracker_record(const GrayImage& pattern,
                                                   const TrackerRecordOptions& options,
                                                   const PatternSurface& surface,
                                                   double* repeated) {
  MODAR_TRY(options.validate());
  if (!is_pattern_size(pattern.width, pattern.height)) {
    return fail(ExitCode::kInvalidInput, "pattern.loop-size", "",
                "each side of the picture needs 32 to 1023 pixels", "give another size");
  }
  const std::vector<ViewLevel> levels = view_levels(pattern);
  const std::vector<RecordFeature> candidates = find_candidates(levels, surface, options.jobs);
  const Trials trials = run_trials(levels, surface, candidates, options.trial_views, options.jobs);
  double matches = 0;
  const std::vector<std::uint32_t> chosen = choose(trials, options.features, matches);
  if (repeated != nullptr) *repeated = matches;
  if (chosen.size() < 8) {
    return fail(ExitCode::kInvalidInput, "pattern.no-features", "",
                "fewer than 8 features of the picture are found again in other views",
                "take a picture with more texture");
  }
  std::vector<RecordFeature> features;
  for (const std::uint32_t i : chosen) features.push_back(candidates[i]);
  return assemble_record({levels.begin(), levels.end()}, features,
                         choose_patches(levels, surface, options.patches_per_level));
}

}  // namespace modar
