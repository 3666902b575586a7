#include "bake/extensions/report/treemap.hpp"

#include <algorithm>
#include <numeric>

namespace modar {
namespace {

/// The worst ratio of sides in a row of these areas along a side of that length.
double worst_ratio(const std::vector<double>& row, double side) {
  const double sum = std::accumulate(row.begin(), row.end(), 0.0);
  const auto [least, greatest] = std::minmax_element(row.begin(), row.end());
  return std::max(side * side * *greatest / (sum * sum), sum * sum / (side * side * *least));
}

/// Lays a row along the shorter side of the free space, and takes its room.
void place_row(const std::vector<double>& row, TreemapBox& free, std::vector<TreemapBox>& boxes) {
  const double sum = std::accumulate(row.begin(), row.end(), 0.0);
  const bool wide = free.width >= free.height;
  const double depth = sum / (wide ? free.height : free.width);
  double at = wide ? free.y : free.x;
  for (const double area : row) {
    const double length = area / depth;
    boxes.push_back(wide ? TreemapBox{free.x, at, depth, length}
                         : TreemapBox{at, free.y, length, depth});
    at += length;
  }
  (wide ? free.x : free.y) += depth;
  (wide ? free.width : free.height) -= depth;
}

}  // namespace

std::vector<TreemapBox> treemap(const std::vector<TreemapItem>& items, double width,
                                double height) {
  double total = 0;
  for (const TreemapItem& item : items) total += item.size;
  std::vector<TreemapBox> boxes;
  TreemapBox free{0, 0, width, height};
  std::vector<double> row;
  for (const TreemapItem& item : items) {
    const double area = item.size / total * width * height;
    const double side = std::min(free.width, free.height);
    std::vector<double> longer = row;
    longer.push_back(area);
    if (!row.empty() && worst_ratio(longer, side) > worst_ratio(row, side)) {
      place_row(row, free, boxes);
      longer = {area};
    }
    row = std::move(longer);
  }
  if (!row.empty()) place_row(row, free, boxes);
  return boxes;
}

}  // namespace modar
