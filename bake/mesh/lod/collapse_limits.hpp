// Triangles around the vertices that collapse, and what bounds the time where many meet in one.
// Internal to lod.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/import/source_model.hpp"

namespace modar {

/// Triangles at both ends of a collapse; with more it has to wait. Models have up to 120.
inline constexpr std::size_t kWidestCollapse = 1024;
/// Looks at triangles, for each triangle, at which collapsing ends: bounds the time where many meet
/// in a vertex. Models need up to 210 of a chunk.
inline constexpr std::size_t kLooksATriangle = 2000;
inline constexpr std::size_t kMeshLooksATriangle = 2000;

/// Of a triangle: the vertex' next corner, and the two vertices that follow it, which are equal
/// where the triangle is gone.
template <class Index>
struct FanCorner {
  std::uint32_t next = kNoIndex;
  Index a = 0;
  Index b = 0;
  [[nodiscard]] bool is_gone() const { return a == b; }
  void leave() { a = b; }
};

/// Calls back with each corner of a list, by its number, and the two vertices that follow it; takes
/// those that are gone out of the list. looks: one fewer for each.
template <class Index, class Callback>
void visit_fan(std::uint32_t& first, std::vector<FanCorner<Index>>& corners, std::size_t& looks,
               const Callback& callback) {
  std::uint32_t* link = &first;
  while (*link != kNoIndex) {
    const std::uint32_t number = *link;
    FanCorner<Index>& corner = corners[number];
    if (corner.is_gone()) {
      *link = corner.next;
      continue;
    }
    callback(number, corner.a, corner.b);
    link = &corner.next;
    if (looks > 0) --looks;
  }
}

}  // namespace modar
