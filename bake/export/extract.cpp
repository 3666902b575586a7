// Takes a bundle's assets out again, as files of other tools.
#include "bake/export/extract.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "bake/export/model_file.hpp"
#include "bake/export/room_models.hpp"
#include "bake/export/texture_files.hpp"
#include "bake/io/output.hpp"
#include "bake/texture/texture_codec.hpp"
#include "formats/base/atomic_file.hpp"

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

/// Collects what was written, and keeps names apart that clean to the same file.
class Extraction {
 public:
  Extraction(const BundleView& bundle, std::string folder)
      : bundle_(bundle), folder_(std::move(folder)) {}

  Result<void> textures();
  Result<void> patterns();
  Result<void> models();
  std::vector<std::string> take_files() { return std::move(files_); }

 private:
  /// A path in the folder that was not written before.
  std::string path_for(const std::string& stem, const std::string& extension);
  std::span<const std::byte> plane(std::uint32_t texture, const TextureLevelRecord& level,
                                   bool alpha) const;

  const BundleView& bundle_;
  std::string folder_;
  std::vector<std::string> files_;
};

std::string Extraction::path_for(const std::string& stem, const std::string& extension) {
  const std::filesystem::path folder(folder_);
  std::string path = folder / (stem + extension);
  for (int copy = 2; std::find(files_.begin(), files_.end(), path) != files_.end(); ++copy) {
    path = folder / (stem + "-" + std::to_string(copy) + extension);
  }
  files_.push_back(path);
  return path;
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
        const auto written = write_file(
            path_for(name, ".pkm"),
            std::span<const std::byte>(to_pkm(plane(t, level, alpha), level.width, level.height)));
        if (!written) return written;
      }
    }
    const auto written = write_file(path_for(stem, ".ktx"),
                                    std::span<const std::byte>(to_ktx(format_of(texture), levels)));
    if (!written) return written;
  }
  return {};
}

Result<void> Extraction::patterns() {
  for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) {
    const std::string stem = clean_name(bundle_.name(bundle_.patterns()[p].name));
    for (std::uint32_t s = 0; s < bundle_.parameter_sets().size(); ++s) {
      const ParameterSetRecord& set = bundle_.parameter_sets()[s];
      const std::string_view yml = bundle_.feature_yml(p, set.id);
      if (yml.empty()) continue;
      const std::string name = stem + "." + clean_name(bundle_.name(set.name));
      if (auto written = write_file(path_for(name, ".yml"), yml); !written) return written;
    }
  }
  return {};
}

Result<void> Extraction::models() {
  const std::vector<GlbImage> images = decoded_textures(bundle_);
  for (std::uint32_t m = 0; m < bundle_.models().size(); ++m) {
    const std::string stem = clean_name(bundle_.name(bundle_.models()[m].name));
    if (auto written = write_glb(bundle_, m, images, path_for(stem, ".glb")); !written) {
      return written;
    }
  }
  for (std::uint32_t p = 0; p < bundle_.patterns().size(); ++p) {
    const std::vector<RoomModel> placed = models_in_room(bundle_, p);
    if (placed.empty()) continue;
    const std::string stem = clean_name(bundle_.name(bundle_.patterns()[p].name));
    MODAR_ASSIGN(const auto file, encode_usdz(bundle_, placed, images));
    MODAR_TRY(write_file(path_for(stem, ".usdz"), std::span<const std::byte>(file)));
  }
  return {};
}

}  // namespace

Result<std::vector<std::string>> extract_bundle(const BundleView& bundle, const std::string& folder,
                                                bool force) {
  MODAR_TRY(claim_output_folder(folder, force));
  Extraction extraction(bundle, folder);
  for (const auto& step : {&Extraction::models, &Extraction::textures, &Extraction::patterns}) {
    if (auto done = (extraction.*step)(); !done) return tl::unexpected(done.error());
  }
  return extraction.take_files();
}

}  // namespace modar
