// Textures that are known by their name alone, as sample models and asset shops have them.
#include "bake/import/texture_by_name.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "bake/image/image.hpp"
#include "bake/import/read_model.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

/// The first in byte order, so that the result does not depend on the file system's; empty: none.
fs::path texture_beside(const std::string& model, const fs::path& folder) {
  fs::path first;
  std::error_code error;
  fs::directory_iterator it(folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const fs::path& path = it->path();
    if (!is_picture_file(path.string()) || !is_texture_name(path.stem().string(), model)) continue;
    if (first.empty() || path.filename() < first.filename()) first = path;
  }
  return first;
}

}  // namespace

bool is_texture_name(std::string_view picture, std::string_view model) {
  constexpr std::string_view kWords[] = {"albedo",  "basecolor", "base_color", "base-color",
                                         "col",     "color",     "colour",     "diff",
                                         "diffuse", "tex",       "texture"};
  if (model.empty() || picture.size() <= model.size() + 1) return false;
  const std::string name = ascii_lower(std::string(picture));
  if (!name.starts_with(ascii_lower(std::string(model)))) return false;
  if (std::string_view("_- .").find(name[model.size()]) == std::string_view::npos) return false;
  const std::string_view word = std::string_view(name).substr(model.size() + 1);
  return std::find(std::begin(kWords), std::end(kWords), word) != std::end(kWords);
}

void take_texture_by_name(const std::string& folder, const std::string& label, SourceModel& model) {
  if (folder.empty() || model.uvs.empty() || !model.colours.empty()) return;
  const fs::path texture = texture_beside(model.name, folder);
  if (texture.empty()) {
    const std::string name = model.name + "_texture.png";
    model.files.push_back((fs::path(folder) / name).string());
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
