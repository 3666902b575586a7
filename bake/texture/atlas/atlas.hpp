// Partly used pictures of a model, repacked into as few textures as the device allows.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/mesh/tri_mesh.hpp"
#include "bake/report.hpp"
#include "bake/texture/texture.hpp"
#include "bake/texture/texture_stage.hpp"
#include "formats/base/error.hpp"

namespace modar {

enum class AtlasMode : std::uint8_t { kWhereItPays, kAlways, kNever };

struct AtlasOptions {
  AtlasMode mode = AtlasMode::kWhereItPays;
  /// As the pictures would be baked apart: pictures are scaled to no less than
  /// their coarser side would be.
  TextureOptions textures;
  std::uint32_t max_side = 2048;  ///< of a page
};

/// Cuts what a mesh shows of pictures that it alone uses and does not repeat into rectangles, and
/// lays them on shared pages: opaque pictures on some, others on others. Vertices on a cut are
/// doubled; materials that differ in their picture only become one. A rectangle is copied with all
/// that the picture has there and with a gutter of 4, 8 or 16 texels, as wide as the page allows;
/// being convex, it also holds every coarser level of detail of its triangles. Where it pays: two
/// pictures or more, a third of the bytes or half of the materials less, and a loss by resampling
/// of 1.5 dB at most, compared with separate pictures. The change and its loss are diagnostic
/// "texture.atlas". uses: of the mesh's materials, as collect_textures() gave them. Errors: those
/// of read_image().
Result<void> make_atlases(const AtlasOptions& options, TriMesh& mesh,
                          std::vector<std::uint32_t>& uses, TextureUses& textures, Report& report);

}  // namespace modar
