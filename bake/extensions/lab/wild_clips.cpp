// Finds clips in a folder and reads their truths.
#include "bake/extensions/lab/wild_clips.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>

#include "bake/extensions/lab/number_lines.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCode = "bench.wild";
constexpr std::string_view kOurs = "_corners.csv";
constexpr std::string_view kPot = "_gt_points.txt";
constexpr std::string_view kFlag = "_flag.txt";

/// What a folder holds, by the names that clips have.
struct Finds {
  std::map<std::string, std::string> frames;     ///< videos, and folders of pictures
  std::map<std::string, std::string> truths;     ///< kOurs
  std::map<std::string, std::string> published;  ///< points of POT and PlanarTrack
  std::map<std::string, std::string> flags;      ///< theirs
  std::set<std::string> videos;                  ///< names of `frames` that are videos
};

bool is_one_of(const fs::path& path, std::initializer_list<const char*> extensions) {
  std::string end = path.extension().string();
  for (char& c : end) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return std::find(extensions.begin(), extensions.end(), end) != extensions.end();
}

bool is_picture(const fs::path& path) {
  return is_one_of(path, {".png", ".jpg", ".jpeg"});
}

/// Without its end.
std::string before(const std::string& name, std::string_view end) {
  return name.substr(0, name.size() - end.size());
}

void take_file(const fs::path& path, const fs::path& root, Finds& finds) {
  const std::string name = path.filename().string();
  if (name.ends_with(kOurs)) {
    finds.truths[before(name, kOurs)] = path.string();
  } else if (name.ends_with(kPot)) {
    finds.published[before(name, kPot)] = path.string();
  } else if (name.ends_with(kFlag)) {
    finds.flags[before(name, kFlag)] = path.string();
  } else if (is_one_of(path, {".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v"})) {
    finds.frames[path.stem().string()] = path.string();
    finds.videos.insert(path.stem().string());
  } else if (is_picture(path) && path.parent_path() != root) {
    fs::path folder = path.parent_path();
    if (folder.filename() == "img" && folder.parent_path() != root) folder = folder.parent_path();
    finds.frames.try_emplace(folder.filename().string(), path.parent_path().string());
  }
}

Result<Finds> look_through(const std::string& folder) {
  std::error_code failed;
  std::vector<fs::path> files;
  fs::recursive_directory_iterator each(folder, failed);
  for (; !failed && each != fs::recursive_directory_iterator(); each.increment(failed)) {
    std::error_code unknown;
    if (each->is_regular_file(unknown)) files.push_back(each->path());
  }
  if (failed) {
    return fail(ExitCode::kIo, "pictures.folder", folder,
                "the folder cannot be read: " + failed.message(), "check its path");
  }
  std::sort(files.begin(), files.end());
  Finds finds;
  for (const fs::path& file : files) take_file(file, folder, finds);
  // PlanarTrack names its points as the clip alone.
  for (const auto& [name, flag] : finds.flags) {
    const fs::path points = fs::path(flag).parent_path() / (name + ".txt");
    if (fs::is_regular_file(points, failed)) finds.published.try_emplace(name, points.string());
  }
  return finds;
}

Corners corners_of(const std::vector<double>& values, std::size_t first) {
  Corners corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i / 2][static_cast<int>(i % 2)] = values[first + i];
  }
  return corners;
}

Error misfit(const std::string& path, std::size_t line, const char* cause) {
  return {ExitCode::kInvalidInput, kCode, path + ":" + std::to_string(line), cause,
          "write them as bake/extensions/lab/README.md describes"};
}

Result<void> read_ours(const std::string& path, WildClip& clip) {
  MODAR_ASSIGN(const auto lines, read_numbers(path, kCode));
  for (const auto& [number, values] : lines) {
    if (values.size() != 9 || !(values[0] >= 0)) {
      return tl::unexpected(
          misfit(path, number, "this is not a frame number and eight coordinates"));
    }
    clip.truth[static_cast<std::uint64_t>(values[0])] = corners_of(values, 1);
  }
  if (clip.truth.empty()) return tl::unexpected(misfit(path, 1, "no frame has corners"));
  return {};
}

/// Whether the corners go round with the clock, as seen (y points down).
bool clockwise(const Corners& corners) {
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = corners[i];
    const glm::dvec2 b = corners[(i + 1) % 4];
    twice += a.x * b.y - a.y * b.x;
  }
  return twice > 0;
}

/// flags: empty where the clip has none.
Result<void> read_published(const std::string& path, const std::string& flags, WildClip& clip) {
  MODAR_ASSIGN(const auto lines, read_numbers(path, kCode));
  std::vector<NumberLine> states;
  if (!flags.empty()) {
    MODAR_ASSIGN(states, read_numbers(flags, kCode));
    if (states.size() != lines.size()) {
      return tl::unexpected(misfit(flags, states.size(), "there are not as many flags as corners"));
    }
  }
  bool turned = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto& [number, values] = lines[i];
    if (values.size() != 8) {
      return tl::unexpected(misfit(path, number, "these are not eight coordinates"));
    }
    const bool labelled =
        std::any_of(values.begin(), values.end(), [](double value) { return value != 0; });
    if (!labelled || (!states.empty() && states[i].values[0] != 0)) continue;
    Corners corners = corners_of(values, 0);
    if (clip.truth.empty()) turned = !clockwise(corners);
    if (turned) std::swap(corners[1], corners[3]);
    clip.truth[i] = corners;
  }
  if (clip.truth.empty()) return tl::unexpected(misfit(path, 1, "no frame has corners"));
  return {};
}

/// The pictures next to `truth` whose names are the clip's, or begin with it and '_'. names: of all
/// clips, of which the longest that fits has the picture.
std::vector<std::string> pictures_beside(const std::string& truth, const std::string& clip,
                                         const std::set<std::string>& names) {
  std::vector<std::string> pictures;
  std::error_code failed;
  for (const auto& each : fs::directory_iterator(fs::path(truth).parent_path(), failed)) {
    const std::string stem = each.path().stem().string();
    if (!is_picture(each.path())) continue;
    std::string owner;
    for (const std::string& name : names) {
      const bool fits = stem == name || stem.starts_with(name + "_");
      if (fits && name.size() > owner.size()) owner = name;
    }
    if (owner == clip) pictures.push_back(each.path().string());
  }
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

/// The clip of that name and its frames. Errors: kInvalidInput "bench.wild" where it has none.
Result<WildClip> clip_of(const Finds& finds, const std::string& name, const std::string& truth) {
  const auto frames = finds.frames.find(name);
  if (frames == finds.frames.end()) {
    return fail(ExitCode::kInvalidInput, kCode, truth,
                "there is no video " + name + ".* and no folder " + name + " of pictures",
                "put its frames below the same folder");
  }
  WildClip clip;
  clip.name = name;
  clip.frames = frames->second;
  return clip;
}

}  // namespace

Result<std::vector<WildClip>> find_wild_clips(const std::string& folder) {
  MODAR_ASSIGN(const Finds finds, look_through(folder));
  std::set<std::string> names;
  for (const auto& [name, truth] : finds.truths) names.insert(name);
  std::vector<WildClip> clips;
  std::vector<std::string> known;  // what the others show
  for (const auto& [name, truth] : finds.truths) {
    MODAR_ASSIGN(WildClip clip, clip_of(finds, name, truth));
    MODAR_TRY(read_ours(truth, clip));
    clip.pictures = pictures_beside(truth, name, names);
    known.insert(known.end(), clip.pictures.begin(), clip.pictures.end());
    clips.push_back(std::move(clip));
  }
  for (const auto& [name, points] : finds.published) {
    MODAR_ASSIGN(WildClip clip, clip_of(finds, name, points));
    const auto flags = finds.flags.find(name);
    MODAR_TRY(
        read_published(points, flags == finds.flags.end() ? std::string() : flags->second, clip));
    clip.published = true;
    clips.push_back(std::move(clip));
  }
  for (const std::string& name : finds.videos) {
    if (names.contains(name) || finds.published.contains(name)) continue;
    clips.push_back({name, finds.frames.at(name), known, {}, false});
  }
  if (clips.empty()) {
    return fail(ExitCode::kInvalidInput, kCode, folder, "the folder holds no clip",
                "put videos there with NAME_corners.csv and NAME.png, or POT-210 or PlanarTrack");
  }
  std::sort(clips.begin(), clips.end(),
            [](const WildClip& a, const WildClip& b) { return a.name < b.name; });
  return clips;
}

Result<ClipFrames> ClipFrames::open(const std::string& path) {
  ClipFrames frames;
  std::error_code failed;
  if (fs::is_directory(path, failed)) {
    MODAR_ASSIGN(frames.pictures_, pictures_of(path));
  } else {
    MODAR_ASSIGN(Video video, Video::open(path));
    frames.video_ = std::make_shared<Video>(std::move(video));
  }
  return frames;
}

Result<std::optional<GrayImage>> ClipFrames::next() {
  if (video_) return video_->next();
  if (read_ == pictures_.size()) return std::nullopt;
  MODAR_ASSIGN(picture_, load_gray(pictures_[read_++]));
  return picture_.view();
}

}  // namespace modar
