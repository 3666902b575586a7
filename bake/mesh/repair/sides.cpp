// Whether the backs of a surface would be seen: through rims that people look into, or because it
// is inside out, wholly or in parts.
#include <cmath>

#include "bake/mesh/repair/surface.hpp"

namespace modar::repair {
namespace {

/// Share of its part's diagonal that a rim's has at least. Lower: scans with holes cost more.
constexpr double kRimDiagonal = 0.1;
/// Cosine between the viewer and a loop's surface from which it hides its backs, as a base does.
constexpr double kHiding = 0.7;
/// Changes of winding a triangle from which on a part has no outside. Lower: scans cost more.
constexpr double kTurnedShare = 0.02;
/// Share of a material's area that shows backs at least. Lower: debris makes scans cost more.
constexpr double kBacksShare = 0.02;
/// Volume by area to the power of 1.5 below which a surface has no inside; a sphere has 0.094.
constexpr double kHollow = 1e-4;

/// The same below which a surface with a hiding rim shows its backs at its sides, as a basin does.
constexpr double kDeep = 0.05;

/// Of a material or a part.
struct Sides {
  double area = 0;
  double open = 0;      ///< area of parts that are looked into
  double volume = 0;    ///< that closed parts have by their winding
  glm::dvec3 sum{0.0};  ///< of area vectors
};

}  // namespace

std::map<std::uint32_t, Loop> open_loops(const Faces& surface,
                                         std::span<const std::uint32_t> open) {
  Sets sets(surface.positions.size());
  for (const std::uint32_t h : open) sets.join(surface.corners[h], surface.corners[next(h)]);
  std::map<std::uint32_t, Loop> loops;
  for (const std::uint32_t h : open) {
    Loop& loop = loops[sets.root(surface.corners[h])];
    loop.box.add(surface.at(h));
    loop.box.add(surface.at(next(h)));
    loop.area += 0.5 * glm::cross(surface.at(h), surface.at(next(h)));
  }
  return loops;
}

std::vector<bool> seen_backs(const Faces& surface, const Components& components,
                             const std::map<std::uint32_t, Loop>& loops,
                             std::span<const std::uint32_t> turned,
                             std::span<const std::uint32_t> materials, const glm::dvec3& viewer) {
  const auto part_of = [&](std::size_t t) { return components.of(surface.corners[3 * t]); };
  std::vector<Sides> parts(components.count());
  for (std::size_t t = 0; t < materials.size(); ++t) {
    Sides& part = parts[part_of(t)];
    part.area += surface.area(t);
    part.volume += glm::dot(surface.at(3 * t), surface.area_vector(t)) / 3;
    part.sum += surface.area_vector(t);
  }
  std::vector<bool> open(components.count(), false);
  std::vector<bool> grounded(components.count(), false);
  for (const auto& [position, loop] : loops) {
    const std::uint32_t p = components.of(position);
    if (loop.box.diagonal() <= kRimDiagonal * components.at(p).box.diagonal()) continue;
    const bool hides = glm::dot(loop.area, viewer) > kHiding * glm::length(loop.area);
    const Sides& part = parts[p];
    const glm::dvec3 middle = (loop.box.low + loop.box.high) / 2.0;
    const double above = part.volume - glm::dot(middle, part.sum) / 3;
    open[p] = open[p] || !hides || above < -kDeep * part.area * std::sqrt(part.area);
    grounded[p] = true;
  }
  std::vector<double> changes(components.count(), 0.0);
  for (const std::uint32_t h : turned) ++changes[components.of(surface.corners[h])];
  for (std::size_t p = 0; p < open.size(); ++p) {
    const auto triangles = static_cast<double>(components.at(p).triangles);
    if (changes[p] > kTurnedShare * triangles) open[p] = true;
  }
  std::vector<Sides> sides;
  for (std::size_t t = 0; t < materials.size(); ++t) {
    if (sides.size() <= materials[t]) sides.resize(materials[t] + std::size_t{1});
    const std::uint32_t part = part_of(t);
    Sides& own = sides[materials[t]];
    const double area = surface.area(t);
    own.area += area;
    if (open[part]) {
      own.open += area;
    } else if (parts[part].area > 0 && !grounded[part]) {
      own.volume += parts[part].volume * area / parts[part].area;
    }
  }
  std::vector<bool> seen;
  seen.reserve(sides.size());
  for (const Sides& own : sides) {
    seen.push_back(own.open > kBacksShare * own.area ||
                   own.volume < -kHollow * own.area * std::sqrt(own.area));
  }
  return seen;
}

}  // namespace modar::repair
