// Materials and images of a glTF file. Internal to the glTF reader.
#pragma once

#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "bake/import/gltf/gltf_metal_maps.hpp"
#include "bake/import/read_model.hpp"

namespace tinygltf {
struct Image;
class Model;
}  // namespace tinygltf

namespace modar {

/// Keeps an image's encoded bytes unchanged: for tinygltf::TinyGLTF::SetImageLoader().
bool keep_image_bytes(tinygltf::Image* image, int index, std::string* error, std::string* warning,
                      int width, int height, const unsigned char* bytes, int size, void* user);

/// Replaces what materials with KHR_materials_pbrSpecularGlossiness say of the core's model by the
/// nearest to the extension: exporters leave the core's white.
void use_metallic_roughness(tinygltf::Model& gltf);

/// One material for each of the file's, followed by clay for primitives without a material:
/// emission, occlusion, roughness, metalness and the modes of alpha as far as our shader has them.
/// Findings state merged and omitted parts.
/// folder: where image names are looked up, with a trailing slash. label: the file's name in
/// diagnostics. metal_maps: those that apply_metal_maps() is yet to apply.
/// images: receives the account of maps, and of images that no material names.
std::vector<SourceMaterial> gltf_materials(const tinygltf::Model& gltf, const ModelFolder& folder,
                                           const std::string& label,
                                           std::vector<Diagnostic>& diagnostics,
                                           std::vector<MetalMap>& metal_maps, Fate& images);

/// KHR_texture_transform of the base colour: uv of the file to those of the image, v down in both.
struct GltfUv {
  std::string attribute = "TEXCOORD_0";
  glm::dvec2 offset{0.0};
  glm::dvec2 scale{1.0};
  double rotation = 0.0;  ///< radians, counter-clockwise as one looks at the image

  [[nodiscard]] glm::dvec2 apply(const glm::dvec2& uv) const;
};

/// material: of the primitive; an unknown one uses the file's uv unchanged.
GltfUv gltf_uv(const tinygltf::Model& gltf, int material);

}  // namespace modar
