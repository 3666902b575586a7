// Levels of detail of a chunked mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/mesh/pack/chunk.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"

namespace modar {

struct LevelOptions {
  std::uint32_t levels = 4;  ///< greatest number a chunk, the finest counted; 1 to kMaxLevels
  PositionKind positions = PositionKind::kHalf;  ///< whose decoded positions the errors are of
  unsigned jobs = 1;                             ///< threads; the result does not depend on it
  /// Pixels of each material's texture along a side, 0 where it has none; may be empty.
  std::vector<std::uint32_t> texture_sides;
  [[nodiscard]] Result<void> validate() const;
};

inline constexpr std::uint32_t kMaxLevels = 12;

/// Gives each chunk coarser levels, each of about half the triangles of the one before, over the
/// chunk's vertices. Positions shared with other chunks, borders and seams stay, so that chunks of
/// any two levels meet without a crack. A level's error bounds the distance between it
/// and level 0, both as the device decodes them, measured from either to the other (see
/// surface_distance()). At vertices of level 0 that were taken out, the texture has slid by no more
/// than 1 % of the chunk's diagonal: collapses that may shift it farther are refused. A chunk ends
/// where halving is no longer possible. Figures go to report.levels.
Result<void> make_levels(ChunkedMesh& mesh, const LevelOptions& options, Report& report);

}  // namespace modar
