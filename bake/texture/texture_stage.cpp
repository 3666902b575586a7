// The textures of a bundle: which images the models show, which parts of them, and what they
// become.
#include "bake/texture/texture_stage.hpp"

#include <algorithm>
#include <bit>

#include "bake/mesh/tri_mesh.hpp"
#include "formats/layout.hpp"
#include "formats/texture_format.hpp"

namespace modar {
namespace {

/// Side of coverage masks, in texels. Finer ones mark fewer hidden texels as shown; each doubling
/// takes four times the time. [512, 2048]
constexpr std::uint32_t kCoverageSide = 1024;

std::uint32_t use_of(const std::string& path, std::uint32_t wrap, TextureUses& textures) {
  const auto next = static_cast<std::uint32_t>(textures.uses.size());
  const auto [place, added] = textures.index.try_emplace({path, wrap}, next);
  if (added) {
    TextureUse& use = textures.uses.emplace_back();
    use.path = path;
    use.wrap = wrap;
    use.coverage = make_coverage(kCoverageSide, kCoverageSide);
    // Masks repeat, so all texels of other textures count as shown.
    use.coverage.full = wrap != 0 && texture_wrap(wrap) != kWrapRepeat;
  }
  return place->second;
}

bool same_level(const TextureLevel& a, const TextureLevel& b) {
  return a.width == b.width && a.height == b.height && a.colour == b.colour && a.alpha == b.alpha;
}

bool same_pixels(const Texture& a, const Texture& b) {
  return a.wrap == b.wrap && a.alpha == b.alpha &&
         std::equal(a.levels.begin(), a.levels.end(), b.levels.begin(), b.levels.end(), same_level);
}

TextureOutcome append_texture(const Texture& baked, BundleContent& content) {
  TextureRecord record{};
  record.name = content.intern(baked.name);
  record.width = baked.levels.front().width;
  record.height = baked.levels.front().height;
  record.source_width = baked.source_width;
  record.source_height = baked.source_height;
  record.format = static_cast<std::uint32_t>(baked.format);
  record.flags =
      (baked.alpha ? kTextureAlpha : 0u) | baked.wrap | (baked.cut_out ? kTextureCutOut : 0u);
  record.first_level = static_cast<std::uint32_t>(content.texture_levels.size());
  record.level_count = static_cast<std::uint32_t>(baked.levels.size());
  record.psnr_db = static_cast<float>(baked.levels.front().psnr_db);
  record.ssim = static_cast<float>(baked.levels.front().ssim);

  std::vector<std::byte> data;
  for (const TextureLevel& level : baked.levels) {
    TextureLevelRecord out{};
    out.offset = data.size();
    out.alpha_offset = kNoOffset;
    out.size = static_cast<std::uint32_t>(level.colour.size());
    out.width = level.width;
    out.height = level.height;
    out.psnr_db = static_cast<float>(level.psnr_db);
    out.ssim = static_cast<float>(level.ssim);
    data.insert(data.end(), level.colour.begin(), level.colour.end());
    if (baked.alpha) {
      out.alpha_offset = data.size();
      data.insert(data.end(), level.alpha.begin(), level.alpha.end());
    }
    content.texture_levels.push_back(out);
  }
  content.texture_data.push_back(std::move(data));
  content.textures.push_back(record);
  TextureOutcome outcome;
  outcome.texture = static_cast<std::uint32_t>(content.textures.size() - 1);
  outcome.side = std::max(record.width, record.height);
  return outcome;
}

}  // namespace

std::vector<std::uint32_t> collect_textures(const TriMesh& mesh, TextureUses& textures) {
  std::vector<std::uint32_t> uses(mesh.materials.size(), kNone);
  if (mesh.uvs.empty()) return uses;
  const std::vector<std::uint32_t> repeats = repeating_materials(mesh);
  std::vector<bool> shown(mesh.materials.size(), false);
  for (const std::uint32_t material : mesh.triangle_material) shown[material] = true;
  for (std::size_t m = 0; m < mesh.materials.size(); ++m) {
    const std::string& map = mesh.materials[m].diffuse_map;
    if (shown[m] && !map.empty()) uses[m] = use_of(map, repeats[m], textures);
  }
  for (std::uint32_t u = 0; u < textures.uses.size(); ++u) {
    if (std::find(uses.begin(), uses.end(), u) != uses.end()) ++textures.uses[u].meshes;
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t use = uses[mesh.triangle_material[t]];
    if (use == kNone) continue;
    std::array<std::array<double, 2>, 3> uv{};
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::dvec2 corner = mesh.uvs[mesh.triangles[t][i]];
      uv[i] = {corner.x, 1.0 - corner.y};  // a mask counts v upwards, as OBJ does
    }
    cover_triangle(textures.uses[use].coverage, uv);
  }
  return uses;
}

std::vector<std::size_t> first_identical(std::span<const Texture> textures) {
  std::vector<std::size_t> first(textures.size());
  for (std::size_t i = 0; i < textures.size(); ++i) {
    std::size_t k = 0;
    while (k < i && !same_pixels(textures[k], textures[i])) ++k;
    first[i] = k;
  }
  return first;
}

std::uint64_t planned_bytes(std::span<const TexturePlan> textures, const TextureOptions& options) {
  const TextureFormatInfo& format = texture_codec(options.format).format;
  std::uint64_t bytes = 0;
  for (const TexturePlan& texture : textures) {
    TextureSize size = texture_size({texture.width, texture.height}, options);
    const std::uint64_t images = texture.alpha ? 2 : 1;
    bytes += images * format.bytes(size.width, size.height);
    while (options.mipmaps && (size.width > 1 || size.height > 1)) {
      size = {std::max(1U, size.width / 2), std::max(1U, size.height / 2)};
      bytes += images * format.bytes(size.width, size.height);
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

std::uint32_t affordable_side(const TextureUses& textures, const TextureOptions& options,
                              std::uint64_t budget) {
  if (budget == 0) return options.max_side;
  std::vector<TexturePlan> files;
  std::vector<TexturePlan> pages;
  for (const TextureUse& use : textures.uses) {
    if (use.replaced) continue;
    if (use.image) {
      pages.push_back({use.image->width, use.image->height, !is_opaque(*use.image)});
    } else {
      const auto image = read_texture(use.path);
      if (image) files.push_back({image->width, image->height, !is_opaque(*image)});
    }
  }
  const std::uint64_t taken = planned_bytes(pages, options);
  return plan_max_side(files, options, budget > taken ? budget - taken : 0);
}

namespace {

/// One unreadable picture of many is no reason to refuse a model: grey replaces it.
Result<Texture> bake_use(const TextureUse& use, const TextureOptions& options, Report& report) {
  if (use.image) return bake_texture(*use.image, use.path, options, report);
  Result<Texture> texture = bake_texture(use.path, options, report);
  if (texture || texture.error().exit == ExitCode::kUsage) return texture;
  const Error& error = texture.error();
  report.diagnostics.push_back({error.code, DiagnosticSeverity::kWarning, error.where, 0,
                                error.cause + "; grey replaces it", error.cure});
  return bake_texture(RgbaImage{1, 1, {128, 128, 128, 255}}, use.path, options, report);
}

/// Drops the last texture where another is the same; answers which one there is.
std::uint32_t merge_last(BundleContent& content) {
  const auto added = static_cast<std::uint32_t>(content.textures.size()) - 1;
  for (std::uint32_t i = 0; i < added; ++i) {
    const TextureRecord& other = content.textures[i];
    const bool same = content.texture_data[i] == content.texture_data[added] &&
                      other.width == content.textures[added].width &&
                      other.source_width * content.textures[added].source_height ==
                          other.source_height * content.textures[added].source_width &&
                      other.flags == content.textures[added].flags &&
                      other.level_count == content.textures[added].level_count;
    if (!same) continue;
    content.texture_levels.resize(content.textures[added].first_level);
    content.textures.pop_back();
    content.texture_data.pop_back();
    return i;
  }
  return added;
}

}  // namespace

Result<std::uint32_t> add_picture(const std::string& path, const TextureOptions& options,
                                  BundleContent& content, Report& report) {
  MODAR_ASSIGN(const RgbaImage image, read_image(path));
  MODAR_ASSIGN(const Texture baked, bake_texture(image, path, options, report));
  append_texture(baked, content);
  return merge_last(content);
}

std::uint32_t adopt_picture(const BundleContent& part, BundleContent& content) {
  TextureRecord record = part.textures[0];
  const auto levels = part.texture_levels.begin() + static_cast<std::ptrdiff_t>(record.first_level);
  record.name = content.intern(part.names.substr(record.name.offset, record.name.length));
  record.first_level = static_cast<std::uint32_t>(content.texture_levels.size());
  content.texture_levels.insert(content.texture_levels.end(), levels, levels + record.level_count);
  content.textures.push_back(record);
  content.texture_data.push_back(part.texture_data[0]);
  return merge_last(content);
}

Result<std::vector<TextureOutcome>> bake_textures(const TextureUses& textures,
                                                  TextureOptions options, std::uint64_t budget,
                                                  BundleContent& content, Report& report) {
  const std::uint32_t page_side = options.max_side;
  const std::uint32_t file_side = affordable_side(textures, options, budget);
  std::vector<Texture> baked;
  std::vector<std::size_t> numbers;  // of their uses
  for (std::size_t i = 0; i < textures.uses.size(); ++i) {
    const TextureUse& use = textures.uses[i];
    if (use.replaced) continue;
    options.wrap = use.wrap;
    options.coverage = use.coverage.full ? nullptr : &use.coverage;
    options.max_side = use.image ? page_side : file_side;
    MODAR_ASSIGN(Texture texture, bake_use(use, options, report));
    baked.push_back(std::move(texture));
    numbers.push_back(i);
  }
  const std::vector<std::size_t> first = first_identical(baked);
  std::vector<TextureOutcome> outcomes(textures.uses.size());
  for (std::size_t i = 0; i < baked.size(); ++i) {
    TextureOutcome& outcome = outcomes[numbers[i]];
    if (first[i] != i) {
      outcome = outcomes[numbers[first[i]]];
    } else if (baked[i].constant) {
      outcome.constant = true;
      outcome.rgba = baked[i].constant_rgba;
    } else {
      outcome = append_texture(baked[i], content);
    }
  }
  return outcomes;
}

}  // namespace modar
