// Picks the reader of a model file by its extension.
#include "bake/import/read_model.hpp"

#include <algorithm>
#include <filesystem>

namespace modar {
namespace {

enum class Format { kObj, kGltf, kPly, kStl, kNone };

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return extension;
}

Format format_of(const std::string& extension) {
  if (extension == ".obj") return Format::kObj;
  if (extension == ".gltf" || extension == ".glb") return Format::kGltf;
  if (extension == ".ply") return Format::kPly;
  if (extension == ".stl") return Format::kStl;
  return Format::kNone;
}

/// A word that a shell takes as it is.
std::string quoted(const std::string& path) {
  std::string text = "'";
  for (const char c : path) text += c == '\'' ? "'\\''" : std::string(1, c);
  return text + "'";
}

/// How to make a file of that kind into one that is read.
std::string conversion(const std::string& path, const std::string& extension) {
  const std::string glb = quoted(std::filesystem::path(path).replace_extension(".glb").string());
  for (const char* known : {".fbx", ".dae", ".3ds", ".lwo", ".x", ".ac", ".ms3d", ".b3d", ".3mf"}) {
    if (extension != known) continue;
    return "convert it: assimp export " + quoted(path) + " " + glb +
           " (Debian's assimp-utils), or export glTF from the program that made it";
  }
  if (extension == ".blend") {
    return "convert it: blender -b " + quoted(path) +
           " --python-expr \"import bpy; bpy.ops.export_scene.gltf(filepath=" + glb + ")\"";
  }
  return "convert it to glTF 2.0 (.glb, .gltf), Wavefront OBJ, PLY or STL";
}

}  // namespace

bool is_model_file(const std::string& path) {
  return format_of(extension_of(path)) != Format::kNone;
}

Result<void> require_model_format(const std::string& path) {
  if (is_model_file(path)) return {};
  const std::string extension = extension_of(path);
  return fail(ExitCode::kUnsupported, "model.format", path,
              extension.empty() ? "the file has no extension that names its format"
                                : "files of the kind '" + extension + "' are not read",
              conversion(path, extension));
}

Result<SourceModel> read_model(const std::string& path, unsigned jobs) {
  switch (format_of(extension_of(path))) {
    case Format::kObj:
      return read_obj(path, {jobs});
    case Format::kGltf:
      return read_gltf(path);
    case Format::kPly:
      return read_ply(path);
    case Format::kStl:
      return read_stl(path);
    case Format::kNone:
      break;
  }
  MODAR_TRY(require_model_format(path));
  return fail(ExitCode::kInternal, "modar.bug", path, "a format without a reader", "report it");
}

}  // namespace modar
