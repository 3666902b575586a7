// The ModAR paper's Tables 6 to 8 and what it states of accuracy, beside the same figures measured
// here: its method under its four parameter sets, and ours, on the same frames.
#include <cmath>
#include <string>

#include "bake/lab/bench_parts.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

/// What the paper prints of one parameter set.
struct PaperColumn {
  const char* set;
  double features[6];       ///< Table 6: of its six patterns
  double low_seconds[4];    ///< Table 7: detection, description, matching, homography
  double mid_seconds[4];    ///< Table 8
  double accuracy_far_pct;  ///< area ratios 0.4 to 0.9; from there to 4 all reach 100
};
constexpr PaperColumn kPaper[] = {{"orb-2000",
                                   {823, 1189, 1595, 1079, 604, 1279},
                                   {0.086, 0.230, 0.020, 0.098},
                                   {0.069, 0.194, 0.070, 0.023},
                                   93},
                                  {"orb-500",
                                   {495, 430, 485, 437, 400, 475},
                                   {0.069, 0.189, 0.016, 0.035},
                                   {0.057, 0.155, 0.012, 0.026},
                                   88},
                                  {"brisk-3",
                                   {248, 544, 781, 564, 174, 603},
                                   {2.425, 2.337, 0.029, 0.089},
                                   {1.926, 1.795, 0.027, 0.080},
                                   97},
                                  {"brisk-2",
                                   {231, 540, 761, 553, 168, 588},
                                   {2.296, 2.229, 0.026, 0.063},
                                   {1.851, 1.656, 0.023, 0.050},
                                   95}};
constexpr const char* kStages[] = {"detect_ms", "describe_ms", "match_ms", "homography_ms"};
constexpr const char* kFar = "area 0.4-0.9";
constexpr const char* kNear = "area 0.9-4";

Result<double> mean_features(const PoseBenchOptions& options, const ParameterSetRecord& set) {
  double sum = 0;
  for (const std::string& path : options.patterns) {
    bool shrunk = false;
    MODAR_ASSIGN(const auto picture, load_pattern(path, shrunk));
    MODAR_ASSIGN(const auto features, describe_image(picture.view(), set));
    sum += static_cast<double>(features.keypoints.size());
  }
  return sum / static_cast<double>(options.patterns.size());
}

/// Rows of one method: its stages over both bands, its accuracy in each. paper: null for ours.
void add_method(const std::vector<PoseBenchRow>& measured, const std::string& method,
                const std::string& name, const PaperColumn* paper, std::vector<BenchRow>& rows) {
  double stages[4] = {0, 0, 0, 0};
  double ms = 0;
  double frames = 0;
  for (const PoseBenchRow& row : measured) {
    if (row.method != method) continue;
    for (std::size_t i = 0; i < 4; ++i) stages[i] += row.stages_ms[i] * row.frames;
    ms += row.ms * row.frames;
    frames += row.frames;
    const double paper_pct = paper == nullptr   ? kNoFigure
                             : row.band == kFar ? paper->accuracy_far_pct
                                                : 100.0;
    const double recognised = 100.0 * row.recognised / row.frames;
    rows.push_back({"accuracy_pct " + row.band + " " + name, recognised, paper_pct,
                    ratio(recognised, paper_pct)});
    rows.push_back({"right_pct " + row.band + " " + name, 100.0 * row.right / row.frames, kNoFigure,
                    kNoFigure});
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const double here = stages[i] / frames;
    const double low = paper == nullptr ? kNoFigure : 1e3 * paper->low_seconds[i];
    const double mid = paper == nullptr ? kNoFigure : 1e3 * paper->mid_seconds[i];
    rows.push_back({std::string("table7_") + kStages[i] + " " + name, here, low, ratio(here, low)});
    rows.push_back({std::string("table8_") + kStages[i] + " " + name, here, mid, ratio(here, mid)});
  }
  rows.push_back({"cpu_ms " + name, ms / frames, kNoFigure, kNoFigure});
}

}  // namespace

Result<std::vector<BenchRow>> paper_rows(const PoseBenchOptions& options,
                                         const ProgressCallback& progress) {
  std::vector<BenchRow> rows;
  bool first = true;
  for (const PaperColumn& column : kPaper) {
    PoseBenchOptions run = options;
    run.ours = first;
    run.bands.clear();
    for (const SceneBand& band : pose_bands()) {
      if (band.name == kFar || band.name == kNear) run.bands.push_back(band);
    }
    for (const ParameterSetRecord& set : paper_parameter_sets()) {
      if (std::string(parameter_set_name(set.id)) != column.set) continue;
      run.paper_set = set.id;
      MODAR_ASSIGN(const double features, mean_features(options, set));
      double paper = 0;
      for (const double count : column.features) paper += count / 6;
      rows.push_back(
          {std::string("table6_features ") + column.set, features, paper, ratio(features, paper)});
    }
    MODAR_ASSIGN(const auto measured, bench_detection(run, progress));
    if (first) add_method(measured, "ours", "ours", nullptr, rows);
    add_method(measured, "paper", column.set, &column, rows);
    first = false;
  }
  return rows;
}

}  // namespace modar
