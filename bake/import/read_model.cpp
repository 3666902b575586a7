// Picks the reader of a model file by its extension.
#include "bake/import/read_model.hpp"

#include <algorithm>
#include <filesystem>

namespace modar {

Result<SourceModel> read_model(const std::string& path, unsigned jobs) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (extension == ".obj") return read_obj(path, {jobs});
  if (extension == ".gltf" || extension == ".glb") return read_gltf(path);
  return fail(ExitCode::kUnsupported, "model.format", path,
              extension.empty() ? "the file has no extension that names its format"
                                : "files of the kind '" + extension + "' are not read",
              "convert it to Wavefront OBJ (.obj) or glTF 2.0 (.gltf, .glb)");
}

}  // namespace modar
