// The levels of a texture, each filtered from the one above it in linear light.
#include <algorithm>

#include "bake/image/resample.hpp"

namespace modar {

std::vector<RgbaImage> mip_chain(const RgbaImage& image, bool repeat, unsigned jobs) {
  std::vector<RgbaImage> levels = {image};
  if (image.width == 0 || image.height == 0) return levels;
  LinearImage level = to_linear(image);
  while (level.width > 1 || level.height > 1) {
    level = resample(level, std::max(1U, level.width / 2), std::max(1U, level.height / 2),
                     {repeat, jobs});
    levels.push_back(to_srgb(level));
  }
  return levels;
}

}  // namespace modar
