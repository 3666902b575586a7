// Writes the first modar.toml from what lies in a folder.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/input.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/options/options.hpp"
#include "bake/process/process.hpp"
#include "bake/project/project.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

bool one_of(const std::string& extension, std::initializer_list<const char*> list) {
  return std::any_of(list.begin(), list.end(), [&](const char* one) { return extension == one; });
}

struct Found {
  std::string folder;
  std::vector<fs::path> left_out;  ///< what looks like a model or a picture and is not read
  std::vector<fs::path> models;    ///< relative to the folder, in byte order
  std::vector<fs::path> pictures;  ///< the same
  std::vector<fs::path> textures;  ///< pictures that are no patterns; the same
  std::string material_text;       ///< of all MTL and glTF files, in lower case
};

/// Hidden folders, and the one that the bundles go to, are left out.
bool left_out(const fs::path& name) {
  return name.string().starts_with('.') || name == "out";
}

/// A larger one embeds its pictures, and names none. What it would name becomes a pattern too many.
constexpr std::size_t kMostMaterialBytes = std::size_t{64} << 20;

std::string text_of(const fs::path& path) {
  return ascii_lower(read_file(path.string(), kMostMaterialBytes).value_or(""));
}

/// A file's name as glTF writes it, in small letters as the text that is searched for it.
std::string as_uri(const std::string& file) {
  std::string uri;
  for (const char c : file) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                       std::string_view("-._~").find(c) != std::string_view::npos;
    char escaped[4];
    std::snprintf(escaped, sizeof escaped, "%%%02x", static_cast<unsigned char>(c));
    uri += plain ? std::string(1, c) : escaped;
  }
  return uri;
}

/// Does a text name a file? "wall1.png" does not name "1.png".
bool names_file(const std::string& text, const std::string& file) {
  for (std::size_t at = text.find(file); at != std::string::npos; at = text.find(file, at + 1)) {
    if (at == 0 || std::string_view(" \t\"'/\\").find(text[at - 1]) != std::string_view::npos) {
      return true;
    }
  }
  return false;
}

/// Files above it are not read to see what they hold.
constexpr std::uintmax_t kMostModelBytes = 100'000'000;  // a second of reading

std::optional<SourceModel> small_model(const fs::path& path) {
  std::error_code error;
  if (fs::file_size(path, error) > kMostModelBytes || error) return std::nullopt;
  auto source = read_model(path.string(), {});
  return source ? std::optional(std::move(*source)) : std::nullopt;
}

/// Is a picture a texture: one that a material names, or that is a model's by its name?
bool is_texture(const fs::path& picture, const Found& found) {
  const std::string name = ascii_lower(picture.filename().string());
  if (names_file(found.material_text, name)) return true;
  if (names_file(found.material_text, as_uri(name))) return true;
  const std::string stem = picture.stem().string();
  return std::any_of(found.models.begin(), found.models.end(), [&](const fs::path& model) {
    if (model.parent_path() != picture.parent_path()) return false;
    if (is_map_name(stem, model.stem().string())) return true;
    if (!is_own_picture(stem, model.stem().string())) return false;
    const auto source = small_model(fs::path(found.folder) / model);
    return source && std::ranges::any_of(source->materials, [&](const SourceMaterial& material) {
             return fs::path(material.diffuse_map).filename() == picture.filename();
           });
  });
}

Result<Found> look_through(const std::string& folder) {
  Found found;
  found.folder = folder;
  std::error_code error;
  fs::recursive_directory_iterator it(folder, error);
  if (error) {
    return fail(ExitCode::kIo, "io.folder", folder, error.message(),
                "name a folder to look through");
  }
  for (; it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (error) break;
    if (left_out(it->path().filename())) {
      if (it->is_directory(error)) it.disable_recursion_pending();
      continue;
    }
    if (!it->is_regular_file(error)) continue;
    const fs::path relative = it->path().lexically_relative(folder);
    const std::string extension = ascii_lower(relative.extension().string());
    if (is_model_file(relative.string())) found.models.push_back(relative);
    if (is_foreign_picture_file(relative.string()) ||
        one_of(extension, {".fbx", ".dae", ".blend", ".3ds", ".usdz", ".usd", ".max", ".c4d", ".ma",
                           ".mb", ".skp", ".stp", ".step", ".las", ".e57"})) {
      found.left_out.push_back(relative);
    }
    if (is_picture_file(relative.string())) found.pictures.push_back(relative);
    if (one_of(extension, {".mtl", ".gltf"})) found.material_text += text_of(it->path()) + "\n";
  }
  std::sort(found.models.begin(), found.models.end());
  std::sort(found.pictures.begin(), found.pictures.end());
  std::sort(found.left_out.begin(), found.left_out.end());
  const auto patterns =
      std::stable_partition(found.pictures.begin(), found.pictures.end(),
                            [&](const fs::path& picture) { return !is_texture(picture, found); });
  found.textures.assign(patterns, found.pictures.end());
  found.pictures.erase(patterns, found.pictures.end());
  return found;
}

/// "; left out: a.fbx, b.pdf", or nothing.
std::string list_of(const char* what, const std::vector<fs::path>& files) {
  constexpr std::size_t kMostNames = 6;
  std::string words;
  for (std::size_t i = 0; i < std::min(kMostNames, files.size()); ++i) {
    words += (i == 0 ? what : ", ") + files[i].string();
  }
  if (files.size() > kMostNames) {
    words += " and " + std::to_string(files.size() - kMostNames) + " more";
  }
  return words;
}

std::string left_out_words(const Found& found) {
  return list_of("; textures, so no patterns: ", found.textures) +
         list_of("; left out, since such files are not read: ", found.left_out);
}

/// A TOML text in quotes, of a file name that a glob matches as it is.
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

/// The value of "file": a glob, and what it would match that is none of these assets.
std::string glob_without(const std::string& glob, const std::vector<fs::path>& others) {
  std::string list;
  for (const fs::path& other : others) {
    if (glob_around(other) != glob) continue;
    const std::string name = quoted(other.string(), true);
    list += ", \"!" + name.substr(1);
  }
  return list.empty() ? "\"" + glob + "\"" : "[\"" + glob + "\"" + list + "]";
}

/// "[[model]]" tables of the files: one glob a folder and extension where all names differ, else a
/// table a file. others: files that are none of them. names: receives what scenes call them.
std::string tables(const std::string& kind, const std::vector<fs::path>& files,
                   const std::vector<fs::path>& others, const std::string& comment,
                   std::vector<std::string>& names) {
  std::map<std::string, int> stems;
  for (const fs::path& file : files) ++stems[file.stem().string()];
  std::map<std::string, std::vector<fs::path>> groups;  // by glob
  for (const fs::path& file : files) groups[glob_around(file)].push_back(file);
  std::string text;
  std::set<std::string> taken;
  for (const auto& [glob, group] : groups) {
    const bool plain = std::ranges::all_of(
        group, [&](const fs::path& file) { return stems[file.stem().string()] == 1; });
    if (plain && group.size() > 1) {
      text += "[[" + kind + "]]\nfile = " + glob_without(glob, others) + comment + "\n\n";
      for (const fs::path& file : group) taken.insert(file.stem().string());
      continue;
    }
    for (const fs::path& file : group) {
      std::string name = file.stem().string();
      text += "[[" + kind + "]]\nfile = " + quoted(file.string(), true) + "\n";
      if (!taken.insert(name).second) {
        name = folder_or_path(file, taken);
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
std::optional<Upright> upright_of(const fs::path& path) {
  auto source = small_model(path);
  if (!source) return std::nullopt;
  if (source->up.reason != UpReason::kConvention) return source->up;
  Report report;
  const auto mesh = weld(std::move(*source), report);
  return mesh ? std::optional(find_up(*mesh)) : std::nullopt;
}

/// "up = "y"   # the glTF standard", so that one sees what to change.
std::string up_line(const Found& found, const std::string& model) {
  const auto file = std::ranges::find_if(found.models, [&](const fs::path& one) {
    std::string name = one.string();
    std::replace(name.begin(), name.end(), '/', '-');
    return one.stem() == model || one.parent_path().filename() == model || name == model;
  });
  const auto up =
      file == found.models.end() ? std::nullopt : upright_of(fs::path(found.folder) / *file);
  if (!up) return "#up = \"y\"\n";
  return "up = \"" + std::string(up_axis_name(up->axis)) +
         "\"        # axis that points up: " + std::string(up_reason_words(up->reason)) + "\n";
}

/// Options of [bake] that a collection often sets, each commented out with an example.
std::string suggestions() {
  constexpr std::string_view kOften[] = {"device", "effort", "unit", "max-error", "up"};
  std::string text;
  for (const BakeOption& option : bake_options()) {
    if (std::find(std::begin(kOften), std::end(kOften), option.key) == std::end(kOften)) continue;
    std::string line = "#" + std::string(option.key) + " = " + quoted(option.example, false);
    line.resize(std::max<std::size_t>(line.size(), 26), ' ');
    text += line + "# " + option_summary(option) + "\n";
  }
  return text;
}

/// Pairs in order, where names do not say what belongs together.
std::string scenes(const Found& found, const std::vector<std::string>& models,
                   const std::vector<std::string>& patterns) {
  if (models.empty() || patterns.empty()) return "";
  const bool by_name = std::any_of(models.begin(), models.end(), [&](const std::string& name) {
    return std::find(patterns.begin(), patterns.end(), name) != patterns.end();
  });
  std::string text =
      "# Which model stands on which pattern. Without any [[scene]], models stand on patterns of "
      "their\n"
      "# own name, and a single one on a single one.\n";
  if (by_name || (models.size() == 1 && patterns.size() == 1)) {
    return text + "#[[scene]]\n#pattern = " + quoted(patterns[0], false) +
           "\n#model = " + quoted(models[0], false) + "\n#" + up_line(found, models[0]) +
           kSceneHints + "\n";
  }
  for (std::size_t i = 0; i < std::min(models.size(), patterns.size()); ++i) {
    text += "[[scene]]\npattern = " + quoted(patterns[i], false) +
            "\nmodel = " + quoted(models[i], false) + "\n" + up_line(found, models[i]) +
            (i == 0 ? kSceneHints : "") + "\n";
  }
  return text;
}

}  // namespace

Result<FoundAssets> find_assets(const std::string& folder) {
  MODAR_ASSIGN(const Found found, look_through(folder));
  FoundAssets assets;
  for (const fs::path& model : found.models) assets.models.push_back(model.string());
  for (const fs::path& picture : found.pictures) assets.pictures.push_back(picture.string());
  std::sort(assets.models.begin(), assets.models.end());
  std::sort(assets.pictures.begin(), assets.pictures.end());
  return assets;
}

std::string as_glob(const std::string& file) {
  std::string glob = file.starts_with('!') ? "./" : "";  // else it would leave the file out
  for (const char c : file) {
    glob += c == '*' || c == '?' || c == '[' ? std::string("[") + c + "]" : std::string(1, c);
  }
  return glob;
}

Result<InitialProject> initial_project(const std::string& folder) {
  MODAR_ASSIGN(const Found found, look_through(folder));
  if (found.models.empty() && found.pictures.empty()) {
    return fail(ExitCode::kInvalidInput, "project.nothing", folder,
                "there is neither a model (OBJ, glTF, GLB, PLY, STL) nor a picture in it" +
                    left_out_words(found),
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
      "[bake]\n"
      "parameters = [\"none\"]     # the ModAR paper's features are for other programs only\n" +
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
  text += tables("model", found.models, {}, "", models);
  text +=
      tables("pattern", found.pictures, found.textures,
             "\n#width-mm = 210          # as printed, where the file does not state it", patterns);
  text += scenes(found, models, patterns);
  while (text.ends_with("\n\n")) text.pop_back();
  return InitialProject{text, left_out_words(found)};
}

}  // namespace modar
