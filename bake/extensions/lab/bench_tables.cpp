// The ModAR paper's Tables 6 to 8 and what it states of accuracy, compared with the same figures
// measured here: its method under its four parameter sets, and ours, on the same frames.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <string>

#include <opencv2/imgproc.hpp>

#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/process/process.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

/// The paper's patterns, Table 3: pixels.
struct PaperPattern {
  const char* name;
  int width;
  int height;
};
constexpr std::size_t kPatterns = 6;
constexpr PaperPattern kPaperPatterns[kPatterns] = {
    {"botero", 348, 717},  {"scythe", 300, 245},   {"surveying", 310, 450},
    {"jeffers", 250, 294}, {"painting", 336, 252}, {"graffiti", 400, 347}};

/// What the paper prints of one parameter set.
struct PaperColumn {
  const char* set;
  double features[kPatterns];  ///< Table 6: of its patterns
  double frame_features[2];    ///< Table 6: of a frame, least and most
  double inliers[2];           ///< the same
  double seconds[2][4];        ///< Tables 7 and 8: detection, description, matching, homography
  double cpu_pct[2][4];        ///< the same
  double accuracy_far_pct;     ///< area ratios 0.4 to 0.9; from there to 4 all reach 100
};
constexpr PaperColumn kPaper[] = {{"orb-2000",
                                   {823, 1189, 1595, 1079, 604, 1279},
                                   {300, 2000},
                                   {10, 200},
                                   {{0.086, 0.230, 0.020, 0.098}, {0.069, 0.194, 0.070, 0.023}},
                                   {{12.51, 32.09, 2.82, 19.37}, {14.21, 37.46, 13.94, 3.89}},
                                   93},
                                  {"orb-500",
                                   {495, 430, 485, 437, 400, 475},
                                   {100, 500},
                                   {10, 100},
                                   {{0.069, 0.189, 0.016, 0.035}, {0.057, 0.155, 0.012, 0.026}},
                                   {{12.02, 34.29, 3.20, 6.30}, {10.33, 35.25, 3.40, 5.30}},
                                   88},
                                  {"brisk-3",
                                   {248, 544, 781, 564, 174, 603},
                                   {500, 2500},
                                   {10, 300},
                                   {{2.425, 2.337, 0.029, 0.089}, {1.926, 1.795, 0.027, 0.080}},
                                   {{49.47, 45.91, 0.53, 1.49}, {49.52, 45.50, 0.53, 1.50}},
                                   97},
                                  {"brisk-2",
                                   {231, 540, 761, 553, 168, 588},
                                   {500, 2500},
                                   {10, 250},
                                   {{2.296, 2.229, 0.026, 0.063}, {1.851, 1.656, 0.023, 0.050}},
                                   {{47.73, 46.69, 0.43, 1.31}, {47.70, 46.51, 0.41, 1.28}},
                                   95}};
/// The paper's bound for what its workflow does beyond the four stages, mainly reading the YML.
constexpr double kPaperRestMs = 250;
constexpr const PaperColumn& kRichest = kPaper[2];  ///< pictures are blurred to its counts
constexpr const char* kTables[] = {"table7_", "table8_"};
constexpr const char* kStages[] = {"detect", "describe", "match", "homography"};
constexpr const char* kFar = "area 0.4-0.9";
constexpr const char* kNear = "area 0.9-4";

const ParameterSetRecord& set_named(const char* name) {
  const auto sets = paper_parameter_sets();
  return *std::find_if(sets.begin(), sets.end(), [&](const ParameterSetRecord& set) {
    return std::string(parameter_set_name(set.id)) == name;
  });
}

/// Which of the paper's patterns has this size; kPatterns: none.
std::size_t paper_pattern(const GrayPicture& picture) {
  std::size_t p = 0;
  while (p < kPatterns &&
         (kPaperPatterns[p].width != picture.width || kPaperPatterns[p].height != picture.height)) {
    ++p;
  }
  return p;
}

/// A picture of the paper's size, blurred until AGAST-BRISK-3 finds no more in it than in the
/// paper's: prints that were drawn are sharper than its scans, and would cost another work.
Result<GrayPicture> as_rich_as(const GrayPicture& picture, double features) {
  constexpr double kMostBlur = 8;  // pixels
  constexpr int kSteps = 10;
  double low = 0;
  double high = kMostBlur;
  GrayPicture soft = picture;
  cv::Mat from(picture.height, picture.width, CV_8UC1,
               const_cast<std::uint8_t*>(picture.pixels.data()));
  cv::Mat to(soft.height, soft.width, CV_8UC1, soft.pixels.data());
  for (int step = 0; step < kSteps; ++step) {
    const double sigma = (low + high) / 2;
    cv::GaussianBlur(from, to, {}, sigma);
    MODAR_ASSIGN(const auto found, describe_image(soft.view(), set_named(kRichest.set)));
    (static_cast<double>(found.keypoints.size()) > features ? low : high) = sigma;
  }
  cv::GaussianBlur(from, to, {}, high);
  return soft;
}

/// The patterns as pictures in `folder`; those that have a size of the paper's as rich as its own.
Result<std::vector<std::string>> paper_patterns(const std::vector<std::string>& paths,
                                                const std::string& folder) {
  std::vector<std::string> out;
  for (const std::string& path : paths) {
    bool shrunk = false;
    MODAR_ASSIGN(GrayPicture picture, load_pattern(path, shrunk));
    const std::size_t p = paper_pattern(picture);
    if (p < kPatterns) {
      MODAR_ASSIGN(picture, as_rich_as(picture, kRichest.features[p]));
    }
    RgbaImage image;
    image.width = static_cast<std::uint32_t>(picture.width);
    image.height = static_cast<std::uint32_t>(picture.height);
    for (const std::uint8_t gray : picture.pixels) {
      image.pixels.insert(image.pixels.end(), {gray, gray, gray, 255});
    }
    out.push_back(folder + "/" + std::filesystem::path(path).stem().string() + ".png");
    MODAR_TRY(write_png(image, out.back()));
  }
  return out;
}

void add(std::vector<BenchRow>& rows, const std::string& measure, double ours, double reference) {
  rows.push_back({measure, ours, reference, ratio(ours, reference)});
}

/// Features as the paper's prototype stored them: FileStorage's usual text, all in decimals.
std::string usual_yml(const Features& features) {
  std::vector<cv::KeyPoint> keypoints;
  for (const KeypointRecord& k : features.keypoints) {
    keypoints.push_back({k.x, k.y, k.size, k.angle, k.response, k.octave, k.class_id});
  }
  cv::Mat descriptors(static_cast<int>(keypoints.size()),
                      static_cast<int>(features.descriptor_bytes), CV_8UC1);
  std::copy(features.descriptors.begin(), features.descriptors.end(),
            reinterpret_cast<std::byte*>(descriptors.data));
  cv::FileStorage storage(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  cv::write(storage, "keypoints", keypoints);
  storage << "descriptors" << descriptors;
  return storage.releaseAndGetString();
}

/// Table 6 of the patterns themselves, blurred to the paper's counts, and of the shipped pictures.
/// Adds up the time of reading their YML, in milliseconds.
Result<void> add_pattern_features(const PoseBenchOptions& options,
                                  const std::vector<std::string>& shipped,
                                  const PaperColumn& column, double& yml_ms,
                                  std::vector<BenchRow>& rows) {
  double sum = 0;
  double sum_shipped = 0;
  double paper = 0;
  for (std::size_t i = 0; i < options.patterns.size(); ++i) {
    const std::string& path = options.patterns[i];
    bool shrunk = false;
    MODAR_ASSIGN(const auto sharp, load_pattern(shipped[i], shrunk));
    MODAR_ASSIGN(const auto unblurred, describe_image(sharp.view(), set_named(column.set)));
    MODAR_ASSIGN(const auto picture, load_pattern(path, shrunk));
    MODAR_ASSIGN(const auto features, describe_image(picture.view(), set_named(column.set)));
    const auto count = static_cast<double>(features.keypoints.size());
    const std::size_t p = paper_pattern(picture);
    const std::string name =
        std::filesystem::path(path).stem().string() +
        (p < kPatterns ? "/" + std::string(kPaperPatterns[p].name) : std::string());
    const double theirs = p < kPatterns ? column.features[p] : kNoFigure;
    const auto count_shipped = static_cast<double>(unblurred.keypoints.size());
    add(rows, "table6_blurred_features " + name + " " + column.set, count, theirs);
    add(rows, "table6_shipped_features " + name + " " + column.set, count_shipped, theirs);
    sum += count;
    sum_shipped += count_shipped;
    paper += theirs;
    const std::string yml = usual_yml(features);
    const auto begin = std::chrono::steady_clock::now();
    MODAR_ASSIGN(const auto read, features_from_yml(yml));
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - begin;
    yml_ms += spent.count() / static_cast<double>(options.patterns.size());
  }
  const auto patterns = static_cast<double>(options.patterns.size());
  const std::string mean = std::string("features mean ") + column.set;
  add(rows, "table6_blurred_" + mean, sum / patterns, paper / patterns);
  add(rows, "table6_shipped_" + mean, sum_shipped / patterns, paper / patterns);
  return {};
}

/// What one method took over both bands, in milliseconds a frame.
struct MethodCost {
  double stages[4] = {0, 0, 0, 0};
  double ms = 0;  ///< of the thread's CPU time; the stages are wall clock
  IntRange features;
  IntRange inliers;
  [[nodiscard]] double total() const { return stages[0] + stages[1] + stages[2] + stages[3]; }
};

MethodCost cost_of(const std::vector<PoseBenchRow>& measured, const std::string& method) {
  MethodCost cost;
  double frames = 0;
  for (const PoseBenchRow& row : measured) {
    if (row.method != method) continue;
    for (std::size_t i = 0; i < 4; ++i) cost.stages[i] += row.stages_ms[i] * row.frames;
    cost.ms += row.ms * row.frames;
    frames += row.frames;
    for (const int bound : {row.features.least, row.features.most}) cost.features.take(bound);
    if (!row.inliers.any) continue;
    for (const int bound : {row.inliers.least, row.inliers.most}) cost.inliers.take(bound);
  }
  for (double& stage : cost.stages) stage /= frames;
  cost.ms /= frames;
  return cost;
}

/// Recognition and accuracy in each band. paper: null for ours.
void add_accuracy(const std::vector<PoseBenchRow>& measured, const std::string& method,
                  const std::string& name, const PaperColumn* paper, std::vector<BenchRow>& rows) {
  for (const PoseBenchRow& row : measured) {
    if (row.method != method) continue;
    const double near_pct = row.band == kFar && paper != nullptr ? paper->accuracy_far_pct : 100.0;
    add(rows, "accuracy_pct " + row.band + " " + name, 100.0 * row.recognised / row.frames,
        paper == nullptr ? kNoFigure : near_pct);
    add(rows, "right_pct " + row.band + " " + name, 100.0 * row.right / row.frames, kNoFigure);
  }
}

/// Tables 6 (of frames), 7 and 8. yml_ms: what a frame's reading of the YML takes, as in the
/// paper's prototype; 0 for ours, which maps its record.
void add_costs(const MethodCost& cost, const std::string& name, const PaperColumn* paper,
               double yml_ms, std::vector<BenchRow>& rows) {
  const auto range = [&](const char* what, const IntRange& ours, const double* theirs) {
    const std::string head = std::string("table6_") + what;
    add(rows, head + "_least " + name, ours.least, theirs != nullptr ? theirs[0] : kNoFigure);
    add(rows, head + "_most " + name, ours.most, theirs != nullptr ? theirs[1] : kNoFigure);
  };
  range("frame_features", cost.features, paper != nullptr ? paper->frame_features : nullptr);
  range("inliers", cost.inliers, paper != nullptr ? paper->inliers : nullptr);
  const double workflow = cost.total() + yml_ms;
  for (std::size_t device = 0; device < 2; ++device) {
    const std::string table = kTables[device];
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double ms = paper != nullptr ? 1e3 * paper->seconds[device][i] : kNoFigure;
      add(rows, table + kStages[i] + "_ms " + name, cost.stages[i], ms);
      add(rows, table + kStages[i] + "_cpu_pct " + name, 100 * cost.stages[i] / workflow,
          paper != nullptr ? paper->cpu_pct[device][i] : kNoFigure);
      sum += ms;
    }
    add(rows, table + "four_stages_ms " + name, cost.total(), sum);
  }
  add(rows, "read_yml_ms " + name, yml_ms, paper != nullptr ? kPaperRestMs : kNoFigure);
  add(rows, "cpu_ms " + name, cost.ms, kNoFigure);
}

/// By how much the four stages of FAST-ORB-2000 are shorter than those of AGAST-BRISK-3.
void add_reduction(double orb_ms, double brisk_ms, std::vector<BenchRow>& rows) {
  constexpr const char* kDevices[] = {"low_end", "mid_range"};
  for (std::size_t device = 0; device < 2; ++device) {
    const auto total = [device](const PaperColumn& column) {
      return std::accumulate(column.seconds[device], column.seconds[device] + 4, 0.0);
    };
    add(rows, std::string("reduction_pct orb-2000/brisk-3 ") + kDevices[device],
        100 * (1 - orb_ms / brisk_ms), 100 * (1 - total(kPaper[0]) / total(kRichest)));
  }
}

}  // namespace

Result<std::vector<BenchRow>> paper_rows(const PoseBenchOptions& asked,
                                         const ProgressCallback& progress) {
  const TemporaryFolder folder;
  PoseBenchOptions options = asked;
  MODAR_ASSIGN(options.patterns, paper_patterns(asked.patterns, folder.path()));
  options.known_camera = true;  // as the paper's is calibrated
  options.bands.clear();
  for (const SceneBand& band : pose_bands()) {
    if (band.name == kFar || band.name == kNear) options.bands.push_back(band);
  }
  std::vector<BenchRow> rows;
  double four_stages[std::size(kPaper)] = {};
  for (std::size_t i = 0; i < std::size(kPaper); ++i) {
    const PaperColumn& column = kPaper[i];
    options.ours = i == 0;
    options.paper_set = set_named(column.set).id;
    double yml_ms = 0;
    MODAR_TRY(add_pattern_features(options, asked.patterns, column, yml_ms, rows));
    MODAR_ASSIGN(const auto measured, bench_detection(options, progress));
    if (options.ours) {
      add_accuracy(measured, "ours", "ours", nullptr, rows);
      add_costs(cost_of(measured, "ours"), "ours", nullptr, 0, rows);
    }
    const MethodCost cost = cost_of(measured, "paper");
    add_accuracy(measured, "paper", column.set, &column, rows);
    add_costs(cost, column.set, &column, yml_ms, rows);
    four_stages[i] = cost.total();
  }
  add_reduction(four_stages[0], four_stages[2], rows);
  return rows;
}

}  // namespace modar
