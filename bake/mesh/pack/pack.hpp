// The final bytes of a model, with their measured error.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bake/mesh/pack/chunk.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/layout.hpp"

namespace modar {

/// Records whose indices and offsets count from this model's own start; the bundle stage shifts
/// them when it merges models. `record` lacks its name, its layout index and its `first_*` fields;
/// materials keep the texture paths in `sources` (same order as `materials`), texture = kNone.
struct PackedMesh {
  std::string name;
  ModelRecord record{};
  LayoutRecord layout{};
  std::uint32_t occlusion_byte = kNone;  ///< of each vertex; see OcclusionRecord
  std::vector<ChunkRecord> chunks;
  std::vector<LevelRecord> levels;
  std::vector<MaterialRecord> materials;
  std::vector<SourceMaterial> sources;
  std::vector<std::byte> vertices;
  std::vector<std::byte> indices;
};

struct PackOptions {
  double unit_metres = 0.0;  ///< metres in a source unit; 0: unknown
  PositionKind positions = PositionKind::kHalf;
  unsigned jobs = 1;  ///< threads; the bytes do not depend on it
  /// Vertices of a chunk's coarser levels come first, so that a renderer that has no room for all
  /// of them keeps the front ones. A chunk is then a range of vertices of its own.
  bool prefixes = false;
};

/// As the bundle has it, without a name and a texture.
MaterialRecord material_record(const SourceMaterial& source);

/// Quantises (positions as asked, 8-bit normals, 16-bit uv, 8-bit colours), decodes its own bytes
/// and measures their greatest and rms error; computes conservative boxes and normal cones; puts
/// each chunk in the order of formats/chunk_order.hpp, where vertices of equal bytes become one.
/// texture_side: for each material the texture's side in pixels, for uv errors in texels (0: none).
Result<PackedMesh> pack(const ChunkedMesh& chunked, const std::vector<std::uint32_t>& texture_side,
                        const PackOptions& options, Report& report);

}  // namespace modar
