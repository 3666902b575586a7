// The commands that convert unsupported files, as cures of errors. Internal to bake/import.
#pragma once

#include <string>

namespace modar {

/// How to make a model file of another kind into one that is read. extension: in lower case, with
/// its dot.
std::string format_conversion(const std::string& path, const std::string& extension);

/// Textures of Basis Universal in KTX 2 files, which no library of Debian 12 reads.
inline constexpr const char* kBasisTextures = "KHR_texture_basisu";

/// What of a glTF file is compressed as no library of Debian 12 reads it.
struct GltfCompression {
  bool meshes = false;    ///< version 1 of meshoptimizer's vertex codec
  bool textures = false;  ///< kBasisTextures
};
/// How to make such a file into one that is read. gltfpack keeps names of materials with -km, and
/// unpacks numbers to floats with -noq, which loses nothing.
std::string gltf_conversion(const std::string& path, GltfCompression compression);

}  // namespace modar
