#include "bake/mesh/repair/surface.hpp"

namespace modar::repair {
namespace {

/// Share of the model's area and triangles that an island has at most. Higher removes claws.
constexpr double kIslandShare = 0.001;
/// Share of the model's diagonal that an island's has at most. Higher removes parts.
constexpr double kIslandDiagonal = 0.02;
/// Triangles below which a closed island is debris. Higher removes rivets.
constexpr std::uint64_t kClosedTriangles = 8;
/// Open edges a triangle that larger debris has at least. Lower removes eyes that are open behind.
constexpr double kRagged = 0.3;
/// Share of the area that a scan's largest part has at least. Lower removes parts of buildings.
constexpr double kMainArea = 0.2;
/// Share of the area above which all islands are kept: they are how the model is built.
constexpr double kIslandsArea = 0.01;
/// Share of its component's diagonal that a hole's diagonal has at most. Higher closes openings.
constexpr double kHoleDiagonal = 0.01;

}  // namespace

SourceFaces::SourceFaces(const TriMesh& mesh) : corners(3 * mesh.triangles.size()) {
  for (std::size_t c = 0; c < corners.size(); ++c) {
    corners[c] = mesh.source_position(mesh.triangles[c / 3][c % 3]);
  }
  if (mesh.source_positions.empty()) {
    positions = std::span(mesh.positions.data(), mesh.positions.size());
    return;
  }
  std::uint32_t count = 0;
  for (const std::uint32_t p : mesh.source_positions) count = std::max(count, p + 1);
  own.assign(count, glm::dvec3(0.0));
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    own[mesh.source_positions[v]] = mesh.positions[v];
  }
  positions = std::span(own.data(), own.size());
}

Around::Around(const Faces& surface)
    : first(surface.positions.size() + 1, 0), corners(surface.corners.size()) {
  for (const std::uint32_t v : surface.corners) ++first[v + std::size_t{1}];
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  Array<std::uint32_t> at(first);
  for (std::uint32_t c = 0; c < surface.corners.size(); ++c) corners[at[surface.corners[c]]++] = c;
}

bool regular(const Faces& surface, std::span<const std::uint32_t> corners) {
  constexpr std::size_t kMost = 16;  // of corners; longer fans take quadratic time
  if (corners.size() < 3 || corners.size() > kMost) return false;
  std::array<std::array<std::uint32_t, 2>, kMost> links;  // positions ahead and behind
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t first = corners[i] / 3 * 3;
    const std::uint32_t at = corners[i] - first;
    links[i] = {surface.corners[first + (at == 2 ? 0 : at + 1)],
                surface.corners[first + (at == 0 ? 2 : at - 1)]};
  }
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    std::size_t found = 0;
    for (std::size_t k = i + 1; k < corners.size(); ++k) {
      if (links[k][0] != links[i][1]) continue;
      if (found != 0) return false;
      found = k;
    }
    if (found == 0) return false;
    std::swap(links[i + 1], links[found]);
  }
  return links[corners.size() - 1][1] == links[0][0];
}

void Fans::read(const Faces& surface, std::span<const std::uint32_t> corners) {
  spokes.clear();
  sets.reset(corners.size());
  count = corners.size();
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t c = corners[i];
    spokes.push_back({surface.corners[next(c)], i, c});
    spokes.push_back({surface.corners[previous(c)], i, previous(c)});
  }
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) {
    return a.neighbour != b.neighbour ? a.neighbour < b.neighbour : a.number < b.number;
  });
  for (std::size_t i = 1; i < spokes.size(); ++i) {
    if (spokes[i].neighbour != spokes[i - 1].neighbour ||
        sets.root(spokes[i].number) == sets.root(spokes[i - 1].number)) {
      continue;
    }
    sets.join(spokes[i].number, spokes[i - 1].number);
    --count;
  }
}

Components::Components(const Faces& surface, std::span<const std::uint32_t> open)
    : surface_(surface), part_(surface.positions.size(), kNone) {
  Sets sets(part_.size());
  for (std::size_t c = 0; c < surface.corners.size(); c += 3) {
    sets.join(surface.corners[c], surface.corners[c + 1]);
    sets.join(surface.corners[c], surface.corners[c + 2]);
  }
  for (std::size_t c = 0; c < surface.corners.size(); ++c) {
    const std::uint32_t v = surface.corners[c];
    if (part_[v] == kNone) add(v, sets.root(v));
    if (c % 3 == 0) ++parts_[part_[v]].triangles;
  }
  for (const std::uint32_t h : open) ++parts_[part_[surface.corners[h]]].open;
}

void Components::add(std::uint32_t position, std::uint32_t root) {
  if (part_[root] == kNone) {
    part_[root] = static_cast<std::uint32_t>(parts_.size());
    parts_.emplace_back();
    parts_.back().box.add(surface_.positions[root]);
  }
  part_[position] = part_[root];
  parts_[part_[root]].box.add(surface_.positions[position]);
}

std::vector<bool> Components::islands(bool& many) {
  const auto triangles = static_cast<double>(surface_.triangles());
  PointBox box;
  std::vector<bool> debris;
  for (const Part& each : parts_) {
    const auto own = static_cast<double>(each.triangles);
    const bool ragged = static_cast<double>(each.open) >= kRagged * own;
    debris.push_back(own < kIslandShare * triangles &&
                     (ragged || each.triangles < kClosedTriangles));
    box.add(each.box.low);
    box.add(each.box.high);
  }
  many = false;
  if (std::find(debris.begin(), debris.end(), true) == debris.end()) return debris;
  double area = 0;
  double main = 0;
  for (std::size_t t = 0; t < surface_.triangles(); ++t) {
    parts_[part_[surface_.corners[3 * t]]].area += surface_.area(t);
  }
  for (const Part& each : parts_) {
    area += each.area;
    main = std::max(main, each.area);
  }
  double sum = 0;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    debris[p] = debris[p] && main >= kMainArea * area && parts_[p].area < kIslandShare * area &&
                parts_[p].box.diagonal() < kIslandDiagonal * box.diagonal();
    if (debris[p]) sum += parts_[p].area;
  }
  many = sum > kIslandsArea * area;
  if (many) debris.assign(parts_.size(), false);
  return debris;
}

bool small_hole(const PointBox& loop, const PointBox& part) {
  return loop.diagonal() <= kHoleDiagonal * part.diagonal();
}

}  // namespace modar::repair
