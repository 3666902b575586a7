// Cuts pictures into boxes, packs rectangles on pages.
#include "bake/texture/atlas/atlas_layout.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace modar {
namespace {

/// Pages are at most this many times as long as wide: of a scan with five photos, the same page is
/// best with 2 to 8.
constexpr std::uint32_t kMostElongated = 4;
/// Least side of a page: below it, mips leave nothing to save.
constexpr std::uint32_t kLeastPage = 16;

/// The shown cells of one line (a row or a column), and what a cut before the line costs.
struct Line {
  std::uint32_t first = 0;  ///< [first, end); end 0: none
  std::uint32_t end = 0;
  double cut = 0;  ///< vertices
};

/// Grows a range by a line's.
void add_line(const Line& line, Line& to) {
  if (line.end == 0) return;
  to.first = to.end == 0 ? line.first : std::min(to.first, line.first);
  to.end = std::max(to.end, line.end);
}

class BoxCutter {
 public:
  BoxCutter(const AtlasCells& cells, const AtlasCosts& costs) : cells_(cells), costs_(costs) {}

  void cut(const AtlasBox& around) {
    const AtlasBox box = tight(around);
    if (box.right == 0) return;
    Cut best;
    look(box, true, best);
    look(box, false, best);
    if (!(best.gain > 0)) {
      boxes_.push_back(box);
      return;
    }
    AtlasBox first = box;
    AtlasBox second = box;
    (best.columns ? first.right : first.bottom) = best.at;
    (best.columns ? second.left : second.top) = best.at;
    cut(first);
    cut(second);
  }

  std::vector<AtlasBox> take() { return std::move(boxes_); }

 private:
  struct Cut {
    double gain = 0;
    std::uint32_t at = 0;
    bool columns = true;
  };

  [[nodiscard]] std::int32_t at(std::uint32_t x, std::uint32_t y) const {
    return cells_.vertices[std::size_t{y} * cells_.width + x];
  }

  [[nodiscard]] double area(std::uint32_t width, std::uint32_t height) const {
    return (width * costs_.cell + 2 * costs_.gutter) * (height * costs_.cell + 2 * costs_.gutter);
  }

  [[nodiscard]] AtlasBox tight(const AtlasBox& box) const {
    AtlasBox found = {box.right, box.bottom, 0, 0};
    for (std::uint32_t y = box.top; y < box.bottom; ++y) {
      for (std::uint32_t x = box.left; x < box.right; ++x) {
        if (at(x, y) == AtlasCells::kNotShown) continue;
        found = {std::min(found.left, x), std::min(found.top, y), std::max(found.right, x + 1),
                 std::max(found.bottom, y + 1)};
      }
    }
    return found;
  }

  /// Of a box' columns, or of its rows.
  [[nodiscard]] std::vector<Line> lines_of(const AtlasBox& box, bool columns) const {
    const std::uint32_t begin = columns ? box.left : box.top;
    const std::uint32_t across = columns ? box.top : box.left;
    const std::uint32_t across_end = columns ? box.bottom : box.right;
    std::vector<Line> lines((columns ? box.right : box.bottom) - begin);
    for (std::uint32_t i = 0; i < lines.size(); ++i) {
      for (std::uint32_t j = across; j < across_end; ++j) {
        const std::uint32_t x = columns ? begin + i : j;
        const std::uint32_t y = columns ? j : begin + i;
        const std::int32_t here = at(x, y);
        if (here == AtlasCells::kNotShown) continue;
        add_line({j, j + 1}, lines[i]);
        const std::int32_t before = i == 0    ? AtlasCells::kNotShown
                                    : columns ? at(x - 1, y)
                                              : at(x, y - 1);
        // Of n vertices that are spread over a square, the root of n are along one side.
        if (before != AtlasCells::kNotShown) lines[i].cut += std::sqrt(0.5 * (here + before)) + 1;
      }
    }
    return lines;
  }

  /// Looks for a better cut between the box' columns, or its rows.
  void look(const AtlasBox& box, bool columns, Cut& best) const {
    const std::vector<Line> lines = lines_of(box, columns);
    const std::uint32_t begin = columns ? box.left : box.top;
    const double whole = area(box.right - box.left, box.bottom - box.top);
    std::vector<double> behind(lines.size() + 1, 0.0);  // area of the part from each line on
    Line range;
    std::size_t end = lines.size();
    for (std::size_t i = lines.size(); i-- > 1;) {
      add_line(lines[i], range);
      const auto length = static_cast<std::uint32_t>(end - i);
      behind[i] = lines[i].end == 0 ? behind[i + 1] : area(length, range.end - range.first);
    }
    range = {};
    std::size_t last = 0;  // one past the last line that is not empty
    for (std::size_t i = 1; i < lines.size(); ++i) {
      add_line(lines[i - 1], range);
      if (lines[i - 1].end != 0) last = i;
      const double before = area(static_cast<std::uint32_t>(last), range.end - range.first);
      const double gain = whole - before - behind[i] - costs_.vertex * lines[i].cut;
      if (gain > best.gain) best = {gain, begin + static_cast<std::uint32_t>(i), columns};
    }
  }

  const AtlasCells& cells_;
  AtlasCosts costs_;
  std::vector<AtlasBox> boxes_;
};

bool holds(const AtlasBox& outer, const AtlasBox& inner) {
  return outer.left <= inner.left && outer.top <= inner.top && outer.right >= inner.right &&
         outer.bottom >= inner.bottom;
}

/// One page, and the maximal rectangles that are free on it; they overlap.
class Page {
 public:
  explicit Page(AtlasSize size) : free_{{0, 0, size.width, size.height}} {}

  bool place(AtlasSize size, std::uint32_t page, AtlasPlace& place) {
    std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t> best;
    bool found = false;
    for (const AtlasBox& box : free_) {
      const std::uint32_t width = box.right - box.left;
      const std::uint32_t height = box.bottom - box.top;
      if (width < size.width || height < size.height) continue;
      const std::uint32_t beside = width - size.width;
      const std::uint32_t below = height - size.height;
      const std::tuple candidate(std::min(beside, below), std::max(beside, below), box.top,
                                 box.left);
      if (found && candidate >= best) continue;
      found = true;
      best = candidate;
      place = {page, box.left, box.top};
    }
    if (found) {
      take({place.left, place.top, place.left + size.width, place.top + size.height});
    }
    return found;
  }

 private:
  /// Takes a box out of the free space.
  void take(const AtlasBox& used) {
    std::vector<AtlasBox> kept;
    std::vector<AtlasBox> pieces;
    for (const AtlasBox& box : free_) {
      if (used.left >= box.right || used.right <= box.left || used.top >= box.bottom ||
          used.bottom <= box.top) {
        kept.push_back(box);
        continue;
      }
      if (used.left > box.left) pieces.push_back({box.left, box.top, used.left, box.bottom});
      if (used.right < box.right) pieces.push_back({used.right, box.top, box.right, box.bottom});
      if (used.top > box.top) pieces.push_back({box.left, box.top, box.right, used.top});
      if (used.bottom < box.bottom)
        pieces.push_back({box.left, used.bottom, box.right, box.bottom});
    }
    const auto untouched = static_cast<std::ptrdiff_t>(kept.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const auto inside = [&](const AtlasBox& other) { return holds(other, pieces[i]); };
      const auto here = pieces.begin() + static_cast<std::ptrdiff_t>(i);
      // Of equal pieces the last one stays.
      if (std::none_of(kept.begin(), kept.begin() + untouched, inside) &&
          std::none_of(
              pieces.begin(), here,
              [&](const AtlasBox& other) { return inside(other) && !holds(pieces[i], other); }) &&
          std::none_of(here + 1, pieces.end(), inside)) {
        kept.push_back(pieces[i]);
      }
    }
    free_ = std::move(kept);
  }

  std::vector<AtlasBox> free_;
};

/// The order of placement. A page that one order does not fill, another one may: all are tried.
enum class Order : std::uint8_t { kLongest, kLargest, kWidestAround };
constexpr Order kOrders[] = {Order::kLongest, Order::kLargest, Order::kWidestAround};

std::vector<std::uint32_t> packing_order(std::span<const AtlasSize> sizes, Order order) {
  std::vector<std::uint32_t> numbers(sizes.size());
  std::iota(numbers.begin(), numbers.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    const std::uint64_t width = sizes[i].width;
    const std::uint64_t height = sizes[i].height;
    if (order == Order::kLargest) return std::pair(width * height, width);
    if (order == Order::kWidestAround) return std::pair(width + height, width);
    return std::pair(std::max(width, height), std::min(width, height));
  };
  std::stable_sort(numbers.begin(), numbers.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return key(a) > key(b); });
  return numbers;
}

/// Places what fits of `left` on one page, takes it out of `left`.
void fill_page(std::span<const AtlasSize> sizes, AtlasSize size, AtlasPages& pages,
               std::vector<std::uint32_t>& left) {
  Page page(size);
  const auto number = static_cast<std::uint32_t>(pages.pages.size());
  pages.pages.push_back(size);
  std::erase_if(left,
                [&](std::uint32_t i) { return page.place(sizes[i], number, pages.places[i]); });
}

/// Powers of two, small areas first, wide before high.
std::vector<AtlasSize> page_sizes(std::uint32_t max_side) {
  std::vector<AtlasSize> sizes;
  for (std::uint32_t w = kLeastPage; w <= max_side; w *= 2) {
    for (std::uint32_t h = kLeastPage; h <= max_side; h *= 2) {
      if (w <= h * kMostElongated && h <= w * kMostElongated) sizes.push_back({w, h});
    }
  }
  std::sort(sizes.begin(), sizes.end(), [](const AtlasSize& a, const AtlasSize& b) {
    const auto key = [](const AtlasSize& s) {
      return std::tuple(std::uint64_t{s.width} * s.height, std::max(s.width, s.height), s.height);
    };
    return key(a) < key(b);
  });
  return sizes;
}

}  // namespace

std::vector<AtlasBox> cut_into_boxes(const AtlasCells& cells, const AtlasCosts& costs) {
  BoxCutter cutter(cells, costs);
  cutter.cut({0, 0, cells.width, cells.height});
  return cutter.take();
}

std::optional<AtlasPages> pack_rectangles(std::span<const AtlasSize> sizes,
                                          std::span<const AtlasSize> pages) {
  for (const Order order : kOrders) {
    AtlasPages result;
    result.places.resize(sizes.size());
    std::vector<std::uint32_t> left = packing_order(sizes, order);
    for (const AtlasSize& page : pages) fill_page(sizes, page, result, left);
    if (left.empty()) return result;
  }
  return std::nullopt;
}

std::optional<AtlasPages> pack_rectangles(std::span<const AtlasSize> sizes,
                                          std::uint32_t max_side) {
  const std::vector<AtlasSize> candidates = page_sizes(max_side);
  if (candidates.empty()) return std::nullopt;
  AtlasPages result;
  result.places.resize(sizes.size());
  std::vector<std::uint32_t> left = packing_order(sizes, Order::kLongest);
  std::vector<AtlasSize> full;
  while (!left.empty()) {
    std::uint64_t area = 0;
    for (const std::uint32_t i : left) area += std::uint64_t{sizes[i].width} * sizes[i].height;
    for (const AtlasSize& page : candidates) {
      if (std::uint64_t{page.width} * page.height < area) continue;
      std::vector<AtlasSize> pages = full;
      pages.push_back(page);
      if (std::optional<AtlasPages> all = pack_rectangles(sizes, pages)) return all;
    }
    const std::size_t before = left.size();
    full.push_back(candidates.back());
    fill_page(sizes, full.back(), result, left);
    if (left.size() == before) return std::nullopt;
  }
  return result;
}

}  // namespace modar
