// Rules of OpenGL ES 2.0 and of the options about a texture's size.
#include "bake/texture/texture_size.hpp"

#include <algorithm>
#include <bit>

namespace modar {
namespace {

std::uint32_t nearest_power(std::uint32_t side, std::uint32_t limit) {
  const std::uint64_t below = std::bit_floor(side);
  const bool up = std::uint64_t{side} * side > below * below * 2;
  return std::min(static_cast<std::uint32_t>(up ? below * 2 : below), std::bit_floor(limit));
}

}  // namespace

TextureSize texture_size(TextureSize source, const TextureOptions& options) {
  if (options.mipmaps || options.repeat) {
    return {nearest_power(source.width, options.max_side),
            nearest_power(source.height, options.max_side)};
  }
  const std::uint64_t longer = std::max(source.width, source.height);
  if (longer <= options.max_side) return source;
  const auto scaled = [&](std::uint64_t side) {
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, (side * options.max_side * 2 + longer) / (2 * longer)));
  };
  return {scaled(source.width), scaled(source.height)};
}

}  // namespace modar
