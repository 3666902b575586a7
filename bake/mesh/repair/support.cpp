#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <numbers>
#include <optional>

#include "bake/mesh/repair/triangles.hpp"

namespace modar::repair {
namespace {

/// Directions that are tried as the support's normal, 9 degrees apart.
constexpr std::size_t kDirections = 512;
/// Triangles that find the plane at most. Fewer are quicker, more find smaller supports.
constexpr std::size_t kSampled = 20000;
/// Planes that are tried, the largest area first.
constexpr int kTries = 8;
/// Cosine of the angle to the support's normal below which triangles do not find it.
constexpr double kAlong = 0.7;
/// Thickness of the support in root mean squares of its noise. Higher removes low parts.
constexpr double kNoise = 3;
/// The same at least and at most, as a share of the diagonal.
constexpr double kThin = 0.0005, kThick = 0.01;
/// Share of the area that the support has at least, as has the rest.
constexpr double kSupportArea = 0.05;
/// Share of the area that may be behind the support: noise, and what hangs from a table.
constexpr double kBehind = 0.03;
/// Thicknesses above the support that parts reach which are not of it.
constexpr double kClear = 2;
/// Length of the support's own border at least, in its diagonals: closed models have none.
constexpr double kOpen = 1;

struct Plane {
  glm::dvec3 normal;  // to the model
  double offset = 0;
  double thickness = 0;
  [[nodiscard]] double height(const glm::dvec3& p) const { return glm::dot(normal, p) - offset; }
};

struct Sample {
  glm::dvec3 centre, corner, normal;
  double area;
};

std::vector<Sample> sampled(const Faces& surface) {
  std::vector<Sample> samples;
  const std::size_t step = surface.triangles() / kSampled + 1;
  for (std::size_t t = 0; t < surface.triangles(); t += step) {
    const glm::dvec3 vector = surface.area_vector(t);
    const double area = glm::length(vector);
    if (!(area > 0)) continue;
    const glm::dvec3 sum = surface.at(3 * t) + surface.at(3 * t + 1) + surface.at(3 * t + 2);
    samples.push_back({sum / 3.0, surface.at(3 * t), vector / area, area});
  }
  return samples;
}

/// The area that faces each direction of a sphere within 18 degrees.
std::vector<std::pair<double, glm::dvec3>> directions(const std::vector<Sample>& samples) {
  std::vector<std::pair<double, glm::dvec3>> all(kDirections);
  for (std::size_t i = 0; i < kDirections; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / kDirections;
    const double turn = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    all[i] = {0, {r * std::cos(turn), r * std::sin(turn), z}};
    for (const Sample& sample : samples) {
      if (glm::dot(sample.normal, all[i].second) > 0.95) all[i].first += sample.area;
    }
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  return all;
}

/// The lowest offset along a direction at which surfaces that face it have enough area.
std::optional<double> lowest(const std::vector<Sample>& samples, const glm::dvec3& along,
                             double width, double enough) {
  std::vector<std::pair<double, double>> found;  // offset, area
  for (const Sample& sample : samples) {
    if (glm::dot(sample.normal, along) < kAlong) continue;
    found.emplace_back(glm::dot(sample.centre, along), sample.area);
  }
  std::sort(found.begin(), found.end());
  double area = 0;
  for (std::size_t first = 0, i = 0; i < found.size(); ++i) {
    area += found[i].second;
    while (found[first].first < found[i].first - width) area -= found[first++].second;
    if (area >= enough) return (found[first].first + found[i].first) / 2;
  }
  return std::nullopt;
}

/// Samples of a plane's surface, by its thickness.
template <class Visit>
void each_near(const std::vector<Sample>& samples, const Plane& plane, const Visit& visit) {
  for (const Sample& sample : samples) {
    const double height = plane.height(sample.centre);
    if (std::fabs(height) <= plane.thickness && glm::dot(sample.normal, plane.normal) >= kAlong) {
      visit(sample, height);
    }
  }
}

/// Fits the plane to surfaces near it, in rounds of falling thickness. False: there are too few.
bool fit(const std::vector<Sample>& samples, Plane& plane, double diagonal) {
  for (int round = 0; round < 8; ++round) {
    const bool steep = std::fabs(plane.normal.x) < 0.6;
    const glm::dvec3 u =
        glm::normalize(glm::cross(plane.normal, glm::dvec3(steep ? 1 : 0, steep ? 0 : 1, 0)));
    const glm::dvec3 v = glm::cross(plane.normal, u);
    const glm::dvec3 origin = plane.normal * plane.offset;
    glm::dmat3 products(0.0);
    glm::dvec3 heights(0.0);
    each_near(samples, plane, [&](const Sample& sample, double height) {
      const glm::dvec3 from = (sample.centre - origin) / diagonal;
      const glm::dvec3 at(glm::dot(from, u), glm::dot(from, v), 1);
      products += glm::outerProduct(at, at) * sample.area;
      heights += at * (height * sample.area);
    });
    const double area = products[2][2];
    if (!(std::fabs(glm::determinant(products)) > 1e-9 * area * area * area)) return false;
    const glm::dvec3 slope = glm::inverse(products) * heights;
    plane.normal = glm::normalize(plane.normal - (u * slope.x + v * slope.y) / diagonal);
    plane.offset = glm::dot(origin, plane.normal) + slope.z;
    double squares = 0;
    double inside = 0;
    each_near(samples, plane, [&](const Sample& sample, double) {
      const double height = plane.height(sample.corner);
      squares += height * height * sample.area;
      inside += sample.area;
    });
    const double noise = inside > 0 ? std::sqrt(squares / inside) : 0;
    plane.thickness = std::clamp(kNoise * noise, kThin * diagonal,
                                 std::max(kThick * diagonal, plane.thickness / 2));
  }
  return true;
}

/// Marks the triangles to remove with a plane. False: the model is not on it.
bool mark(const Faces& surface, const Plane& plane, std::vector<bool>& gone) {
  Array<double> heights(surface.positions.size());
  for (std::size_t v = 0; v < heights.size(); ++v) heights[v] = plane.height(surface.positions[v]);
  const auto of = [&](std::size_t c) { return heights[surface.corners[c]]; };
  double all = 0, flat = 0, behind = 0;
  PointBox box;
  std::vector<std::uint32_t> rest;  // corners
  gone.assign(surface.triangles(), false);
  for (std::uint32_t c = 0; c < surface.corners.size(); c += 3) {
    const double area = surface.area(c / 3);
    all += area;
    const auto [low, high] = std::minmax({of(c), of(c + 1), of(c + 2)});
    if (high < -plane.thickness) behind += area;
    gone[c / 3] = low >= -plane.thickness && high <= plane.thickness;
    if (!gone[c / 3]) {
      rest.insert(rest.end(), {surface.corners[c], surface.corners[c + 1], surface.corners[c + 2]});
      continue;
    }
    flat += area;
    for (std::uint32_t i = c; i < c + 3; ++i) box.add(surface.at(i));
  }
  double border = 0;
  for (const std::uint32_t h : open_edges(surface, Around(surface))) {
    if (gone[h / 3]) border += glm::distance(surface.at(h), surface.at(next(h)));
  }
  if (flat < kSupportArea * all || behind > kBehind * all || border < kOpen * box.diagonal()) {
    return false;
  }
  Sets parts(heights.size());  // of the rest: those that are not clear of the support go with it
  for (std::size_t i = 0; i < rest.size(); i += 3) {
    parts.join(rest[i], rest[i + 1]);
    parts.join(rest[i], rest[i + 2]);
  }
  Array<std::uint8_t> clear(heights.size(), 0);
  for (const std::uint32_t v : rest) {
    if (heights[v] > kClear * plane.thickness) clear[parts.root(v)] = 1;
  }
  double kept = 0;
  for (std::size_t t = 0; t < gone.size(); ++t) {
    if (!gone[t]) gone[t] = clear[parts.root(surface.corners[3 * t])] == 0;
    if (!gone[t]) kept += surface.area(t);
  }
  return kept >= kSupportArea * all;
}

}  // namespace

std::vector<bool> find_support(const Faces& surface) {
  const std::vector<Sample> samples = sampled(surface);
  PointBox box;
  double area = 0;
  for (const Sample& sample : samples) {
    box.add(sample.centre);
    area += sample.area;
  }
  const double diagonal = box.diagonal();
  std::vector<bool> gone;
  std::vector<glm::dvec3> tried;
  for (const auto& [facing, along] : directions(samples)) {
    const glm::dvec3& one = along;
    if (facing < kSupportArea * area / 2 || tried.size() == kTries) break;
    if (std::any_of(tried.begin(), tried.end(),
                    [&](const glm::dvec3& other) { return glm::dot(one, other) > 0.9; })) {
      continue;
    }
    tried.push_back(one);
    const auto offset = lowest(samples, one, 4 * kThick * diagonal, kSupportArea * area / 2);
    if (!offset) continue;
    Plane plane{one, *offset, 4 * kThick * diagonal};
    if (fit(samples, plane, diagonal) && mark(surface, plane, gone)) return gone;
  }
  return {};
}

}  // namespace modar::repair
