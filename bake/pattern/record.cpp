// A picture's record, its score, and its description under the ModAR paper's parameter sets.
#include "bake/pattern/record.hpp"

#include <algorithm>
#include <cmath>

#include "bake/pattern/picture.hpp"
#include "bake/pattern/score.hpp"
#include "formats/base/path.hpp"
#include "formats/base/shortest_number.hpp"
#include "modar/features.hpp"
#include "modar/pose.hpp"

namespace modar {
namespace {

Result<FeatureContent> paper_features(const GrayImage& image,
                                      const ParameterSetRecord& parameters) {
  MODAR_ASSIGN(auto features, describe_image(image, parameters));
  FeatureContent content;
  content.yml = features_to_yml(features);
  content.set_id = parameters.id;
  content.descriptor_bytes = features.descriptor_bytes;
  content.keypoints = std::move(features.keypoints);
  content.descriptors = std::move(features.descriptors);
  return content;
}

/// "A: recognised from 34 cm to 3.8 m, ...", and what the causes advise.
Result<void> add_score(const std::string& path, const GrayImage& gray, unsigned jobs,
                       PatternFeatures& out, Report& report) {
  MODAR_ASSIGN(const PatternScore score, score_pattern(gray, out.loop_record, jobs, out.shape));
  out.record.score = static_cast<float>(score.score);
  out.record.score_version = kScoreVersion;
  out.range = score.range;
  const auto worst =
      std::min_element(score.causes.begin(), score.causes.end(),
                       [](const ScoreCause& a, const ScoreCause& b) { return a.value < b.value; });
  const std::string advice =
      *worst->advice == 0 ? "" : std::string(worst->id) + ": " + worst->advice;
  const bool weak = score.grade >= kWeakGrade;
  report.diagnostics.push_back({weak ? "pattern.weak" : "pattern.score",
                                weak ? DiagnosticSeverity::kWarning : DiagnosticSeverity::kInfo,
                                path, 0,
                                std::string("grade ") + score.grade + ", " +
                                    range_sentence(score.range, out.record.width_mm),
                                advice});
  return {};
}

}  // namespace

namespace {

/// Says that pictures of a box's sides were not cut along its edges.
void report_crops(const std::string& path, const ShapedPicture& shaped, Report& report) {
  if (!(shaped.corrected > 0)) return;
  const auto tenths = static_cast<int>(std::lround(1000 * shaped.corrected));
  report.diagnostics.push_back(
      {"pattern.crops",
       shaped.cut_beyond ? DiagnosticSeverity::kWarning : DiagnosticSeverity::kInfo, path, 0,
       "print that runs over the box's edges does not meet there: edges of the pictures were moved "
       "by "
       "up to " +
           std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " % of a side" +
           (shaped.cut_beyond ? ", some are further off" : ""),
       shaped.cut_beyond ? "cut the pictures again, along the edges of their sides" : ""});
}

}  // namespace

Result<PatternFeatures> bake_pattern(const std::string& path, double width_mm,
                                     std::span<const ParameterSetRecord> sets,
                                     const TrackerRecordOptions& options, Report& report,
                                     const ShapeRequest& shape) {
  StageTimer timer(report, "pattern");
  MODAR_ASSIGN(ShapedPicture shaped, load_shaped(path, width_mm, shape));
  const GrayImage gray = shaped.picture.view();
  if (shaped.shrunk) {
    report.diagnostics.push_back({"pattern.resized", DiagnosticSeverity::kInfo, path, 0,
                                  "the picture was made smaller, to " + std::to_string(gray.width) +
                                      "x" + std::to_string(gray.height) + " pixels",
                                  ""});
  }
  if (shaped.width_of_file) {
    report.diagnostics.push_back(
        {"pattern.width", DiagnosticSeverity::kInfo, path, 0,
         "the file states that it is printed " +
             shortest_text(std::round(10.0 * double{shaped.width_mm}) / 10) + " mm wide",
         "if it is not, write the width behind its name, as in " + file_stem(path) + ".png:210mm"});
  }
  report_crops(path, shaped, report);
  PatternFeatures out;
  out.name = file_stem(path);
  out.record.width = static_cast<std::uint32_t>(gray.width);
  out.record.height = static_cast<std::uint32_t>(gray.height);
  out.record.width_mm = shaped.width_mm;
  const PatternSurface surface = surface_of(shaped.section, gray.width, gray.height);
  const auto corners = pattern_corners(gray.width, gray.height);
  out.record.half_width = static_cast<float>(corners[1].x);
  out.record.half_height = static_cast<float>(corners[1].y);
  out.record.score = -1.0f;
  for (const ParameterSetRecord& parameters : sets) {
    MODAR_ASSIGN(auto content, paper_features(gray, parameters));
    out.features.push_back(std::move(content));
  }
  const std::size_t found = sets.empty() ? 0 : out.features.front().keypoints.size();
  auto record = make_tracker_record(gray, options, surface);
  if (!record) {
    record.error().where = path;
    return tl::unexpected(record.error());
  }
  out.loop_record = std::move(*record);
  out.shape = std::move(shaped.section);
  if (options.score) MODAR_TRY(add_score(path, gray, options.jobs, out, report));
  timer.done(shaped.picture.pixels.size(), found);
  return out;
}

}  // namespace modar
