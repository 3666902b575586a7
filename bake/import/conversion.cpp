// Commands with the file's own name, to be copied into a shell.
#include "bake/import/conversion.hpp"

#include <filesystem>

#include "bake/io/input.hpp"

namespace modar {
namespace {

std::string with_ending(const std::string& path, const char* ending) {
  return shell_quoted(std::filesystem::path(path).replace_extension(ending).string());
}

}  // namespace

std::string format_conversion(const std::string& path, const std::string& extension) {
  const std::string glb = with_ending(path, ".glb");
  for (const char* known : {".fbx", ".dae", ".3ds", ".lwo", ".x", ".ac", ".ms3d", ".b3d", ".3mf"}) {
    if (extension != known) continue;
    return "convert it: assimp export " + shell_quoted(path) + " " + glb +
           " (Debian's assimp-utils), or export glTF from the program that made it";
  }
  if (extension == ".blend") {
    return "convert it: blender -b " + shell_quoted(path) +
           " --python-expr \"import bpy; bpy.ops.export_scene.gltf(filepath=" + glb + ")\"";
  }
  if (extension == ".modar") return "it is baked already; pass the model that it was made from";
  return "convert it to glTF 2.0 (.glb, .gltf), Wavefront OBJ, PLY or STL";
}

std::string gltf_conversion(const std::string& path, GltfCompression compression) {
  std::string command = "convert it: ";
  std::string from = shell_quoted(path);
  if (compression.meshes) {
    const std::string unpacked = with_ending(path, ".unpacked.glb");
    command += "npx gltfpack -noq -km -i " + from + " -o " + unpacked;
    from = unpacked;
  }
  if (!compression.textures) return command;
  if (compression.meshes) command += " && ";
  return command + "npx @gltf-transform/cli ktxdecompress " + from + " " +
         with_ending(path, ".png.glb") + " (with the program ktx of Khronos' KTX-Software)";
}

}  // namespace modar
