// Scores and measured working ranges, pattern by pattern.
#include "bake/lab/score_bench.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <thread>

#include "bake/pattern/pose_subject.hpp"
#include "bake/pattern/score.hpp"
#include "bake/pattern/view_trial.hpp"
#include "formats/bundle_view.hpp"

namespace modar {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLargest = 150;  // frame pixels: root of the area of the nearest views
constexpr double kStep = 1.15;
constexpr int kSizes = 10;
constexpr double kTilts[] = {54, 58, 62, 66, 70, 74, 78, 82};
constexpr double kTiltStep = 4;
constexpr double kEasySide = 240;

std::vector<TrialSetting> settings_of(const GrayImage& picture) {
  const double own = 1.0 * picture.width * picture.height;
  std::vector<TrialSetting> settings;
  const auto add = [&](double side, double low, double high) {
    TrialSetting setting;
    const double foreshortened = std::cos(0.5 * (low + high) * kPi / 180);
    setting.band.area_low = setting.band.area_high = side * side / own * foreshortened;
    setting.band.tilt_low = low;
    setting.band.tilt_high = high;
    settings.push_back(setting);
  };
  for (int k = 0; k < kSizes; ++k) add(kLargest / std::pow(kStep, k), 0, 30);
  const double side = std::min(std::sqrt(own), kEasySide);
  for (const double tilt : kTilts) add(side, tilt, tilt);
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
  const auto backgrounds = load_backgrounds(options.backgrounds, options.width, options.height);
  if (!backgrounds) return tl::unexpected(backgrounds.error());
  PoseBenchOptions ours = options;
  ours.paper_set = 0;
  ours.ours = false;
  TrialBed bed;
  bed.camera = default_camera(options.width, options.height);
  bed.backgrounds = *backgrounds;
  bed.views = options.frames;
  bed.seed = options.seed;
  bed.jobs = std::thread::hardware_concurrency();
  std::vector<ScoreBenchRow> rows;
  for (const std::string& path : options.patterns) {
    const auto subject = make_subject({path}, ours, bed.camera, true);
    if (!subject) return tl::unexpected(subject.error());
    bed.picture = subject->pictures[0].view();
    bed.bundle = subject->bytes;
    const auto score = score_pattern(
        bed.picture, BundleView::open(subject->bytes)->section(SectionType::kTrackerRecord, 0, 0),
        bed.jobs);
    if (!score) return tl::unexpected(score.error());
    const auto outcomes = try_views(bed, settings_of(bed.picture), {});
    if (!outcomes) return tl::unexpected(outcomes.error());
    ScoreBenchRow row;
    row.name = std::filesystem::path(path).stem().string();
    row.score = score->score;
    row.tuned = rows.size() % 2 == 0;
    // A step counts by the share of its views that are right: the mean place of the range's end.
    double steps = 0;
    for (int k = 0; k < kSizes; ++k)
      steps += (*outcomes)[static_cast<std::size_t>(k)].right_share();
    row.farthest = bed.camera.fx / kLargest * std::pow(kStep, steps - 0.5);
    row.tilt_deg = kTilts[0] - 0.5 * kTiltStep;
    for (std::size_t k = kSizes; k < outcomes->size(); ++k) {
      row.tilt_deg += kTiltStep * (*outcomes)[k].right_share();
    }
    rows.push_back(row);
    if (progress) {
      progress("scores",
               static_cast<double>(rows.size()) / static_cast<double>(options.patterns.size()));
    }
  }
  return rows;
}

}  // namespace modar
