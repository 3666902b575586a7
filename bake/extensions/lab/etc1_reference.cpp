// Android's libetc1, seen through our image type.
#include "bake/extensions/lab/etc1_reference.hpp"

#ifdef MODAR_HAS_LIBETC1
#include <android/ETC1/etc1.h>

namespace modar {

extern const bool kHasEtc1Reference = true;

std::vector<std::byte> encode_etc1_reference(const RgbaImage& image) {
  std::vector<etc1_byte> rgb;
  rgb.reserve(image.pixels.size() / 4 * 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (i % 4 != 3) rgb.push_back(image.pixels[i]);
  }
  std::vector<std::byte> blocks(etc1_get_encoded_data_size(image.width, image.height));
  etc1_encode_image(rgb.data(), image.width, image.height, 3, image.width * 3,
                    reinterpret_cast<etc1_byte*>(blocks.data()));
  return blocks;
}

}  // namespace modar
#else

namespace modar {

extern const bool kHasEtc1Reference = false;

std::vector<std::byte> encode_etc1_reference(const RgbaImage&) {
  return {};
}

}  // namespace modar
#endif
