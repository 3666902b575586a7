// The size that a texture is baked at.
#pragma once

#include <cstdint>

#include "bake/texture/texture.hpp"

namespace modar {

struct TextureSize {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// Powers of two (each the nearest as a ratio) where the texture has mips or repeats, which OpenGL
/// ES 2.0 asks for; at most options.max_side.
TextureSize texture_size(TextureSize source, const TextureOptions& options);

}  // namespace modar
