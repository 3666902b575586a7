// Where the base colour of a glTF material lies. Internal to the glTF reader.
#pragma once

#include <string>

#include <glm/vec2.hpp>

namespace tinygltf {
class Model;
}  // namespace tinygltf

namespace modar {

/// KHR_texture_transform of the base colour: uv of the file to those of the image, v down in both.
struct GltfUv {
  std::string attribute = "TEXCOORD_0";
  glm::dvec2 offset{0.0};
  glm::dvec2 scale{1.0};
  double rotation = 0.0;  ///< radians, counter-clockwise as one looks at the image

  [[nodiscard]] glm::dvec2 apply(const glm::dvec2& uv) const;
};

/// material: of the primitive; what does not exist has the file's uv as they are.
GltfUv gltf_uv(const tinygltf::Model& gltf, int material);

}  // namespace modar
