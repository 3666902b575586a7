// Materials and images of a glTF file. Internal to the glTF reader.
#pragma once

#include <string>
#include <vector>

#include "bake/import/source_model.hpp"

namespace tinygltf {
struct Image;
class Model;
}  // namespace tinygltf

namespace modar {

/// Keeps an image's coded bytes as they are: for tinygltf::TinyGLTF::SetImageLoader().
bool keep_image_bytes(tinygltf::Image* image, int index, std::string* error, std::string* warning,
                      int width, int height, const unsigned char* bytes, int size, void* user);

/// One material of ours for each of the file's, and a white one behind them for primitives that
/// have none. folder: where image names are looked up, with a slash at its end. label: the file's
/// name in findings.
std::vector<SourceMaterial> gltf_materials(const tinygltf::Model& gltf, const std::string& folder,
                                           const std::string& label,
                                           std::vector<Diagnostic>& findings);

/// Linear light to sRGB (IEC 61966-2-1), both in [0,1].
double srgb_of_linear(double linear);

}  // namespace modar
