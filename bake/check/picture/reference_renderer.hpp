// A slow renderer in double precision that shares no code with the device's: what a model should
// look like, from its source and its uncompressed pictures.
#pragma once

#include <array>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/image/image.hpp"
#include "bake/mesh/tri_mesh.hpp"
#include "formats/base/error.hpp"
#include "formats/sections.hpp"
#include "modar/camera.hpp"
#include "modar/renderer.hpp"

namespace modar {

/// A material's picture as mip levels; no levels: it has none.
struct SoftTexture {
  std::vector<RgbaImage> levels;
  TextureWrap wrap{};
};

/// Uncompressed pictures of all materials, at their own size. Errors: those of read_image().
Result<std::vector<SoftTexture>> load_textures(const TriMesh& mesh, unsigned jobs);

/// As stored, trilinear. level: any number; 0 is the picture itself. texture: with levels.
glm::dvec4 look_up(const SoftTexture& texture, const glm::dvec2& uv, double level);

/// IEC 61966-2-1, both ways, channel by channel.
glm::dvec3 srgb_to_linear(const glm::dvec3& stored);
glm::dvec3 linear_to_srgb(const glm::dvec3& linear);

/// Draws a mesh over the clear colour of `options`, in the world of a level camera: light is summed
/// at vertices as shaders/model.vert does, and multiplied with a pixel's colour in linear light
/// with sRGB's own transfer function; across a triangle, what its corners would show is mixed
/// encoded, as light is there. Perspective-correct attributes, trilinear textures; opaque, or
/// nothing where a picture's alpha is below 1/2. to_eye: mesh space to GL eye space. textures: one
/// a material. Pixels are sampled at their centres.
RgbaImage render_reference(const TriMesh& mesh, const std::vector<SoftTexture>& textures,
                           const Camera& camera, const glm::dmat4& to_eye,
                           const RenderOptions& options);

}  // namespace modar
