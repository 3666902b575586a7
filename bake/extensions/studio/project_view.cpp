// The project as JSON for the page.
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "bake/extensions/studio/exports.hpp"
#include "bake/extensions/studio/report_view.hpp"
#include "bake/extensions/studio/session.hpp"
#include "bake/extensions/studio/upload.hpp"
#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "formats/base/utf8.hpp"
#include "modar/device_profile.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 20'000;  // that are listed

std::uint64_t bytes_of(const std::string& path) {
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  return error ? 0 : bytes;
}

}  // namespace

const char* file_kind(const std::string& file) {
  const std::string extension = ascii_lower(fs::path(file).extension().string());
  if (is_picture_file(file)) return "photo";
  for (const char* video : {".mp4", ".mov", ".webm", ".mkv", ".avi", ".m4v"}) {
    if (extension == video) return "video";
  }
  return is_model_file(file) ? "model" : "other";
}

namespace {

Json settings_json(const Settings& settings) {
  Json json = Json::object();
  for (const auto& [key, value] : settings) json.set(key, value);
  return json;
}

Json words_json(const Words& words) {
  Json json = Json::object();
  for (const auto& [language, text] : words) json.set(language, text);
  return json;
}

Json some(double value) {
  return value > 0 ? Json(value) : Json();
}

int line_of(const std::string& where) {
  return static_cast<int>(json_of(Error{ExitCode::kOk, "", where, "", ""})
                              .find("line")
                              .value_or(0)
                              .number()
                              .value_or(0));
}

/// How many assets each table names.
std::vector<std::size_t> table_sizes(const std::vector<ProjectAsset>& assets) {
  std::vector<std::size_t> sizes;
  for (const ProjectAsset& asset : assets) {
    sizes.resize(std::max(sizes.size(), asset.table + 1));
    ++sizes[asset.table];
  }
  return sizes;
}

Json asset_json(const Session& session, const ProjectAsset& asset,
                const std::vector<std::size_t>& sizes) {
  return {{"name", asset.name},
          {"file", asset.file},
          {"bytes", bytes_of(path_in(session, asset.file))},
          {"table", asset.table},
          {"shared", sizes[asset.table] > 1},
          {"line", line_of(asset.where)},
          {"settings", settings_json(asset.settings)}};
}

const char* shape_word(ShapeRequest::Kind kind) {
  constexpr const char* kWords[] = {"flat", "cylinder", "cone", "box"};
  return kWords[static_cast<std::size_t>(kind)];
}

Json pattern_json(const Session& session, const ProjectAsset& asset,
                  const std::vector<std::size_t>& sizes) {
  Json json = asset_json(session, asset, sizes);
  const ShapeRequest& shape = asset.shape;
  json.set("kind", shape_word(shape.kind));
  Json corners;
  if (shape.corners) {
    corners = Json::array();
    for (const PixelPoint& corner : *shape.corners) {
      corners.push_back(Json::array({corner.x, corner.y}));
    }
  }
  json.set("corners", corners);
  json.set("height_mm", some(shape.height_mm));
  json.set("width_mm", some(asset.width_mm));
  json.set("top_mm", some(shape.top_mm));
  json.set("bottom_mm", some(shape.bottom_mm));
  json.set("arc_deg", some(shape.arc_deg));
  json.set("box_mm", shape.kind == ShapeRequest::Kind::kBox ? Json::list(shape.box_mm) : Json());
  Json sides = Json::object();
  constexpr std::array<const char*, 5> kSides = {"right", "back", "left", "top", "bottom"};
  for (std::size_t i = 0; i < kSides.size(); ++i) {
    if (!shape.sides[i].empty()) sides.set(kSides[i], shape.sides[i]);
  }
  json.set("sides", sides);
  return json;
}

Json scene_json(const ProjectScene& scene) {
  const SceneRequest& request = scene.request;
  constexpr const char* kSizes[] = {"scale", "height", "width"};
  constexpr const char* kUnits[] = {"usual", "side", "mm"};
  return {{"index", scene.table ? Json(*scene.table) : Json()},
          {"line", line_of(scene.where)},
          {"pattern", request.pattern},
          {"model", request.model},
          {"name", request.name},
          {"offset", Json::list(request.offset.value)},
          {"offset_unit", kUnits[static_cast<std::size_t>(request.offset.unit)]},
          {"turn", Json::list(request.turn)},
          {"size", Json{{"kind", kSizes[static_cast<std::size_t>(request.size.kind)]},
                        {"value", request.size.value}}},
          {"up", request.up ? Json(up_axis_name(*request.up)) : Json()},
          {"clip", request.clip.empty() ? Json() : Json(request.clip)},
          {"centred", request.centred},
          {"hidden", request.hidden},
          {"group", request.group},
          {"texts", words_json(scene.texts)},
          {"alts", words_json(scene.alts)},
          {"nodes", scene.nodes.size()}};
}

/// Files of the folder, hidden ones and those of bundles left out, in byte order.
std::vector<std::string> files_in(const Session& session, const std::string& out) {
  std::vector<std::string> files;
  std::error_code error;
  fs::recursive_directory_iterator it(session.folder, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    const std::string name = it->path().filename().string();
    const std::string relative = it->path().lexically_relative(session.folder).string();
    if (name.starts_with('.') || relative == out) {
      if (it->is_directory(error)) it.disable_recursion_pending();
      continue;
    }
    if (it->is_regular_file(error) && relative != kProjectFile) files.push_back(relative);
    if (files.size() >= kMostFiles) break;
  }
  std::sort(files.begin(), files.end());
  return files;
}

Json files_json(const Session& session, const Project& project,
                const std::vector<std::string>& files) {
  std::set<std::string> used;
  for (const auto* assets : {&project.models, &project.patterns}) {
    for (const ProjectAsset& asset : *assets) used.insert(asset.file);
  }
  Json json = Json::array();
  for (const std::string& file : files) {
    json.push_back({{"file", file},
                    {"bytes", bytes_of(path_in(session, file))},
                    {"kind", file_kind(file)},
                    {"used", used.count(file) != 0}});
  }
  return json;
}

Json baked_scenes_of(Session& session) {
  const std::lock_guard lock(session.mutex);
  return session.baked_scenes;
}

/// Whether `modar bake` would write a bundle anew.
bool is_stale(const Session& session, const Project& project, bool wrong) {
  if (wrong) return true;
  ProjectOptions options;
  options.dry_run = true;
  options.tool_version = session.tool_version;
  const auto planned = bake_project(project, options, {});
  return !planned || std::any_of(planned->bundles.begin(), planned->bundles.end(),
                                 [](const BundleOutcome& bundle) { return !bundle.fresh; });
}

Json bundle_json(Session& session, const Project& project, bool wrong) {
  if (project.bundles.empty() || project.tiers.empty()) return {};
  const std::string& tier = project.tiers.front().name;
  const std::string path = project.out + "/" + project.bundles.front().name +
                           (tier.empty() ? "" : "-" + tier) + ".modar";
  const std::uint64_t bytes = bytes_of(path_in(session, path));
  return {{"path", path},
          {"bytes", bytes},
          {"baked", bytes != 0},
          {"stale", bytes != 0 && is_stale(session, project, wrong)},
          {"scenes", baked_scenes_of(session)},
          {"count", project.bundles.size() * project.tiers.size()}};
}

BakedFacts facts_of(const Session& session, const Project& project) {
  if (project.bundles.empty() || project.tiers.empty()) return {};
  const std::string& tier = project.tiers.front().name;
  return baked_facts(path_in(session, project.out + "/" + project.bundles.front().name +
                                          (tier.empty() ? "" : "-" + tier) + ".modar"));
}

/// Known members of a name; null where nothing is.
void add_facts(Json& json, const std::map<std::string, Json>& facts, const std::string& name,
               std::initializer_list<const char*> keys) {
  const auto found = facts.find(name);
  const Json own = found == facts.end() ? Json() : found->second;
  for (const char* key : keys) json.set(key, own[key]);
}

Json phone_of(Session& session) {
  const std::lock_guard lock(session.mutex);
  return session.phone;
}

Json devices_json() {
  const Json names =
      Json::list(device_profiles(), [&](const DeviceProfile& device) { return device.name; });
  return names;
}

Json languages_json(const Project& project) {
  std::set<std::string> languages;
  for (const ProjectScene& scene : project.scenes) {
    for (const auto* words : {&scene.texts, &scene.alts}) {
      for (const auto& [language, text] : *words) languages.insert(language);
    }
  }
  return Json::list(languages);
}

}  // namespace

Result<Json> project_view(Session& session) {
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const ProjectDraft draft = read_draft(state.text, session.file);
  const Project& project = draft.project;
  const std::vector<std::string> files = files_in(session, project.out);
  Json init;
  if (state.revision.empty()) {
    std::array<std::size_t, 2> counts{};
    for (const std::string& file : files) {
      counts[0] += file_kind(file) == std::string_view("model") ? 1U : 0U;
      counts[1] += file_kind(file) == std::string_view("photo") ? 1U : 0U;
    }
    if (counts[0] + counts[1] != 0) init = {{"models", counts[0]}, {"pictures", counts[1]}};
  }
  Json models = Json::array();
  Json patterns = Json::array();
  Json scenes = Json::array();
  const BakedFacts facts = facts_of(session, project);
  const auto model_sizes = table_sizes(project.models);
  const auto pattern_sizes = table_sizes(project.patterns);
  for (const ProjectAsset& model : project.models) {
    Json json = asset_json(session, model, model_sizes);
    json.set("missing", Json::list(missing_of(session, model.file)));
    add_facts(json, facts.models, model.name, {"triangles", "size", "up", "repair", "clips"});
    models.push_back(std::move(json));
  }
  for (const ProjectAsset& pattern : project.patterns) {
    Json json = pattern_json(session, pattern, pattern_sizes);
    add_facts(json, facts.patterns, pattern.name, {"grade", "score", "range_cm"});
    patterns.push_back(std::move(json));
  }
  for (const ProjectScene& scene : project.scenes) scenes.push_back(scene_json(scene));
  Json problems = Json::array();
  for (const Error& error : draft.problems) {
    if (error.code != "project.empty") problems.push_back(json_of(error));
  }
  const auto app = can_make_app();
  return Json{{"revision", state.revision},
              {"folder", session.folder},
              {"name", project.bundles.empty() ? "" : project.bundles.front().name},
              {"version", session.tool_version},
              {"init", init},
              {"bundle", bundle_json(session, project, problems.size() > 0)},
              {"models", models},
              {"patterns", patterns},
              {"scenes", scenes},
              {"settings", settings_json(project.settings)},
              {"files", files_json(session, project, files)},
              {"problems", problems},
              {"undo", state.undo},
              {"redo", state.redo},
              {"languages", languages_json(project)},
              {"baking", session.jobs.busy()},
              {"phone", phone_of(session)},
              {"app", app ? Json() : json_of(app.error())},
              {"devices", devices_json()}};
}

}  // namespace modar
