// A model out of a bundle as a GLB file that any viewer opens.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "bake/texture/texture.hpp"
#include "formats/bundle_view.hpp"
#include "formats/error.hpp"

namespace modar {

/// A texture of the bundle, decoded.
struct GlbImage {
  std::uint32_t texture = 0;  ///< index into the bundle's textures
  RgbaImage pixels;
};

/// Writes level 0 of a model: one primitive a chunk, positions in source units (about the model's
/// centre, which is the node's translation, so that large coordinates keep their digits in floats),
/// normals, uv and colours as they decode, materials, textures as PNG.
/// images: may lack textures; their materials then have their colour alone.
/// Errors: kInvalidInput "glb.index" where an index exceeds its vertices; kUnsupported
/// "glb.too-large" beyond 4 GB; kIo.
Result<void> write_glb(const BundleView& bundle, std::uint32_t model,
                       std::span<const GlbImage> images, const std::string& path);

}  // namespace modar
