// The textures of a bundle: which images the models show, which parts of them, and what they
// become.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bake/mesh/tri_mesh.hpp"
#include "bake/report.hpp"
#include "bake/texture/coverage.hpp"
#include "bake/texture/texture.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// An image with one wrap mode, and the texels that any triangle of any model shows of it.
struct TextureUse {
  std::string path;
  std::uint32_t wrap = 0;  ///< as in TextureOptions
  CoverageMask coverage;
  std::uint32_t meshes = 0;                ///< that show it
  std::shared_ptr<const RgbaImage> image;  ///< a page that make_atlases() drew; null: the file
  bool replaced = false;                   ///< by such pages: not baked
};

/// All uses of a bundle, in the order in which the models name them. An image that is used twice in
/// the same way is one use.
struct TextureUses {
  std::vector<TextureUse> uses;
  std::map<std::pair<std::string, std::uint32_t>, std::uint32_t> index;
};

/// Notes the images that a mesh shows. Answers the use of each material, kNone where it shows none.
std::vector<std::uint32_t> collect_textures(const TriMesh& mesh, TextureUses& textures);

/// For each texture the index of the first that has the same pixels, alpha and wrapping (its own,
/// where it is the first). Names and source sizes do not count.
std::vector<std::size_t> first_identical(std::span<const Texture> textures);

/// What plan_max_side() needs to know of an image before it is baked.
struct TexturePlan {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool alpha = false;  ///< counts twice
};

/// GPU bytes of the textures under these options.
std::uint64_t planned_bytes(std::span<const TexturePlan> textures, const TextureOptions& options);

/// The greatest power of two, at most options.max_side, under which all textures together take at
/// most `budget` bytes; 1 where even that is too much.
std::uint32_t plan_max_side(std::span<const TexturePlan> textures, const TextureOptions& options,
                            std::uint64_t budget);

/// The greatest side under which all files of the uses fit into `budget` bytes next to the pages of
/// atlases, which keep their sides; options.max_side where the budget is 0. Files that cannot be
/// read take nothing.
std::uint32_t affordable_side(const TextureUses& textures, const TextureOptions& options,
                              std::uint64_t budget);

/// What became of a use: a texture of the bundle, or one colour that represents it.
struct TextureOutcome {
  std::uint32_t texture = kNone;
  std::uint32_t side = 0;  ///< pixels of the longer side of level 0; 0: no texture
  bool constant = false;
  std::array<std::uint8_t, 4> rgba{};
};

/// Bakes each use once, keeps identical results once, folds constant ones to their colour. budget:
/// bytes that all of them together may take on the GPU, 0: any; the greatest side is lowered for
/// it, but for pages of an atlas, which keep theirs. Grey replaces a file that cannot be read,
/// with a warning. Errors: those of bake_texture().
Result<std::vector<TextureOutcome>> bake_textures(const TextureUses& textures,
                                                  TextureOptions options, std::uint64_t budget,
                                                  BundleContent& content, Report& report);

/// The first texture of a part, where `content` has not the same bytes already; answers its index.
std::uint32_t adopt_picture(const BundleContent& part, BundleContent& content);

/// Bakes a whole picture as a texture of the bundle, whatever it shows. Answers its index; that of
/// a texture that has the same bytes already. Errors: those of bake_texture().
Result<std::uint32_t> add_picture(const std::string& path, const TextureOptions& options,
                                  BundleContent& content, Report& report);

}  // namespace modar
