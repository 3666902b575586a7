// Images that the texture tests make or find.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "bake/texture/texture.hpp"

namespace modar::test {

inline RgbaImage make_image(std::uint32_t width, std::uint32_t height, std::uint8_t value = 255) {
  return {width, height, std::vector<std::uint8_t>(std::size_t{width} * height * 4, value)};
}

template <class Colour>
RgbaImage paint(std::uint32_t width, std::uint32_t height, const Colour& colour) {
  RgbaImage image = make_image(width, height);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const auto rgb = colour(x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        image.pixels[(std::size_t{y} * width + x) * 4 + c] = static_cast<std::uint8_t>(rgb[c]);
      }
    }
  }
  return image;
}

/// Smooth waves of colour, edges and grain: a little of what photos have.
inline RgbaImage synthetic_photo(std::uint32_t width, std::uint32_t height, unsigned seed = 1) {
  std::mt19937 random(seed);
  return paint(width, height, [&random](std::uint32_t x, std::uint32_t y) {
    const int grain = static_cast<int>(random() % 17) - 8;
    const bool bright = (x / 13 + y / 17) % 3 == 0;
    const auto channel = [&](int value) { return value + grain < 0 ? 0 : (value + grain) % 256; };
    const int wave = static_cast<int>((x * 3 + y * 2) % 120);
    return std::array<int, 3>{channel(wave + (bright ? 100 : 20)), channel(40 + wave),
                              channel(bright ? 200 : 90)};
  });
}

inline RgbaImage noise(std::uint32_t width, std::uint32_t height, unsigned seed) {
  std::mt19937 random(seed);
  return paint(width, height, [&random](std::uint32_t, std::uint32_t) {
    return std::array<unsigned long, 3>{random() % 256, random() % 256, random() % 256};
  });
}

/// The centre crop of the project's ETC1 protocol: offsets rounded down to a multiple of 4.
inline RgbaImage centre_crop(const RgbaImage& image, std::uint32_t side) {
  const std::uint32_t left = (image.width - side) / 2 / 4 * 4;
  const std::uint32_t top = (image.height - side) / 2 / 4 * 4;
  return paint(side, side, [&](std::uint32_t x, std::uint32_t y) {
    const std::uint8_t* p = &image.pixels[((top + y) * std::size_t{image.width} + left + x) * 4];
    return std::array<std::uint8_t, 3>{p[0], p[1], p[2]};
  });
}

/// A folder of its own for files of a test, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "modar-texture-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~ScratchFolder() {
    std::error_code none;
    std::filesystem::remove_all(path_, none);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

template <class Bytes>
void write_file(const std::string& path, const Bytes& bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

inline std::vector<std::byte> read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> chars((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::vector<std::byte> bytes(chars.size());
  for (std::size_t i = 0; i < chars.size(); ++i) bytes[i] = static_cast<std::byte>(chars[i]);
  return bytes;
}

}  // namespace modar::test
