// The places of parts of pictures on shared pages: cuts into rectangles, and a packer of
// rectangles.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace modar {

struct AtlasSize {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// Columns [left, right) and rows [top, bottom).
struct AtlasBox {
  std::uint32_t left = 0;
  std::uint32_t top = 0;
  std::uint32_t right = 0;
  std::uint32_t bottom = 0;
};

/// A picture in square cells, top row first: how many vertices of triangles are in each, where
/// triangles show any of it.
struct AtlasCells {
  static constexpr std::int32_t kNotShown = -1;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::int32_t> vertices;  ///< width * height
};

/// What cut_into_boxes() weighs, in areas of texels.
struct AtlasCosts {
  double cell = 0;    ///< side of a cell, texels
  double gutter = 0;  ///< around every box, texels
  double vertex = 0;  ///< texels that take as many bytes as a vertex
};

/// Boxes that hold every shown cell once. A box is cut in two, again and again, where the boxes
/// around both halves, with their gutters, are smaller than it by more than the vertices along the
/// cut cost, which are needed on both sides.
std::vector<AtlasBox> cut_into_boxes(const AtlasCells& cells, const AtlasCosts& costs);

struct AtlasPlace {
  std::uint32_t page = 0;
  std::uint32_t left = 0;
  std::uint32_t top = 0;
};

struct AtlasPages {
  std::vector<AtlasPlace> places;  ///< one a rectangle
  std::vector<AtlasSize> pages;    ///< powers of two
};

/// Places rectangles without overlaps on pages of powers of two, at most max_side: on the smallest
/// page that holds them all, else on full pages of max_side and the smallest for the rest. By
/// maximal free rectangles, where the shorter side fits best (Jylanki, "A thousand ways to pack the
/// bin", 2010). Nothing where one is larger than a page.
std::optional<AtlasPages> pack_rectangles(std::span<const AtlasSize> sizes, std::uint32_t max_side);

/// The same onto these pages; nothing where they do not hold all.
std::optional<AtlasPages> pack_rectangles(std::span<const AtlasSize> sizes,
                                          std::span<const AtlasSize> pages);

}  // namespace modar
