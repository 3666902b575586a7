// Chooses, of all descriptors that rendered views of a pattern give, those that random views
// repeat.
#include "bake/pattern/tracker_record_bake.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <queue>

#include "bake/parallel.hpp"
#include "bake/pattern/described_view.hpp"
#include "bake/pattern/tracker_patches.hpp"
#include "bake/pattern/view_kernel.hpp"
#include "bake/pattern/view_render.hpp"
#include "formats/tracker_record.hpp"
#include "modar/tracker_features.hpp"

namespace modar {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kLargestSide = 1023;
constexpr double kScaleStep = 1.2599210498948732;  // three views an octave
constexpr int kScales = 7;
constexpr double kLogSmallest = -1.2039728043259361;  // of the trials' scales: 0.3
constexpr double kLogLargest = 0.69314718055994531;   // 2
constexpr int kMargin = 24;       // pixels around a rendered pattern: a patch and the border
constexpr int kNear = 3;          // view pixels between a trial's feature and a candidate
constexpr int kRepeats = 64;      // bits: a candidate within this of a trial's feature repeats it
constexpr double kEnough = 24.0;  // matches of a view after which more gain little

struct Candidate {
  double x = 0;  // pattern pixels
  double y = 0;
  std::array<double, 4> warp{};
  std::array<std::uint8_t, 32> code{};
  std::uint8_t dark = 0;
};

/// A candidate that repeats a trial's feature, and how well (0 to 1].
struct Hit {
  std::uint32_t feature = 0;
  float value = 0;
};

struct Trials {
  std::vector<std::vector<Hit>> hits;  // a list a candidate
  std::vector<std::uint32_t> view_of;  // a view a trial feature
  std::uint32_t views = 0;
};

bool within(const GrayImage& pattern, const std::array<double, 2>& p) {
  return p[0] >= -0.5 && p[1] >= -0.5 && p[0] < pattern.width - 0.5 && p[1] < pattern.height - 0.5;
}

std::vector<Candidate> candidates_of(const std::vector<ViewLevel>& levels, const AffineView& view) {
  std::vector<Candidate> candidates;
  const GrayPicture picture = render_view(levels, view, nullptr);
  const auto describer =
      FeatureExtractor::create(picture.width, picture.height, generous_detection());
  describer->set_frame(picture.view());
  for (const TrackerFeature& feature : describer->features()) {
    // Coarser levels show what views of smaller scale show.
    if (feature.level != 0) continue;
    const auto place =
        to_picture(view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    if (!within(levels[0].view(), place)) continue;
    Candidate candidate;
    candidate.x = place[0];
    candidate.y = place[1];
    const double c = static_cast<double>(feature.cosine);
    const double s = static_cast<double>(feature.sine);
    const auto& a = view.linear;
    candidate.warp = {c * a[0] + s * a[2], c * a[1] + s * a[3], c * a[2] - s * a[0],
                      c * a[3] - s * a[1]};
    candidate.code = feature.code;
    candidate.dark = feature.dark;
    candidates.push_back(candidate);
  }
  return candidates;
}

std::vector<Candidate> find_candidates(const std::vector<ViewLevel>& levels, unsigned jobs) {
  std::vector<AffineView> views;
  Random random(1);
  double scale = 1.0;
  for (int k = 0; k < kScales; ++k, scale /= kScaleStep) {
    // Directions get denser with the tilt (Yu & Morel, "ASIFT", 2011).
    for (const auto& [tilt, turns] : {std::pair{1.0, 2}, {1.5, 4}, {2.1, 6}, {2.9, 8}, {4.1, 11}}) {
      for (int i = 0; i < turns; ++i) {
        views.push_back(make_view(levels[0].width, levels[0].height, scale, tilt,
                                  turn_of(kPi * i / turns), turn_of(random.uniform(0.0, 2 * kPi)),
                                  kMargin));
      }
    }
  }
  std::vector<std::vector<Candidate>> found(views.size());
  parallel_rows(static_cast<std::uint32_t>(views.size()), jobs,
                [&](std::uint32_t i) { found[i] = candidates_of(levels, views[i]); });
  std::vector<Candidate> candidates;
  for (const auto& some : found) candidates.insert(candidates.end(), some.begin(), some.end());
  return candidates;
}

/// What a camera adds: other light and noise.
void disturb(Random& random, GrayPicture& picture) {
  const double gain = random.uniform(0.6, 1.25);
  const double bias = random.uniform(-20.0, 20.0);
  for (std::uint8_t& gray : picture.pixels) {
    const double seen = gain * gray + bias + 3.0 * random.normal();
    gray = static_cast<std::uint8_t>(std::clamp(seen + 0.5, 0.0, 255.0));
  }
}

/// Candidates by squares of the pattern, so that a trial's feature meets only its neighbours.
class Grid {
 public:
  Grid(const GrayImage& pattern, const std::vector<Candidate>& candidates)
      : columns_(pattern.width / kSquare + 1),
        rows_(pattern.height / kSquare + 1),
        cells_(static_cast<std::size_t>(2 * columns_ * rows_)) {
    for (std::uint32_t i = 0; i < candidates.size(); ++i) {
      const Candidate& candidate = candidates[i];
      cells_[index(square(candidate.x), square(candidate.y), candidate.dark)].push_back(
          {candidate.x, candidate.y, i});
      codes_.push_back(candidate.code);
    }
  }
  /// The candidates of the feature's polarity within the radius, and their codes' distances to its.
  void near(double x, double y, double radius, const TrackerFeature& feature,
            std::vector<std::uint32_t>& which, std::vector<int>& bits) const {
    which.clear();
    for (int row = std::max(0, square(y - radius)); row <= std::min(rows_ - 1, square(y + radius));
         ++row) {
      for (int column = std::max(0, square(x - radius));
           column <= std::min(columns_ - 1, square(x + radius)); ++column) {
        for (const Entry& entry : cells_[index(column, row, feature.dark)]) {
          const double dx = entry.x - x;
          const double dy = entry.y - y;
          if (dx * dx + dy * dy <= radius * radius) which.push_back(entry.candidate);
        }
      }
    }
    bits.resize(which.size());
    code_distances(feature.code, codes_.data(), which.data(), which.size(), bits.data());
  }

 private:
  static constexpr int kSquare = 4;
  /// What decides on a visit lies together: most candidates are looked at no further.
  struct Entry {
    double x;
    double y;
    std::uint32_t candidate;
  };
  static int square(double value) { return static_cast<int>(std::floor((value + 0.5) / kSquare)); }
  [[nodiscard]] std::size_t index(int column, int row, int dark) const {
    return static_cast<std::size_t>((dark * rows_ + row) * columns_ + column);
  }
  int columns_;
  int rows_;
  std::vector<std::vector<Entry>> cells_;
  std::vector<TrackerCode> codes_;
};

/// What a random view shows of the pattern: a hit list of (candidate, feature of the view).
struct TrialView {
  std::uint32_t features = 0;
  std::vector<std::pair<std::uint32_t, Hit>> hits;
};

TrialView run_trial(const std::vector<ViewLevel>& levels, std::uint64_t seed, const Grid& grid) {
  Random random(seed);
  const double scale = exp_of(random.uniform(kLogSmallest, kLogLargest));
  const double tilt = 1.0 / turn_of(random.uniform(0.0, 77.0) * kPi / 180.0).cosine;
  const Turn direction = turn_of(random.uniform(0.0, kPi));
  const Turn rotation = turn_of(random.uniform(0.0, 2 * kPi));
  const AffineView view =
      make_view(levels[0].width, levels[0].height, scale, tilt, direction, rotation, kMargin + 8);
  const GrayPicture background = made_clutter(random, view.width, view.height);
  GrayPicture picture = render_view(levels, view, &background);
  disturb(random, picture);
  const auto describer = FeatureExtractor::create(picture.width, picture.height, DetectOptions{});
  describer->set_frame(picture.view());
  const double mean_scale = scale / std::sqrt(tilt);
  TrialView trial;
  std::vector<std::uint32_t> which;
  std::vector<int> bits;
  for (const TrackerFeature& feature : describer->features()) {
    const auto place =
        to_picture(view, static_cast<double>(feature.x), static_cast<double>(feature.y));
    if (!within(levels[0].view(), place)) continue;
    const std::uint32_t id = trial.features++;
    const double radius = std::min(kNear * (1 << feature.level) / mean_scale, 16.0);
    grid.near(place[0], place[1], radius, feature, which, bits);
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (bits[i] > kRepeats) continue;
      trial.hits.push_back(
          {which[i], {id, static_cast<float>(kRepeats + 8 - bits[i]) / (kRepeats + 8)}});
    }
  }
  return trial;
}

Trials run_trials(const std::vector<ViewLevel>& levels, const std::vector<Candidate>& candidates,
                  std::uint32_t count, unsigned jobs) {
  const Grid grid(levels[0].view(), candidates);
  std::vector<TrialView> views(count);
  parallel_rows(count, jobs,
                [&](std::uint32_t i) { views[i] = run_trial(levels, 1000 + i, grid); });
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
std::vector<std::uint32_t> choose(const Trials& trials, std::uint32_t count) {
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
  return chosen;
}

/// Bright ones first, each group filled up to whole blocks; answers the number of bright ones.
std::uint32_t group(const std::vector<Candidate>& candidates, std::vector<std::uint32_t>& chosen) {
  std::vector<std::uint32_t> ordered;
  std::uint32_t bright = 0;
  for (int dark = 0; dark < 2; ++dark) {
    for (const std::uint32_t i : chosen) {
      if (candidates[i].dark == dark) ordered.push_back(i);
    }
    while (!ordered.empty() && ordered.size() % kTrackerBlockCodes != 0)
      ordered.push_back(ordered.back());
    if (dark == 0) bright = static_cast<std::uint32_t>(ordered.size());
  }
  chosen = std::move(ordered);
  return bright;
}

TrackerFeatureRecord feature_record(const Candidate& candidate) {
  TrackerFeatureRecord record{};
  record.x = static_cast<std::uint16_t>(std::lround((candidate.x + 0.5) * 64));
  record.y = static_cast<std::uint16_t>(std::lround((candidate.y + 0.5) * 64));
  for (std::size_t k = 0; k < 4; ++k) {
    record.warp[k] = static_cast<std::int16_t>(std::lround(candidate.warp[k] * 4096));
  }
  return record;
}

template <class T>
void put(std::vector<std::byte>& bytes, std::uint64_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

std::vector<std::byte> assemble(const std::vector<ViewLevel>& levels,
                                const std::vector<Candidate>& candidates,
                                std::vector<std::uint32_t> chosen,
                                const std::vector<TrackerPatchRecord>& patches) {
  TrackerRecordHeader header{};
  header.describer_version = kFeatureExtractorVersion;
  header.bright_count = group(candidates, chosen);
  header.feature_count = static_cast<std::uint32_t>(chosen.size());
  header.patch_count = static_cast<std::uint32_t>(patches.size());
  header.width = static_cast<std::uint32_t>(levels[0].width);
  header.height = static_cast<std::uint32_t>(levels[0].height);
  header.level_count = static_cast<std::uint32_t>(levels.size());
  header.codes_offset = sizeof header;
  header.features_offset = header.codes_offset + chosen.size() * kTrackerCodeBytes;
  header.patches_offset = header.features_offset + chosen.size() * sizeof(TrackerFeatureRecord);
  header.pixels_offset = header.patches_offset + patches.size() * sizeof(TrackerPatchRecord);
  std::vector<std::byte> bytes(header.pixels_offset);
  put(bytes, 0, header);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Candidate& candidate = candidates[chosen[i]];
    const std::size_t block = i / kTrackerBlockCodes;
    for (std::size_t k = 0; k < kTrackerCodeBytes; ++k) {
      put(bytes,
          header.codes_offset + (block * kTrackerCodeBytes + k) * kTrackerBlockCodes +
              i % kTrackerBlockCodes,
          candidate.code[k]);
    }
    put(bytes, header.features_offset + i * sizeof(TrackerFeatureRecord),
        feature_record(candidate));
  }
  for (std::size_t i = 0; i < patches.size(); ++i) {
    put(bytes, header.patches_offset + i * sizeof(TrackerPatchRecord), patches[i]);
  }
  for (const ViewLevel& level : levels) {
    const auto pixels = std::as_bytes(std::span(level.pixels));
    bytes.insert(bytes.end(), pixels.begin(), pixels.end());
  }
  return bytes;
}

}  // namespace

Result<void> TrackerRecordOptions::validate() const {
  if (features < 32 || features > 32768 || trial_views < 1 || trial_views > 10000 ||
      patches_per_level < 8 || patches_per_level > 256) {
    return fail(ExitCode::kUsage, "pattern.loop-options", "", "an option is out of its range",
                "features 32 to 32768, trial views 1 to 10000, patches 8 to 256");
  }
  return {};
}

Result<std::vector<std::byte>> bake_tracker_record(const GrayImage& pattern,
                                                   const TrackerRecordOptions& options) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  if (pattern.width < 32 || pattern.height < 32 || pattern.width > kLargestSide ||
      pattern.height > kLargestSide) {
    return fail(ExitCode::kInvalidInput, "pattern.loop-size", "",
                "the picture is smaller than 32 or larger than 1023 pixels on a side",
                "give another size");
  }
  const std::vector<ViewLevel> levels = view_levels(pattern);
  const std::vector<Candidate> candidates = find_candidates(levels, options.jobs);
  const Trials trials = run_trials(levels, candidates, options.trial_views, options.jobs);
  const std::vector<std::uint32_t> chosen = choose(trials, options.features);
  if (chosen.size() < 8) {
    return fail(ExitCode::kInvalidInput, "pattern.no-features", "",
                "fewer than 8 features of the picture repeat from view to view",
                "take a picture with more texture");
  }
  return assemble(levels, candidates, chosen, choose_patches(levels, options.patches_per_level));
}

}  // namespace modar
