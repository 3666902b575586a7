// The part of `modar check` that bakes again, looks and tracks.
#include <filesystem>
#include <string>
#include <system_error>

#include "bake/bundle/request_text.hpp"
#include "bake/commands/check_command.hpp"
#include "bake/import/read_model.hpp"
#include "bake/output.hpp"
#include "bake/terminal.hpp"

namespace modar {
namespace {

/// What the sources would be baked as again.
Result<BakeRequest> source_request(const BundleView& bundle, const CheckCommand& command) {
  BakeRequest request;
  for (const std::string& path : command.sources) {
    if (is_model_file(parse_model(path).path)) {
      request.models.push_back(parse_model(path));
    } else {
      MODAR_ASSIGN(PatternRequest pattern, parse_pattern(path));
      request.patterns.push_back(std::move(pattern));
    }
  }
  for (std::uint32_t set = 0; set < bundle.parameter_sets().size(); ++set) {
    request.parameters.emplace_back(bundle.name(bundle.parameter_sets()[set].name));
  }
  if (request.parameters.empty()) request.parameters = {"none"};
  read_bake_options(bundle.meta(), request);
  MODAR_TRY(name_assets(request));
  request.jobs = command.jobs;
  return request;
}

Result<SourceFit> bake_and_compare(const BundleView& bundle, const CheckCommand& command,
                                   const BakeRequest& request, const IssueSink& sink) {
  ProgressBar bar(command.json || command.sarif);
  Report report;
  report.progress = [&bar](const std::string& stage, double done) { bar.show(stage, done); };
  return check_source(bundle, request, sink, report);
}

Result<std::vector<PatternRange>> track_patterns(const BundleView& bundle,
                                                 const CheckCommand& command,
                                                 const BakeRequest& request,
                                                 const IssueSink& sink) {
  PoseCheckOptions options;
  options.pictures = request.patterns;
  ProgressBar bar(command.json || command.sarif);
  options.views = command.pose_views;
  options.progress = [&bar](double done) { bar.show("pose", done); };
  return check_poses(bundle, options, sink);
}

Result<std::vector<ModelLook>> compare_looks(const BundleView& bundle, const CheckCommand& command,
                                             const BakeRequest& request, const IssueSink& sink) {
  MODAR_TRY(make_output_folder(command.visual));
  VisualOptions options;
  options.models = request.models;
  options.picture_folder = command.visual;
  options.jobs = command.jobs;
  ProgressBar bar(command.json || command.sarif);
  options.progress = [&bar](double done) { bar.show("look", done); };
  return check_looks(bundle, options, sink);
}

/// Refuses pictures of --visual that would overwrite a source.
Result<void> keep_sources(const BundleView& bundle, const CheckCommand& command) {
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const std::string name(bundle.name(bundle.models()[m].name));
    MODAR_TRY(keep_inputs(command.visual + "/" + name + ".png", command.sources));
  }
  return {};
}

}  // namespace

Result<void> check_against_sources(const BundleView& bundle, const CheckCommand& command,
                                   const IssueSink& sink, CheckExtras& extras) {
  if (!command.visual.empty()) MODAR_TRY(keep_sources(bundle, command));
  MODAR_ASSIGN(const BakeRequest request, source_request(bundle, command));
  MODAR_ASSIGN(extras.source, bake_and_compare(bundle, command, request, sink));
  if (!command.visual.empty()) {
    MODAR_ASSIGN(extras.looks, compare_looks(bundle, command, request, sink));
  }
  if (command.pose) {
    MODAR_ASSIGN(extras.poses, track_patterns(bundle, command, request, sink));
  }
  return {};
}

}  // namespace modar
