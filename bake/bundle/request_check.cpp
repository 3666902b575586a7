#include "bake/bundle/request_check.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "bake/bundle/light_image.hpp"
#include "bake/bundle/scene/scene_nodes.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/import/read_model.hpp"
#include "formats/base/nearest.hpp"
#include "formats/base/path.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

template <class Asset>
std::vector<std::string> names_of(const std::vector<Asset>& assets) {
  std::vector<std::string> names;
  for (const Asset& asset : assets) names.push_back(asset.name);
  return names;
}

/// The name of the folder that a file is in.
std::string folder_name(const std::string& path) {
  std::error_code error;
  return fs::absolute(path, error).lexically_normal().parent_path().filename().string();
}

template <class Asset>
Result<void> name_files(std::vector<Asset>& assets, const char* what) {
  std::map<std::string, int> stems;
  for (const Asset& asset : assets) {
    if (asset.name.empty()) ++stems[file_stem(asset.path)];
  }
  std::map<std::string, std::string> taken;  // files by name
  for (Asset& asset : assets) {
    const std::string stem = file_stem(asset.path);
    if (asset.name.empty()) asset.name = stems[stem] > 1 ? folder_name(asset.path) : stem;
    if (asset.name.empty()) asset.name = stem;
    const auto [first, fresh] = taken.try_emplace(asset.name, asset.path);
    if (fresh) continue;
    std::error_code error;
    if (fs::equivalent(first->second, asset.path, error)) {
      return fail(ExitCode::kUsage, "bake.twice", asset.path, "the file is given twice",
                  std::string("name it once; to bake it twice, give one another name: --") + what +
                      " NAME=" + asset.path);
    }
    return fail(ExitCode::kUsage, "bake.same-name", asset.path,
                std::string("two ") + what + "s are named '" + asset.name + "'",
                std::string("give one of them a name: --") + what + " NAME=" + asset.path);
  }
  return {};
}

Result<std::uint32_t> find_by_name(const std::vector<std::string>& names, const std::string& name,
                                   const char* what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<std::uint32_t>(found - names.begin());
  return fail(ExitCode::kUsage, "bake.scene-unknown", name,
              std::string("the scene names a ") + what + " that is not baked",
              cure_of_name(name, names));
}

Result<void> check_model(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    return fail(ExitCode::kIo, "io.open", path, "it is a folder",
                "name a file in it, or run `modar init` and `modar bake` in it");
  }
  MODAR_TRY(require_model_format(path));
  const char* cause = nullptr;
  if (::access(path.c_str(), R_OK) != 0) {
    cause = std::strerror(errno);
  } else if (!fs::is_regular_file(path, error)) {
    cause = "this is not a regular file";
  }
  if (cause == nullptr) return {};
  return missing_file(
      path, {ExitCode::kIo, "io.open", path, cause, "check the path and its permissions"});
}

}  // namespace

Result<void> name_assets(BakeRequest& request) {
  MODAR_TRY(name_files(request.models, "model"));
  return name_files(request.patterns, "pattern");
}

Result<std::vector<KnownScene>> find_scenes(const BakeRequest& request) {
  std::vector<SceneRequest> scenes = request.scenes;
  if (scenes.empty() && request.models.size() == 1 && request.patterns.size() == 1) {
    SceneRequest scene;
    scene.pattern = request.patterns[0].name;
    scene.model = request.models[0].name;
    scene.light = request.light;
    scenes.push_back(scene);
  }
  std::vector<KnownScene> known;
  for (const SceneRequest& scene : scenes) {
    MODAR_ASSIGN(const std::uint32_t pattern,
                 find_by_name(names_of(request.patterns), scene.pattern, "pattern"));
    MODAR_ASSIGN(const std::uint32_t model,
                 find_by_name(names_of(request.models), scene.model, "model"));
    known.push_back({scene, pattern, model});
  }
  return known;
}

Result<void> check_inputs(const BakeRequest& request) {
  for (const ModelRequest& model : request.models) MODAR_TRY(check_model(model.path));
  std::vector<double> widths;
  for (const PatternRequest& pattern : request.patterns) {
    MODAR_ASSIGN(const ShapedPicture shaped,
                 load_shaped(pattern.path, pattern.width_mm, pattern.shape));
    widths.push_back(shaped.width_mm);
  }
  MODAR_ASSIGN(const std::vector<KnownScene> scenes, find_scenes(request));
  std::set<std::string> lights;
  for (const KnownScene& known : scenes) {
    if (needs_width(known.scene) && !(widths[known.pattern] > 0)) {
      return no_width(known.scene);
    }
    const std::string& light = known.scene.light;
    if (!light.empty() && lights.insert(light).second) MODAR_TRY(read_light(light));
  }
  return check_nodes(request);
}

Result<void> require_shown(const BakeRequest& request) {
  const bool whole = !request.models.empty() && !request.patterns.empty();
  const bool one_scene =
      request.scenes.empty() && request.models.size() == 1 && request.patterns.size() == 1;
  if (!whole || one_scene || !find_scenes(request)) return {};
  const auto shown = [&](const std::string& name, std::string SceneRequest::*side) {
    return std::any_of(request.scenes.begin(), request.scenes.end(),
                       [&](const SceneRequest& scene) { return scene.*side == name; });
  };
  std::vector<std::string> idle;  // patterns without a model
  for (const PatternRequest& pattern : request.patterns) {
    if (!shown(pattern.name, &SceneRequest::pattern)) idle.push_back(pattern.name);
  }
  std::string lines;
  std::string what;
  std::size_t next = 0;
  for (const ModelRequest& model : request.models) {
    if (shown(model.name, &SceneRequest::model)) continue;
    const std::string on = next < idle.size() ? idle[next++] : request.patterns.front().name;
    lines += " --scene " + on + "=" + model.name;
    if (what.empty()) what = "the model '" + model.name + "' is on no pattern";
  }
  for (; next < idle.size(); ++next) {
    lines += " --scene " + idle[next] + "=" + request.models.front().name;
    if (what.empty()) what = "no model is on the pattern '" + idle[next] + "'";
  }
  if (lines.empty()) return {};
  return fail(ExitCode::kUsage, "bake.never-shown", "", what + ", so it would never be shown",
              "add" + lines);
}

}  // namespace modar
