// Rays of one direction, met triangle by triangle.
#include "bake/mesh/rays/parallel_rays.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Cells of the grid for each point. Both 0.5 and 2 are slower.
constexpr float kCellsAPoint = 1.0f;
constexpr float kMostRows = 2047;  // more of a side are no faster
constexpr float kOutside = 1e9f;
constexpr float kRowSlack = 1e-2f;  // cells; more than places in single precision are off by
/// Triangles over at most this many rows are not clipped to each. Lower clips more often. [3, 16]
constexpr std::uint32_t kFewRows = 6;
constexpr float kLeastWidth = 1e-3f;  // of a grid, as points in a line have none
/// Groups of points and rows of cells that triangles are tried with in one direction, for each
/// triangle and point. Models need up to 66.
constexpr std::size_t kMostTried = 100;

}  // namespace

ParallelRays::ParallelRays(std::span<const glm::vec3> origins, std::span<const glm::vec3> normals,
                           std::span<const glm::vec3> positions,
                           std::span<const Triangle> triangles)
    : origins_(origins), normals_(normals), positions_(positions), triangles_(triangles) {
  places_.resize(positions.size());
  origin_places_.resize(origins.size());
  cells_.resize(origins.size());
  points_.resize(origins.size());
  cosines_.resize(origins.size());
  groups_.resize(origins.size() / 4 + 1);
}

ParallelRays::Place ParallelRays::Frame::of(const glm::vec3& point) const {
  return {glm::dot(point, across), glm::dot(point, along), glm::dot(point, axis)};
}

std::uint32_t ParallelRays::column(float x) const {
  return static_cast<std::uint32_t>(std::clamp(x, 0.0f, last_column_));
}

std::uint32_t ParallelRays::row(float y) const {
  return static_cast<std::uint32_t>(std::clamp(y, 0.0f, last_row_));
}

/// Lays a grid over the points, scales the frame to its cells, and answers where it begins.
ParallelRays::Place ParallelRays::lay_grid(Frame& frame) {
  Place low = {kOutside, kOutside, 0};
  Place high = {-kOutside, -kOutside, 0};
  for (const glm::vec3& origin : origins_) {
    const float x = glm::dot(origin, frame.across);
    const float y = glm::dot(origin, frame.along);
    low = {std::min(low.x, x), std::min(low.y, y), 0};
    high = {std::max(high.x, x), std::max(high.y, y), 0};
  }
  const float width = std::max(high.x - low.x, kLeastWidth);
  const float height = std::max(high.y - low.y, kLeastWidth);
  const float cells = kCellsAPoint * static_cast<float>(origins_.size());
  const float scale = std::sqrt(cells / (width * height));
  last_column_ = std::floor(std::min(width * scale, kMostRows));
  last_row_ = std::floor(std::min(height * scale, kMostRows));
  columns_ = static_cast<std::uint32_t>(last_column_) + 1;
  starts_.assign(std::size_t{columns_} * (static_cast<std::uint32_t>(last_row_) + 1) + 1, 0);
  frame.across *= scale;
  frame.along *= scale;
  return {low.x * scale, low.y * scale, 0};
}

void ParallelRays::sort_points(const Frame& frame, const Place& low, float to) {
  for (std::size_t i = 0; i < origins_.size(); ++i) {
    const Place place = frame.of(origins_[i]);
    origin_places_[i] = {place.x - low.x, place.y - low.y, place.depth};
    cells_[i] = row(origin_places_[i].y) * columns_ + column(origin_places_[i].x);
    ++starts_[cells_[i] + 1];
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  for (std::size_t i = 0; i < origins_.size(); ++i) {
    const Place& place = origin_places_[i];
    const float cosine = glm::dot(normals_[i], frame.axis);
    const std::uint32_t at = starts_[cells_[i]]++;
    points_[at] = static_cast<std::uint32_t>(i);
    const float sign = cosine < 0 ? -1.0f : 1.0f;
    cosines_[at] = std::fabs(cosine);
    Group& group = groups_[at / 4];
    group.x[at % 4] = place.x;
    group.y[at % 4] = place.y;
    group.sign[at % 4] = sign;
    group.depth[at % 4] = place.depth * sign;
    group.distance[at % 4] = to;
  }
  // Each start has moved to the next cell's.
  std::copy_backward(starts_.begin(), starts_.end() - 1, starts_.end());
  starts_[0] = 0;
}

/// The triangle's functions of the place; false: it is seen from its edge.
bool ParallelRays::Facet::prepare(const Corners& corners) {
  const auto& [p, q, r] = corners;
  const float qx = q.x - p.x;
  const float qy = q.y - p.y;
  const float rx = r.x - p.x;
  const float ry = r.y - p.y;
  const float area = qx * ry - qy * rx;
  if (area == 0) return false;
  const float scale = 1 / area;
  const auto splat = [](float value) { return Four{value, value, value, value}; };
  const float q_rise = q.depth - p.depth;
  const float r_rise = r.depth - p.depth;
  x = splat(p.x);
  y = splat(p.y);
  depth = splat(p.depth);
  b_x = splat(ry * scale);
  b_y = splat(-rx * scale);
  c_x = splat(-qy * scale);
  c_y = splat(qx * scale);
  depth_x = splat(ry * scale * q_rise - qy * scale * r_rise);
  depth_y = splat(qx * scale * r_rise - rx * scale * q_rise);
  return true;
}

/// Tries the points of a row's cells from `left` to `right`.
inline void ParallelRays::meet_row(const Facet& facet, std::uint32_t row, std::uint32_t left,
                                   std::uint32_t right, Four from) {
  const std::uint32_t* starts = &starts_[std::size_t{row} * columns_];
  Group* const groups = groups_.data();
  // Those of a group before or behind the row's are tried in vain.
  Group* const end = groups + (starts[right + 1] + 3) / 4;
  tried_ += 1 + (starts[right + 1] - starts[left]) / 4;
  for (Group* group = groups + starts[left] / 4; group < end; ++group) {
    const Four x = group->x - facet.x;
    const Four y = group->y - facet.y;
    const Four b = facet.b_x * x + facet.b_y * y;
    const Four c = facet.c_x * x + facet.c_y * y;
    const Four depth = facet.depth_x * x + facet.depth_y * y + facet.depth;
    const Four distance = group->sign * depth - group->depth;
    const auto met = (b >= 0.0f) & (c >= 0.0f) & (b + c <= 1.0f) & (distance >= from) &
                     (distance < group->distance);
    group->distance = met ? distance : group->distance;
  }
}

/// The extent of a triangle within a row of the grid, from left to right; nowhere: the wrong way
/// round.
std::pair<float, float> ParallelRays::extent_in_row(const Corners& corners,
                                                    std::uint32_t row) const {
  const float floor = row == 0 ? -kOutside : static_cast<float>(row);
  const float roof = static_cast<float>(row) == last_row_ ? kOutside : static_cast<float>(row + 1);
  float left = kOutside;
  float right = -kOutside;
  for (std::size_t i = 0; i < 3; ++i) {
    const Place& a = corners[i];
    const Place& b = corners[(i + 1) % 3];
    if (std::max(a.y, b.y) < floor || std::min(a.y, b.y) > roof) continue;
    const float slope = a.y == b.y ? 0 : (b.x - a.x) / (b.y - a.y);
    for (const float end : {a.y, b.y}) {
      const float y = std::clamp(end, floor, roof);
      const float x = y == b.y ? b.x : a.x + slope * (y - a.y);
      left = std::min(left, x);
      right = std::max(right, x);
    }
  }
  return {left - kRowSlack, right + kRowSlack};
}

void ParallelRays::meet(const Corners& corners, float from) {
  const auto& [p, q, r] = corners;
  const std::uint32_t left = column(std::min(std::min(p.x, q.x), r.x));
  const std::uint32_t right = column(std::max(std::max(p.x, q.x), r.x));
  const std::uint32_t first = row(std::min(std::min(p.y, q.y), r.y));
  const std::uint32_t last = row(std::max(std::max(p.y, q.y), r.y));
  Facet facet;
  if (!facet.prepare(corners)) return;
  const Four least = {from, from, from, from};
  if (last - first < kFewRows) {
    for (std::uint32_t at = first; at <= last; ++at) meet_row(facet, at, left, right, least);
    return;
  }
  for (std::uint32_t at = first; at <= last; ++at) {
    const auto [begin, end] = extent_in_row(corners, at);
    if (begin <= end) meet_row(facet, at, column(begin), column(end), least);
  }
}

bool ParallelRays::cast(const glm::vec3& axis, const Lengths& lengths) {
  const glm::vec3 other = std::fabs(axis.x) < 0.6f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  Frame frame;
  frame.axis = axis;
  frame.across = glm::normalize(glm::cross(other, axis));
  frame.along = glm::cross(axis, frame.across);
  const Place low = lay_grid(frame);
  sort_points(frame, low, lengths.to);
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    const Place place = frame.of(positions_[i]);
    places_[i] = {place.x - low.x, place.y - low.y, place.depth};
  }
  tried_ = 0;
  const std::size_t most = kMostTried * (triangles_.size() + origins_.size());
  for (const Triangle& t : triangles_) {
    meet({places_[t[0]], places_[t[1]], places_[t[2]]}, lengths.from);
    if (tried_ > most) return false;
  }
  return true;
}

}  // namespace modar
