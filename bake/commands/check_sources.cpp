// The part of `modar check` that bakes again, looks and tracks.
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bake/check/source/second_check.hpp"
#include "bake/check/text_check.hpp"
#include "bake/commands/check_command.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/options/options.hpp"
#include "bake/options/request_text.hpp"
#include "bake/process/process.hpp"
#include "bake/project/project.hpp"
#include "formats/base/path.hpp"

namespace modar {
namespace {

struct Sources {
  BakeRequest request;
  /// Of a project file's scenes; unset: no project file is given, and no text is known.
  std::optional<std::vector<SceneText>> texts;
};

bool is_project(const std::string& path) {
  return path.ends_with(".toml");
}

/// The assets of a project file that the bundle has, and what its scenes say.
Result<void> take_project(const BundleView& bundle, const std::string& path, Sources& sources) {
  MODAR_ASSIGN(const Project project, read_project(path, true));
  const auto holds = [&bundle](const auto& records, const std::string& name) {
    for (std::uint32_t i = 0; i < records.size(); ++i) {
      if (bundle.name(records[i].name) == name) return true;
    }
    return false;
  };
  for (const ProjectAsset& asset : project.models) {
    if (holds(bundle.models(), asset.name)) {
      sources.request.models.push_back({project.path(asset.file), asset.name});
    }
  }
  for (const ProjectAsset& asset : project.patterns) {
    if (!holds(bundle.patterns(), asset.name)) continue;
    PatternRequest pattern;
    pattern.path = project.path(asset.file);
    pattern.name = asset.name;
    pattern.width_mm = asset.width_mm;
    pattern.shape = asset.shape;
    pattern.copies = asset.copies;
    sources.request.patterns.push_back(std::move(pattern));
  }
  sources.texts.emplace();
  for (const ProjectScene& scene : project.scenes) {
    const SceneRequest& asked = scene.request;
    if ((scene.texts.empty() && scene.alts.empty()) || !holds(bundle.patterns(), asked.pattern) ||
        (!asked.model.empty() && !holds(bundle.models(), asked.model))) {
      continue;
    }
    sources.texts->push_back({asked.pattern, asked.model, scene.texts, scene.alts});
  }
  std::set<std::string> given;  // a light may be a pattern, too
  for (const PatternRequest& pattern : sources.request.patterns) given.insert(pattern.path);
  for (const ProjectScene& scene : project.scenes) {
    for (const NodeRequest& node : scene.nodes) {
      if (node.file.empty() || !holds(bundle.patterns(), node.place.pattern)) continue;
      sources.request.nodes.push_back(project.located(node));
    }
    const std::string light = project.path(scene.request.light);
    if (scene.request.light.empty() || !given.insert(light).second) continue;
    PatternRequest picture;
    picture.path = light;
    sources.request.patterns.push_back(std::move(picture));
  }
  return {};
}

/// Did the bake take a picture that is named as the model? Its knowledge of patterns may exceed the
/// arguments here.
bool has_own_picture(const BundleView& bundle, const ModelRequest& model) {
  const std::string stem = file_stem(model.path);
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    if (is_own_picture(file_stem(bundle.name(bundle.textures()[t].name)), stem)) return true;
  }
  return false;
}

/// What the sources would be baked as again.
Result<Sources> read_sources(const BundleView& bundle, const CheckCommand& command) {
  Sources sources;
  BakeRequest& request = sources.request;
  for (const std::string& path : command.sources) {
    if (is_project(path)) {
      MODAR_TRY(take_project(bundle, path, sources));
    } else if (is_model_file(parse_model(path).path)) {
      request.models.push_back(parse_model(path));
    } else {
      MODAR_ASSIGN(PatternRequest pattern, parse_pattern(path));
      request.patterns.push_back(std::move(pattern));
    }
  }
  read_bake_options(bundle.meta(), request);
  std::vector<std::string> stored;
  for (const ParameterSetRecord& set : bundle.parameter_sets()) {
    stored.emplace_back(bundle.name(set.name));
  }
  if (stored_parameters(request) != stored) {
    request.parameters = stored.empty() ? std::vector<std::string>{"none"} : stored;
  }
  MODAR_TRY(name_assets(request));
  for (ModelRequest& model : request.models) model.own_picture = has_own_picture(bundle, model);
  request.jobs = command.jobs;
  request.tool_version = command.tool_version;
  return sources;
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
  options.crease = request.crease_degrees();
  options.repair = request.repairs();
  options.repair_support = request.repair_support;
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
  MODAR_ASSIGN(const Sources sources, read_sources(bundle, command));
  const BakeRequest& request = sources.request;
  if (sources.texts) check_texts(bundle, *sources.texts, sink);
  MODAR_ASSIGN(extras.source, bake_and_compare(bundle, command, request, sink));
  MODAR_TRY(check_second(bundle, request, companion_file(kSecondReader), sink));
  if (!command.visual.empty()) {
    MODAR_ASSIGN(extras.looks, compare_looks(bundle, command, request, sink));
  }
  if (command.pose) {
    MODAR_ASSIGN(extras.poses, track_patterns(bundle, command, request, sink));
  }
  return {};
}

}  // namespace modar
