// Models out of a bundle as files that viewers open: GLB for any, USDZ for those of iPhones (Quick
// Look).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/texture/texture.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// A texture of the bundle, decoded.
struct GlbImage {
  std::uint32_t texture = 0;  ///< index into the bundle's textures
  RgbaImage pixels;
};

/// A model and where it is: its own space, in [-1,1], to that of the file.
struct RoomModel {
  std::uint32_t model = 0;
  glm::dmat4 place{1.0};
  std::uint32_t clip = kNone;  ///< that plays
};

/// The finest level of a chunk, decoded; only the vertices that it uses, in their order.
struct DecodedLevel {
  std::vector<std::uint16_t> indices;
  std::vector<glm::dvec3> positions;  ///< model space, in [-1,1]
  std::vector<glm::dvec3> normals;
  std::vector<glm::dvec2> uvs;             ///< v down; empty: none
  std::vector<glm::dvec4> colours;         ///< sRGB; empty: none
  std::vector<const std::byte*> vertices;  ///< as stored
};
/// Errors: kInvalidInput "model.index" where an index exceeds its vertices.
Result<DecodedLevel> decode_level(const BundleView& bundle, const LayoutRecord& layout,
                                  const ChunkRecord& chunk);

/// Of each vertex of a part that moves: four bones of the part, and their shares.
struct VertexShares {
  std::vector<std::uint8_t> bones;
  std::vector<float> shares;
};
VertexShares vertex_shares(const LayoutRecord& layout, const PartRecord& part,
                           const DecodedLevel& level);

/// The roughness whose highlight is as wide as that of the Phong exponent.
double roughness_of(float shininess);

/// Whether any material of the model shows the texture.
bool shows_texture(const BundleView& bundle, const ModelRecord& model, std::uint32_t texture);

/// What an exported texture is multiplied with, and a material's diffuse divided by: files hold no
/// factor above 1, as materials have it whose relief gets brighter than white.
float export_gain(const BundleView& bundle, std::uint32_t texture);

/// A channel of a material's diffuse in linear light, as files hold it.
double exported_diffuse(const BundleView& bundle, const MaterialRecord& material,
                        std::size_t channel);

/// Level 0 of a model: one primitive a chunk, positions in source units (about the model's
/// centre, which is the node's translation, so that large coordinates keep their digits in floats),
/// normals, uv and colours as they decode, materials, textures as PNG. What moves has a skin for
/// each part and morph targets, and the model's clips are animations.
/// images: may lack textures; their materials then have their colour alone.
/// Errors: those of decode_level(); kUnsupported "glb.too-large" beyond 4 GB.
Result<std::vector<std::byte>> encode_glb(const BundleView& bundle, std::uint32_t model,
                                          std::span<const GlbImage> images);

/// The same of models that stand together, in the space that their places lead to.
Result<std::vector<std::byte>> encode_glb(const BundleView& bundle,
                                          std::span<const RoomModel> models,
                                          std::span<const GlbImage> images);

/// A stored ZIP of a scene description as text (Model.usda, y up, metres) and its textures (JPEG,
/// or PNG where one has alpha), each at a multiple of 64 bytes, as the USDZ specification asks.
/// Meshes are the finest level, materials UsdPreviewSurface; a clip is a UsdSkel animation of 30
/// poses a second, as long as the longest of them. images: may lack textures; their
/// materials then have their colour alone. Errors: those of decode_level(); kUnsupported
/// "usdz.too-large" beyond 4 GB.
Result<std::vector<std::byte>> encode_usdz(const BundleView& bundle,
                                           std::span<const RoomModel> models,
                                           std::span<const GlbImage> images);

}  // namespace modar
