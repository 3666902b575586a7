// Measures scores and working ranges, pattern by pattern.
#include "bake/extensions/lab/score_bench.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <thread>

namespace modar {
namespace {

// Largest size and smallest tilt, at which every picture of the test data is recognised.
constexpr double kLargest = 150;
constexpr double kStep = 1.15;  // from one size to the next
constexpr int kSizes = 10;
constexpr double kTilts[] = {54, 58, 62, 66, 70, 74, 78, 82};  // degrees
constexpr double kTiltStep = 4;
constexpr double kTiltSide = 240;  // frame pixels: root of the area of the tilted views, if frontal

std::vector<TrialSetting> settings_of(const GrayImage& picture) {
  const double own = 1.0 * picture.width * picture.height;
  std::vector<TrialSetting> settings;
  const auto add = [&](double side, double low, double high) {
    TrialSetting setting;
    const double foreshortened = std::cos(0.5 * (low + high) * std::numbers::pi / 180);
    setting.band.area_low = setting.band.area_high = side * side / own * foreshortened;
    setting.band.tilt_low = low;
    setting.band.tilt_high = high;
    settings.push_back(setting);
  };
  for (int k = 0; k < kSizes; ++k) add(kLargest / std::pow(kStep, k), 0, 30);
  const double side = std::min(std::sqrt(own), kTiltSide);
  for (const double tilt : kTilts) add(side, tilt, tilt);
  add(side, 0, 45);
  settings.back().band.covered_low = settings.back().band.covered_high = 0.5;
  return settings;
}

std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<double> ranks;
  for (const double value : values) {
    const auto below =
        std::count_if(values.begin(), values.end(), [&](double v) { return v < value; });
    const auto equal = std::count(values.begin(), values.end(), value);
    ranks.push_back(static_cast<double>(below) + 0.5 * static_cast<double>(equal - 1));
  }
  return ranks;
}

}  // namespace

double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto ra = ranks_of(a);
  const auto rb = ranks_of(b);
  const double mean = 0.5 * (static_cast<double>(a.size()) - 1);
  double both = 0;
  double first = 0;
  double second = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    both += (ra[i] - mean) * (rb[i] - mean);
    first += (ra[i] - mean) * (ra[i] - mean);
    second += (rb[i] - mean) * (rb[i] - mean);
  }
  return first > 0 && second > 0 ? both / std::sqrt(first * second) : 0;
}

Result<std::vector<ScoreBenchRow>> bench_scores(const PoseBenchOptions& options,
                                                const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto backgrounds,
               load_backgrounds(options.backgrounds, options.width, options.height));
  TrialSetup setup;
  setup.camera = default_camera(options.width, options.height);
  setup.backgrounds = backgrounds;
  setup.views = options.frames;
  setup.seed = options.seed;
  setup.jobs = std::thread::hardware_concurrency();
  std::vector<ScoreBenchRow> rows;
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    MODAR_ASSIGN(const GrayPicture picture, load_pattern(path, shrunk));
    MODAR_ASSIGN(const auto record, make_tracker_record(picture.view(), {}));
    MODAR_ASSIGN(const PatternScore score, score_pattern(picture.view(), record, setup.jobs));
    MODAR_ASSIGN(const auto bundle, bundle_of_record(picture.view(), record));
    setup.picture = picture.view();
    setup.bundle = bundle;
    MODAR_ASSIGN(const auto outcomes, try_views(setup, settings_of(setup.picture), {}));
    ScoreBenchRow row;
    row.name = std::filesystem::path(path).stem().string();
    row.score = score.score;
    row.grade = score.grade;
    row.graded = range_value(score.range);
    row.tuned = rows.size() % 2 == 0;
    ScoreRange& range = row.measured;
    // A step counts by the share of its views that are right: the mean place of the range's end.
    double steps = 0;
    for (int k = 0; k < kSizes; ++k) steps += outcomes[static_cast<std::size_t>(k)].right_share();
    const double aspect = std::sqrt(1.0 * setup.picture.width / setup.picture.height);
    range.farthest = setup.camera.fx / kLargest * std::pow(kStep, steps - 0.5) / aspect;
    range.tilt_deg = kTilts[0] - 0.5 * kTiltStep;
    for (std::size_t k = 0; k < std::size(kTilts); ++k) {
      range.tilt_deg += kTiltStep * outcomes[kSizes + k].right_share();
    }
    range.covered_share = outcomes.back().right_share();
    rows.push_back(row);
    if (progress) {
      progress("scores",
               static_cast<double>(rows.size()) / static_cast<double>(options.patterns.size()));
    }
  }
  return rows;
}

}  // namespace modar
