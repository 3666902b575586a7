// The corners of a flat thing in a photo, and the way from there to a picture, as the page has them
// (runtime/extensions/web/own-picture.js).
#include "modar/photo.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Longer side of the copy in which corners are looked for: a pixel of it is some five of the
/// photo, which people correct.
constexpr int kLookSide = 192;
/// Sum of the differences in red, green and blue from which a pixel is not part of the table.
constexpr int kOffTable = 48;
constexpr double kLeastThing = 0.05;  ///< share of the photo
/// A thing of another shape fills its corners' quadrangle less, or more, by this share.
constexpr double kUnlike = 0.1;
/// Of a side, from its rough line: what of the rim belongs to it.
constexpr double kNearSide = 0.06;

struct PhotoCells {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> cells;
};

/// Contents of a cell: nothing of the table yet, something else; then the table, and things that
/// were looked at.
enum PhotoCell : std::uint8_t { kLikeTable, kThing, kTable, kSeen };

struct SmallPhoto {
  int width = 0;
  int height = 0;
  double scale = 1;
  std::vector<std::array<int, 3>> pixels;
};

/// Means of squares.
SmallPhoto small_copy(const Photo& photo) {
  SmallPhoto small;
  small.scale = std::min(1.0, double{kLookSide} / std::max(photo.width, photo.height));
  small.width = std::max(1, static_cast<int>(std::lround(photo.width * small.scale)));
  small.height = std::max(1, static_cast<int>(std::lround(photo.height * small.scale)));
  for (int y = 0; y < small.height; ++y) {
    const int top = y * photo.height / small.height;
    const int bottom = std::max(top + 1, (y + 1) * photo.height / small.height);
    for (int x = 0; x < small.width; ++x) {
      const int left = x * photo.width / small.width;
      const int right = std::max(left + 1, (x + 1) * photo.width / small.width);
      std::array<int, 3> sum{};
      for (int row = top; row < bottom; ++row) {
        const std::uint8_t* pixel = photo.rgba + row * photo.stride + 4 * std::ptrdiff_t{left};
        for (int column = left; column < right; ++column, pixel += 4) {
          for (std::size_t c = 0; c < 3; ++c) sum[c] += pixel[c];
        }
      }
      for (int& value : sum) value /= (bottom - top) * (right - left);
      small.pixels.push_back(sum);
    }
  }
  return small;
}

/// kThing where a pixel has none of the colours of the photo's rim.
PhotoCells off_table(const SmallPhoto& photo) {
  std::vector<std::array<int, 3>> rim;
  const auto pixel = [&](int x, int y) {
    return photo.pixels[static_cast<std::size_t>(y * photo.width + x)];
  };
  for (int x = 0; x < photo.width; x += 4) {
    rim.push_back(pixel(x, 0));
    rim.push_back(pixel(x, photo.height - 1));
  }
  for (int y = 0; y < photo.height; y += 4) {
    rim.push_back(pixel(0, y));
    rim.push_back(pixel(photo.width - 1, y));
  }
  PhotoCells cells{photo.width, photo.height, {}};
  for (const std::array<int, 3>& each : photo.pixels) {
    const bool near = std::any_of(rim.begin(), rim.end(), [&](const std::array<int, 3>& other) {
      return std::abs(each[0] - other[0]) + std::abs(each[1] - other[1]) +
                 std::abs(each[2] - other[2]) <
             kOffTable;
    });
    cells.cells.push_back(near ? kLikeTable : kThing);
  }
  return cells;
}

/// The cells of one value that hang together with `start`; they become `mark`.
std::vector<int> part_from(int start, PhotoCells& cells, std::uint8_t value, std::uint8_t mark) {
  std::vector<int> part;
  std::vector<int> open{start};
  while (!open.empty()) {
    const int at = open.back();
    open.pop_back();
    std::uint8_t& cell = cells.cells[static_cast<std::size_t>(at)];
    if (cell != value) continue;
    cell = mark;
    part.push_back(at);
    const int x = at % cells.width;
    if (x > 0) open.push_back(at - 1);
    if (x + 1 < cells.width) open.push_back(at + 1);
    if (at >= cells.width) open.push_back(at - cells.width);
    if (at + cells.width < cells.width * cells.height) open.push_back(at + cells.width);
  }
  return part;
}

/// The largest thing on the table, with what of it has the table's colour.
std::vector<int> largest_thing(PhotoCells cells) {
  const int count = cells.width * cells.height;
  for (int i = 0; i < count; ++i) {
    const int x = i % cells.width;
    const int y = i / cells.width;
    if (x == 0 || y == 0 || x + 1 == cells.width || y + 1 == cells.height) {
      part_from(i, cells, kLikeTable, kTable);
    }
  }
  for (std::uint8_t& cell : cells.cells) cell = cell == kTable ? kTable : kThing;
  std::vector<int> best;
  for (int i = 0; i < count; ++i) {
    std::vector<int> part = part_from(i, cells, kThing, kSeen);
    if (part.size() > best.size()) best = std::move(part);
  }
  return best;
}

/// The border pixels of a part, as points.
std::vector<glm::dvec2> rim_of(const std::vector<int>& part, const PhotoCells& cells) {
  std::vector<bool> inside(cells.cells.size());
  for (const int at : part) inside[static_cast<std::size_t>(at)] = true;
  const auto is_inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < cells.width && y < cells.height &&
           inside[static_cast<std::size_t>(y * cells.width + x)];
  };
  std::vector<glm::dvec2> rim;
  for (const int at : part) {
    const int x = at % cells.width;
    const int y = at / cells.width;
    if (is_inside(x - 1, y) && is_inside(x + 1, y) && is_inside(x, y - 1) && is_inside(x, y + 1)) {
      continue;
    }
    rim.emplace_back(x, y);
  }
  return rim;
}

double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// normal * point = distance.
struct RimLine {
  glm::dvec2 normal{};
  double distance = 0;
};

/// The line through the rim along a side: least squares of the distances.
RimLine line_along(const glm::dvec2& from, const glm::dvec2& to,
                   const std::vector<glm::dvec2>& rim) {
  const double length = glm::distance(from, to);
  const glm::dvec2 way = (to - from) / length;
  std::vector<glm::dvec2> near;
  for (const glm::dvec2& point : rim) {
    const double along = glm::dot(point - from, way) / length;
    if (along > 0.1 && along < 0.9 && std::abs(cross(point - from, way)) < kNearSide * length) {
      near.push_back(point);
    }
  }
  const glm::dvec2 mean =
      std::accumulate(near.begin(), near.end(), glm::dvec2(0.0)) / static_cast<double>(near.size());
  double xx = 0;
  double xy = 0;
  double yy = 0;
  for (const glm::dvec2& point : near) {
    const glm::dvec2 off = point - mean;
    xx += off.x * off.x;
    xy += off.x * off.y;
    yy += off.y * off.y;
  }
  // Across the axis of the greater of the matrix' two values.
  const double half = (xx - yy) / 2;
  const double root = std::sqrt(half * half + xy * xy);
  const glm::dvec2 axis = half > 0 ? glm::dvec2(half + root, xy) : glm::dvec2(xy, root - half);
  const glm::dvec2 normal = glm::normalize(glm::dvec2(-axis.y, axis.x));
  return {normal, glm::dot(normal, mean)};
}

glm::dvec2 crossing(const RimLine& a, const RimLine& b) {
  const double determinant = cross(a.normal, b.normal);
  return glm::dvec2(a.distance * b.normal.y - a.normal.y * b.distance,
                    a.normal.x * b.distance - a.distance * b.normal.x) /
         determinant;
}

double area_of(const PhotoCorners& corners) {
  double area = 0;
  for (std::size_t i = 0; i < 4; ++i) area += 0.5 * cross(corners[i], corners[(i + 1) % 4]);
  return std::abs(area);
}

/// Clockwise, without an inner angle of half a turn and more: what a flat rectangle looks like.
bool is_convex(const PhotoCorners& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 side = corners[(i + 1) % 4] - corners[i];
    const glm::dvec2 next = corners[(i + 2) % 4] - corners[(i + 1) % 4];
    if (!(cross(side, next) > 1)) return false;  // so are corners that are no numbers
  }
  return true;
}

/// From the unit square to a quadrangle: P. Heckbert, 1989.
class SquareTo {
 public:
  explicit SquareTo(const PhotoCorners& corners) : corners_(corners) {
    const glm::dvec2 a = corners[1] - corners[2];
    const glm::dvec2 b = corners[3] - corners[2];
    const glm::dvec2 s = corners[0] - corners[1] + corners[2] - corners[3];
    g_ = cross(s, b) / cross(a, b);
    h_ = cross(a, s) / cross(a, b);
  }
  [[nodiscard]] glm::dvec2 at(double u, double v) const {
    const glm::dvec2 across = corners_[1] - corners_[0] + g_ * corners_[1];
    const glm::dvec2 down = corners_[3] - corners_[0] + h_ * corners_[3];
    return (across * u + down * v + corners_[0]) / (g_ * u + h_ * v + 1.0);
  }

 private:
  PhotoCorners corners_;
  double g_ = 0;
  double h_ = 0;
};

/// Luma between four pixels, by the weights of BT.601.
double luma_at(const Photo& photo, const glm::dvec2& place) {
  const glm::dvec2 at = place - 0.5;
  const int x = std::clamp(static_cast<int>(std::floor(at.x)), 0, photo.width - 2);
  const int y = std::clamp(static_cast<int>(std::floor(at.y)), 0, photo.height - 2);
  const double across = std::clamp(at.x - x, 0.0, 1.0);
  const double down = std::clamp(at.y - y, 0.0, 1.0);
  const auto luma = [&](int column, int row) {
    const std::uint8_t* rgb = photo.rgba + row * photo.stride + 4 * std::ptrdiff_t{column};
    return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
  };
  return (luma(x, y) * (1 - across) + luma(x + 1, y) * across) * (1 - down) +
         (luma(x, y + 1) * (1 - across) + luma(x + 1, y + 1) * across) * down;
}

}  // namespace

std::optional<PhotoCorners> photo_corners(const Photo& photo) {
  if (photo.rgba == nullptr || photo.width < 2 || photo.height < 2) return std::nullopt;
  const SmallPhoto small = small_copy(photo);
  const PhotoCells cells = off_table(small);
  const std::vector<int> part = largest_thing(cells);
  if (static_cast<double>(part.size()) < kLeastThing * small.width * small.height) {
    return std::nullopt;
  }
  const std::vector<glm::dvec2> rim = rim_of(part, cells);
  const auto most = [&](double x, double y) {
    return *std::max_element(rim.begin(), rim.end(), [&](const glm::dvec2& a, const glm::dvec2& b) {
      return glm::dot(a, glm::dvec2(x, y)) < glm::dot(b, glm::dvec2(x, y));
    });
  };
  const PhotoCorners rough{most(-1, -1), most(1, -1), most(1, 1), most(-1, 1)};
  std::array<RimLine, 4> lines;
  for (std::size_t i = 0; i < 4; ++i) lines[i] = line_along(rough[i], rough[(i + 1) % 4], rim);
  PhotoCorners corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = crossing(lines[(i + 3) % 4], lines[i]);
  const double filled = static_cast<double>(part.size()) / area_of(corners);
  if (!is_convex(corners) || std::abs(filled - 1) >= kUnlike) return std::nullopt;
  for (glm::dvec2& corner : corners) corner = (corner + 0.5) / small.scale;
  return corners;
}

std::optional<GrayPicture> photo_flat(const Photo& photo, const PhotoCorners& corners) {
  if (photo.rgba == nullptr || photo.width < 2 || photo.height < 2 || !is_convex(corners)) {
    return std::nullopt;
  }
  const auto side = [&](std::size_t i, std::size_t k) {
    return glm::distance(corners[i], corners[k]);
  };
  const double wide = (side(0, 1) + side(3, 2)) / 2;
  const double high = (side(0, 3) + side(1, 2)) / 2;
  const double scale = std::min(1.0, kFlatSide / std::max(wide, high));
  GrayPicture flat;
  flat.width = std::max(1, static_cast<int>(std::lround(wide * scale)));
  flat.height = std::max(1, static_cast<int>(std::lround(high * scale)));
  flat.pixels.reserve(static_cast<std::size_t>(flat.width) * static_cast<std::size_t>(flat.height));
  const SquareTo place(corners);
  for (int y = 0; y < flat.height; ++y) {
    for (int x = 0; x < flat.width; ++x) {
      double sum = 0;  // the mean of four places
      for (const double down : {0.25, 0.75}) {
        for (const double across : {0.25, 0.75}) {
          sum += luma_at(photo, place.at((x + across) / flat.width, (y + down) / flat.height));
        }
      }
      flat.pixels.push_back(static_cast<std::uint8_t>(std::lround(sum / 4)));
    }
  }
  return flat;
}

}  // namespace modar
