#include "bake/extensions/studio/upload.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "bake/extensions/studio/archive.hpp"
#include "bake/extensions/studio/edits.hpp"
#include "bake/extensions/studio/move_file.hpp"
#include "bake/extensions/studio/path_guard.hpp"
#include "bake/import/read_model.hpp"
#include "bake/project/project_edit.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kObjStart = 1u << 16;      // bytes; exporters name the MTL in the first lines
constexpr std::uintmax_t kMostText = 32u << 20;  // bytes of an MTL or glTF text that is read

/// A folder that is removed with all that is in it.
class Staging {
 public:
  explicit Staging(const std::string& in) : path_(in + "/unpacked-XXXXXX") {
    if (::mkdtemp(path_.data()) == nullptr) path_.clear();
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;
  ~Staging() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

bool same_bytes(const std::string& a, const std::string& b) {
  std::error_code error;
  if (fs::file_size(a, error) != fs::file_size(b, error) || error) return false;
  if (fs::file_size(a, error) == 0) return true;
  const auto first = MappedFile::open(a);
  const auto second = MappedFile::open(b);
  return first && second &&
         std::equal(first->bytes().begin(), first->bytes().end(), second->bytes().begin());
}

/// "vase.obj" -> "vase-2.obj".
std::string numbered(const std::string& name, int number) {
  const fs::path path(name);
  const std::string file =
      path.stem().string() + "-" + std::to_string(number) + path.extension().string();
  return (path.parent_path() / file).string();
}

void sync(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

/// Gives a file that has arrived its name, or the next one that is free; answers it. Of the same
/// bytes one is kept. Errors: kUsage "studio.name"; kIo "io.write".
Result<std::string> settle(const Session& session, const std::string& from,
                           const std::string& name) {
  constexpr int kMostNames = 1000;
  ::chmod(from.c_str(), 0644);
  sync(from);
  for (int number = 1; number < kMostNames; ++number) {
    const std::string candidate = number == 1 ? name : numbered(name, number);
    MODAR_ASSIGN(const std::string path, place_inside(session.folder, candidate));
    if (move_to_free(from, path)) {
      sync(fs::path(path).parent_path().string());
      return candidate;
    }
    if (errno != EEXIST) {
      return fail(ExitCode::kIo, "io.write", candidate,
                  std::string("the file cannot be saved: ") + std::strerror(errno),
                  cure_of_writing(errno));
    }
    if (same_bytes(from, path)) return candidate;
  }
  return fail(ExitCode::kUsage, "studio.name", name, "a thousand files have this name",
              "rename the file, and drop it again");
}

bool is_zip(const std::string& path) {
  std::array<char, 4> start{};
  std::ifstream(path, std::ios::binary).read(start.data(), start.size());
  return std::string_view(start.data(), start.size()) == std::string_view("PK\3\4", 4);
}

bool has_ending(const std::string& name, std::string_view ending) {
  if (name.size() < ending.size()) return false;
  return std::equal(ending.begin(), ending.end(), name.end() - static_cast<long>(ending.size()),
                    [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b + 32 : b); });
}

/// The files of an archive, in a folder of its name.
Result<std::vector<std::string>> settle_archive(const Session& session, const std::string& from,
                                                const std::string& name) {
  const Staging staging(session.own);
  if (staging.path().empty()) {
    return fail(ExitCode::kIo, "io.write", name, std::strerror(errno), cure_of_writing(errno));
  }
  MODAR_ASSIGN(const auto names, unpack_zip(from, staging.path()));
  const std::string stem = name.substr(0, name.size() - 4);
  std::vector<std::string> files;
  for (const std::string& one : names) {
    const std::string top = file_name(stem) + "/";
    const std::string below = one.starts_with(top) ? one.substr(top.size()) : one;
    MODAR_ASSIGN(const std::string kept,
                 settle(session, staging.path() + "/" + one, stem + "/" + below));
    files.push_back(kept);
  }
  return files;
}

/// What the folder now has and modar.toml does not list; pictures that turned out to be textures
/// leave it, where nobody has done anything with them.
Result<std::string> listed_text(const Session& session, const std::string& text,
                                const std::vector<std::string>& files, const FoundAssets& found) {
  const auto is_in = [](const std::vector<std::string>& list, const std::string& file) {
    return std::binary_search(list.begin(), list.end(), file);
  };
  std::string now = text;
  const ProjectDraft draft = read_draft(text, session.file);
  Json leaving = Json::array();
  for (const ProjectAsset& pattern : draft.project.patterns) {
    const bool plain = pattern.globs.size() == 1 && pattern.globs[0] == as_glob(pattern.file) &&
                       pattern.width_mm == 0 && pattern.shape.text.empty() &&
                       pattern.settings.empty();
    const bool placed = ranges::any_of(draft.project.scenes, [&](const ProjectScene& scene) {
      return scene.table && scene.request.pattern == pattern.name;
    });
    if (!plain || placed || is_in(found.pictures, pattern.file)) continue;
    leaving.push_back({{"op", "delete"}, {"table", "pattern"}, {"name", pattern.name}});
  }
  if (leaving.size() > 0) {
    MODAR_ASSIGN(now, edited_text(now, session.file, leaving));
  }
  std::vector<NewAsset> assets;
  for (const std::string& file : files) {
    const bool pattern = is_in(found.pictures, file);
    if (pattern || is_in(found.models, file)) assets.push_back({file, pattern});
  }
  if (assets.empty()) return now;
  return text_with_assets(now, session.file, assets);
}

/// Where a file without a folder goes: where a model in a folder of the project misses it, else to
/// the project's root.
std::string place_of(const Session& session, const std::string& name) {
  const auto found = find_assets(session.folder);
  if (!found || name.find('/') != std::string::npos) return name;
  for (const std::string& model : found->models) {
    for (const std::string& missing : missing_of(session, model)) {
      if (fs::path(missing).filename() == name && check_name(missing)) return missing;
    }
  }
  return name;
}

Result<Json> add_upload(Session& session, const std::string& upload, const std::string& name) {
  MODAR_TRY(check_name(name));
  if (name == kProjectFile) {
    return fail(ExitCode::kUsage, "studio.name", name, "the studio writes this file itself",
                "open its folder by `modar studio FOLDER`");
  }
  const bool archive = has_ending(name, ".zip") && is_zip(upload);
  std::vector<std::string> files;
  if (archive) {
    MODAR_ASSIGN(files, settle_archive(session, upload, name));
  } else {
    MODAR_ASSIGN(files.emplace_back(), settle(session, upload, place_of(session, name)));
  }
  Json problems = Json::array();
  MODAR_ASSIGN(const ProjectText::State before, session.text.read());
  MODAR_ASSIGN(const FoundAssets found, find_assets(session.folder));
  const auto listed = session.text.edit(before.revision, [&](const std::string& text) {
    return listed_text(session, text, files, found);
  });
  if (!listed) problems.push_back(json_of(listed.error()));
  for (const LeftOut& one : found.left_out) {
    if (ranges::count(files, one.file) > 0) problems.push_back(json_of(one.error));
  }
  std::set<std::string> missing;
  for (const std::string& file : files) {
    for (std::string& one : missing_of(session, file)) missing.insert(std::move(one));
  }
  MODAR_ASSIGN(Json project, project_view(session));
  return Json{{"added", Json::list(files)},
              {"kind", archive ? "archive" : file_kind(files.front())},
              {"missing", Json::list(missing)},
              {"problems", std::move(problems)},
              {"project", std::move(project)}};
}

std::string text_of(const std::string& path, std::size_t most) {
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  std::string text(std::min<std::uintmax_t>(most, fs::file_size(path, error)), '\0');
  file.read(text.data(), static_cast<std::streamsize>(most));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return text;
}

/// Where a file that a model names is looked for, relative to the project's folder: of one outside
/// of it, in the model's own folder.
std::string wanted(const Session& session, const std::string& model, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  const fs::path own = fs::path(model).parent_path();
  const fs::path relative = (own / name).lexically_normal().lexically_relative(session.folder);
  if (!relative.empty() && *relative.begin() != "..") return relative.string();
  return (own / fs::path(name).filename()).lexically_relative(session.folder).string();
}

void add_missing_of_obj(const Session& session, const std::string& path,
                        std::vector<std::string>& missing) {
  const std::string text = text_of(path, kObjStart);
  const ModelFolder folder(fs::path(path).parent_path().string(), session.folder);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    at = end + 1;
    if (!line.starts_with("mtllib ")) continue;
    line.erase(0, 7);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    const std::string file = find_named_file(line, folder);
    if (file.empty()) {
      missing.push_back(wanted(session, path, line));
      continue;
    }
    std::vector<Diagnostic> ignored;
    std::vector<std::string> maps;
    parse_mtl(text_of(file, kMostText), {fs::path(file).parent_path().string(), session.folder},
              line, ignored, &maps);
    for (const std::string& map : maps) missing.push_back(wanted(session, path, map));
  }
}

/// "a%20b" -> "a b".
std::string without_percents(const std::string& uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size()) {
      out += static_cast<char>(std::strtol(uri.substr(i + 1, 2).c_str(), nullptr, 16));
      i += 2;
    } else {
      out += uri[i];
    }
  }
  return out;
}

void add_missing_of_gltf(const Session& session, const std::string& path,
                         std::vector<std::string>& missing) {
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  if (error || bytes > kMostText) return;
  const Json json = Json::parse(text_of(path, static_cast<std::size_t>(bytes)));
  const fs::path own = fs::path(path).parent_path();
  const ModelFolder folder(own.string(), session.folder);
  for (const char* list : {"buffers", "images"}) {
    for (const Json& entry : json[list].elements()) {
      const std::string uri = entry.text_at("uri");
      if (uri.empty() || uri.starts_with("data:")) continue;
      const std::string name = without_percents(uri);
      const bool there = folder.has((own / name).string()) ||
                         (list == std::string_view("images") &&
                          folder.has((own / fs::path(name).filename()).string()));
      if (!there) missing.push_back(wanted(session, path, name));
    }
  }
}

}  // namespace

std::vector<std::string> missing_of(const Session& session, const std::string& file) {
  std::vector<std::string> missing;
  const std::string path = path_in(session, file);
  if (has_ending(file, ".obj")) add_missing_of_obj(session, path, missing);
  if (has_ending(file, ".gltf")) add_missing_of_gltf(session, path, missing);
  std::sort(missing.begin(), missing.end());
  missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
  return missing;
}

Result<Answer> take_upload(Session& session, const Call& call) {
  const std::string name = call.path.substr(std::string_view("api/files/").size());
  return answer_or_error(add_upload(session, call.upload, name));
}

}  // namespace modar
