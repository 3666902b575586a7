// A pattern's picture to its record and its features under every parameter set of the article.
#include <algorithm>
#include <string_view>

#include "bake/pattern/pattern_image.hpp"
#include "bake/pattern/pattern_picture.hpp"
#include "bake/pattern/score.hpp"
#include "modar/features.hpp"
#include "modar/pose.hpp"

namespace modar {
namespace {

std::string base_name(std::string_view path) {
  const std::size_t slash = path.find_last_of("/\\");
  std::string_view name = slash == std::string_view::npos ? path : path.substr(slash + 1);
  const std::size_t dot = name.find_last_of('.');
  if (dot != std::string_view::npos && dot > 0) name = name.substr(0, dot);
  return std::string(name);
}

Result<FeatureContent> describe(const GrayImage& image, const ParameterSetRecord& parameters) {
  auto features = describe_image(image, parameters);
  if (!features) return tl::unexpected(features.error());
  auto yml = features_to_yml(*features);
  if (!yml) return tl::unexpected(yml.error());
  FeatureContent content;
  content.set_id = parameters.id;
  content.descriptor_bytes = features->descriptor_bytes;
  content.keypoints = std::move(features->keypoints);
  content.descriptors = std::move(features->descriptors);
  content.yml = std::move(*yml);
  return content;
}

Result<void> add_score(const std::string& path, const GrayImage& gray, unsigned jobs,
                       PatternFeatures& out, Report& report) {
  const auto score = score_pattern(gray, out.loop_record, jobs);
  if (!score) return tl::unexpected(score.error());
  out.record.score = static_cast<float>(score->score);
  out.record.score_version = kScoreVersion;
  const auto worst =
      std::min_element(score->causes.begin(), score->causes.end(),
                       [](const ScoreCause& a, const ScoreCause& b) { return a.value < b.value; });
  const bool weak = score->score < kWeakScore;
  report.diagnostics.push_back({weak ? "pattern.weak" : "pattern.score",
                             weak ? DiagnosticSeverity::kWarning : DiagnosticSeverity::kInfo, path,
                             0, "the pattern scores " + std::to_string(score->score) + " of 100",
                             weak ? worst->advice : ""});
  return {};
}

}  // namespace

Result<PatternFeatures> bake_pattern(const std::string& path, double width_mm,
                                     std::span<const ParameterSetRecord> sets,
                                     const TrackerRecordOptions& loop, Report& report) {
  StageTimer timer(report, "pattern");
  bool shrunk = false;
  const auto picture = load_pattern(path, shrunk);
  if (!picture) return tl::unexpected(picture.error());
  const GrayImage gray = picture->view();
  if (shrunk) {
    report.diagnostics.push_back({"pattern.resized", DiagnosticSeverity::kInfo, path, 0,
                               "the picture was made smaller, to " + std::to_string(gray.width) +
                                   "x" + std::to_string(gray.height) + " pixels",
                               ""});
  }
  PatternFeatures out;
  out.name = base_name(path);
  out.record.width = static_cast<std::uint32_t>(gray.width);
  out.record.height = static_cast<std::uint32_t>(gray.height);
  out.record.width_mm = width_mm > 0 ? width_mm : read_width_mm(path);
  const auto corners = pattern_corners(gray.width, gray.height);
  out.record.half_width = static_cast<float>(corners[1].x);
  out.record.half_height = static_cast<float>(corners[1].y);
  out.record.score = -1.0f;
  for (const ParameterSetRecord& parameters : sets) {
    auto content = describe(gray, parameters);
    if (!content) return tl::unexpected(content.error());
    out.features.push_back(std::move(*content));
  }
  const std::size_t found = sets.empty() ? 0 : out.features.front().keypoints.size();
  if (!sets.empty() && found < sets.front().min_matches) {
    return fail(ExitCode::kInvalidInput, "pattern.no-features", path,
                "the picture holds " + std::to_string(found) + " features, too few to recognise it",
                "take a larger, sharper picture with more texture");
  }
  auto record = bake_tracker_record(gray, loop);
  if (!record) {
    record.error().where = path;
    return tl::unexpected(record.error());
  }
  out.loop_record = std::move(*record);
  if (loop.score) {
    if (auto done = add_score(path, gray, loop.jobs, out, report); !done) {
      return tl::unexpected(done.error());
    }
  }
  timer.done(picture->pixels.size(), found);
  return out;
}

}  // namespace modar
