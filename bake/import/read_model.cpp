// Picks the reader of a model file by its extension.
#include "bake/import/read_model.hpp"

#include <algorithm>
#include <array>
#include <filesystem>

#include "bake/import/conversion.hpp"
#include "bake/io/input.hpp"

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

Result<SourceModel> read_format(const std::string& path, const ReadOptions& options) {
  switch (format_of(extension_of(path))) {
    case Format::kObj:
      return read_obj(path, options);
    case Format::kGltf:
      return read_gltf(path, options);
    case Format::kPly:
      return read_ply(path, options);
    case Format::kStl:
      return read_stl(path);
    case Format::kNone:
      break;
  }
  return fail(ExitCode::kInternal, "modar.bug", path, "a format without a reader", "report it");
}

/// Of formats whose materials and attributes are as the model has them.
void account_for(SourceModel& model) {
  Account& account = model.account;
  for (const SourceMaterial& m : model.materials) {
    account.images.used += m.diffuse_map.empty() ? 0u : 1u;
    account.images.changed += m.normal.path.empty() ? 0u : 1u;
    account.colours.changed += m.whitened ? 1u : 0u;
  }
  for (const Diagnostic& d : model.diagnostics) {
    constexpr std::array<std::string_view, 3> kLost = {"mtl.missing-map", "mtl.emission-map",
                                                       "mtl.opacity-map"};
    account.images.left_out += std::find(kLost.begin(), kLost.end(), d.id) != kLost.end() ? 1u : 0u;
  }
  account.colours.used = model.materials.size() - account.colours.changed;
  account.attributes.used = 1u + (model.corner_uvs.kind != IndexPlane::Kind::kAbsent ? 1u : 0u) +
                            (model.corner_normals.kind != IndexPlane::Kind::kAbsent ? 1u : 0u) +
                            (model.colours.empty() ? 0u : 1u);
}

}  // namespace

bool ModelFolder::has(const std::string& file) const {
  return is_regular_file(file) && (within.empty() || is_inside(within, file));
}

Diagnostic not_read(const char* id, const std::string& label, std::uint64_t line,
                    const std::string& what, const std::string& name, const ModelFolder& folder,
                    const char* missing) {
  const bool outside =
      !folder.within.empty() && !find_named_file(name, ModelFolder(folder.path)).empty();
  return {
      id,
      DiagnosticSeverity::kWarning,
      label,
      line,
      what + (outside ? " is outside the project's folder and is left out" : " was not found"),
      outside ? "copy it into the folder; if you trust the project, bake with --outside" : missing};
}

bool is_model_file(const std::string& path) {
  return format_of(extension_of(path)) != Format::kNone;
}

Result<void> require_model_format(const std::string& path) {
  if (path.empty()) return tl::unexpected(read_file(path, 0).error());
  if (is_regular_file(path)) MODAR_TRY(require_kind(FileKind::kModel, path));
  if (is_model_file(path)) return {};
  const std::string extension = extension_of(path);
  return fail(ExitCode::kUnsupported, "model.format", path,
              extension.empty() ? "the file has no extension that names its format"
                                : "files of the kind '" + extension + "' are not read",
              format_conversion(path, extension));
}

Result<SourceModel> read_model(const std::string& path, const ReadOptions& options) {
  MODAR_TRY(require_model_format(path));
  MODAR_ASSIGN(SourceModel model, read_format(path, options));
  if (format_of(extension_of(path)) != Format::kGltf) account_for(model);
  for (SourceMaterial& m : model.materials) {
    m.sides_stated = format_of(extension_of(path)) == Format::kGltf;
    // Clay is for what has no colour: those of vertices are seen unchanged.
    const bool clay = m.diffuse_map.empty() && m.diffuse == glm::vec3(kClay);
    if (clay && !model.colours.empty()) m.diffuse = glm::vec3(1.0f);
  }
  return model;
}

}  // namespace modar
