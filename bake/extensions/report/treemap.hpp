// Sizes as areas.
#pragma once

#include <string>
#include <vector>

namespace modar {

struct TreemapItem {
  std::string label;
  std::string kind;  ///< CSS class of its rectangle
  double size = 0;   ///< above 0
};

struct TreemapBox {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;
};

/// A box for each item, in their order, whose areas are as their sizes and fill the whole.
/// Squarified treemaps: Bruls, Huizing and van Wijk, "Squarified Treemaps", 2000. items: largest
/// first.
std::vector<TreemapBox> treemap(const std::vector<TreemapItem>& items, double width, double height);

}  // namespace modar
