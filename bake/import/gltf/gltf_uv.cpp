// Scales, turns, moves: the order and the sense of Khronos' sample viewer. (The matrix in the
// extension's text turns the other way; viewers, and the extension's test model, turn this way.)
#include "bake/import/gltf/gltf_uv.hpp"

#include <cmath>

#include "bake/import/gltf/tinygltf_library.hpp"

namespace modar {
namespace {

void take_pair(const tinygltf::Value& transform, const char* key, glm::dvec2& pair) {
  if (!transform.Has(key)) return;
  const tinygltf::Value& value = transform.Get(key);
  if (!value.IsArray() || value.ArrayLen() != 2) return;
  const tinygltf::Value& x = value.Get(0);
  const tinygltf::Value& y = value.Get(1);
  if (x.IsNumber() && y.IsNumber()) pair = {x.GetNumberAsDouble(), y.GetNumberAsDouble()};
}

}  // namespace

glm::dvec2 GltfUv::apply(const glm::dvec2& uv) const {
  const glm::dvec2 scaled = scale * uv;
  const double c = std::cos(rotation);
  const double s = std::sin(rotation);
  return offset + glm::dvec2(c * scaled.x + s * scaled.y, c * scaled.y - s * scaled.x);
}

GltfUv gltf_uv(const tinygltf::Model& gltf, int material) {
  GltfUv uv;
  if (material < 0 || static_cast<std::size_t>(material) >= gltf.materials.size()) return uv;
  const tinygltf::TextureInfo& texture =
      gltf.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorTexture;
  int set = texture.texCoord;
  const auto found = texture.extensions.find("KHR_texture_transform");
  if (found != texture.extensions.end() && found->second.IsObject()) {
    const tinygltf::Value& transform = found->second;
    take_pair(transform, "offset", uv.offset);
    take_pair(transform, "scale", uv.scale);
    if (transform.Has("rotation") && transform.Get("rotation").IsNumber()) {
      uv.rotation = transform.Get("rotation").GetNumberAsDouble();
    }
    if (transform.Has("texCoord") && transform.Get("texCoord").IsInt()) {
      set = transform.Get("texCoord").GetNumberAsInt();
    }
  }
  uv.attribute = "TEXCOORD_" + std::to_string(set);
  return uv;
}

}  // namespace modar
