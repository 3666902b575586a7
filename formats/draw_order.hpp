// The order in which triangles that are seen through are drawn, for any place of the camera: a
// section since 1.2.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/layout.hpp"

namespace modar {

/// A node of a tree over the triangles of a chunk's finest level; its subtrees follow it, the one
/// behind its plane first. Fuchs, Kedem, Naylor, "On Visible Surface Generation by A Priori Tree
/// Structures", 1980.
struct DrawOrderRecord {
  float plane[4];          ///< model space; a point p is behind it where dot(xyz, p) + w < 0
  std::uint32_t behind;    ///< nodes of the subtree behind; the rest of its own is in front
  std::uint32_t triangle;  ///< in the plane; kNone: none
};
static_assert(sizeof(DrawOrderRecord) == 24);

/// Nodes whose turn has not come; begin = end: the triangle of `begin`.
struct DrawOrderRange {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

/// What walk_draw_order() needs of `waiting` at most.
constexpr std::size_t draw_order_depth(std::size_t nodes) {
  return 2 * nodes + 1;
}

/// Calls draw(triangle) for each, the farthest from the eye first. nodes: of a valid section;
/// others give some order. eye: model space. waiting: its capacity is kept.
template <class Draw>
void walk_draw_order(std::span<const DrawOrderRecord> nodes, const float (&eye)[3],
                     std::vector<DrawOrderRange>& waiting, const Draw& draw) {
  waiting.clear();
  const auto later = [&](std::uint32_t begin, std::uint32_t end) {
    if (begin < end) waiting.push_back({begin, end});
  };
  later(0, static_cast<std::uint32_t>(nodes.size()));
  while (!waiting.empty()) {
    const DrawOrderRange range = waiting.back();
    waiting.pop_back();
    const DrawOrderRecord& node = nodes[range.begin];
    if (range.begin == range.end) {
      draw(node.triangle);
      continue;
    }
    const std::uint32_t first = range.begin + 1;
    const std::uint32_t middle = first + std::min(node.behind, range.end - first);
    const float* plane = node.plane;
    const bool in_front =
        plane[0] * eye[0] + plane[1] * eye[1] + plane[2] * eye[2] + plane[3] >= 0.0f;
    if (in_front) later(middle, range.end);
    if (!in_front) later(first, middle);
    if (node.triangle != kNone) waiting.push_back({range.begin, range.begin});
    if (in_front) later(first, middle);
    if (!in_front) later(middle, range.end);
  }
}

}  // namespace modar
