// Textures that are known by their name alone, as sample models and asset shops have them.
#include "bake/import/texture_by_name.hpp"

#include <algorithm>
#include <bit>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>

#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

/// Last words of the names of textures: those of colours, and what else a surface has pictures of.
constexpr std::string_view kColours[] = {"albedo",  "basecolor", "base_color", "base-color",
                                         "col",     "color",     "colour",     "diff",
                                         "diffuse", "tex",       "texture"};
constexpr std::string_view kOtherMaps[] = {
    "ao",        "alpha",    "bump",      "disp",  "displacement", "emission", "emissive",
    "height",    "metallic", "metalness", "nor",   "normal",       "normals",  "nrm",
    "occlusion", "opacity",  "orm",       "rough", "roughness",    "specular"};
constexpr std::string_view kSeparators = "_- .";

/// Sides of textures are powers of two; those of photos and scans hardly ever are.
bool has_sides_of_textures(const std::string& picture) {
  const auto image = read_image(picture);
  return image && std::has_single_bit(image->width) && std::has_single_bit(image->height);
}

/// The first in byte order, so that the result does not depend on the file system's; empty: none.
fs::path texture_beside(const std::string& model, const ModelFolder& folder, bool own_picture) {
  std::set<fs::path> named;
  std::set<fs::path> own;
  std::error_code error;
  fs::directory_iterator it(folder.path, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const fs::path& path = it->path();
    if (!is_picture_file(path.string()) || !folder.has(path.string())) continue;
    if (is_texture_name(path.stem().string(), model)) named.insert(path);
    if (own_picture && is_own_picture(path.stem().string(), model)) own.insert(path);
  }
  if (!named.empty()) return *named.begin();
  const auto texture = std::find_if(own.begin(), own.end(), [](const fs::path& path) {
    return has_sides_of_textures(path.string());
  });
  return texture == own.end() ? fs::path() : *texture;
}

}  // namespace

bool is_texture_name(std::string_view picture, std::string_view model) {
  if (model.empty() || picture.size() <= model.size() + 1) return false;
  const std::string name = ascii_lower(std::string(picture));
  if (!name.starts_with(ascii_lower(std::string(model)))) return false;
  if (kSeparators.find(name[model.size()]) == std::string_view::npos) return false;
  const std::string_view word = std::string_view(name).substr(model.size() + 1);
  return std::find(std::begin(kColours), std::end(kColours), word) != std::end(kColours);
}

bool is_map_name(std::string_view picture, std::string_view model) {
  const std::string name = ascii_lower(std::string(picture));
  const std::size_t end = name.find_last_of(kSeparators);
  if (end == std::string::npos) return false;
  const std::string_view word = std::string_view(name).substr(end + 1);
  const auto in = [word](const auto& words) {
    return std::find(std::begin(words), std::end(words), word) != std::end(words);
  };
  const auto begins = [](std::string_view whole, std::string_view part) {
    return whole.starts_with(part) &&
           (whole.size() == part.size() ||
            kSeparators.find(whole[part.size()]) != std::string_view::npos);
  };
  const std::string_view start = std::string_view(name).substr(0, end);
  const std::string other = ascii_lower(std::string(model));
  return is_texture_name(picture, model) ||
         ((in(kColours) || in(kOtherMaps)) && (begins(start, other) || begins(other, start)));
}

bool is_own_picture(std::string_view picture, std::string_view model) {
  return ascii_lower(std::string(picture)) == ascii_lower(std::string(model));
}

void assign_texture_by_name(const ModelFolder& folder, const std::string& label, bool own_picture,
                            SourceModel& model) {
  if (folder.path.empty() || model.uvs.empty() || !model.colours.empty()) return;
  const fs::path texture = texture_beside(model.name, folder, own_picture);
  if (texture.empty()) {
    const std::string name = model.name + "_texture.png";
    model.files.push_back((fs::path(folder.path) / name).string());
    model.diagnostics.push_back({"model.no-texture", DiagnosticSeverity::kInfo, label, 0,
                                 "has texture coordinates, but no texture",
                                 "if it should have one, call the picture '" + name + "'"});
    return;
  }
  for (SourceMaterial& material : model.materials) {
    material.diffuse = glm::vec3(1.0f);
    material.diffuse_map = texture.string();
  }
  model.diagnostics.push_back({"model.texture-by-name", DiagnosticSeverity::kInfo, label, 0,
                               "'" + texture.filename().string() + "' is used as the texture", ""});
}

}  // namespace modar
