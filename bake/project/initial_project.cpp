// Writes the first modar.toml from the files of a folder.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "bake/bundle/files/sorted_files.hpp"
#include "bake/import/source_model.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/options/options.hpp"
#include "bake/process/process.hpp"
#include "bake/project/project.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/shortest_number.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

struct Found {
  std::string folder;
  SortedFiles files;                     ///< relative to the folder, in byte order
  std::vector<PatternRequest> pictures;  ///< of the files, each with the corners found in it
  std::vector<Diagnostic> said;          ///< of the pictures
};

/// Hidden folders, and the one that the bundles go to, are left out.
bool left_out(const fs::path& name) {
  return name.string().starts_with('.') || name == "out";
}

Result<std::vector<std::string>> files_below(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  fs::recursive_directory_iterator it(folder, error);
  if (error) {
    return missing_file(folder, {ExitCode::kIo, "io.folder", folder, error.message(),
                                 "name a folder to look through"});
  }
  for (; it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (error) break;
    if (left_out(it->path().filename())) {
      if (it->is_directory(error)) it.disable_recursion_pending();
      continue;
    }
    if (it->is_regular_file(error)) files.push_back(it->path().lexically_relative(folder).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// "a.png, b.png and 3 more".
std::string listed(const std::vector<std::string>& files) {
  constexpr std::size_t kMostNames = 6;
  std::string words;
  for (std::size_t i = 0; i < std::min(kMostNames, files.size()); ++i) {
    words += (i == 0 ? "" : ", ") + files[i];
  }
  if (files.size() > kMostNames) {
    words += " and " + std::to_string(files.size() - kMostNames) + " more";
  }
  return words;
}

/// Files that could not be baked are left out, so that the project bakes without edits.
Result<Found> look_through(const std::string& folder) {
  Found found;
  found.folder = folder;
  MODAR_ASSIGN(const std::vector<std::string> files, files_below(folder));
  found.files = sort_files(files, folder);
  auto& left_out = found.files.left_out;
  std::erase_if(found.files.models, [&](const std::string& model) {
    const auto read = small_model((fs::path(folder) / model).string(), folder);
    if (!read || *read) return false;
    left_out.push_back({model, read->error()});
    return true;
  });
  for (const std::string& picture : found.files.pictures) {
    PatternRequest pattern{(fs::path(folder) / picture).lexically_normal().string()};
    const auto good = find_picture(pattern, found.said);
    pattern.path = picture;
    if (good) {
      found.pictures.push_back(std::move(pattern));
    } else {
      left_out.push_back({picture, good.error()});
    }
  }
  if (!found.files.textures.empty()) {
    found.said.push_back({"project.textures", DiagnosticSeverity::kInfo, folder, 0,
                          "textures, so no patterns: " + listed(found.files.textures), ""});
  }
  for (const LeftOut& one : left_out) {
    found.said.push_back({one.error.code, DiagnosticSeverity::kWarning, one.error.where, 0,
                          "left out: " + one.error.cause, one.error.cure});
  }
  return found;
}

/// A TOML text in quotes, of a file name that a glob matches literally.
std::string quoted(const std::string& text, bool glob) {
  std::string out = "\"";
  for (const char c : glob ? as_glob(text) : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

/// The name of a file whose stem is taken: its folder's, else its whole path's.
std::string folder_or_path(const fs::path& file, const std::set<std::string>& taken) {
  std::string name = file.parent_path().filename().string();
  if (!name.empty() && taken.count(name) == 0) return name;
  name = file.string();
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

/// The glob of all files of a file's extension in its folder, as TOML has it without the quotes.
std::string glob_around(const fs::path& file) {
  const fs::path folder = file.parent_path();
  const std::string prefix = folder.empty() ? "" : quoted((folder / "").string(), true);
  return (prefix.empty() ? "" : prefix.substr(1, prefix.size() - 2)) + "*" +
         file.extension().string();
}

/// The value of "file": a glob, and the files outside these assets that it would match.
std::string glob_without(const std::string& glob, const std::vector<fs::path>& others) {
  std::string list;
  for (const fs::path& other : others) {
    if (glob_around(other) != glob) continue;
    const std::string name = quoted(other.string(), true);
    list += ", \"!" + name.substr(1);
  }
  return list.empty() ? "\"" + glob + "\"" : "[\"" + glob + "\"" + list + "]";
}

/// "corners = [[x, y], ...]": where the picture is in the photo.
std::string corners_line(const std::array<PixelPoint, 4>& corners) {
  std::string list;
  for (const PixelPoint& corner : corners) {
    list += (list.empty() ? "[" : ", [") + shortest_text(corner.x) + ", " +
            shortest_text(corner.y) + "]";
  }
  return "corners = [" + list + "]   # of the picture in this photo; `modar studio` shows them\n";
}

/// "[[model]]" tables of the files: one glob a folder and extension where all names differ, else a
/// table a file. others: files that are not among them. names: receives what scenes call them.
std::string tables(const std::string& kind, const std::vector<PatternRequest>& files,
                   const std::vector<fs::path>& others, const std::string& comment,
                   std::vector<std::string>& names) {
  std::map<std::string, int> stems;
  for (const PatternRequest& file : files) ++stems[file_stem(file.path)];
  std::map<std::string, std::vector<PatternRequest>> groups;  // by glob
  for (const PatternRequest& file : files) groups[glob_around(file.path)].push_back(file);
  std::string text;
  std::set<std::string> taken;
  for (const auto& [glob, group] : groups) {
    const bool plain = ranges::all_of(group, [&](const PatternRequest& file) {
      return stems[file_stem(file.path)] == 1 && !file.shape.corners;
    });
    if (plain && group.size() > 1) {
      text += "[[" + kind + "]]\nfile = " + glob_without(glob, others) + comment + "\n\n";
      for (const PatternRequest& file : group) taken.insert(file_stem(file.path));
      continue;
    }
    for (const PatternRequest& file : group) {
      std::string name = file_stem(file.path);
      text += "[[" + kind + "]]\nfile = " + quoted(file.path, true) + "\n";
      if (file.shape.corners) text += corners_line(*file.shape.corners);
      if (!taken.insert(name).second) {
        name = folder_or_path(file.path, taken);
        taken.insert(name);
        text += "name = " + quoted(name, false) + "\n";
      }
      text += comment.empty() ? "\n" : comment.substr(1) + "\n\n";
    }
  }
  names.assign(taken.begin(), taken.end());
  return text;
}

constexpr const char* kSceneHints =
    "#turn = 90       # degrees about the axis out of the pattern\n"
    "#scale = 0.8     # of the pattern's largest side, or height = \"120mm\" where its width is "
    "known\n"
    "#text.en = \"A vase.\"\n";

/// How a model would stand: "y", and how that is known. Large files are not read for it.
std::optional<Upright> upright_of(const fs::path& path, const std::string& within) {
  auto source = small_model(path.string(), within);
  if (!source || !*source) return std::nullopt;
  if ((*source)->up.reason != UpReason::kConvention) return (*source)->up;
  Report report;
  const auto mesh = weld(std::move(**source), report);
  return mesh ? std::optional(find_up(*mesh)) : std::nullopt;
}

/// "up = "y"   # the glTF standard", so that one sees what to change.
std::string up_line(const Found& found, const std::string& model) {
  const auto& models = found.files.models;
  const auto file = ranges::find_if(models, [&](const fs::path& one) {
    std::string name = one.string();
    std::replace(name.begin(), name.end(), '/', '-');
    return one.stem() == model || one.parent_path().filename() == model || name == model;
  });
  const auto up = file == models.end() ? std::nullopt
                                       : upright_of(fs::path(found.folder) / *file, found.folder);
  if (!up) return "#up = \"y\"\n";
  return "up = \"" + std::string(up_axis_name(up->axis)) +
         "\"        # axis that points up: " + std::string(up_reason_words(up->reason)) + "\n";
}

/// Options of [bake] that a collection often sets, each commented out with an example.
std::string suggestions() {
  constexpr std::string_view kOften[] = {"device", "effort", "unit", "max-error", "up"};
  std::string text;
  for (const BakeOption& option : bake_options()) {
    if (std::find(std::begin(kOften), std::end(kOften), option.name) == std::end(kOften)) continue;
    std::string line = "#" + std::string(option.name) + " = " + quoted(option.example, false);
    line.resize(std::max<std::size_t>(line.size(), 26), ' ');
    text += line + "# " + option_summary(option) + "\n";
  }
  return text;
}

/// What a person should know of the pairs: that they are a guess, and what stands nowhere.
void report_pairs(const ScenePairs& pairs, const std::vector<std::string>& models, Found& found) {
  std::vector<std::string> guesses;
  std::vector<std::string> idle = models;
  for (const SceneRequest& scene : pairs.scenes) {
    if (pairs.guessed) guesses.push_back(scene.model + " on " + scene.pattern);
    std::erase(idle, scene.model);
  }
  if (!guesses.empty()) {
    found.said.push_back({"project.guessed", DiagnosticSeverity::kWarning, found.folder, 0,
                          "models were put on pictures in the order of their names, which is a "
                          "guess: " +
                              listed(guesses),
                          "change pattern = and model = in [[scene]], or give a model the name of "
                          "its picture"});
  }
  if (!idle.empty()) {
    found.said.push_back(
        {"project.idle", DiagnosticSeverity::kWarning, found.folder, 0,
         (pairs.guessed ? "no picture is left for: " : "no picture has the name of: ") +
             listed(idle),
         "add a [[scene]] for each, or more pictures"});
  }
}

/// The scenes that names do not say by themselves.
std::string scenes(Found& found, const std::vector<std::string>& models,
                   const std::vector<std::string>& patterns) {
  if (models.empty() || patterns.empty()) return "";
  const ScenePairs pairs = pair_by_names(patterns, models);
  report_pairs(pairs, models, found);
  std::string text =
      "# Which model is on which pattern. Without any [[scene]], models are on patterns of "
      "their\n"
      "# own name, and a single one on a single one.\n";
  if (!pairs.guessed) {
    return text + "#[[scene]]\n#pattern = " + quoted(patterns[0], false) +
           "\n#model = " + quoted(models[0], false) + "\n#" + up_line(found, models[0]) +
           kSceneHints + "\n";
  }
  text += "# These pairs are in the order of the names, which is a guess.\n";
  for (const SceneRequest& scene : pairs.scenes) {
    text += "[[scene]]\npattern = " + quoted(scene.pattern, false) +
            "\nmodel = " + quoted(scene.model, false) + "\n" + up_line(found, scene.model) +
            (&scene == pairs.scenes.data() ? kSceneHints : "") + "\n";
  }
  return text;
}

}  // namespace

Result<FoundAssets> find_assets(const std::string& folder) {
  MODAR_ASSIGN(const std::vector<std::string> files, files_below(folder));
  SortedFiles sorted = sort_files(files, folder);
  return FoundAssets{std::move(sorted.models), std::move(sorted.pictures),
                     std::move(sorted.left_out)};
}

std::string as_glob(const std::string& file) {
  std::string glob = file.starts_with('!') ? "./" : "";  // else it would leave the file out
  for (const char c : file) {
    glob += c == '*' || c == '?' || c == '[' ? std::string("[") + c + "]" : std::string(1, c);
  }
  return glob;
}

Result<InitialProject> initial_project(const std::string& folder) {
  MODAR_ASSIGN(Found found, look_through(folder));
  const auto& left_out = found.files.left_out;
  if (found.files.models.empty() && found.pictures.empty()) {
    std::string cause = "there is neither a model (OBJ, glTF, GLB, PLY, STL) nor a picture in it";
    for (const LeftOut& one : left_out) cause += "; left out: " + to_line(one.error);
    return fail(ExitCode::kInvalidInput, "project.nothing", folder, cause,
                "put some there, or name another folder");
  }
  std::error_code error;
  const std::string name = fs::absolute(folder, error).lexically_normal().string();
  std::string stem = fs::path(name).filename().string();
  if (stem.empty()) stem = fs::path(name).parent_path().filename().string();
  const fs::path schema = fs::path(program_folder()) / "../share/modar/modar.schema.json";
  std::string text;
  if (fs::exists(schema, error)) text += "#:schema " + schema.lexically_normal().string() + "\n";
  text +=
      "# A ModAR project: `modar bake` in this folder bakes what changed.\n\n"
      "[project]\n"
      "name = " +
      quoted(stem, false) +
      "          # of the bundle: out/NAME.modar\n"
      "#out = \"out\"\n"
      "#light = \"room.hdr\"      # panorama or photo of the room whose light falls on the "
      "scenes\n\n"
      "[bake]\n" +
      suggestions() +
      "\n"
      "#[[tier]]                 # the same bundles once more, for other devices\n"
      "#name = \"low\"\n"
      "#device = \"mali400\"\n"
      "#max-texture = 512\n\n"
      "#[gates]                  # a bundle that does not reach them is not written\n"
      "#min-psnr = 30\n"
      "#min-grade = \"C\"\n\n";
  std::vector<std::string> models;
  std::vector<std::string> patterns;
  std::vector<fs::path> others(found.files.textures.begin(), found.files.textures.end());
  for (const LeftOut& one : left_out) others.emplace_back(one.file);
  for (const PatternRequest& picture : found.pictures) {
    if (picture.shape.corners) others.emplace_back(picture.path);
  }
  std::vector<PatternRequest> files;
  for (const std::string& model : found.files.models) files.push_back({model});
  text += tables("model", files, others, "", models);
  text += tables("pattern", found.pictures, others,
                 "\n#width = \"210mm\"         # as printed, where the file does not state it",
                 patterns);
  text += scenes(found, models, patterns);
  while (text.ends_with("\n\n")) text.pop_back();
  return InitialProject{text, std::move(found.said)};
}

}  // namespace modar
