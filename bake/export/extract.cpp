// Takes a bundle's assets out again, as files of other tools.
#include "bake/export/extract.hpp"

#include <algorithm>
#include <string_view>

#include "bake/export/model_file.hpp"
#include "bake/export/room_models.hpp"
#include "bake/export/texture_files.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/texture/texture_codec.hpp"

namespace modar {
namespace {

/// A name of a bundle as a file name: no folders, no control characters, no leading dot.
std::string clean_name(std::string_view name) {
  std::string clean;
  for (const char c : name) {
    const bool bad = c == '/' || c == '\\' || c == ':' || (c >= 0 && c < 0x20);
    clean += bad ? '_' : c;
  }
  if (clean.empty() || clean.front() == '.') clean.insert(clean.begin(), '_');
  return clean;
}

TextureFormat format_of(const TextureRecord& texture) {
  return static_cast<TextureFormat>(texture.format);
}

/// Collects written files, and keeps names apart that clean to the same file.
class Extraction {
 public:
  Extraction(const BundleView& bundle, OutputFolder& folder) : bundle_(bundle), folder_(folder) {}

  Result<void> textures();
  Result<void> patterns();
  Result<void> models();
  /// Paths of written files.
  [[nodiscard]] std::vector<std::string> paths() const;

 private:
  /// Under a name that no file before it has.
  Result<void> write(const std::string& stem, const std::string& extension,
                     std::span<const std::byte> bytes);
  std::span<const std::byte> plane(std::uint32_t texture, const TextureLevelRecord& level,
                                   bool alpha) const;

  const BundleView& bundle_;
  OutputFolder& folder_;
  std::vector<std::string> files_;
};

Result<void> Extraction::write(const std::string& stem, const std::string& extension,
                               std::span<const std::byte> bytes) {
  std::string name = stem + extension;
  for (int copy = 2; std::find(files_.begin(), files_.end(), name) != files_.end(); ++copy) {
    name = stem + "-" + std::to_string(copy) + extension;
  }
  files_.push_back(name);
  return folder_.write(name, bytes);
}

std::vector<std::string> Extraction::paths() const {
  std::vector<std::string> paths;
  for (const std::string& name : files_) paths.push_back(folder_.path(name));
  return paths;
}

std::span<const std::byte> Extraction::plane(std::uint32_t texture, const TextureLevelRecord& level,
                                             bool alpha) const {
  return bundle_.texture_data(texture).subspan(alpha ? level.alpha_offset : level.offset,
                                               level.size);
}

Result<void> Extraction::textures() {
  for (std::uint32_t t = 0; t < bundle_.textures().size(); ++t) {
    const TextureRecord& texture = bundle_.textures()[t];
    const std::string stem = clean_name(bundle_.name(texture.name));
    std::vector<KtxLevel> levels;
    for (std::uint32_t l = 0; l < texture.level_count; ++l) {
      const TextureLevelRecord& level = bundle_.texture_levels()[texture.first_level + l];
      levels.push_back({level.width, level.height, plane(t, level, false)});
      for (const bool alpha : {false, true}) {
        if (format_of(texture) != TextureFormat::kEtc1Rgb) continue;  // all that PKM holds
        if (alpha && (texture.flags & kTextureAlpha) == 0) continue;
        const std::string name = stem + (alpha ? ".alpha." : ".") + std::to_string(l);
        MODAR_TRY(write(name, ".pkm", to_pkm(plane(t, level, alpha), level.width, level.height)));
      }
    }
    MODAR_TRY(write(stem, ".ktx", to_ktx(format_of(texture), levels)));
  }
  return {};
}

Result<void> Extraction::patterns() {
  for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) {
    const std::string stem = clean_name(bundle_.name(bundle_.patterns()[p].name));
    for (const ParameterSetRecord& set : bundle_.parameter_sets()) {
      const std::string_view yml = bundle_.feature_yml(p, set.id);
      if (yml.empty()) continue;
      const std::string name = stem + "." + clean_name(bundle_.name(set.name));
      MODAR_TRY(write(name, ".yml", std::as_bytes(std::span(yml))));
    }
  }
  return {};
}

Result<void> Extraction::models() {
  const std::vector<GlbImage> images = decoded_textures(bundle_);
  for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) {
    const std::string stem = clean_name(bundle_.name(bundle_.models()[m].name));
    const auto file = encode_glb(bundle_, m, images);
    if (!file) return in_file(stem + ".glb", file.error());
    MODAR_TRY(write(stem, ".glb", *file));
  }
  for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) {
    const std::vector<RoomModel> placed = models_in_room(bundle_, p);
    if (placed.empty()) continue;
    const std::string stem = clean_name(bundle_.name(bundle_.patterns()[p].name));
    MODAR_ASSIGN(const auto file, encode_usdz(bundle_, placed, images));
    MODAR_TRY(write(stem, ".usdz", file));
  }
  return {};
}

}  // namespace

Result<std::vector<std::string>> extract_bundle(const BundleView& bundle, const std::string& folder,
                                                bool force) {
  MODAR_ASSIGN(OutputFolder output, OutputFolder::claim(folder, force));
  Extraction extraction(bundle, output);
  for (const auto& step : {&Extraction::models, &Extraction::textures, &Extraction::patterns}) {
    MODAR_TRY((extraction.*step)());
  }
  MODAR_TRY(output.commit());
  return extraction.paths();
}

}  // namespace modar
