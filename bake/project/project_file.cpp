// Reads modar.toml. toml++ is known to this file alone.
#define TOML_EXCEPTIONS 0
// "[=]" breaks what toml++ 3.0 asserts in debug builds, before it finds the error itself.
#define TOML_ASSERT(expr) static_assert(true)
#include <toml++/toml.h>

#include <glob.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>

#include "bake/options/request_text.hpp"
#include "bake/project/project.hpp"
#include "bake/project/settings.hpp"
#include "formats/base/nearest.hpp"
#include "formats/base/path.hpp"
#include "formats/base/shortest_number.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

using Keys = std::vector<std::string_view>;

std::string place(const std::string& file, const toml::source_region& region) {
  return file + ":" + std::to_string(region.begin.line) + ":" + std::to_string(region.begin.column);
}

/// A table of the file, whose keys are taken one by one.
class TableReader {
 public:
  TableReader(const std::string& file, const toml::table& table, std::string name)
      : file_(file), table_(table), name_(std::move(name)) {}

  /// Refuses keys that are not in the list.
  [[nodiscard]] Result<void> allow(const Keys& keys) const {
    for (const auto& [key, node] : table_) {
      const std::string_view word = key.str();
      if (std::find(keys.begin(), keys.end(), word) != keys.end()) continue;
      std::string list;
      for (const std::string_view known : keys)
        list += (list.empty() ? "" : ", ") + std::string(known);
      const std::string_view nearest = nearest_name(word, keys);
      return fail(ExitCode::kInvalidInput, "project.key", place(file_, key.source()),
                  "there is no key '" + std::string(word) + "' in " + name_,
                  nearest.empty() ? "the keys are " + list
                                  : "did you mean '" + std::string(nearest) + "'?");
    }
    return {};
  }

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  Result<void> take(std::string_view key, std::string& value) const {
    return take_as<std::string>(key, "a text in quotes", value);
  }
  Result<void> take(std::string_view key, bool& value) const {
    return take_as<bool>(key, "true or false", value);
  }
  /// least: the least value that is allowed.
  Result<void> take(std::string_view key, double& value, double least) const {
    MODAR_TRY(take_as<double>(key, "a number", value));
    if (has(key) && !(value >= least && std::isfinite(value))) {
      return wrong(key, "a number from " + std::to_string(static_cast<int>(least)));
    }
    return {};
  }
  /// A text, or a list of texts.
  Result<void> take(std::string_view key, std::vector<std::string>& values) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    if (const auto* text = node->as_string()) {
      values.push_back(text->get());
      return {};
    }
    const auto* list = node->as_array();
    if (list == nullptr || !list->is_homogeneous<std::string>()) {
      return wrong(key, "a text in quotes, or a list of them");
    }
    for (const auto& element : *list) values.push_back(element.as_string()->get());
    return {};
  }
  /// A text, a number, or a list of numbers, as --scene has them: "y", "0.8", "0:0:20".
  Result<void> take_scene_value(std::string_view key, std::string& text) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    if (const auto* plain = node->as_string()) {
      text = plain->get();
      return {};
    }
    const auto add = [&text](const toml::node& part) {
      const auto number = part.value<double>();
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.17g", number.value_or(0));
      text += (text.empty() ? "" : ":") + std::string(digits);
      return number.has_value();
    };
    const auto* list = node->as_array();
    bool good = list != nullptr || add(*node);
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) good &= add(*list->get(i));
    if (good) return {};
    return wrong(key, "a number, a text, or a list of numbers");
  }
  /// Numbers, in lists of any depth, in their order: "212:80:905:131".
  Result<void> take_numbers(std::string_view key, std::string& text) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr || add_numbers(*node, text)) return {};
    return wrong(key, "a list of numbers");
  }
  /// The tables of an array within, [[name.key]].
  [[nodiscard]] Result<std::vector<TableReader>> take_tables(const std::string& key) const {
    std::vector<TableReader> list;
    const toml::node* node = table_.get(key);
    if (node == nullptr) return list;
    const std::string name = "[[" + name_.substr(2, name_.size() - 4) + "." + key + "]]";
    const auto* array = node->as_array();
    if (array == nullptr || !array->is_homogeneous<toml::table>()) {
      return wrong(key, name + " above each of them");
    }
    for (const auto& element : *array) list.emplace_back(file_, *element.as_table(), name);
    return list;
  }
  /// Every key of a table within: {"en", "A vase."}.
  Result<void> take(std::string_view key, Words& texts) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    const auto* within = node->as_table();
    if (within == nullptr) return wrong(key, "a table of texts by language");
    const TableReader reader(file_, *within, name_ + "." + std::string(key));
    for (const auto& [language, text] : *within) {
      MODAR_TRY(reader.take(language.str(), texts[std::string(language.str())]));
    }
    return {};
  }

  /// The settings of the bake that stand in this table.
  Result<void> take_settings(Settings& settings) const {
    for (const BakeOption& option : bake_options()) {
      if (option.part == OptionPart::kProject || !has(option.key)) continue;
      std::string value;
      MODAR_TRY(take_setting(option, value));
      settings[option.key] = value;
      BakeRequest trial;
      if (auto good = take_option(option, value, trial); !good) {
        return fail(ExitCode::kInvalidInput, "project.value", at(option.key),
                    std::string(option.key) + ": " + good.error().cause, good.error().cure);
      }
    }
    return {};
  }

  [[nodiscard]] std::string where() const { return place(file_, table_.source()); }

  [[nodiscard]] std::string at(std::string_view key) const {
    const toml::node* node = table_.get(key);
    return place(file_, node != nullptr ? node->source() : table_.source());
  }

  [[nodiscard]] tl::unexpected<Error> wrong(std::string_view key,
                                            const std::string& expected) const {
    return fail(ExitCode::kInvalidInput, "project.value", at(key),
                "'" + std::string(key) + "' in " + name_ + " has the wrong type",
                "write " + expected);
  }

 private:
  template <class T>
  Result<void> take_as(std::string_view key, const char* expected, T& value) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return {};
    // An integer is a number, too; nothing else changes its type.
    const auto got = std::is_same_v<T, double> ? node->value<T>() : node->value_exact<T>();
    if (!got) return wrong(key, expected);
    value = *got;
    return {};
  }

  static bool add_numbers(const toml::node& node, std::string& text) {
    const auto* list = node.as_array();
    if (list == nullptr) {
      const auto number = node.value<double>();
      if (number) text += (text.empty() ? "" : ":") + shortest_text(*number);
      return number.has_value();
    }
    bool good = true;
    for (const auto& element : *list) good &= add_numbers(element, text);
    return good;
  }

  Result<void> take_setting(const BakeOption& option, std::string& value) const {
    const auto* word = std::get_if<WordOption>(&option.value);
    if (std::holds_alternative<TruthOption>(option.value) || (word != nullptr && word->truth)) {
      bool truth = false;
      MODAR_TRY(take(option.key, truth));
      value = truth ? "true" : "false";
    } else if (std::holds_alternative<NumberOption>(option.value)) {
      double number = 0;
      MODAR_TRY(take(option.key, number, 0));
      value = std::to_string(static_cast<long long>(number));
      if (number != std::floor(number)) return wrong(option.key, "a whole number");
    } else if (std::holds_alternative<WordsOption>(option.value)) {
      std::vector<std::string> words;
      MODAR_TRY(take(option.key, words));
      for (const std::string& one : words) value += (value.empty() ? "" : ",") + one;
    } else {
      MODAR_TRY(take(option.key, value));
    }
    return {};
  }

  const std::string& file_;
  const toml::table& table_;
  std::string name_;
};

/// The globs for glob() of one in which "**/" stands for any number of folders.
std::vector<std::string> plain_globs(const std::string& folder, const std::string& pattern) {
  const std::size_t deep = pattern.find("**/");
  if (deep == std::string::npos) return {folder + pattern};
  const std::string base = folder + pattern.substr(0, deep);
  const std::string rest = pattern.substr(deep + 3);
  std::vector<std::string> globs = {base + rest};
  std::error_code error;
  fs::recursive_directory_iterator it(base.empty() ? "." : base, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (it->is_directory()) globs.push_back((it->path() / rest).string());
  }
  return globs;
}

/// The folders in which a new file or folder could match a glob, but for hidden ones.
void add_folders(const std::string& folder, const std::string& pattern,
                 std::set<std::string>& folders) {
  const bool deep = pattern.find("**/") != std::string::npos;
  for (const std::string& one : plain_globs(folder, pattern)) {
    if (deep && one.find("/.") != std::string::npos) continue;
    for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
      end = one.find('/', begin);
      const std::string part = one.substr(begin, end - begin);
      const bool last_of_deep = deep && end == std::string::npos;
      if (!last_of_deep && part.find_first_of("*?[") == std::string::npos) continue;
      glob_t found{};
      const std::string above = begin == 0 ? "." : one.substr(0, begin - 1);
      if (::glob(above.c_str(), GLOB_NOSORT, nullptr, &found) == 0) {
        for (std::size_t i = 0; i < found.gl_pathc; ++i) folders.insert(found.gl_pathv[i]);
      }
      ::globfree(&found);
    }
  }
}

/// Files that a glob matches, relative to the folder, in byte order.
std::vector<std::string> expand(const std::string& folder, const std::string& pattern) {
  std::vector<std::string> files;
  for (const std::string& one : plain_globs(folder, pattern)) {
    glob_t found{};
    if (::glob(one.c_str(), GLOB_NOSORT, nullptr, &found) == 0) {
      for (std::size_t i = 0; i < found.gl_pathc; ++i) {
        std::string path = fs::path(found.gl_pathv[i]).lexically_normal().string();
        const std::string root = fs::path(folder).lexically_normal().string();
        if (!root.empty() && path.starts_with(root)) path.erase(0, root.size());
        std::error_code error;
        if (fs::is_regular_file(found.gl_pathv[i], error)) files.push_back(std::move(path));
      }
    }
    ::globfree(&found);
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// part: nothing for those of [bake].
Keys keys_with_settings(Keys keys, std::optional<OptionPart> part) {
  for (const BakeOption& option : bake_options()) {
    if (part ? option.part == *part : option.part != OptionPart::kProject) {
      keys.push_back(option.key);
    }
  }
  return keys;
}

/// The tables of an array "[[name]]".
Result<std::vector<TableReader>> tables(const std::string& file, const toml::table& root,
                                        const std::string& name) {
  std::vector<TableReader> list;
  const toml::node* node = root.get(name);
  if (node == nullptr) return list;
  const auto* array = node->as_array();
  if (array == nullptr || !array->is_homogeneous<toml::table>()) {
    return TableReader(file, root, "the file").wrong(name, "[[" + name + "]] above each of them");
  }
  for (const auto& element : *array) {
    list.emplace_back(file, *element.as_table(), "[[" + name + "]]");
  }
  return list;
}

/// "[name]", or nothing.
Result<std::optional<TableReader>> table(const std::string& file, const toml::table& root,
                                         const std::string& name) {
  const toml::node* node = root.get(name);
  if (node == nullptr) return std::nullopt;
  if (node->as_table() == nullptr) {
    return TableReader(file, root, "the file").wrong(name, "[" + name + "] above its keys");
  }
  return TableReader(file, *node->as_table(), "[" + name + "]");
}

Error no_toml(const std::string& path, const toml::parse_error& error) {
  return {ExitCode::kInvalidInput, "project.toml", place(path, error.source()),
          std::string(error.description()), "correct the line; see toml.io"};
}

class ProjectReader {
 public:
  /// problems: receives what is wrong, and the rest is read; nullptr: the first error ends it.
  ProjectReader(const std::string& file, const toml::table& root, bool outside,
                std::vector<Error>* problems = nullptr)
      : root_(root), problems_(problems) {
    project_.file = file;
    project_.outside = outside;
    const fs::path folder = fs::path(file).parent_path();
    if (!folder.empty()) project_.folder = (folder / "").string();
  }

  Result<Project> run() {
    const TableReader whole(project_.file, root_, "the file");
    MODAR_TRY(told(
        whole.allow({"project", "bake", "tier", "model", "pattern", "scene", "bundle", "gates"})));
    MODAR_TRY(told(read_project_table()));
    MODAR_TRY(told(read_bake()));
    MODAR_TRY(told(read_assets("model", false, project_.models)));
    MODAR_TRY(told(read_assets("pattern", true, project_.patterns)));
    MODAR_TRY(told(read_scenes()));
    MODAR_TRY(told(read_bundles()));
    MODAR_TRY(told(read_gates()));
    for (const std::string& path : {project_.out, std::string(kCacheFolder)}) {  // may be links
      MODAR_TRY(told(keep_inside(whole, "project", path)));
    }
    if (project_.models.empty() && project_.patterns.empty()) {
      MODAR_TRY(told(fail(ExitCode::kInvalidInput, "project.empty", project_.file,
                          "it lists neither a model nor a pattern",
                          "add [[model]] file = \"vase.glb\" and [[pattern]] file = \"cover.png\", "
                          "or write it again with `modar init --force`")));
    }
    return std::move(project_);
  }

 private:
  /// Nothing where a draft is read, which notes the error.
  Result<void> told(Result<void> done) {
    if (done || problems_ == nullptr) return done;
    problems_->push_back(std::move(done.error()));
    return {};
  }

  Result<void> read_project_table() {
    name_ = fs::absolute(project_.file).lexically_normal().parent_path().filename().string();
    MODAR_ASSIGN(const auto reader, table(project_.file, root_, "project"));
    if (!reader) return {};
    MODAR_TRY(reader->allow({"name", "out", "cache", "light"}));
    MODAR_TRY(reader->take("name", name_));
    if (reader->has("name") && !is_plain(name_)) return wrong_name(*reader);
    MODAR_TRY(reader->take("out", project_.out));
    MODAR_TRY(keep_inside(*reader, "out", project_.out));
    MODAR_TRY(reader->take("cache", project_.cache));
    MODAR_TRY(keep_inside(*reader, "cache", project_.cache));
    return take_light(*reader, project_.light);
  }

  /// A name that files get: none of another folder, none that a terminal takes for a command.
  static bool is_plain(const std::string& name) {
    return !name.empty() && !name.starts_with('.') && name.find('/') == std::string::npos &&
           printable(name) == name;
  }

  static tl::unexpected<Error> wrong_name(const TableReader& reader) {
    return reader.wrong("name", "a name without a slash, which the file gets");
  }

  /// `path` is relative to the project's folder.
  [[nodiscard]] Result<void> keep_inside(const TableReader& reader, const char* key,
                                         const std::string& path) const {
    if (printable(path) != path) return reader.wrong(key, "a path without control characters");
    if (path.empty() || project_.may_use(project_.path(path))) return {};
    return fail(ExitCode::kInvalidInput, "project.outside", reader.at(key),
                "'" + path + "' leads outside the project's folder",
                "copy it into the folder; if you trust the project, bake with --outside");
  }

  Result<void> read_bake() {
    MODAR_ASSIGN(const auto reader, table(project_.file, root_, "bake"));
    if (reader) {
      MODAR_TRY(reader->allow(keys_with_settings({}, std::nullopt)));
      MODAR_TRY(reader->take_settings(project_.settings));
    }
    MODAR_ASSIGN(const auto tiers, tables(project_.file, root_, "tier"));
    for (const TableReader& tier : tiers) {
      MODAR_TRY(tier.allow(keys_with_settings({"name"}, std::nullopt)));
      ProjectTier read;
      MODAR_TRY(tier.take("name", read.name));
      if (!is_plain(read.name)) return wrong_name(tier);
      MODAR_TRY(tier.take_settings(read.settings));
      project_.tiers.push_back(std::move(read));
    }
    if (project_.tiers.empty()) project_.tiers.emplace_back();
    return {};
  }

  Result<void> read_assets(const std::string& kind, bool pattern,
                           std::vector<ProjectAsset>& assets) {
    MODAR_ASSIGN(const auto readers, tables(project_.file, root_, kind));
    Keys keys =
        keys_with_settings({"file", "name"}, pattern ? OptionPart::kPattern : OptionPart::kModel);
    if (pattern) keys.insert(keys.end(), {"width-mm", "height-mm", "corners", "shape"});
    std::set<std::string> seen;
    for (std::size_t i = 0; i < readers.size(); ++i) {
      MODAR_TRY(told(readers[i].allow(keys)));
      const std::size_t before = assets.size();
      MODAR_TRY(told(add_assets(readers[i], pattern, seen, assets)));
      for (std::size_t added = before; added < assets.size(); ++added) assets[added].table = i;
    }
    return {};
  }

  /// shape, corners and height-mm together are what --pattern has in one text.
  static Result<void> take_shape(const TableReader& reader, ShapeRequest& shape) {
    std::string text;
    MODAR_TRY(reader.take("shape", text));
    if (!text.empty() && !parse_shape(text)) {
      return reader.wrong("shape", "shape = \"cylinder,diameter=66mm,arc=120\"");
    }
    std::string corners;
    MODAR_TRY(reader.take_numbers("corners", corners));
    double height = 0;
    MODAR_TRY(reader.take("height-mm", height, 0));
    if (text.empty() && (!corners.empty() || height > 0)) text = "flat";
    if (!corners.empty()) text += ",corners=" + corners;
    if (height > 0) text += ",height=" + shortest_text(height) + "mm";
    if (text.empty()) return {};
    auto parsed = parse_shape(text);
    if (!parsed && corners.empty()) return reader.wrong("height-mm", "it beside corners = [...]");
    if (!parsed) return reader.wrong("corners", "[[212, 80], [905, 131], [870, 640], [190, 602]]");
    shape = std::move(*parsed);
    return {};
  }

  /// The files of a table's globs; those after a "!" are left out.
  Result<void> add_assets(const TableReader& reader, bool pattern, std::set<std::string>& seen,
                          std::vector<ProjectAsset>& assets) {
    std::vector<std::string> globs;
    MODAR_TRY(reader.take("file", globs));
    if (globs.empty())
      return reader.wrong("file", "file = \"NAME\", where * matches any characters");
    ProjectAsset asset;
    asset.globs = globs;
    asset.pattern = pattern;
    asset.where = reader.where();
    MODAR_TRY(reader.take("name", asset.name));
    if (printable(asset.name) != asset.name) return reader.wrong("name", "a name of letters");
    MODAR_TRY(reader.take("width-mm", asset.width_mm, 0));
    MODAR_TRY(take_shape(reader, asset.shape));
    MODAR_TRY(reader.take_settings(asset.settings));
    const std::string name = asset.name;
    std::set<std::string> left_out;
    for (const std::string& glob : globs) {
      if (!glob.starts_with('!')) continue;
      for (std::string& file : expand(project_.folder, glob.substr(1)))
        left_out.insert(std::move(file));
    }
    for (const std::string& glob : globs) {
      if (glob.starts_with('!')) continue;
      add_folders(project_.folder, glob, project_.folders);
      const std::vector<std::string> files = expand(project_.folder, glob);
      if (files.empty()) {
        return fail(ExitCode::kInvalidInput, "project.no-match", reader.at("file"),
                    "there is no file '" + glob + "'", "correct the name, or remove the line");
      }
      for (const std::string& file : files) {
        if (left_out.count(file) != 0) continue;
        MODAR_TRY(keep_inside(reader, "file", file));
        asset.file = file;
        asset.name = name.empty() ? file_stem(file) : name;
        if (!seen.insert(asset.name).second) {
          return fail(ExitCode::kInvalidInput, "project.same-name", reader.at("file"),
                      "two files are named '" + asset.name + "', the second is " + file,
                      "give each its own table with a different name = \"...\"");
        }
        assets.push_back(asset);
      }
    }
    return {};
  }

  Result<void> read_scenes() {
    MODAR_ASSIGN(const auto readers, tables(project_.file, root_, "scene"));
    for (std::size_t i = 0; i < readers.size(); ++i) MODAR_TRY(told(read_scene(readers[i], i)));
    if (readers.empty()) make_scenes();
    return {};
  }

  Result<void> read_scene(const TableReader& reader, std::size_t table) {
    MODAR_TRY(
        told(reader.allow({"pattern", "model",   "scale", "height", "width", "up",    "turn",
                           "offset",  "centred", "light", "text",   "alt",   "name",  "hidden",
                           "group",   "picture", "video", "sound",  "label", "action"})));
    ProjectScene scene;
    scene.table = table;
    scene.where = reader.where();
    MODAR_TRY(reader.take("pattern", scene.request.pattern));
    MODAR_TRY(reader.take("model", scene.request.model));
    MODAR_TRY(known(reader, "pattern", scene.request.pattern, project_.patterns));
    MODAR_TRY(read_nodes(reader, scene));
    if (reader.has("model") || scene.nodes.empty()) {
      MODAR_TRY(known(reader, "model", scene.request.model, project_.models));
    }
    MODAR_TRY(take_node(reader, scene.request));
    MODAR_TRY(read_placement(reader, scene.request));
    MODAR_TRY(reader.take("centred", scene.request.centred));
    scene.request.light = project_.light;
    MODAR_TRY(take_light(reader, scene.request.light));
    MODAR_TRY(reader.take("text", scene.texts));
    MODAR_TRY(reader.take("alt", scene.alts));
    project_.scenes.push_back(std::move(scene));
    return {};
  }

  /// What a scene's model, its pictures and labels have in common.
  static Result<void> take_node(const TableReader& reader, SceneRequest& place) {
    MODAR_TRY(reader.take("name", place.name));
    if (printable(place.name) != place.name) return reader.wrong("name", "a name of letters");
    MODAR_TRY(reader.take("hidden", place.hidden));
    return reader.take("group", place.group);
  }

  Result<void> read_nodes(const TableReader& scene_reader, ProjectScene& scene) {
    MODAR_ASSIGN(const auto pictures, scene_reader.take_tables("picture"));
    for (const TableReader& reader : pictures) MODAR_TRY(read_picture(reader, scene));
    MODAR_ASSIGN(const auto videos, scene_reader.take_tables("video"));
    for (const TableReader& reader : videos) MODAR_TRY(read_video(reader, scene));
    MODAR_ASSIGN(const auto sounds, scene_reader.take_tables("sound"));
    for (const TableReader& reader : sounds) MODAR_TRY(read_sound(reader, scene));
    MODAR_ASSIGN(const auto labels, scene_reader.take_tables("label"));
    for (const TableReader& reader : labels) MODAR_TRY(read_label(reader, scene));
    MODAR_ASSIGN(const auto actions, scene_reader.take_tables("action"));
    for (const TableReader& reader : actions) MODAR_TRY(read_action(reader, scene));
    return {};
  }

  Result<void> read_picture(const TableReader& reader, ProjectScene& scene) {
    MODAR_TRY(reader.allow({"file", "name", "scale", "height", "width", "turn", "offset", "centred",
                            "hidden", "group", "alt"}));
    return read_plane(reader, {}, scene);
  }

  Result<void> read_video(const TableReader& reader, ProjectScene& scene) {
    MODAR_TRY(reader.allow({"file", "name", "scale", "height", "width", "turn", "offset", "centred",
                            "hidden", "group", "alt", "play", "loop", "alpha", "captions"}));
    NodeRequest node;
    node.kind = NodeKind::kVideo;
    MODAR_TRY(take_playing(reader, node));
    std::string alpha = "none";
    MODAR_TRY(reader.take("alpha", alpha));
    if (const auto read = parse_alpha(alpha, node); !read) {
      return fail(ExitCode::kInvalidInput, "project.value", reader.at("alpha"),
                  "alpha = \"" + alpha + "\": " + read.error().cause, read.error().cure);
    }
    return read_plane(reader, std::move(node), scene);
  }

  Result<void> read_sound(const TableReader& reader, ProjectScene& scene) {
    MODAR_TRY(reader.allow({"file", "name", "play", "loop", "captions"}));
    NodeRequest node;
    node.kind = NodeKind::kSound;
    MODAR_TRY(take_playing(reader, node));
    MODAR_TRY(take_node_file(reader, scene, node));
    scene.nodes.push_back(std::move(node));
    return {};
  }

  /// What videos and sounds have in common.
  Result<void> take_playing(const TableReader& reader, NodeRequest& node) const {
    MODAR_TRY(reader.take("play", node.plays));
    MODAR_TRY(reader.take("loop", node.loops));
    MODAR_TRY(reader.take("captions", node.captions));
    for (auto& [language, file] : node.captions) {
      MODAR_TRY(have_file(reader, "captions", file));
    }
    return {};
  }

  /// What all that have a file have in common.
  Result<void> take_node_file(const TableReader& reader, const ProjectScene& scene,
                              NodeRequest& node) {
    node.where = reader.at("file");
    node.place.pattern = scene.request.pattern;
    MODAR_TRY(take_file(reader, "file", node.file));
    if (node.file.empty()) return reader.wrong("file", "file = \"map.png\"");
    MODAR_TRY(take_node(reader, node.place));
    if (node.place.name.empty()) node.place.name = file_stem(node.file);
    return {};
  }

  /// What pictures and videos have in common.
  Result<void> read_plane(const TableReader& reader, NodeRequest node, ProjectScene& scene) {
    MODAR_TRY(take_node_file(reader, scene, node));
    MODAR_TRY(read_placement(reader, node.place));
    MODAR_TRY(reader.take("centred", node.place.centred));
    MODAR_TRY(reader.take("alt", node.alts));
    scene.nodes.push_back(std::move(node));
    return {};
  }

  static Result<void> read_label(const TableReader& reader, ProjectScene& scene) {
    constexpr std::size_t kMostMarkBytes = 32;
    MODAR_TRY(reader.allow({"name", "mark", "offset", "hidden", "group", "title", "text"}));
    NodeRequest node;
    node.kind = NodeKind::kLabel;
    node.where = reader.at("name");
    node.place.pattern = scene.request.pattern;
    MODAR_TRY(take_node(reader, node.place));
    node.mark = std::to_string(
        1 + std::count_if(scene.nodes.begin(), scene.nodes.end(),
                          [](const NodeRequest& other) { return other.kind == NodeKind::kLabel; }));
    MODAR_TRY(reader.take("mark", node.mark));
    if (node.place.name.empty()) node.place.name = node.mark;
    if (node.mark.empty() || node.mark.size() > kMostMarkBytes ||
        printable(node.mark) != node.mark) {
      return reader.wrong("mark", "a number or a short word");
    }
    MODAR_TRY(read_part(reader, "offset", node.place));
    MODAR_TRY(reader.take("title", node.titles));
    MODAR_TRY(reader.take("text", node.texts));
    scene.nodes.push_back(std::move(node));
    return {};
  }

  static Result<void> read_action(const TableReader& reader, ProjectScene& scene) {
    MODAR_TRY(reader.allow({"on", "part", "do"}));
    ActionRequest action;
    action.pattern = scene.request.pattern;
    action.where = reader.at("do");
    std::string event;
    std::string command;
    MODAR_TRY(reader.take("on", event));
    MODAR_TRY(reader.take("part", action.part));
    MODAR_TRY(reader.take("do", command));
    const auto wrong = [&](const char* key, const std::string& text, const WrongValue& why) {
      return fail(ExitCode::kInvalidInput, "project.value", reader.at(key),
                  std::string(key) + " = \"" + text + "\": " + why.cause, why.cure);
    };
    if (const auto read = parse_event(event, action); !read) {
      return wrong("on", event, read.error());
    }
    if (const auto read = parse_command(command, action); !read) {
      return wrong("do", command, read.error());
    }
    if (!action.part.empty() && action.event != ActionEvent::kTap) {
      return reader.wrong("part", "a part beside on = \"tap MODEL\" only");
    }
    scene.actions.push_back(std::move(action));
    return {};
  }

  /// A key whose value is written as in --scene, where lists of numbers may stand for "X:Y:Z".
  static Result<void> read_part(const TableReader& reader, const char* key, SceneRequest& scene) {
    if (!reader.has(key)) return {};
    std::string text;
    MODAR_TRY(reader.take_scene_value(key, text));
    const auto taken = take_scene_part(key, text, scene);
    if (taken) return {};
    return fail(ExitCode::kInvalidInput, "project.value", reader.at(key),
                std::string(key) + " = " + text + ": " + taken.error().cause, taken.error().cure);
  }

  static Result<void> read_placement(const TableReader& reader, SceneRequest& scene) {
    int sizes = 0;
    for (const char* key : {"scale", "height", "width"}) sizes += reader.has(key) ? 1 : 0;
    if (sizes > 1) return reader.wrong("scale", "one of scale, height and width, not several");
    for (const char* key : {"scale", "height", "width", "up", "turn", "offset"}) {
      MODAR_TRY(read_part(reader, key, scene));
    }
    return {};
  }

  /// The picture of a room.
  Result<void> take_light(const TableReader& reader, std::string& light) const {
    return take_file(reader, "light", light);
  }

  /// A file; relative to the project's folder, as models are.
  Result<void> take_file(const TableReader& reader, const char* key, std::string& file) const {
    MODAR_TRY(reader.take(key, file));
    return have_file(reader, key, file);
  }

  Result<void> have_file(const TableReader& reader, const char* key,
                         const std::string& file) const {
    std::error_code error;
    if (!file.empty()) MODAR_TRY(keep_inside(reader, key, file));
    if (file.empty() || fs::is_regular_file(project_.path(file), error)) return {};
    return fail(ExitCode::kInvalidInput, "project.no-match", reader.at(key),
                "there is no file '" + file + "'", "correct the name, or remove the line");
  }

  static Result<void> known(const TableReader& reader, const char* key, const std::string& name,
                            const std::vector<ProjectAsset>& assets) {
    std::vector<std::string> names;
    for (const ProjectAsset& asset : assets) names.push_back(asset.name);
    if (std::find(names.begin(), names.end(), name) != names.end()) return {};
    const std::string_view nearest = nearest_name(name, names);
    return fail(ExitCode::kInvalidInput, "project.scene-unknown", reader.at(key),
                "there is no " + std::string(key) + " '" + name + "'",
                nearest.empty() ? "name the file without folder and extension"
                                : "did you mean '" + std::string(nearest) + "'?");
  }

  /// Without [[scene]]: models stand on patterns of their name, and one on one.
  void make_scenes() {
    for (const ProjectAsset& model : project_.models) {
      for (const ProjectAsset& pattern : project_.patterns) {
        const bool pair = project_.models.size() == 1 && project_.patterns.size() == 1;
        if (!pair && model.name != pattern.name) continue;
        ProjectScene scene;
        scene.request.pattern = pattern.name;
        scene.request.model = model.name;
        scene.request.light = project_.light;
        project_.scenes.push_back(std::move(scene));
      }
    }
  }

  Result<void> read_bundles() {
    MODAR_ASSIGN(const auto readers, tables(project_.file, root_, "bundle"));
    for (const TableReader& reader : readers) {
      MODAR_TRY(reader.allow({"name", "models", "patterns"}));
      ProjectBundle bundle;
      MODAR_TRY(reader.take("name", bundle.name));
      MODAR_TRY(reader.take("models", bundle.models));
      MODAR_TRY(reader.take("patterns", bundle.patterns));
      if (!is_plain(bundle.name)) return wrong_name(reader);
      project_.bundles.push_back(std::move(bundle));
    }
    if (project_.bundles.empty()) project_.bundles.push_back({name_, {}, {}});
    return {};
  }

  Result<void> read_gates() {
    MODAR_ASSIGN(const auto reader, table(project_.file, root_, "gates"));
    if (!reader) return {};
    MODAR_TRY(reader->allow({"min-psnr", "min-ssim", "min-score", "min-grade", "max-bytes"}));
    MODAR_TRY(reader->take("min-psnr", project_.gates.min_psnr_db, 0));
    MODAR_TRY(reader->take("min-ssim", project_.gates.min_ssim, 0));
    MODAR_TRY(reader->take("min-score", project_.gates.min_score, 0));
    std::string grade;
    MODAR_TRY(reader->take("min-grade", grade));
    if (!grade.empty()) {
      if (grade.size() != 1 || grade[0] < 'A' || grade[0] > 'E') {
        return reader->wrong("min-grade", "\"A\" (the best) to \"E\"");
      }
      project_.gates.min_grade = grade[0];
    }
    double bytes = 0;
    MODAR_TRY(reader->take("max-bytes", bytes, 0));
    project_.gates.max_bytes = static_cast<std::uint64_t>(bytes);
    return {};
  }

  const toml::table& root_;
  std::vector<Error>* problems_;
  Project project_;
  std::string name_;  // of the only bundle
};

}  // namespace

NodeRequest Project::located(NodeRequest node) const {
  if (!node.file.empty()) node.file = path(node.file);
  for (auto& [language, name] : node.captions) name = path(name);
  return node;
}

bool Project::may_use(const std::string& name) const {
  if (outside) return true;
  std::error_code error;
  const fs::path own = fs::canonical(folder.empty() ? "." : folder, error);
  const fs::path whole = fs::weakly_canonical(fs::absolute(name, error), error);
  // Of what cannot be looked at nothing is known.
  const fs::path relative = whole.lexically_relative(own);
  return !error && !relative.empty() && *relative.begin() != "..";
}

Result<Project> read_project(const std::string& path, bool outside) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    return fail(ExitCode::kIo, "project.open", path, "there is no project file",
                "`modar init` writes one from the models and pictures of a folder; or name files "
                "with --model and --pattern");
  }
  const toml::parse_result parsed = toml::parse_file(path);
  if (!parsed) return tl::unexpected(no_toml(path, parsed.error()));
  return ProjectReader(path, parsed.table(), outside).run();
}

Result<Project> read_project_text(const std::string& text, const std::string& path) {
  const toml::parse_result parsed = toml::parse(text, path);
  if (!parsed) return tl::unexpected(no_toml(path, parsed.error()));
  return ProjectReader(path, parsed.table(), false).run();
}

ProjectDraft read_draft(const std::string& text, const std::string& path) {
  ProjectDraft draft;
  const toml::parse_result parsed = toml::parse(text, path);
  if (!parsed) draft.problems.push_back(no_toml(path, parsed.error()));
  const toml::table nothing;
  auto read = ProjectReader(path, parsed ? parsed.table() : nothing, false, &draft.problems).run();
  if (read) draft.project = std::move(*read);
  return draft;
}

}  // namespace modar
