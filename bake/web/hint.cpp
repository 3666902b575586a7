#include "bake/web/hint.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "formats/colour_grid.hpp"
#include "formats/tracker_record.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kMostSide = 512;       ///< pixels: what a cover shows of it
constexpr std::size_t kMostBytes = 24 * 1000;  ///< 0.12 s at 1.6 Mbit/s

RgbaImage gray_picture(const TrackerRecordView& record) {
  RgbaImage image{record.header.width, record.header.height, {}};
  const std::size_t pixels = std::size_t{image.width} * image.height;
  image.pixels.resize(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    std::fill_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(4 * i), 3, record.pixels[i]);
    image.pixels[4 * i + 3] = 255;
  }
  const double shrink =
      std::min(1.0, static_cast<double>(kMostSide) / std::max(image.width, image.height));
  if (shrink == 1.0) return image;
  const auto side = [shrink](std::uint32_t length) {
    return std::max(1u, static_cast<std::uint32_t>(std::lround(length * shrink)));
  };
  return resize(image, side(image.width), side(image.height), {});
}

/// The mean colours of a pattern's cells, as large as the picture. The section is a valid one.
RgbaImage cell_colours(std::span<const std::byte> section, std::uint32_t width,
                       std::uint32_t height) {
  ColourGridHeader header{};
  std::memcpy(&header, section.data(), sizeof header);
  LinearImage cells;
  cells.width = header.columns;
  cells.height = header.rows;
  for (std::size_t i = 0; i < std::size_t{header.columns} * header.rows; ++i) {
    std::uint16_t colour[3];
    std::memcpy(colour, section.data() + sizeof header + i * sizeof colour, sizeof colour);
    for (const std::uint16_t channel : colour) {
      cells.pixels.push_back(static_cast<float>(channel) / 65535.0F);
    }
    cells.pixels.push_back(1.0F);
  }
  return to_srgb(resample(cells, width, height, {}));
}

/// Keeps each pixel's gray, by the weights of BT.601, and takes the colour's distance from gray, or
/// as much of it as fits into 0 to 255.
void tint(RgbaImage& picture, const RgbaImage& colours) {
  for (std::size_t i = 0; i < picture.pixels.size(); i += 4) {
    const double gray = picture.pixels[i];
    const std::uint8_t* const colour = &colours.pixels[i];
    const double own = 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2];
    double share = 1.0;
    for (int c = 0; c < 3; ++c) {
      const double offset = colour[c] - own;
      if (offset > 0) share = std::min(share, (255.0 - gray) / offset);
      if (offset < 0) share = std::min(share, gray / -offset);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = gray + share * (colour[c] - own);
      picture.pixels[i + c] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
  }
}

}  // namespace

Result<Hint> hint_of(const BundleView& bundle, std::uint32_t pattern) {
  TrackerRecordView record;
  const auto bytes = bundle.section(SectionType::kTrackerRecord, pattern);
  if (bytes.empty() || view_tracker_record(bytes, record)) {
    const std::string name(bundle.name(bundle.patterns()[pattern].name));
    return fail(ExitCode::kInvalidInput, "web.pattern", "pattern '" + name + "'",
                "it has no tracker record", "bake the bundle with this version of modar");
  }
  RgbaImage picture = gray_picture(record);
  const auto colours = bundle.section(SectionType::kPatternColours, pattern);
  if (!colours.empty()) tint(picture, cell_colours(colours, picture.width, picture.height));
  for (int quality = 85;; quality -= 10) {
    MODAR_ASSIGN(std::vector<std::byte> file, encode_jpeg(picture, quality));
    if (file.size() <= kMostBytes || quality <= 25) {
      return Hint{std::move(file), record.header.width, record.header.height};
    }
  }
}

}  // namespace modar
