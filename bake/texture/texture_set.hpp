// Several textures together: what they may cost, and which of them are the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/texture/texture.hpp"

namespace modar {

/// For each texture the index of the first that has the same pixels, alpha and wrapping (its own,
/// where it is the first). Names and source sizes do not count.
std::vector<std::size_t> first_identical(std::span<const Etc1Texture> textures);

/// What plan_max_side() needs to know of an image before it is baked.
struct TexturePlan {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool alpha = false;  ///< counts twice
};

/// GPU bytes of the textures under these options.
std::uint64_t planned_bytes(std::span<const TexturePlan> textures, const TextureOptions& options);

/// The greatest power of two, at most options.max_side, under which all textures together take at
/// most `budget` bytes; 1 where even that is too much.
std::uint32_t plan_max_side(std::span<const TexturePlan> textures, const TextureOptions& options,
                            std::uint64_t budget);

}  // namespace modar
