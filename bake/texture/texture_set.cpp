// Identical textures, and the size that a memory budget allows.
#include "bake/texture/texture_set.hpp"

#include <algorithm>
#include <bit>

#include "bake/texture/texture_size.hpp"

namespace modar {
namespace {

bool same_level(const Etc1Level& a, const Etc1Level& b) {
  return a.width == b.width && a.height == b.height && a.colour == b.colour && a.alpha == b.alpha;
}

bool same_pixels(const Etc1Texture& a, const Etc1Texture& b) {
  return a.repeat == b.repeat && a.alpha == b.alpha &&
         std::equal(a.levels.begin(), a.levels.end(), b.levels.begin(), b.levels.end(), same_level);
}

std::uint64_t block_bytes(TextureSize size) {
  return ((std::uint64_t{size.width} + 3) / 4) * ((std::uint64_t{size.height} + 3) / 4) * 8;
}

}  // namespace

std::vector<std::size_t> first_identical(std::span<const Etc1Texture> textures) {
  std::vector<std::size_t> first(textures.size());
  for (std::size_t i = 0; i < textures.size(); ++i) {
    std::size_t k = 0;
    while (k < i && !same_pixels(textures[k], textures[i])) ++k;
    first[i] = k;
  }
  return first;
}

std::uint64_t planned_bytes(std::span<const TexturePlan> textures, const TextureOptions& options) {
  std::uint64_t bytes = 0;
  for (const TexturePlan& texture : textures) {
    TextureSize size = texture_size({texture.width, texture.height}, options);
    const std::uint64_t images = texture.alpha ? 2 : 1;
    bytes += images * block_bytes(size);
    while (options.mipmaps && (size.width > 1 || size.height > 1)) {
      size = {std::max(1U, size.width / 2), std::max(1U, size.height / 2)};
      bytes += images * block_bytes(size);
    }
  }
  return bytes;
}

std::uint32_t plan_max_side(std::span<const TexturePlan> textures, const TextureOptions& options,
                            std::uint64_t budget) {
  TextureOptions smaller = options;
  smaller.max_side = std::bit_floor(options.max_side);
  while (smaller.max_side > 1 && planned_bytes(textures, smaller) > budget) smaller.max_side /= 2;
  return smaller.max_side;
}

}  // namespace modar
