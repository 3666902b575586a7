// Textures: repeated statements, and mip levels against the levels before.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bake/bundle/bundle_json.hpp"
#include "bake/check/content/content_rules.hpp"
#include "bake/image/resample.hpp"
#include "bake/texture/texture.hpp"
#include "bake/texture/texture_codec.hpp"

namespace modar {
namespace {

/// Rms by which texels may differ from half of the level before. Lower: good ETC1 blocks
/// refused; higher: faults accepted. [20, 60]
constexpr double kMipSlack = 40;
/// Shortest side of a level that is compared. Lower: levels of few blocks, where one texel is much
/// of a block, are refused. [8, 32] texels
constexpr std::uint32_t kShortestMip = 16;

bool is_of_a_material(const BundleView& bundle, std::uint32_t texture) {
  for (const MaterialRecord& material : bundle.materials()) {
    if (material.texture == texture) return true;
  }
  return false;
}

/// Are its sides those that `modar bake` gives an image of the stated size?
bool has_its_size(const BundleView& bundle, const TextureRecord& texture) {
  const Json stated = stated_list(bundle, "options");
  const auto most = stated["max-texture"].count();
  const std::uint32_t longer = std::max(texture.width, texture.height);
  // A device or a tier may ask for less.
  const bool free = !stated.text_at("device").empty() || !stated.text_at("tier").empty() || !most;
  TextureOptions options;
  options.mipmaps = texture.level_count > 1;
  options.wrap = texture.flags & kTextureRepeat;
  for (const std::uint64_t limit : {most.value_or(kMaxTextureSide), std::uint64_t{longer}}) {
    if (limit == longer && !free && limit != most) continue;
    options.max_side = static_cast<std::uint32_t>(limit);
    const TextureSize source = {texture.source_width, texture.source_height};
    for (const std::uint32_t scale :
         {1U, can_be_enlarged(source, options.max_side) ? kEnlarged : 1U}) {
      const TextureSize size = texture_size({scale * source.width, scale * source.height}, options);
      if (size.width == texture.width && size.height == texture.height) return true;
    }
  }
  return false;
}

/// A level, decoded, with its alpha.
RgbaImage decode_level(const BundleView& bundle, std::uint32_t texture, std::uint32_t level) {
  const TextureRecord& record = bundle.textures()[texture];
  const TextureLevelRecord& place = bundle.texture_levels()[record.first_level + level];
  const auto data = bundle.texture_data(texture);
  const auto format = static_cast<TextureFormat>(record.format);
  const auto at = [&](std::uint64_t offset) {
    return decode_texture(format, data.subspan(static_cast<std::size_t>(offset), place.size),
                          place.width, place.height);
  };
  RgbaImage image = at(place.offset);
  if (place.alpha_offset == kNoOffset) return image;
  const RgbaImage alpha = at(place.alpha_offset);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) image.pixels[i + 3] = alpha.pixels[i];
  return image;
}

/// The blocks of a level, as numbers. Beyond an edge comes the other one.
class LevelBlocks {
 public:
  LevelBlocks(const BundleView& bundle, std::uint32_t texture, std::uint32_t level) {
    const TextureRecord& record = bundle.textures()[texture];
    const TextureLevelRecord& place = bundle.texture_levels()[record.first_level + level];
    columns_ = static_cast<int>((place.width + 3) / 4);
    rows_ = static_cast<int>((place.height + 3) / 4);
    const auto data = bundle.texture_data(texture).subspan(place.offset, place.size);
    blocks_.resize(data.size() / sizeof(std::uint64_t));
    std::memcpy(blocks_.data(), data.data(), data.size());
    for (const std::uint64_t block : blocks_) ++counts_[block];
  }
  [[nodiscard]] std::uint64_t at(int x, int y) const {
    x = (x + 2 * columns_) % columns_;
    y = (y + 2 * rows_) % rows_;
    return blocks_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(x)];
  }
  /// Does it occur again? Those that no triangle shows are all alike.
  [[nodiscard]] bool repeats(int x, int y) const { return counts_.at(at(x, y)) > 1; }
  [[nodiscard]] bool all_alike(int left, int top, int right, int bottom) const {
    return every(left, top, right, bottom, [&](int x, int y) { return at(x, y) == at(left, top); });
  }
  [[nodiscard]] bool none_repeats(int left, int top, int right, int bottom) const {
    return every(left, top, right, bottom, [&](int x, int y) { return !repeats(x, y); });
  }

 private:
  template <class Test>
  static bool every(int left, int top, int right, int bottom, const Test& test) {
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        if (!test(x, y)) return false;
      }
    }
    return true;
  }

  std::vector<std::uint64_t> blocks_;
  int columns_ = 0;
  int rows_ = 0;
  std::map<std::uint64_t, std::size_t> counts_;
};

/// The greatest difference between a channel's texels of a block.
double range_of(const RgbaImage& image, std::uint32_t left, std::uint32_t top) {
  std::array<std::uint8_t, 3> low = {255, 255, 255};
  std::array<std::uint8_t, 3> high = {};
  int range = 0;
  for (std::uint32_t y = top; y < std::min(top + 4, image.height); ++y) {
    for (std::uint32_t x = left; x < std::min(left + 4, image.width); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint8_t value = image.pixels[4 * (std::size_t{y} * image.width + x) + c];
        low[c] = std::min(low[c], value);
        high[c] = std::max(high[c], value);
        range = std::max(range, high[c] - low[c]);
      }
    }
  }
  return range;
}

/// Root of the mean square of the differences in a square of texels.
double rms(const RgbaImage& a, const RgbaImage& b, std::uint32_t left, std::uint32_t top,
           std::uint32_t side) {
  double sum = 0;
  int count = 0;
  for (std::uint32_t y = top; y < std::min(top + side, a.height); ++y) {
    for (std::uint32_t x = left; x < std::min(left + side, a.width); ++x) {
      for (std::size_t c = 0; c < 3; ++c, ++count) {
        const std::size_t at = 4 * (std::size_t{y} * a.width + x) + c;
        const int off = int{a.pixels[at]} - int{b.pixels[at]};
        sum += off * off;
      }
    }
  }
  return std::sqrt(sum / std::max(count, 1));
}

/// Means of the texels that each coarser texel covers, which take nothing from other blocks.
RgbaImage means(const RgbaImage& image, std::uint32_t width, std::uint32_t height) {
  const LinearImage linear = to_linear(image);
  LinearImage mean{width, height, linear.opaque, {}};
  mean.pixels.resize(std::size_t{4} * width * height);
  const std::uint32_t across = image.width / width;
  const std::uint32_t down = image.height / height;
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) {
      for (std::size_t c = 0; c < 4; ++c) {
        mean.pixels[4 * (std::size_t{y / down} * width + x / across) + c] +=
            linear.pixels[4 * (std::size_t{y} * image.width + x) + c] /
            static_cast<float>(across * down);
      }
    }
  }
  return to_srgb(mean);
}

/// A level and the one before, of a texture.
class MipPair {
 public:
  MipPair(const BundleView& bundle, std::uint32_t texture, std::uint32_t level,
          const RgbaImage& finer, const RgbaImage& image)
      : image_(image),
        across_(finer.width / image.width),
        down_(finer.height / image.height),
        finer_blocks_(bundle, texture, level - 1),
        blocks_(bundle, texture, level) {
    const TextureRecord& record = bundle.textures()[texture];
    alpha_ = (record.flags & kTextureAlpha) != 0;
    half_ = resize(finer, image.width, image.height, {texture_wrap(record.flags), 1});
    means_ = alpha_ ? half_ : means(finer, image.width, image.height);
    const auto format = static_cast<TextureFormat>(record.format);
    again_ =
        decode_texture(format, texture_codec(format).encode(half_, {}), image.width, image.height);
  }

  /// Is a block of the level half of the finer one's blocks?
  [[nodiscard]] bool halves(std::uint32_t left, std::uint32_t top) const {
    const double range = std::min(range_of(half_, left, top), range_of(image_, left, top));
    const double lost = std::min(rms(half_, again_, left, top, 4), range);
    const double slack = kMipSlack + range + lost;
    for (std::uint32_t y = top; y < std::min(top + 4, image_.height); y += 4 / down_) {
      for (std::uint32_t x = left; x < std::min(left + 4, image_.width); x += 4 / across_) {
        const int column = static_cast<int>(x * across_ / 4);
        const int row = static_cast<int>(y * down_ / 4);
        if (!comparable(column, row, static_cast<int>(left / 4), static_cast<int>(top / 4)))
          continue;
        const bool alone = finer_blocks_.none_repeats(column - 1, row - 1, column + 1, row + 1);
        const RgbaImage& wanted = alone ? half_ : means_;

        if (rms(wanted, image_, x, y, 4 / std::max(across_, down_)) > slack) return false;
      }
    }
    return true;
  }

 private:
  /// Blocks that are not shown are no halves. They repeat, and where one level has them the other
  /// may have shown ones at their edges.
  [[nodiscard]] bool comparable(int column, int row, int coarse_column, int coarse_row) const {
    const int left = column - column % static_cast<int>(across_);
    const int top = row - row % static_cast<int>(down_);
    if (finer_blocks_.repeats(column, row)) {
      return finer_blocks_.all_alike(left - 2, top - 2, left + 3, top + 3);
    }
    return !alpha_ || (finer_blocks_.none_repeats(column - 1, row - 1, column + 1, row + 1) &&
                       !blocks_.repeats(coarse_column, coarse_row));
  }

  const RgbaImage& image_;
  std::uint32_t across_;
  std::uint32_t down_;
  bool alpha_ = false;
  LevelBlocks finer_blocks_;
  LevelBlocks blocks_;
  RgbaImage half_;
  RgbaImage means_;
  RgbaImage again_;  ///< half_, as the encoder stores it
};

/// Where a level is no half of the finer one; empty where it is.
std::string mip_fault(const BundleView& bundle, std::uint32_t texture, std::uint32_t level,
                      const RgbaImage& finer, const RgbaImage& image) {
  const MipPair pair(bundle, texture, level, finer, image);
  for (std::uint32_t y = 0; y < image.height; y += 4) {
    for (std::uint32_t x = 0; x < image.width; x += 4) {
      if (pair.halves(x, y)) continue;
      return with_numbers("level {} at pixel {},{} is no half of the level before", {level, x, y});
    }
  }
  return "";
}

}  // namespace

void check_textures(ContentLog& log) {
  const Table<TextureRecord> textures = log.bundle.textures();
  for (std::uint32_t t = 0; t < textures.size(); ++t) {
    const TextureRecord& texture = textures[t];
    const TextureLevelRecord& first = log.bundle.texture_levels()[texture.first_level];
    std::string fault;
    if (texture.psnr_db != first.psnr_db || texture.ssim != first.ssim) {
      fault = "its quality is not that of its level 0";
    } else if (is_of_a_material(log.bundle, t) && !has_its_size(log.bundle, texture)) {
      fault = "no image of the size that it states gets its sides";
    }
    RgbaImage finer = decode_level(log.bundle, t, 0);
    for (std::uint32_t l = 1; l < texture.level_count && fault.empty(); ++l) {
      RgbaImage image = decode_level(log.bundle, t, l);
      if (std::min(image.width, image.height) < kShortestMip) break;
      fault = mip_fault(log.bundle, t, l, finer, image);
      finer = std::move(image);
    }
    if (fault.empty()) continue;
    log.tell(WorkstationRule::kTextureContent, log.label("texture", texture.name), &texture, fault);
  }
}

}  // namespace modar
