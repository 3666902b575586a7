// From a pattern's plane to a room's ground.
#include "bake/export/room_models.hpp"

#include <algorithm>
#include <cmath>

#include "bake/texture/texture_codec.hpp"
#include "modar/renderer.hpp"

namespace modar {

std::vector<RoomModel> models_in_room(const BundleView& bundle, std::uint32_t pattern) {
  constexpr double kUnknownSide = 0.2;  // metres: a sheet of A5
  const PatternRecord& record = bundle.patterns()[pattern];
  // A pattern's largest side is 2 units long.
  const double unit = record.width_mm > 0
                          ? 0.001 * record.width_mm / (2.0 * static_cast<double>(record.half_width))
                          : kUnknownSide / 2;
  // The pattern's y, away from who reads it, is the room's -z.
  glm::dmat4 room(unit);
  room[1] = {0, 0, -unit, 0};
  room[2] = {0, unit, 0, 0};
  room[3] = {0, 0, 0, 1};
  std::vector<RoomModel> models;
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    const SceneRecord& scene = bundle.scenes()[s];
    if (scene.pattern != pattern) continue;
    models.push_back({scene.model, room * glm::dmat4(scene_matrix(scene)), kNone});
    for (const SceneClipRecord& plays : bundle.scene_clips()) {
      if (plays.scene == s) models.back().clip = plays.clip;
    }
  }
  return models;
}

std::vector<GlbImage> decoded_textures(const BundleView& bundle) {
  std::vector<GlbImage> images;
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    const TextureRecord& texture = bundle.textures()[t];
    const TextureLevelRecord& level = bundle.texture_levels()[texture.first_level];
    const auto decoded = [&](std::uint64_t offset) {
      return decode_texture(static_cast<TextureFormat>(texture.format),
                            bundle.texture_data(t).subspan(offset, level.size), level.width,
                            level.height);
    };
    GlbImage image{t, decoded(level.offset)};
    if ((texture.flags & kTextureAlpha) != 0) {
      const RgbaImage alpha = decoded(level.alpha_offset);
      for (std::size_t i = 0; i < alpha.pixels.size(); i += 4) {
        image.pixels.pixels[i + 3] = alpha.pixels[i];
      }
    }
    const float gain = export_gain(bundle, t);
    for (std::size_t i = 0; gain > 1 && i < image.pixels.pixels.size(); ++i) {
      std::uint8_t& value = image.pixels.pixels[i];
      if (i % 4 != 3) value = static_cast<std::uint8_t>(std::min(255L, std::lround(gain * value)));
    }
    images.push_back(std::move(image));
  }
  return images;
}

}  // namespace modar
