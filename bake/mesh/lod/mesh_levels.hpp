// Levels of detail of a chunked mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/mesh/pack/chunk.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"

namespace modar {

struct LevelOptions {
  std::uint32_t levels = 4;  ///< greatest number a chunk, the finest counted; 1 to kMaxLevels
  PositionKind positions = PositionKind::kHalf;  ///< whose decoded positions the errors are of
  unsigned jobs = 1;                             ///< threads; the result does not depend on it
  /// A level of more triangles than this is a quarter of the level before it, not a half: no phone
  /// draws a million, and each level takes bytes and has to be measured.
  std::size_t many_triangles = 1'000'000;
  /// Pixels of each material's texture along a side, 0 where it has none; may be empty.
  std::vector<std::uint32_t> texture_sides;
  [[nodiscard]] Result<void> validate() const;
};

inline constexpr std::uint32_t kMaxLevels = 12;

/// Gives chunks coarser levels over their own vertices. Each level of the model has about half of
/// the triangles of the one before (see many_triangles), shared out among the chunks so that the
/// price of the last collapse is the same in all; a chunk that would lose less than a fifth has no
/// level of its own there. Where the model cannot be halved any more, there is a last level that is
/// only somewhat worse than the one before. Positions shared with other chunks stay, so that chunks
/// of any two levels meet without a crack; seams inside a chunk are simplified on both sides alike,
/// open rims of the model too. Vertices that differ in their normals only are one meanwhile where
/// most do (flat shading): corners of coarser triangles take the normal that is nearest to the
/// triangle's. A level's error bounds the distance between it and level 0, both as the device
/// decodes them, measured from either to the other (see level_distance()), for coarse levels by way
/// of a finer one that is hardly off; beside it stands what its shading shows. Where vertices of
/// level 0 are gone, the texture has slid by no more than 1 % of the chunk's diagonal. Figures go
/// to report.levels.
Result<void> make_levels(ChunkedMesh& mesh, const LevelOptions& options, Report& report);

/// Takes out the levels that are hardly nearer to the finest than the next coarser one is.
void drop_alike_levels(ChunkedMesh& mesh);

}  // namespace modar
