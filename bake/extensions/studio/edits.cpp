#include "bake/extensions/studio/edits.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <vector>

#include "bake/project/project.hpp"
#include "bake/project/project_edit.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> no_edit(const std::string& cause) {
  return fail(ExitCode::kUsage, "studio.edit", "", cause, "reload the page");
}

bool holds_no_asset(const Error& error) {
  return error.code == "project.empty";
}

/// A text on its way through a list of edits.
class Edits {
 public:
  Edits(std::string text, const std::string& file) : text_(std::move(text)), file_(file) { look(); }

  [[nodiscard]] const std::string& text() const { return text_; }

  Result<void> apply(const Json& edit) {
    const std::string op = edit.text_at("op");
    const std::string table = edit.text_at("table");
    if (op == "add") return add(table, edit.find("value").value_or(Json::object()));
    if (op == "delete") return remove(table, edit);
    if (op != "set" && op != "remove") return no_edit("there is no edit '" + op + "'");
    const std::string key = edit.text_at("key");
    if (key.empty()) return no_edit("the edit names no key");
    MODAR_ASSIGN(const TableName place, own_table(table, edit));
    if (op == "remove") return take(remove_key(text_, place, key));
    const Json value = edit["value"];
    if (key == "name" && is_asset(table)) MODAR_TRY(rename(table, edit, place, value));
    if (table == "scene") MODAR_TRY(clear_sizes(place, key));
    return take(set_key(text_, place, key, value));
  }

  Result<void> add(const std::string& table, const Json& keys) {
    if (table == "scene") {
      MODAR_TRY(write_scenes());
      // What followed from the names and was written out a moment ago is the one that is meant.
      const auto same = scene_of(keys.text_at("pattern"), keys.text_at("model"));
      if (same && implied_.count(*same) != 0) {
        for (const std::string& key : keys.keys()) {
          MODAR_TRY(take(set_key(text_, {"scene", same}, key, *keys.find(key))));
        }
        return {};
      }
    }
    return take(add_table(text_, table, keys));
  }

 private:
  static bool is_asset(const std::string& table) { return table == "model" || table == "pattern"; }

  void look() { draft_ = read_draft(text_, file_); }

  Result<void> take(Result<std::string> changed) {
    MODAR_ASSIGN(text_, std::move(changed));
    look();
    return {};
  }

  [[nodiscard]] const std::vector<ProjectAsset>& assets(const std::string& table) const {
    return table == "model" ? draft_.project.models : draft_.project.patterns;
  }

  [[nodiscard]] const ProjectAsset* find(const std::string& table, const std::string& name) const {
    const auto& list = assets(table);
    const auto found = ranges::find(list, name, &ProjectAsset::name);
    return found == list.end() ? nullptr : &*found;
  }

  [[nodiscard]] std::size_t sharing(const std::string& table, std::size_t index) const {
    const auto& list = assets(table);
    return static_cast<std::size_t>(ranges::count(list, index, &ProjectAsset::table));
  }

  [[nodiscard]] std::optional<std::size_t> scene_of(const std::string& pattern,
                                                    const std::string& model) const {
    for (const ProjectScene& scene : draft_.project.scenes) {
      if (scene.request.pattern == pattern && scene.request.model == model) return scene.table;
    }
    return std::nullopt;
  }

  /// The table that an edit names, of its own where it shared one with other files.
  Result<TableName> own_table(const std::string& table, const Json& edit) {
    if (table == "project" || table == "bake" || table == "gates") {
      return TableName{table, std::nullopt};
    }
    const auto index = edit["index"].count();
    if (table == "scene" && !index) return scene_table(edit);
    if (is_asset(table) && edit.find("name")) return asset_table(table, edit.text_at("name"));
    if (!index) return no_edit("the edit names no table");
    return TableName{table, static_cast<std::size_t>(*index)};
  }

  Result<TableName> scene_table(const Json& edit) {
    MODAR_TRY(write_scenes());
    const auto index = scene_of(edit.text_at("pattern"), edit.text_at("model"));
    if (!index) return no_edit("there is no such scene");
    return TableName{"scene", index};
  }

  Result<TableName> asset_table(const std::string& table, const std::string& name) {
    const ProjectAsset* asset = find(table, name);
    if (asset == nullptr) return no_edit("there is no " + table + " '" + name + "'");
    if (sharing(table, asset->table) == 1) return TableName{table, asset->table};
    const std::string file = asset->file;
    const Settings settings = asset->settings;
    MODAR_TRY(leave_out(table, asset->table, file));
    Json keys = {{"file", as_glob(file)}};
    if (name != file_stem(file)) keys.set("name", name);
    MODAR_TRY(take(add_table(text_, table, keys)));
    return TableName{table, count_tables(text_, table) - 1};
  }

  /// "!file" behind the globs of a table.
  Result<void> leave_out(const std::string& table, std::size_t index, const std::string& file) {
    std::vector<std::string> globs = draft_globs(table, index);
    globs.push_back("!" + as_glob(file));
    return take(set_key(text_, {table, index}, "file", Json::list(globs)));
  }

  /// What the table's "file" has, as toml++ reads it.
  [[nodiscard]] std::vector<std::string> draft_globs(const std::string& table,
                                                     std::size_t index) const {
    for (const ProjectAsset& asset : assets(table)) {
      if (asset.table == index) return asset.globs;
    }
    return {};
  }

  /// Scenes that follow from the names end where one is written: all are written first.
  Result<void> write_scenes() {
    std::vector<Json> implied;
    for (const ProjectScene& scene : draft_.project.scenes) {
      if (scene.table) return {};
      implied.push_back({{"pattern", scene.request.pattern}, {"model", scene.request.model}});
    }
    for (const Json& keys : implied) {
      implied_.insert(count_tables(text_, "scene"));
      MODAR_TRY(take(add_table(text_, "scene", keys)));
    }
    return {};
  }

  /// A scene has one of scale, height and width.
  Result<void> clear_sizes(const TableName& place, const std::string& key) {
    const std::set<std::string> sizes = {"scale", "height", "width"};
    if (sizes.count(key) == 0) return {};
    for (const std::string& other : sizes) {
      if (other != key) MODAR_TRY(take(remove_key(text_, place, other)));
    }
    return {};
  }

  /// Scenes that name an asset follow its new name.
  Result<void> rename(const std::string& table, const Json& edit, const TableName& place,
                      const Json& value) {
    const std::string now = value.text().value_or("");
    if (now.empty() || printable(now) != now) return no_edit("the name has no letters");
    std::string before = edit.text_at("name");
    for (const ProjectAsset& asset : assets(table)) {
      if (before.empty() && asset.table == place.index) before = asset.name;
    }
    const bool implied = std::any_of(draft_.project.scenes.begin(), draft_.project.scenes.end(),
                                     [](const ProjectScene& scene) { return !scene.table; });
    if (implied) MODAR_TRY(write_scenes());
    const std::vector<ProjectScene> scenes = draft_.project.scenes;
    for (const ProjectScene& scene : scenes) {
      const std::string& named = table == "model" ? scene.request.model : scene.request.pattern;
      if (named != before || !scene.table) continue;
      MODAR_TRY(take(set_key(text_, {"scene", scene.table}, table, now)));
    }
    return {};
  }

  Result<void> remove(const std::string& table, const Json& edit) {
    if (table == "scene" && !edit["index"].count()) {
      MODAR_ASSIGN(const TableName place, scene_table(edit));
      return take(remove_table(text_, place));
    }
    if (!is_asset(table)) {
      MODAR_ASSIGN(const TableName place, own_table(table, edit));
      return take(remove_table(text_, place));
    }
    std::string name = edit.text_at("name");
    const auto index = edit["index"].count();
    for (const ProjectAsset& asset : assets(table)) {
      if (name.empty() && index && asset.table == *index) name = asset.name;
    }
    return remove_asset(table, name);
  }

  Result<void> remove_asset(const std::string& table, const std::string& name) {
    const ProjectAsset* asset = find(table, name);
    if (asset == nullptr) return no_edit("there is no " + table + " '" + name + "'");
    const TableName place{table, asset->table};
    const std::string file = asset->file;
    std::vector<std::size_t> gone;
    for (const ProjectScene& scene : draft_.project.scenes) {
      const std::string& named = table == "model" ? scene.request.model : scene.request.pattern;
      if (named == name && scene.table) gone.push_back(*scene.table);
    }
    for (auto scene = gone.rbegin(); scene != gone.rend(); ++scene) {
      MODAR_TRY(take(remove_table(text_, {"scene", *scene})));
    }
    if (sharing(table, *place.index) > 1) return leave_out(table, *place.index, file);
    return take(remove_table(text_, place));
  }

  std::string text_;
  const std::string& file_;
  ProjectDraft draft_;
  std::set<std::size_t> implied_;  ///< scenes that followed from the names before
};

/// Refuses a text that is wrong where the one before was not.
Result<std::string> checked(const std::string& before, std::string text, const std::string& file) {
  const auto read = read_project_text(text, file);
  if (read || holds_no_asset(read.error())) return text;
  const auto old = read_project_text(before, file);
  const bool wrong_before = !old && !holds_no_asset(old.error());
  if (!wrong_before) return tl::unexpected(read.error());
  const auto problems = [&](const std::string& one) {
    return read_draft(one, file).problems.size();
  };
  if (problems(text) > problems(before)) return tl::unexpected(read.error());
  return text;
}

Result<void> check_syntax(const std::string& text, const std::string& file) {
  const auto read = read_project_text(text, file);
  if (read || read.error().code != "project.toml") return {};
  return tl::unexpected(read.error());
}

}  // namespace

Result<std::string> edited_text(const std::string& text, const std::string& file,
                                const Json& edits) {
  MODAR_TRY(check_syntax(text, file));
  if (!edits.is_array()) return no_edit("there are no edits");
  Edits changed(text, file);
  for (const Json& edit : edits.elements()) MODAR_TRY(changed.apply(edit));
  return checked(text, changed.text(), file);
}

Result<std::string> text_with_assets(const std::string& text, const std::string& file,
                                     const std::vector<NewAsset>& assets) {
  MODAR_TRY(check_syntax(text, file));
  std::string begun = text;
  if (begun.find_first_not_of(" \t\r\n") == std::string::npos) {
    std::string name = fs::path(file).parent_path().filename().string();
    if (name.starts_with('.') || printable(name) != name || name.empty()) name = "project";
    MODAR_ASSIGN(begun, set_key("", {"project", {}}, "name", name));
  }
  Edits changed(std::move(begun), file);
  std::set<std::string> names;
  const ProjectDraft draft = read_draft(changed.text(), file);
  std::set<std::string> listed;
  for (const auto* list : {&draft.project.models, &draft.project.patterns}) {
    for (const ProjectAsset& asset : *list) {
      names.insert((asset.pattern ? "p" : "m") + asset.name);
      listed.insert(asset.file);
    }
  }
  for (const NewAsset& asset : assets) {
    if (listed.count(asset.file) != 0) continue;
    const std::string kind = asset.pattern ? "p" : "m";
    const std::string stem = file_stem(asset.file);
    std::string name = stem;
    for (int n = 2; !names.insert(kind + name).second; ++n) name = stem + "-" + std::to_string(n);
    Json keys = {{"file", as_glob(asset.file)}};
    if (name != stem) keys.set("name", name);
    MODAR_TRY(changed.add(asset.pattern ? "pattern" : "model", keys));
  }
  return checked(text, changed.text(), file);
}

}  // namespace modar
