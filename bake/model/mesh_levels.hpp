// Levels of detail of a chunked mesh.
#pragma once

#include <cstdint>

#include "bake/model/chunked_mesh.hpp"
#include "bake/model/position_plan.hpp"

namespace modar {

struct LevelOptions {
  std::uint32_t levels = 4;  ///< greatest number a chunk, the finest counted; 1 to kMaxLevels
  PositionKind positions = PositionKind::kHalf;  ///< whose decoded positions the errors are of
  unsigned jobs = 1;                             ///< threads; the result does not depend on it
  [[nodiscard]] Result<void> validate() const;
};

inline constexpr std::uint32_t kMaxLevels = 12;

/// Gives each chunk coarser levels, each of about half the triangles of the one before, over the
/// vertices that it has. Positions of other chunks, borders and seams stay as they are, so that
/// chunks of any two levels meet without a crack. A level's error bounds the distance between it
/// and level 0, both as the device decodes them, measured from either to the other (see
/// surface_distance()). A chunk ends where halving is no longer possible.
Result<void> make_levels(ChunkedMesh& mesh, const LevelOptions& options, Report& report);

}  // namespace modar
