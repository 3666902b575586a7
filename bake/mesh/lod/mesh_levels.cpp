// Decimates chunk by chunk, on several threads, shares the triangles out, and measures the error.
#include "bake/mesh/lod/mesh_levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/chunk_decimate.hpp"
#include "bake/mesh/lod/collapse_bound.hpp"
#include "bake/mesh/lod/level_map.hpp"
#include "bake/mesh/lod/pixel_cells.hpp"
#include "bake/mesh/lod/surface_distance.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

/// Chunks of fewer triangles get no coarser level. Lower adds levels that save no draw call. [12,
/// 48]
constexpr std::size_t kFewTriangles = 24;
/// A level that keeps more of the previous one's triangles is not worth its bytes. Swept on scans:
/// flat from 0.6 to 0.95.
constexpr double kWorthwhile = 0.8;
/// Share of the chunk's diagonal that a collapse may move the surface. Higher makes levels that no
/// distance draws.
constexpr double kMaxCollapse = 0.25;
/// Share of the chunk's diagonal that the texture may shift at removed vertices. Higher gives
/// coarser levels with visible shifts. [0.005, 0.02] tuned: lod
constexpr double kMaxSlide = 0.01;
/// Largest ratio of error between the last two levels when borders block further halving. Lower
/// drops useful last levels, higher keeps bad ones. [4, 16] tuned: lod
constexpr float kMaxErrorRatio = 8;
/// A price (see CollapseSequence) below what half floats tell apart.
constexpr float kLeastPrice = static_cast<float>(kDistanceFloor * kDistanceFloor);
/// Share of its part of the cut at which a chunk's decimation ends. Lower moves triangles from flat
/// chunks to detailed ones, higher bakes faster.
constexpr double kLeastShare = 0.75;
/// Share of the next level's error above which a level is left out. Lower stores fewer levels,
/// higher stores levels that are rarely drawn.
constexpr double kAlike = 0.9;
/// Share of the chunk's diagonal up to which distances need no exact measure. Higher bakes faster
/// and uses proxies of noisy chunks less. [0.01, 0.05]
constexpr double kLoosest = 0.03;
/// Where collapses leave more than one in this many triangles open, a map of the whole is faster.
constexpr std::size_t kMostOpen = 8;
/// Normals at one place that a corner chooses from: bounds the time where more are. Any number that
/// models do not reach.
constexpr int kMostNormals = 256;
/// What a phone without ES 3 draws of one model in a frame, less some draw calls (see the
/// renderer's kFewTriangles).
constexpr std::size_t kPhoneTriangles = 98'000;
constexpr std::size_t kChunksPerUpdate = 8;  ///< chunks between two updates of the progress bar

/// Vertices that differ in their normals only, as one: flat-shaded models have one for every corner
/// of a triangle, and nothing would be inside a surface. Empty where the chunk is not like that.
struct MergedVertices {
  std::vector<std::uint16_t> first;    ///< of each vertex: the one that represents it
  std::vector<std::uint16_t> next;     ///< of each vertex: another one of the same, kNoTwin: none
  std::vector<std::uint16_t> indices;  ///< the chunk's, by those that represent others

  [[nodiscard]] bool stands(std::size_t vertex) const {
    return first.empty() || first[vertex] == vertex;
  }
  [[nodiscard]] std::span<const std::uint16_t> indices_of(const Chunk& chunk) const {
    return first.empty() ? std::span<const std::uint16_t>(chunk.indices) : indices;
  }
};

MergedVertices merge_vertices(const TriMesh& mesh, const Chunk& chunk) {
  // Smooth surfaces have about two triangles a vertex.
  if (chunk.vertices.size() <= chunk.indices.size() / 3) return {};
  const auto key = [&](std::uint16_t i) {
    const std::uint32_t v = chunk.vertices[i];
    const glm::dvec3& p = mesh.positions[v];
    const glm::dvec2 uv = mesh.uvs.empty() ? glm::dvec2(0.0) : mesh.uvs[v];
    const glm::u8vec4 c = mesh.colours.empty() ? glm::u8vec4(0) : mesh.colours[v];
    return std::tuple(p.x, p.y, p.z, uv.x, uv.y, c.r, c.g, c.b, c.a);
  };
  std::vector<std::uint16_t> order(chunk.vertices.size());
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  std::sort(order.begin(), order.end(), [&](std::uint16_t a, std::uint16_t b) {
    return std::tuple(key(a), a) < std::tuple(key(b), b);
  });
  MergedVertices merged;
  merged.first.resize(order.size());
  merged.next.assign(order.size(), kNoTwin);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    merged.first[order[i]] = same ? merged.first[order[i - 1]] : order[i];
    if (same) merged.next[order[i - 1]] = order[i];
  }
  for (const std::uint16_t i : chunk.indices) merged.indices.push_back(merged.first[i]);
  return merged;
}

/// Gives the corners of triangles that represent several vertices the one whose normal is nearest
/// to the triangle's.
void split_normals(const TriMesh& mesh, const Chunk& chunk, const MergedVertices& merged,
                   std::span<const glm::dvec3> positions, std::vector<std::uint16_t>& indices) {
  if (merged.first.empty() || mesh.normals.empty()) return;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const glm::dvec3& origin = positions[indices[i]];
    const glm::dvec3 normal =
        glm::cross(positions[indices[i + 1]] - origin, positions[indices[i + 2]] - origin);
    for (std::size_t k = i; k < i + 3; ++k) {
      double best = -std::numeric_limits<double>::max();
      std::uint16_t v = indices[k];
      for (int tried = 0; v != kNoTwin && tried < kMostNormals; v = merged.next[v], ++tried) {
        const double cosine = glm::dot(normal, glm::dvec3(mesh.normals[chunk.vertices[v]]));
        if (cosine <= best) continue;
        best = cosine;
        indices[k] = v;
      }
    }
  }
}

/// The vertices of a chunk that share their place with others. A rim of the model is free.
struct SharedVertices {
  /// 1: must stay, so that the chunk meets its neighbours at any level.
  std::vector<std::uint8_t> locked;
  /// The vertex across a seam inside the chunk, see ChunkVertices; empty if none.
  std::vector<std::uint16_t> twins;
};

/// A vertex at an edge of one triangle.
struct OpenVertex {
  glm::dvec3 position;
  std::uint32_t chunk = 0;
  std::uint32_t vertex = 0;
};

/// Adds the vertices of a chunk whose triangles form no closed fans. Around a closed fan every
/// neighbour follows the vertex in one triangle and precedes it in another: numbers cancel.
void find_open_vertices(const TriMesh& mesh, const Chunk& chunk, const MergedVertices& merged,
                        std::uint32_t number, std::vector<OpenVertex>& open) {
  std::vector<std::int64_t> sums(chunk.vertices.size(), 0);
  const std::span<const std::uint16_t> indices = merged.indices_of(chunk);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const std::uint16_t* t = &indices[i];
    for (std::size_t k = 0; k < 3; ++k) {
      sums[t[k]] += std::int64_t{t[(k + 1) % 3]} - std::int64_t{t[(k + 2) % 3]};
    }
  }
  for (std::uint32_t v = 0; v < sums.size(); ++v) {
    if (sums[v] != 0) open.push_back({mesh.positions[chunk.vertices[v]], number, v});
  }
}

/// Vertices of equal place: two of one chunk at open edges are twins, all others stay.
void share_place(std::span<const OpenVertex> place, bool nowhere_else,
                 std::vector<SharedVertices>& shared) {
  const auto chunk = place[0].chunk;
  if (place.size() == 2 && place[1].chunk == chunk && nowhere_else) {
    SharedVertices& mine = shared[chunk];
    if (mine.twins.empty()) mine.twins.assign(mine.locked.size(), kNoTwin);
    mine.twins[place[0].vertex] = static_cast<std::uint16_t>(place[1].vertex);
    mine.twins[place[1].vertex] = static_cast<std::uint16_t>(place[0].vertex);
    for (const OpenVertex& v : place) mine.locked[v.vertex] = 0;
    return;
  }
  for (const OpenVertex& v : place) shared[v.chunk].locked[v.vertex] = 1;
}

std::vector<SharedVertices> find_shared(const ChunkedMesh& mesh,
                                        const std::vector<MergedVertices>& merged) {
  // By the file's numbers, and for files that write a position twice, by place where edges are
  // open.
  Array<std::uint8_t> uses(mesh.mesh.source_vertex_count + mesh.mesh.cut_vertices, 0);
  std::vector<OpenVertex> open;
  for (std::uint32_t c = 0; c < mesh.chunks.size(); ++c) {
    for (std::size_t i = 0; i < mesh.chunks[c].vertices.size(); ++i) {
      if (!merged[c].stands(i)) continue;
      std::uint8_t& count = uses[mesh.mesh.source_position(mesh.chunks[c].vertices[i])];
      count = static_cast<std::uint8_t>(std::min(count + 1, 3));
    }
    find_open_vertices(mesh.mesh, mesh.chunks[c], merged[c], c, open);
  }
  std::vector<SharedVertices> shared(mesh.chunks.size());
  for (std::size_t c = 0; c < mesh.chunks.size(); ++c) {
    for (const std::uint32_t v : mesh.chunks[c].vertices) {
      shared[c].locked.push_back(uses[mesh.mesh.source_position(v)] > 1 ? 1 : 0);
    }
  }
  const auto key = [](const OpenVertex& v) {
    return std::tuple(v.position.x, v.position.y, v.position.z);
  };
  std::sort(open.begin(), open.end(),
            [&](const OpenVertex& a, const OpenVertex& b) { return key(a) < key(b); });
  const auto source = [&](const OpenVertex& v) {
    return mesh.mesh.source_position(mesh.chunks[v.chunk].vertices[v.vertex]);
  };
  for (std::size_t i = 0; i < open.size();) {
    std::size_t end = i + 1;
    while (end < open.size() && open[end].position == open[i].position) ++end;
    const std::span<const OpenVertex> place(&open[i], end - i);
    i = end;
    if (place.size() < 2) continue;
    const bool once = source(place[0]) != source(place[1]);
    const int expected = once ? 1 : 2;
    share_place(place, uses[source(place[0])] == expected && uses[source(place[1])] == expected,
                shared);
  }
  return shared;
}

double diagonal_of(std::span<const glm::dvec3> positions) {
  glm::dvec3 low = positions[0];
  glm::dvec3 high = low;
  for (const glm::dvec3& p : positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return glm::length(high - low);
}

/// uvs in texels, and how far they may be off. Empty where no texture shows it.
std::vector<glm::dvec2> texels_of(const TriMesh& mesh, const Chunk& chunk,
                                  std::span<const glm::dvec3> positions,
                                  std::span<const std::uint32_t> sides, DecimateLimits& limits) {
  if (mesh.uvs.empty() || chunk.material >= sides.size() || sides[chunk.material] == 0) return {};
  const Array<glm::dvec2>& uvs = mesh.picture_uvs.empty() ? mesh.uvs : mesh.picture_uvs;
  std::vector<glm::dvec2> texels;
  for (const std::uint32_t v : chunk.vertices) {
    texels.push_back(uvs[v] * static_cast<double>(sides[chunk.material]));
  }
  double area = 0;
  double texel_area = 0;
  for (std::size_t i = 0; i < chunk.indices.size(); i += 3) {
    const std::uint16_t* t = &chunk.indices[i];
    area += glm::length(
        glm::cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]));
    const glm::dvec2 ab = texels[t[1]] - texels[t[0]];
    const glm::dvec2 ac = texels[t[2]] - texels[t[0]];
    texel_area += std::abs(ab.x * ac.y - ab.y * ac.x);
  }
  // One colour everywhere: nothing can slide.
  if (!(texel_area > 0)) return {};
  limits.length_of_uv = std::sqrt(area / texel_area);
  limits.max_uv_shift = kMaxSlide * diagonal_of(positions) / limits.length_of_uv;
  return texels;
}

std::vector<glm::dvec3> decoded_positions(const TriMesh& mesh, const Chunk& chunk,
                                          PositionKind kind, const ChunkGrid& grid) {
  std::vector<glm::dvec3> positions;
  positions.reserve(chunk.vertices.size());
  for (const std::uint32_t v : chunk.vertices) {
    positions.push_back(decoded_position(mesh.positions[v], kind, grid));
  }
  return positions;
}

CollapseSequence decimate(const TriMesh& mesh, const Chunk& chunk, const MergedVertices& merged,
                          const ChunkGrid& grid, const SharedVertices& shared, PositionKind kind,
                          std::span<const std::uint32_t> sides, double share) {
  const std::size_t triangles = chunk.indices.size() / 3;
  if (triangles < 2 * kFewTriangles) return {};
  const std::vector<glm::dvec3> positions = decoded_positions(mesh, chunk, kind, grid);
  DecimateLimits limits;
  limits.max_error = kMaxCollapse * diagonal_of(positions);
  limits.least_triangles =
      std::max(kFewTriangles,
               static_cast<std::size_t>(kLeastShare * share * static_cast<double>(triangles)));
  const std::vector<glm::dvec2> texels = texels_of(mesh, chunk, positions, sides, limits);
  return decimate_chunk({positions, texels, shared.twins}, merged.indices_of(chunk), shared.locked,
                        limits);
}

/// Where the sequences of all chunks are cut: all collapses below a price, and a share of those at
/// it.
struct Cut {
  float price = 0;
  double share = 0;
  std::uint32_t halvings = 0;  ///< of the model's triangles, at the level that this makes
};

/// Collapses of one chunk ahead of the cut.
std::size_t collapses_at(const CollapseSequence& sequence, const Cut& cut) {
  const auto [begin, end] =
      std::equal_range(sequence.prices.begin(), sequence.prices.end(), cut.price);
  const auto at_price = static_cast<double>(end - begin);
  const std::size_t count = static_cast<std::size_t>(begin - sequence.prices.begin()) +
                            static_cast<std::size_t>(cut.share * at_price);
  // Both sides of a seam go together.
  return count > 0 && sequence.paired[count - 1] != 0 ? count - 1 : count;
}

/// Triangles of a chunk that has `all` after some collapses.
std::size_t triangles_after(const CollapseSequence& sequence, std::size_t all,
                            std::size_t collapses) {
  return collapses == 0 ? all : sequence.triangles[collapses - 1];
}

/// The cut that leaves the model `target` triangles or a few less: one for all chunks, so that
/// triangles are where they matter. Nothing if that number cannot be reached.
std::optional<Cut> cut_for(const ChunkedMesh& mesh, const std::vector<CollapseSequence>& sequences,
                           std::size_t target) {
  const auto fits = [&](const Cut& cut) {
    std::size_t count = 0;
    for (std::size_t c = 0; c < sequences.size(); ++c) {
      count += triangles_after(sequences[c], mesh.chunks[c].indices.size() / 3,
                               collapses_at(sequences[c], cut));
    }
    return count <= target;
  };
  constexpr float kMost = std::numeric_limits<float>::max();
  if (!fits({kMost, 1.0})) return std::nullopt;
  // Floats of one sign are in the order of their bits.
  std::uint32_t low = 0;
  std::uint32_t high = __builtin_bit_cast(std::uint32_t, kMost);
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (fits({__builtin_bit_cast(float, middle), 1.0})) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  Cut cut{__builtin_bit_cast(float, low), 1.0};
  double less = 0.0;
  for (int i = 0; i < 30; ++i) {
    const double middle = 0.5 * (less + cut.share);
    (fits({cut.price, middle}) ? cut.share : less) = middle;
  }
  return cut;
}

/// The cuts of all levels up to the last that can be reached, and one that is not much worse.
std::vector<Cut> cuts_for(const ChunkedMesh& mesh, const std::vector<CollapseSequence>& sequences,
                          const std::vector<std::uint32_t>& halvings) {
  std::vector<Cut> cuts;
  for (const std::uint32_t level : halvings) {
    std::optional<Cut> cut = cut_for(mesh, sequences, level_triangles(triangles_in(mesh), level));
    const bool reached = cut.has_value();
    const float before = cuts.empty() ? 0.0f : cuts.back().price;
    if (!reached) cut = {std::max(before, kLeastPrice) * kMaxErrorRatio * kMaxErrorRatio, 1.0};
    cut->halvings = level;
    cuts.push_back(*cut);
    if (!reached) break;
  }
  return cuts;
}

std::vector<std::uint16_t> collapsed_triangles(std::span<const std::uint16_t> indices,
                                               const std::vector<std::uint16_t>& become) {
  std::vector<std::uint16_t> result;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const std::array<std::uint16_t, 3> t = {become[indices[i]], become[indices[i + 1]],
                                            become[indices[i + 2]]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    result.insert(result.end(), t.begin(), t.end());
  }
  return result;
}

/// A level of a chunk, and how far it is from the finest. Which triangles are adjacent is looked up
/// on first use: of the finest level it mostly never is.
class MeasuredLevel {
 public:
  MeasuredLevel(std::span<const glm::dvec3> positions, std::vector<std::uint16_t> triangles)
      : indices(std::move(triangles)), positions_(positions) {}

  [[nodiscard]] std::size_t triangles() const { return indices.size() / 3; }
  LevelSurface& surface() {
    if (!surface_) surface_.emplace(positions_, indices);
    return *surface_;
  }
  /// Of each vertex a triangle whose corner it is, kNoIndex if none.
  const std::vector<std::uint32_t>& of_vertices() {
    if (of_vertices_.empty()) of_vertices_ = surface().triangles_of_vertices();
    return of_vertices_;
  }

  std::vector<std::uint16_t> indices;
  double error = 0;

 private:
  std::span<const glm::dvec3> positions_;
  std::optional<LevelSurface> surface_;  ///< of the indices
  std::vector<std::uint32_t> of_vertices_;
};

/// Of each vertex of the finest level, a triangle of a level near it; kNoIndex: that piece is gone.
std::vector<std::uint32_t> near_vertices(MeasuredLevel& level,
                                         std::span<const glm::dvec3> positions,
                                         const std::vector<std::uint16_t>& become) {
  const std::vector<std::uint32_t>& of_vertices = level.of_vertices();
  std::vector<std::uint32_t> nearby = of_vertices;
  for (std::size_t v = 0; v < nearby.size(); ++v) {
    const std::uint32_t start = of_vertices[become[v]];
    if (nearby[v] == kNoIndex && start != kNoIndex) {
      nearby[v] = level.surface().walk(positions[v], start);
    }
  }
  return nearby;
}

/// What the collapses from the finest level to another tell of its distance: no part that is
/// settled is farther off than `most`.
CollapseBound settled_by_collapses(MeasuredLevel& level, std::span<const std::uint16_t> finest,
                                   std::span<const glm::dvec3> positions,
                                   const std::vector<std::uint16_t>& become, double most) {
  const LevelSurface& surface = level.surface();
  const std::vector<std::uint32_t>& of_vertices = level.of_vertices();
  std::vector<double> moved(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const glm::dvec3 way = positions[become[v]] - positions[v];
    moved[v] = of_vertices[become[v]] != kNoIndex ? glm::dot(way, way)
                                                  : std::numeric_limits<double>::infinity();
  }
  const auto lands = [&](std::uint32_t t) {
    const std::uint16_t* v = &finest[3 * std::size_t{t}];
    const std::uint16_t a = become[v[0]];
    const std::uint16_t b = become[v[1]];
    const std::uint16_t c = become[v[2]];
    if (a != b && b != c && c != a) return true;
    const std::uint16_t other = a != b ? b : c;
    return a == other || surface.has_edge(a, other) || surface.has_edge(other, a);
  };
  return collapse_bound(positions, finest, std::span<const double>(moved), lands, most);
}

/// Measures what collapses leave open of a level's distance from the finest: one by one.
double distance_of_open(MeasuredLevel& level, MeasuredLevel& finest,
                        const std::vector<std::uint16_t>& become,
                        const std::vector<std::uint32_t>& nearby, const CollapseBound& bound,
                        double least) {
  const double up =
      surface_distance(finest.surface(), level.surface(), nearby, least, 0, bound.settled);
  // Each triangle is what one of the finest has become, in the same order.
  std::vector<std::uint8_t> covered;
  covered.reserve(level.triangles());
  for (std::uint32_t t = 0; t < finest.triangles(); ++t) {
    const std::uint16_t* v = &finest.indices[3 * std::size_t{t}];
    if (become[v[0]] == become[v[1]] || become[v[1]] == become[v[2]] ||
        become[v[2]] == become[v[0]]) {
      continue;
    }
    covered.push_back(bound.settled[t]);
  }
  return surface_distance(level.surface(), finest.surface(), finest.of_vertices(), up, 0, covered);
}

/// Measures a level: by the collapses from the finest where they tell enough, or its distance from
/// a finer one, and that one's from the finest. nearby: see near_vertices(). hidden: a distance
/// that need not be told apart.
void measure(MeasuredLevel& level, std::vector<MeasuredLevel>& finer,
             std::span<const glm::dvec3> positions, const std::vector<std::uint16_t>& become,
             const std::vector<std::uint32_t>& nearby, double hidden) {
  const double least = finer.back().error;
  const double enough = std::max(least, hidden);
  MeasuredLevel& finest = finer.front();
  const CollapseBound bound =
      settled_by_collapses(level, finest.indices, positions, become, enough);
  if (bound.open.empty()) {
    level.error = std::max(least, bound.moved);
  } else if (bound.open.size() * kMostOpen < finest.triangles()) {
    level.error = distance_of_open(level, finest, become, nearby, bound, enough);
  } else {
    const auto exact = [&](MeasuredLevel& other) { return other.error <= kNegligible * enough; };
    MeasuredLevel& from = *std::find_if(finer.rbegin(), finer.rend(), exact);
    const double distance = level_distance(from.surface(), level.surface(), nearby,
                                           from.of_vertices(), enough - from.error);
    level.error = from.error + distance;
  }
}

/// Greatest distance of the uv of a removed vertex from that of the surface at the nearest point.
/// limit: what collapses were held to; where the triangles around tell more, they are not the
/// nearest, and all are looked at.
double greatest_uv_shift(LevelSurface& surface, const ChunkVertices& vertices,
                         const std::vector<std::uint16_t>& become,
                         const std::vector<std::uint32_t>& nearby, double limit) {
  const auto shift_on = [&](std::size_t v, const std::array<std::uint32_t, 3>& t) {
    const auto& [a, b, c] = t;
    const ClosestPoint closest =
        closest_point(vertices.positions[v],
                      {vertices.positions[a], vertices.positions[b], vertices.positions[c]});
    const std::span<const glm::dvec2> uvs = vertices.uvs;
    return glm::length(uvs[a] + closest.b * (uvs[b] - uvs[a]) + closest.c * (uvs[c] - uvs[a]) -
                       uvs[v]);
  };
  double greatest = 0;
  for (std::size_t v = 0; v < vertices.uvs.size(); ++v) {
    if (become[v] == v || nearby[v] == kNoIndex) continue;
    const std::uint16_t* t = &surface.indices()[3 * std::size_t{nearby[v]}];
    double shift = shift_on(v, {t[0], t[1], t[2]});
    if (shift <= greatest) continue;
    const NearTriangle near = surface.nearest_around(vertices.positions[v], nearby[v]);
    t = surface.corners(near.triangle);
    shift = shift_on(v, {t[0], t[1], t[2]});
    if (shift > limit) {
      t = surface.corners(surface.nearest(vertices.positions[v], 0, near).triangle);
      shift = std::min(shift, shift_on(v, {t[0], t[1], t[2]}));
    }
    greatest = std::max(greatest, shift);
  }
  return greatest;
}

/// Compares the looks of levels of one chunk with that of the finest: at its vertices, each of
/// which represents a third of the triangles around it. Where a vertex has several normals, at the
/// middles of its triangles.
class ChunkLooker {
 public:
  ChunkLooker(const TriMesh& mesh, const Chunk& chunk, const MergedVertices& merged,
              std::span<const glm::dvec3> positions, double length_of_uv)
      : mesh_(mesh),
        chunk_(chunk),
        flat_(!merged.first.empty()),
        length_of_uv_(length_of_uv),
        points_(flat_ ? middles(merged, positions) : vertices(positions)),
        cells_(points_) {}

  /// As ChunkLevel::shading. level: its triangles, with the vertices that carry their normals.
  /// become: what each vertex of the finest has become. nearby: see near_vertices().
  double shading(MeasuredLevel& measured, const std::vector<std::uint16_t>& level,
                 const std::vector<std::uint16_t>& become,
                 const std::vector<std::uint32_t>& nearby) {
    const LevelSurface& surface = measured.surface();
    std::vector<LookDifference> differences(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      std::uint32_t t = nearby[of_[i]];
      if (t == kNoIndex) continue;
      if (!flat_ && become[of_[i]] == of_[i]) {
        differences[i].area = static_cast<float>(areas_[i]);
        continue;
      }
      // By way of the vertex, a walk to a middle goes astray less often.
      if (flat_) t = surface.walk(points_[i], t);
      const ClosestPoint closest = closest_point(points_[i], surface.triangle(t));
      const Look there =
          look_at(mesh_, vertices_of(&level[3 * std::size_t{t}]), closest.b, closest.c);
      differences[i] = {there, looks_[i], length_of_uv_, areas_[i]};
    }
    return cells_.smallest_pixel(differences);
  }

 private:
  std::vector<glm::dvec3> vertices(std::span<const glm::dvec3> positions) {
    areas_.assign(positions.size(), 0.0);
    for (std::size_t i = 0; i < chunk_.indices.size(); i += 3) {
      const std::uint16_t* t = &chunk_.indices[i];
      const double area = twice_area(positions, t) / 3;
      for (std::size_t k = 0; k < 3; ++k) areas_[t[k]] += area;
    }
    of_.resize(positions.size());
    std::iota(of_.begin(), of_.end(), std::uint16_t{0});
    for (const std::uint32_t v : chunk_.vertices) looks_.push_back(look_at(mesh_, {v, v, v}, 0, 0));
    return {positions.begin(), positions.end()};
  }
  std::vector<glm::dvec3> middles(const MergedVertices& merged,
                                  std::span<const glm::dvec3> positions) {
    std::vector<glm::dvec3> points;
    for (std::size_t i = 0; i < chunk_.indices.size(); i += 3) {
      const std::uint16_t* t = &chunk_.indices[i];
      points.push_back((positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0);
      of_.push_back(merged.first[t[0]]);
      areas_.push_back(twice_area(positions, t));
      looks_.push_back(look_at(mesh_, vertices_of(t), 1.0 / 3, 1.0 / 3));
    }
    return points;
  }
  static double twice_area(std::span<const glm::dvec3> positions, const std::uint16_t* corners) {
    const glm::dvec3& origin = positions[corners[0]];
    return glm::length(glm::cross(positions[corners[1]] - origin, positions[corners[2]] - origin));
  }
  [[nodiscard]] std::array<std::uint32_t, 3> vertices_of(const std::uint16_t* corners) const {
    return {chunk_.vertices[corners[0]], chunk_.vertices[corners[1]], chunk_.vertices[corners[2]]};
  }

  const TriMesh& mesh_;
  const Chunk& chunk_;
  bool flat_;
  double length_of_uv_;
  std::vector<std::uint16_t> of_;  ///< of each point: a vertex there, or of its triangle
  std::vector<double> areas_;
  std::vector<Look> looks_;  ///< of the finest level
  std::vector<glm::dvec3> points_;
  PixelCells cells_;
};

/// Fills one chunk's coarser levels: what it is after the collapses ahead of each cut. hidden: the
/// share of what shading shows below which distances are not told apart.
void level_chunk(const TriMesh& mesh, const MergedVertices& merged,
                 std::span<const glm::dvec3> positions, const LevelOptions& options,
                 const CollapseSequence& sequence, const std::vector<Cut>& cuts, double hidden,
                 Chunk& chunk) {
  DecimateLimits limits;
  const std::vector<glm::dvec2> texels =
      texels_of(mesh, chunk, positions, options.texture_sides, limits);
  const std::span<const std::uint16_t> finest = merged.indices_of(chunk);
  const double side = texels.empty() ? 0.0 : options.texture_sides[chunk.material];
  ChunkLooker looker(mesh, chunk, merged, positions, side * limits.length_of_uv);
  const double loosest = kLoosest * diagonal_of(positions);
  std::vector<MeasuredLevel> levels;
  levels.emplace_back(positions, std::vector<std::uint16_t>(finest.begin(), finest.end()));
  for (const Cut& cut : cuts) {
    const std::size_t collapses = collapses_at(sequence, cut);
    const std::size_t count = triangles_after(sequence, chunk.indices.size() / 3, collapses);
    const auto before = static_cast<double>(levels.back().triangles());
    if (count == 0 || static_cast<double>(count) > kWorthwhile * before) continue;
    const std::vector<std::uint16_t> become =
        collapsed_vertices(sequence, collapses, positions.size());
    MeasuredLevel coarser(positions, collapsed_triangles(finest, become));
    ChunkLevel& level = chunk.coarser.emplace_back();
    level.halvings = cut.halvings;
    const std::vector<std::uint32_t> nearby = near_vertices(coarser, positions, become);
    if (!texels.empty()) {
      level.uv_shift = greatest_uv_shift(coarser.surface(), {positions, texels}, become, nearby,
                                         limits.max_uv_shift);
    }
    level.indices = coarser.indices;
    split_normals(mesh, chunk, merged, positions, level.indices);
    level.shading = looker.shading(coarser, level.indices, become, nearby);
    measure(coarser, levels, positions, become, nearby, std::min(hidden * level.shading, loosest));
    level.error = coarser.error;
    levels.push_back(std::move(coarser));
  }
}

/// What the collapses ahead of a cut have left of a chunk that has its levels.
ProxyStart start_of(const TriMesh& mesh, const Chunk& chunk, const MergedVertices& merged,
                    std::span<const glm::dvec3> positions, const CollapseSequence& sequence,
                    const Cut& cut) {
  ProxyStart start;
  const std::vector<std::uint16_t> become =
      collapsed_vertices(sequence, collapses_at(sequence, cut), positions.size());
  const auto of = [&](std::uint16_t v) {
    return become[merged.first.empty() ? v : merged.first[v]];
  };
  start.indices = chunk.coarser.empty() ? chunk.indices : chunk.coarser.back().indices;
  for (std::uint16_t& v : start.indices) v = of(v);
  split_normals(mesh, chunk, merged, positions, start.indices);
  std::vector<std::uint16_t> numbers(positions.size());
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    start.become.push_back(of(static_cast<std::uint16_t>(v)));
    if (start.become.back() != v) continue;
    numbers[v] = static_cast<std::uint16_t>(start.vertices.size());
    start.vertices.push_back(static_cast<std::uint16_t>(v));
  }
  start.quadrics.resize(start.vertices.size());
  for (std::size_t i = 0; i < chunk.indices.size(); i += 3) {
    const std::uint16_t* t = &chunk.indices[i];
    const Quadric plane = Quadric::of_triangle(positions[t[0]], positions[t[1]], positions[t[2]]);
    for (std::size_t k = 0; k < 3; ++k) start.quadrics[numbers[of(t[k])]] += plane;
  }
  return start;
}

}  // namespace

Result<void> LevelOptions::validate() const {
  if (levels >= 1 && levels <= kMaxLevels) return {};
  return fail(ExitCode::kUsage, "levels.count", "", "a chunk has 1 to 12 levels of detail",
              "choose a number in that range");
}

std::size_t triangles_in(const ChunkedMesh& mesh) {
  std::size_t count = 0;
  for (const Chunk& chunk : mesh.chunks) count += chunk.indices.size() / 3;
  return count;
}

std::size_t level_triangles(std::size_t triangles, std::uint32_t halvings) {
  const std::size_t level = triangles >> halvings;
  return level > kPhoneTriangles && level < kPhoneTriangles * 10 / 7 ? kPhoneTriangles : level;
}

std::vector<std::uint32_t> halvings_of(std::size_t triangles, const LevelOptions& options) {
  std::vector<std::uint32_t> halvings;
  for (std::uint32_t at = 0; halvings.size() + 1 < options.levels;) {
    at += triangles >> (at + 1) > options.many_triangles ? 2u : 1u;
    if (at > options.most_halvings) break;
    halvings.push_back(at);
  }
  return halvings;
}

Result<std::vector<ProxyStart>> make_levels(ChunkedMesh& mesh, const LevelOptions& options,
                                            Report& report) {
  MODAR_TRY(options.validate());
  if (triangles_in(mesh) == 0) return no_triangle_left(mesh.mesh.name, "the levels need some");
  if (options.levels == 1) return std::vector<ProxyStart>();
  StageTimer timer(report, "levels");
  std::vector<MergedVertices> merged;
  for (const Chunk& chunk : mesh.chunks) merged.push_back(merge_vertices(mesh.mesh, chunk));
  const std::vector<SharedVertices> shared = find_shared(mesh, merged);
  const std::vector<ChunkGrid> grids = make_grids(mesh, options.positions);
  const std::size_t chunks = mesh.chunks.size();
  const auto each_chunk = [&](double begin, const auto& body) {
    for (std::size_t first = 0; first < chunks; first += kChunksPerUpdate) {
      const std::size_t count = std::min(kChunksPerUpdate, chunks - first);
      parallel_rows(static_cast<std::uint32_t>(count), options.jobs,
                    [&](std::uint32_t i) { body(first + i); });
      const double done = static_cast<double>(first + count) / static_cast<double>(chunks);
      if (report.progress) report.progress("levels", begin + 0.5 * done);
    }
  };
  const std::size_t all = triangles_in(mesh);
  const std::vector<std::uint32_t> halvings = halvings_of(all, options);
  const std::size_t last = options.start > 0 ? options.start : all >> halvings.back();
  std::vector<CollapseSequence> sequences(chunks);
  each_chunk(0.0, [&](std::size_t c) {
    sequences[c] =
        decimate(mesh.mesh, mesh.chunks[c], merged[c], grids[c], shared[c], options.positions,
                 options.texture_sides, static_cast<double>(last) / static_cast<double>(all));
  });
  const std::vector<Cut> cuts = cuts_for(mesh, sequences, halvings);
  const double hidden = all > options.measured_triangles ? kHidden : 0.0;
  std::vector<ProxyStart> starts(options.start > 0 ? chunks : 0);
  const Cut start = cut_for(mesh, sequences, options.start).value_or(cuts.back());
  each_chunk(0.5, [&](std::size_t c) {
    Chunk& chunk = mesh.chunks[c];
    const std::vector<glm::dvec3> positions =
        decoded_positions(mesh.mesh, chunk, options.positions, grids[c]);
    level_chunk(mesh.mesh, merged[c], positions, options, sequences[c], cuts, hidden, chunk);
    if (!starts.empty()) {
      starts[c] = start_of(mesh.mesh, chunk, merged[c], positions, sequences[c], start);
    }
    sequences[c] = {};
  });
  std::uint64_t fine = 0;
  std::uint64_t triangles = 0;
  LevelFigures figures;
  double error = 0;
  for (const Chunk& chunk : mesh.chunks) {
    fine += chunk.indices.size() / 3;
    for (const ChunkLevel& level : chunk.coarser) {
      triangles += level.indices.size() / 3;
      error = std::max(error, level.error);
      figures.uv_shift_max_texels = std::max(figures.uv_shift_max_texels, level.uv_shift);
    }
  }
  figures.position_error_max = error * mesh.mesh.placement.scale;
  timer.done(fine, triangles, figures.position_error_max);
  report.levels.push_back(figures);
  return starts;
}

void drop_alike_levels(ChunkedMesh& mesh, double proxy) {
  const auto shown = [](const ChunkLevel& level) { return std::max(level.error, level.shading); };
  for (Chunk& chunk : mesh.chunks) {
    std::vector<ChunkLevel>& levels = chunk.coarser;
    double next = proxy;
    for (std::size_t i = levels.size(); i-- > 0;) {
      if (shown(levels[i]) > kAlike * next) {
        levels.erase(levels.begin() + static_cast<std::ptrdiff_t>(i));
      } else {
        next = shown(levels[i]);
      }
    }
  }
}

}  // namespace modar
