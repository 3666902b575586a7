// What bounds the time of collapses where many triangles meet in a vertex. Internal to lod.
#pragma once

#include <cstddef>

namespace modar {

/// Triangles at both ends of a collapse; with more it has to wait. Models have up to 120.
inline constexpr std::size_t kWidestCollapse = 1024;
/// Looks at triangles, for each triangle, at which collapsing ends: bounds the time where many meet
/// in a vertex. Models need up to 210 of a chunk.
inline constexpr std::size_t kLooksATriangle = 2000;
inline constexpr std::size_t kMeshLooksATriangle = 2000;

}  // namespace modar
