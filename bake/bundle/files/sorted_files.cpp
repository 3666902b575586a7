#include "bake/bundle/files/sorted_files.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/input.hpp"
#include "bake/options/request_text.hpp"
#include "bake/pattern/pattern.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/shortest_number.hpp"
#include "formats/base/utf8.hpp"
#include "modar/pattern_record.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostMaterialBytes = std::size_t{64} << 20;  // larger ones embed pictures
constexpr std::uintmax_t kMostModelBytes = 100'000'000;            // a second of reading

bool ends_as(const std::string& file, std::initializer_list<const char*> endings) {
  const std::string ending = ascii_lower(fs::path(file).extension().string());
  return std::any_of(endings.begin(), endings.end(),
                     [&](const char* one) { return ending == one; });
}

/// Models that people have and nothing here reads.
bool is_foreign_model_file(const std::string& file) {
  return ends_as(file, {".fbx", ".dae", ".blend", ".3ds", ".usdz", ".usd", ".max", ".c4d", ".ma",
                        ".mb", ".skp", ".stp", ".step", ".las", ".e57", ".3mf", ".lwo"});
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

class Sorter {
 public:
  explicit Sorter(const std::string& folder) : folder_(folder) {}

  SortedFiles sort(const std::vector<std::string>& files) {
    for (const std::string& file : files) take(file);
    const auto patterns =
        std::stable_partition(sorted_.pictures.begin(), sorted_.pictures.end(),
                              [&](const std::string& picture) { return !is_texture(picture); });
    sorted_.textures.assign(patterns, sorted_.pictures.end());
    sorted_.pictures.erase(patterns, sorted_.pictures.end());
    return std::move(sorted_);
  }

 private:
  [[nodiscard]] std::string path(const std::string& file) const {
    return folder_.empty() ? file : (fs::path(folder_) / file).string();
  }

  void take(const std::string& file) {
    if (ends_as(file, {".mtl", ".gltf"}) && (folder_.empty() || is_inside(folder_, path(file)))) {
      materials_ += ascii_lower(read_file(path(file), kMostMaterialBytes).value_or("")) + "\n";
    }
    if (is_model_file(file) || is_foreign_model_file(file)) {
      keep(file, require_model_format(path(file)), sorted_.models);
    } else if (is_picture_file(file)) {
      keep(file,
           is_regular_file(path(file)) ? require_kind(FileKind::kPicture, path(file))
                                       : Result<void>(),
           sorted_.pictures);
    } else if (is_foreign_picture_file(file)) {
      const auto image = read_image(path(file));
      keep(file, image ? Result<void>() : tl::unexpected(image.error()), sorted_.pictures);
    } else {
      sorted_.others.push_back(file);
    }
  }

  void keep(const std::string& file, const Result<void>& good, std::vector<std::string>& list) {
    if (good) {
      list.push_back(file);
    } else {
      sorted_.left_out.push_back({file, good.error()});
    }
  }

  /// Is a picture one that a material names, or a model's by its name?
  [[nodiscard]] bool is_texture(const std::string& file) const {
    const fs::path picture(file);
    const std::string name = ascii_lower(picture.filename().string());
    if (names_file(materials_, name) || names_file(materials_, as_uri(name))) return true;
    const std::string stem = picture.stem().string();
    return ranges::any_of(sorted_.models, [&](const fs::path& model) {
      if (model.parent_path() != picture.parent_path()) return false;
      if (is_map_name(stem, model.stem().string())) return true;
      if (!is_own_picture(stem, model.stem().string())) return false;
      const auto source = small_model(path(model.string()), folder_);
      return source && *source &&
             ranges::any_of((*source)->materials, [&](const SourceMaterial& material) {
               return fs::path(material.diffuse_map).filename() == picture.filename();
             });
    });
  }

  std::string folder_;
  std::string materials_;  ///< the text of all MTL and glTF files, in lower case
  SortedFiles sorted_;
};

}  // namespace

SortedFiles sort_files(const std::vector<std::string>& files, const std::string& folder) {
  return Sorter(folder).sort(files);
}

bool is_material_file(const std::string& file) {
  return ends_as(file, {".mtl", ".bin"});
}

std::optional<Result<SourceModel>> small_model(const std::string& path, const std::string& within) {
  std::error_code error;
  if (fs::file_size(path, error) > kMostModelBytes || error) return std::nullopt;
  return read_model(path, {1, true, within});
}

/// Uncertainty of width by height from which models would be placed visibly wrong.
constexpr double kUnsureShape = 0.1;

void doubt_shape(const Photo& photo, const std::array<PixelPoint, 4>& corners,
                 const std::string& path, std::vector<Diagnostic>& said) {
  const AspectEstimate sides =
      estimate_aspect(corners, photo.image.width, photo.image.height, photo.focal_px);
  if (sides.spread < kUnsureShape * sides.aspect) return;
  char cause[96];
  std::snprintf(cause, sizeof cause,
                "a cropped photo does not tell the picture's shape: width by height %.2f +- %.2f",
                sides.aspect, sides.spread);
  said.push_back({"pattern.shape", DiagnosticSeverity::kWarning, path, 0, cause,
                  "give the whole photo; or measure it: `modar pattern rectify " + path +
                      " --width 210mm --height 297mm -o picture.png`"});
}

Result<void> find_picture(PatternRequest& pattern, std::vector<Diagnostic>& said) {
  if (!pattern.shape.text.empty() || !is_picture_file(pattern.path)) return {};
  MODAR_ASSIGN(const Photo photo, read_photo(pattern.path));
  const FoundPicture found = find_picture(photo, find_corners(photo.image));
  if (found.corners) {
    std::string text = "flat,corners=";
    for (const PixelPoint& corner : *found.corners) {
      text +=
          (text.back() == '=' ? "" : ":") + shortest_text(corner.x) + ":" + shortest_text(corner.y);
    }
    MODAR_ASSIGN(pattern.shape, parse_shape(text));
  } else {
    const auto [width, height] =
        pattern_sides(static_cast<int>(photo.image.width), static_cast<int>(photo.image.height));
    if (!is_pattern_size(width, height)) {
      return fail(ExitCode::kInvalidInput, "pattern.loop-size", pattern.path,
                  "reduced to 720 pixels at most, the picture is " + std::to_string(width) + "x" +
                      std::to_string(height) + ", and each side needs 32",
                  "give a larger picture, or crop it closer to a square");
    }
  }
  if (!found.corners && *found.doubt == 0) return {};
  const std::string what =
      found.corners ? "a photo: the picture in it has the corners " + pattern.shape.text.substr(13)
                    : std::string("the whole file is taken as the picture");
  const bool sure = *found.doubt == 0;
  if (found.corners) doubt_shape(photo, *found.corners, pattern.path, said);
  said.push_back(
      {sure ? "pattern.photo" : "pattern.doubtful",
       sure ? DiagnosticSeverity::kInfo : DiagnosticSeverity::kWarning, pattern.path, 0,
       what + (sure ? "" : ", which may be wrong: " + std::string(doubt_words(found.doubt))),
       found.corners
           ? "look at it with `modar pattern rectify " + pattern.path +
                 " -o picture.png`; corners= in its shape sets other corners, shape=flat takes the "
                 "whole file"
           : std::string("a photo needs all four edges in it; corners= in its shape sets the "
                         "corners; shape=flat says that the whole file is right")});
  return {};
}

ScenePairs pair_by_names(const std::vector<std::string>& patterns,
                         const std::vector<std::string>& models) {
  ScenePairs pairs;
  const auto add = [&](const std::string& pattern, const std::string& model) {
    SceneRequest& scene = pairs.scenes.emplace_back();
    scene.pattern = pattern;
    scene.model = model;
  };
  const bool single = models.size() == 1 && patterns.size() == 1;
  for (const std::string& model : models) {
    for (const std::string& pattern : patterns) {
      if (single || model == pattern) add(pattern, model);
    }
  }
  if (!pairs.scenes.empty()) return pairs;
  pairs.guessed = !models.empty() && !patterns.empty();
  for (std::size_t i = 0; i < std::min(models.size(), patterns.size()); ++i) {
    add(patterns[i], models[i]);
  }
  return pairs;
}

}  // namespace modar
