#include "bake/mesh/repair/triangles.hpp"

namespace modar::repair {
namespace {

/// Whether the triangles at a border are one piece of one picture.
bool one_look(const Triangles& triangles, const std::vector<std::uint32_t>& border) {
  for (std::size_t i = 0; i < border.size(); ++i) {
    const std::uint32_t before = border[i == 0 ? border.size() - 1 : i - 1];
    if (triangles.corner(next(before)).uv != triangles.corner(border[i]).uv ||
        triangles.material(before / 3) != triangles.material(border[i] / 3)) {
      return false;
    }
  }
  return true;
}

/// border: half-edges in their order.
void close(Triangles& triangles, const std::vector<std::uint32_t>& border, DefectCount& count) {
  const bool one = one_look(triangles, border);
  std::vector<Corner> corners;
  for (const std::uint32_t h : border) {
    corners.push_back(triangles.corner(h));
    if (!one) corners.back().uv = corners[0].uv;
  }
  const Corner middle = triangles.add_middle(corners);
  ++count.count;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    triangles.add({corners[(i + 1) % corners.size()], corners[i], middle}, border[0] / 3);
    count.area += triangles.surface().area(triangles.surface().triangles() - 1);
  }
}

}  // namespace

void close_holes(Triangles& triangles, DefectCount& count) {
  const Faces surface = triangles.surface();
  const std::vector<std::uint32_t> open = open_edges(surface, Around(surface));
  const Components components(surface, open);
  Array<std::uint32_t> out(surface.positions.size(), kNone);  // the open half-edge from a position
  for (const std::uint32_t h : open) out[surface.corners[h]] = h;
  std::vector<std::vector<std::uint32_t>> holes;
  std::vector<std::uint32_t> border;
  for (const std::uint32_t first : open) {
    if (out[surface.corners[first]] != first) continue;
    border.clear();
    PointBox box;
    for (std::uint32_t h = first; h != kNone;) {
      border.push_back(h);
      box.add(surface.at(h));
      out[surface.corners[h]] = kNone;  // once
      h = out[surface.corners[next(h)]];
    }
    const bool loop = surface.corners[next(border.back())] == surface.corners[first];
    const PointBox& part = components.at(components.of(surface.corners[first])).box;
    if (loop && border.size() > 2 && small_hole(box, part)) holes.push_back(border);
  }
  for (const auto& hole : holes) close(triangles, hole, count);
}

}  // namespace modar::repair
