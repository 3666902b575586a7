// Joins the chunks' coarse levels, collapses the whole, and measures the result.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/attribute_fit.hpp"
#include "bake/mesh/lod/collapse_bound.hpp"
#include "bake/mesh/lod/mesh_collapse.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/lod/pixel_cells.hpp"
#include "bake/mesh/lod/surface_distance.hpp"

namespace modar {
namespace {

/// No phone draws more triangles of one model, and the inside is drawn by chunks.
constexpr std::size_t kMostProxy = 140'000;
/// A model of fewer is drawn unchanged.
constexpr std::size_t kLeastProxy = 1000;
/// Halvings of the first: chunks have the levels before. Their vertices are those of level 0 and
/// cost nothing, a proxy's are its own.
constexpr std::uint32_t kFirstHalving = 3;
/// Halvings from one proxy to the next. With one, most state the same error as the next and are
/// drawn nowhere.
constexpr std::uint32_t kHalvingsApart = 2;
/// Triangles to start from, relative to the first proxy's. Higher is more exact and slower.
/// [1.25, 1.6]
constexpr double kStart = 1.4;
/// Prices are recomputed whenever this share of the triangles is left. Higher is more exact and
/// slower.
constexpr double kRepriced = 0.7;
/// At most this many triangles are compared for the shading: a share of 1 % of them is known to
/// 0.05 %.
constexpr std::size_t kMostLooks = 50'000;
/// Points of the finest level for each triangle of a proxy that its attributes are fitted to.
/// Higher is more exact and slower. [2, 8]
constexpr std::size_t kFitted = 4;
/// Cosine of the angle between the normals of level 0 and a proxy beyond which a point is on
/// another side of an edge.
constexpr double kSameSide = 0.5;

/// A surface of the whole model that others are measured against. Moves, but is never copied, as
/// `triangles` looks at the others.
struct Measured {
  Measured() = default;
  Measured(Measured&&) = default;
  Measured& operator=(Measured&&) = default;

  std::vector<glm::dvec3> positions;  ///< decoded
  std::vector<std::uint32_t> indices;
  std::vector<std::uint32_t> places;     ///< of each vertex: of the collapser
  std::optional<MeshSurface> triangles;  ///< of the former two, once they are known
  double error = 0;                      ///< from level 0
};

/// The coarsest levels of all chunks, joined.
struct JoinedSurface {
  Measured surface;
  std::vector<std::uint32_t> vertices;   ///< of the mesh, by vertex of the surface
  std::vector<std::uint32_t> start;      ///< by index of the surface: the vertex it has become
  std::vector<Quadric> quadrics;         ///< by vertex of the surface
  Array<std::uint32_t> become;           ///< by vertex of the mesh: that of the surface
  std::vector<std::uint32_t> materials;  ///< by triangle
  std::vector<std::uint32_t> faces;      ///< by triangle: of the collapser, kNoIndex: none
};

JoinedSurface join_chunks(const ChunkedMesh& mesh, const std::vector<ProxyStart>& starts,
                          PositionKind kind) {
  JoinedSurface joined;
  const std::vector<ChunkGrid> grids = make_grids(mesh, kind);
  Array<std::uint32_t> numbers(mesh.mesh.positions.size(), kNoIndex);
  joined.become = Array<std::uint32_t>(numbers.size(), kNoIndex);
  Measured& surface = joined.surface;
  for (std::size_t c = 0; c < mesh.chunks.size(); ++c) {
    const Chunk& chunk = mesh.chunks[c];
    const auto number_of = [&](std::uint16_t i) {
      std::uint32_t& number = numbers[chunk.vertices[i]];
      if (number == kNoIndex) {
        number = static_cast<std::uint32_t>(joined.vertices.size());
        joined.vertices.push_back(chunk.vertices[i]);
        joined.quadrics.emplace_back();
        surface.positions.push_back(
            decoded_position(mesh.mesh.positions[chunk.vertices[i]], kind, grids[c]));
      }
      return number;
    };
    if (!chunk.coarser.empty()) {
      surface.error = std::max(surface.error, chunk.coarser.back().error);
    }
    const ProxyStart& start = starts[c];
    for (const std::uint16_t i :
         chunk.coarser.empty() ? chunk.indices : chunk.coarser.back().indices) {
      surface.indices.push_back(number_of(i));
    }
    for (const std::uint16_t i : start.indices) joined.start.push_back(number_of(i));
    for (std::size_t i = 0; i < start.vertices.size(); ++i) {
      joined.quadrics[number_of(start.vertices[i])] += start.quadrics[i];
    }
    for (std::size_t i = 0; i < start.become.size(); ++i) {
      joined.become[chunk.vertices[i]] = number_of(start.become[i]);
    }
    joined.materials.resize(surface.indices.size() / 3, chunk.material);
  }
  return joined;
}

/// Equal numbers for equal values, in the order of first use: a hash table with open addressing.
template <std::size_t kWords>
class Numbers {
 public:
  using Key = std::array<std::uint64_t, kWords>;

  /// The number of a key, and whether it is new.
  std::pair<std::uint32_t, bool> of(const Key& key) {
    if (2 * keys_.size() >= slots_.size()) grow();
    std::uint32_t& slot = slot_of(key);
    const bool added = slot == kNoIndex;
    if (added) {
      slot = static_cast<std::uint32_t>(keys_.size());
      keys_.push_back(key);
    }
    return {slot, added};
  }

 private:
  /// Where the number of a key is, or comes.
  std::uint32_t& slot_of(const Key& key) {
    std::uint64_t hash = 0;
    for (const std::uint64_t word : key) {
      hash = (hash ^ word) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 32;
    }
    std::size_t at = hash & (slots_.size() - 1);
    while (slots_[at] != kNoIndex && keys_[slots_[at]] != key) at = (at + 1) & (slots_.size() - 1);
    return slots_[at];
  }
  void grow() {
    slots_.assign(std::max<std::size_t>(64, 2 * slots_.size()), kNoIndex);
    for (std::uint32_t i = 0; i < keys_.size(); ++i) slot_of(keys_[i]) = i;
  }

  std::vector<Key> keys_;             // by number
  std::vector<std::uint32_t> slots_;  // a power of two, at most half of them taken
};

std::uint64_t bits_of(double value) {
  return __builtin_bit_cast(std::uint64_t, value == 0.0 ? 0.0 : value);
}

/// What collapses see of the joined levels. Sets the places of the surface's vertices.
CollapseMesh collapse_mesh(const TriMesh& mesh, JoinedSurface& joined) {
  CollapseMesh out;
  Numbers<3> places;
  Numbers<5> looks;
  Numbers<4> shades;
  Measured& surface = joined.surface;
  surface.places.assign(surface.positions.size(), kNoIndex);
  const auto place_of = [&](std::uint32_t vertex) {
    std::uint32_t& place = surface.places[vertex];
    if (place != kNoIndex) return place;
    const glm::dvec3& p = surface.positions[vertex];
    const auto [number, added] = places.of({bits_of(p.x), bits_of(p.y), bits_of(p.z)});
    if (added) {
      out.places.push_back(p);
      out.quadrics.emplace_back();
    }
    out.quadrics[number] += joined.quadrics[vertex];
    return place = number;
  };
  const auto look_of = [&](std::uint32_t place, std::uint32_t v, std::uint32_t material) {
    CornerLook look;
    if (!mesh.uvs.empty()) look.uv = mesh.uvs[v];
    std::uint64_t colour = 0;
    if (!mesh.colours.empty()) {
      const glm::u8vec4& c = mesh.colours[v];
      look.colour = glm::vec4(c);
      colour = c.r | c.g << 8 | c.b << 16 | std::uint64_t{c.a} << 24;
    }
    const auto [number, added] =
        looks.of({place, material, bits_of(look.uv.x), bits_of(look.uv.y), colour});
    if (added) out.looks.push_back(look);
    return number;
  };
  const auto shade_of = [&](std::uint32_t place, std::uint32_t v) {
    CornerShade shade;
    if (!mesh.normals.empty()) shade.normal = mesh.normals[v];
    if (!mesh.occlusion.empty()) shade.occlusion = static_cast<float>(mesh.occlusion[v]);
    const auto word = [](float value) { return bits_of(static_cast<double>(value)); };
    const auto [number, added] =
        shades.of({place, word(shade.normal.x), word(shade.normal.y), word(shade.normal.z)});
    if (added) out.shades.push_back(shade);
    return number;
  };
  struct LastVertex {
    std::uint32_t material = kNoIndex;
    std::uint32_t look = kNoIndex;
    std::uint32_t shade = kNoIndex;
  };
  std::vector<LastVertex> known(surface.positions.size());  // of each vertex: what it had last
  for (std::size_t i = 0; i < surface.indices.size(); i += 3) {
    CollapseFace face;
    face.material = joined.materials[i / 3];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = joined.start[i + k];
      face.places[k] = place_of(vertex);
      LastVertex& at = known[vertex];
      if (at.look == kNoIndex || at.material != face.material) {
        const std::uint32_t v = joined.vertices[vertex];
        at = {face.material, look_of(face.places[k], v, face.material),
              shade_of(face.places[k], v)};
      }
      face.looks[k] = at.look;
      face.shades[k] = at.shade;
    }
    const auto& p = face.places;
    const bool has_area = p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
    joined.faces.push_back(has_area ? static_cast<std::uint32_t>(out.faces.size()) : kNoIndex);
    if (has_area) out.faces.push_back(face);
  }
  for (std::uint32_t v = 0; v < joined.quadrics.size(); ++v) {
    if (joined.quadrics[v].area > 0) place_of(v);
  }
  for (std::size_t i = 0; i < surface.indices.size(); ++i) {
    surface.places[surface.indices[i]] = surface.places[joined.start[i]];
  }
  return out;
}

std::uint8_t byte_of(float value, float most) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0f, most)));
}

glm::vec4 shade_of(const TriMesh& mesh, std::uint32_t v) {
  const float occlusion = mesh.occlusion.empty() ? 0.0f : static_cast<float>(mesh.occlusion[v]);
  return {mesh.normals.empty() ? glm::vec3(0.0f) : mesh.normals[v], occlusion};
}

glm::vec4 colour_of(const TriMesh& mesh, std::uint32_t v) {
  return mesh.colours.empty() ? glm::vec4(0.0f) : glm::vec4(mesh.colours[v]);
}

/// What vertices of a proxy are of the collapser.
struct ProxyVertices {
  std::vector<std::uint32_t> places;
  std::vector<std::uint32_t> looks;
  std::vector<std::uint32_t> shades;
};

/// The remaining triangles as a separate mesh. low, high: the box of the whole, which least points
/// of quadrics may leave.
TriMesh mesh_of(const TriMesh& source, const MeshCollapser& collapser, const glm::dvec3& low,
                const glm::dvec3& high, ProxyVertices& of) {
  TriMesh mesh;
  mesh.name = source.name;
  mesh.placement = source.placement;
  mesh.source_min = source.source_min;
  mesh.source_max = source.source_max;
  mesh.materials = source.materials;
  Numbers<2> vertices;
  for (const CollapseFace& face : collapser.faces()) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [number, added] = vertices.of({face.looks[k], face.shades[k]});
      triangle[k] = number;
      if (!added) continue;
      of.places.push_back(face.places[k]);
      of.looks.push_back(face.looks[k]);
      of.shades.push_back(face.shades[k]);
      mesh.positions.push_back(glm::clamp(collapser.point_of(face.places[k]), low, high));
      const CornerLook& look = collapser.look(face.looks[k]);
      const CornerShade& shade = collapser.shade(face.shades[k]);
      if (!source.normals.empty()) mesh.normals.push_back(shade.normal);
      if (!source.uvs.empty()) mesh.uvs.push_back(look.uv);
      if (!source.colours.empty()) {
        const glm::vec4& c = look.colour;
        mesh.colours.push_back(
            {byte_of(c.r, 255), byte_of(c.g, 255), byte_of(c.b, 255), byte_of(c.a, 255)});
      }
      if (!source.occlusion.empty()) mesh.occlusion.push_back(byte_of(shade.occlusion, 127));
    }
    mesh.triangles.push_back(triangle);
    mesh.triangle_material.push_back(face.material);
  }
  mesh.source_vertex_count = mesh.positions.size();
  return mesh;
}

/// Maps each welded position to one incident triangle.
class TrianglesAt {
 public:
  TrianglesAt(const Measured& surface, MeshCollapser& collapser, std::size_t places)
      : collapser_(collapser), triangles_(places, kNoIndex) {
    for (std::size_t i = 0; i < surface.indices.size(); ++i) {
      const std::uint32_t place = collapser.place_of(surface.places[surface.indices[i]]);
      triangles_[place] = static_cast<std::uint32_t>(i / 3);
    }
  }
  /// kNoIndex: that piece of the model is gone.
  std::uint32_t operator[](std::uint32_t place) const {
    return triangles_[collapser_.place_of(place)];
  }

 private:
  MeshCollapser& collapser_;
  std::vector<std::uint32_t> triangles_;
};

/// Of each vertex of some triangles of a surface, a triangle of another one near it: within
/// `enough`, or the nearest around. indices: of the triangles' corners.
std::vector<std::uint32_t> near_triangles(const Measured& from,
                                          std::span<const std::uint32_t> indices,
                                          const MeshSurface& to, const TrianglesAt& at,
                                          double enough) {
  std::vector<std::uint32_t> near(from.positions.size(), kNoIndex);
  for (const std::uint32_t v : indices) {
    if (near[v] != kNoIndex) continue;
    const std::uint32_t start = at[from.places[v]];
    if (start == kNoIndex) continue;
    near[v] = to.walk(from.positions[v], start);
    if (distance_square(from.positions[v], to.triangle(near[v])) > enough * enough) {
      near[v] = to.nearest_around(from.positions[v], near[v]).triangle;
    }
  }
  return near;
}

/// Bounds the distance of either surface from the other. at_fine, at_coarse: their triangles.
double distance_both_ways(Measured& fine, const TrianglesAt& at_fine, Measured& coarse,
                          const TrianglesAt& at_coarse, double least) {
  const std::vector<std::uint32_t> there =
      near_triangles(fine, fine.indices, *coarse.triangles, at_coarse, least);
  const double found = surface_distance(*fine.triangles, *coarse.triangles, there, least);
  const std::vector<std::uint32_t> back =
      near_triangles(coarse, coarse.indices, *fine.triangles, at_fine, least);
  return surface_distance(*coarse.triangles, *fine.triangles, back, found);
}

/// Lengths on the surface that a unit of uv covers, of each material; 0 where it has no texture.
std::vector<double> lengths_of_uv(const JoinedSurface& joined, const TriMesh& mesh) {
  std::vector<double> lengths(mesh.materials.size(), 0.0);
  if (mesh.uvs.empty()) return lengths;
  std::vector<double> uv_areas(lengths.size(), 0.0);
  const Measured& surface = joined.surface;
  for (std::size_t i = 0; i < surface.indices.size(); i += 3) {
    const std::uint32_t* t = &surface.indices[i];
    const std::uint32_t material = joined.materials[i / 3];
    const glm::dvec3& origin = surface.positions[t[0]];
    lengths[material] +=
        glm::length(glm::cross(surface.positions[t[1]] - origin, surface.positions[t[2]] - origin));
    const glm::dvec2& uv = mesh.uvs[joined.vertices[t[0]]];
    const glm::dvec2 ab = mesh.uvs[joined.vertices[t[1]]] - uv;
    const glm::dvec2 ac = mesh.uvs[joined.vertices[t[2]]] - uv;
    uv_areas[material] += std::abs(ab.x * ac.y - ab.y * ac.x);
  }
  for (std::size_t m = 0; m < lengths.size(); ++m) {
    const bool seen = !mesh.materials[m].diffuse_map.empty() && uv_areas[m] > 0;
    lengths[m] = seen ? std::sqrt(lengths[m] / uv_areas[m]) : 0.0;
  }
  return lengths;
}

/// Points of level 0 where proxies are looked at.
struct LookPoints {
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices of the mesh
  std::vector<std::uint32_t> materials;
  std::vector<glm::dvec3> middles;
  std::vector<Look> looks;
  std::vector<double> areas;
};

LookPoints look_points(const ChunkedMesh& mesh) {
  LookPoints points;
  const std::size_t step = 1 + triangles_in(mesh) / kMostLooks;
  std::size_t next = 0;
  for (const Chunk& chunk : mesh.chunks) {
    for (; next < chunk.indices.size() / 3; next += step) {
      std::array<std::uint32_t, 3> v{};
      for (std::size_t k = 0; k < 3; ++k) v[k] = chunk.vertices[chunk.indices[3 * next + k]];
      const glm::dvec3& a = mesh.mesh.positions[v[0]];
      const glm::dvec3& b = mesh.mesh.positions[v[1]];
      const glm::dvec3& c = mesh.mesh.positions[v[2]];
      points.triangles.push_back(v);
      points.materials.push_back(chunk.material);
      points.middles.push_back((a + b + c) / 3.0);
      points.areas.push_back(glm::length(glm::cross(b - a, c - a)));
      points.looks.push_back(look_at(mesh.mesh, v, 1.0 / 3, 1.0 / 3));
    }
    next -= chunk.indices.size() / 3;
  }
  return points;
}

/// Of a mesh in its chunks: the decoded surface.
Measured decoded_surface(const ChunkedMesh& chunked, PositionKind kind,
                         const std::vector<std::uint32_t>& places) {
  Measured surface;
  const std::vector<ChunkGrid> grids = make_grids(chunked, kind);
  surface.positions.resize(chunked.mesh.positions.size());
  surface.places = places;
  for (std::size_t c = 0; c < chunked.chunks.size(); ++c) {
    const Chunk& chunk = chunked.chunks[c];
    for (const std::uint32_t v : chunk.vertices) {
      surface.positions[v] = decoded_position(chunked.mesh.positions[v], kind, grids[c]);
    }
    for (const std::uint16_t i : chunk.indices) surface.indices.push_back(chunk.vertices[i]);
  }
  surface.triangles.emplace(surface.positions, surface.indices);
  return surface;
}

class ProxyMaker {
 public:
  ProxyMaker(const ChunkedMesh& mesh, const std::vector<ProxyStart>& starts,
             const ProxyOptions& options)
      : mesh_(mesh),
        options_(options),
        joined_(join_chunks(mesh, starts, options.positions)),
        collapser_(collapse_mesh(mesh.mesh, joined_)),
        places_(collapser_.places()),
        points_(look_points(mesh)),
        lengths_of_uv_(lengths_of_uv(joined_, mesh.mesh)),
        cells_(points_.middles),
        low_(std::numeric_limits<double>::infinity()),
        high_(-low_) {
    for (const glm::dvec3& p : joined_.surface.positions) {
      low_ = glm::min(low_, p);
      high_ = glm::max(high_, p);
    }
    joined_.surface.triangles.emplace(joined_.surface.positions, joined_.surface.indices);
  }

  /// The next one, of at most this many triangles. False: that number cannot be reached.
  Result<bool> make(std::size_t triangles, Proxy& out) {
    const auto repriced = [](std::size_t count) {
      return static_cast<std::size_t>(kRepriced * static_cast<double>(count));
    };
    while (repriced(collapser_.triangles()) > triangles) {
      if (!collapser_.reduce_to(repriced(collapser_.triangles()))) return false;
      collapser_.forget();
    }
    // Pieces of the same triangles go as a whole, all of them at one price.
    if (!collapser_.reduce_to(triangles) || collapser_.triangles() == 0) return false;
    ProxyVertices of;
    Report quiet;
    TriMesh whole = mesh_of(mesh_.mesh, collapser_, low_, high_, of);
    MODAR_ASSIGN(out.mesh, chunk(std::move(whole), {}, quiet));
    // What repeats is a material's.
    out.mesh.repeats = mesh_.repeats;
    Measured surface = decoded_surface(out.mesh, options_.positions, of.places);
    const TrianglesAt at(surface, collapser_, places_);
    fit(*surface.triangles, at, of, out.mesh);
    out.shading = shading_of(*surface.triangles, at, out.mesh.mesh);
    surface.error = out.error = error_of(surface, at, out.shading);
    measured_.push_back(std::move(surface));
    collapser_.forget();
    return true;
  }

 private:
  /// Whether a triangle of the joined levels has become one of the proxy.
  [[nodiscard]] bool is_left(std::uint32_t t) const {
    return joined_.faces[t] != kNoIndex && collapser_.has(joined_.faces[t]);
  }

  /// Of a new proxy from level 0: by the collapses from the joined levels where that is accurate
  /// enough compared with the shading, or measured.
  double error_of(Measured& surface, const TrianglesAt& at, double shading) {
    const double least = measured_.empty() ? joined_.surface.error : measured_.back().error;
    const double hidden = triangles_in(mesh_) > options_.measured_triangles ? kHidden : 0.0;
    const double loose = std::max(least, hidden * shading);
    const double enough = loose - joined_.surface.error;
    const CollapseBound bound = settled_by_collapses(surface, at, enough);
    if (bound.open.empty()) return std::max(least, joined_.surface.error + bound.moved);
    const auto stays = [this](std::uint32_t t) { return is_left(t); };
    if (std::none_of(bound.open.begin(), bound.open.end(), stays)) {
      // All of the proxy is near the joined levels.
      std::vector<std::uint32_t> corners;
      for (const std::uint32_t t : bound.open) {
        const std::uint32_t* i = joined_.surface.triangles->corners(t);
        corners.insert(corners.end(), i, i + 3);
      }
      const double settled = std::max(least - joined_.surface.error, bound.moved);
      return joined_.surface.error +
             surface_distance(
                 *joined_.surface.triangles, *surface.triangles,
                 near_triangles(joined_.surface, corners, *surface.triangles, at, settled), settled,
                 0, bound.settled);
    }
    const auto exact = [&](const Measured& other) { return other.error <= kNegligible * loose; };
    const auto from = std::find_if(measured_.rbegin(), measured_.rend(), exact);
    Measured& fine = from != measured_.rend() ? *from : joined_.surface;
    const double distance = distance_both_ways(fine, TrianglesAt(fine, collapser_, places_),
                                               surface, at, std::max(0.0, loose - fine.error));
    // No coarser one is measured against those before.
    measured_.erase(measured_.begin(), from.base() - (from != measured_.rend() ? 1 : 0));
    return std::max(least, fine.error + distance);
  }

  /// What the collapses tell of the distance of a proxy from the joined levels.
  CollapseBound settled_by_collapses(const Measured& surface, const TrianglesAt& at, double most) {
    // Vertices at one place may be decoded apart where chunks meet.
    std::vector<glm::dvec3> points(places_);
    std::vector<std::uint8_t> known(places_, 0);
    double apart = 0;
    for (std::size_t v = 0; v < surface.positions.size(); ++v) {
      const std::uint32_t place = surface.places[v];
      if (std::exchange(known[place], std::uint8_t{1}) == 0) points[place] = surface.positions[v];
      apart = std::max(apart, glm::length(surface.positions[v] - points[place]));
    }
    std::vector<double> moved(joined_.surface.positions.size());
    for (std::size_t v = 0; v < moved.size(); ++v) {
      const std::uint32_t place = collapser_.place_of(joined_.surface.places[v]);
      const double way = glm::length(joined_.surface.positions[v] - points[place]) + apart;
      moved[v] = at[place] == kNoIndex ? std::numeric_limits<double>::infinity() : way * way;
    }
    const auto lands = [this](std::uint32_t t) { return is_left(t); };
    return collapse_bound(std::span<const glm::dvec3>(joined_.surface.positions),
                          std::span<const std::uint32_t>(joined_.surface.indices),
                          std::span<const double>(moved), lands, most);
  }

  /// A triangle of a proxy where a vertex of level 0 has gone; kNoIndex: that piece is gone.
  [[nodiscard]] std::uint32_t triangle_at(std::uint32_t vertex, const TrianglesAt& at) const {
    const std::uint32_t become = joined_.become[vertex];
    const std::uint32_t place = become == kNoIndex ? kNoIndex : joined_.surface.places[become];
    return place == kNoIndex ? kNoIndex : at[place];
  }

  /// The middle of a triangle of level 0 on a proxy; nothing where the proxy has no such side.
  [[nodiscard]] std::optional<FitPoint> fit_point(const std::array<std::uint32_t, 3>& v,
                                                  const MeshSurface& surface, const TrianglesAt& at,
                                                  const TriMesh& mesh) const {
    const std::uint32_t start = triangle_at(v[0], at);
    if (start == kNoIndex) return std::nullopt;
    const Array<glm::dvec3>& p = mesh_.mesh.positions;
    const glm::dvec3 middle = (p[v[0]] + p[v[1]] + p[v[2]]) / 3.0;
    const std::uint32_t t = surface.walk(middle, start);
    const ClosestPoint closest = closest_point(middle, surface.triangle(t));
    const std::uint32_t* corners = surface.corners(t);
    FitPoint point;
    point.corners = {corners[0], corners[1], corners[2]};
    point.weights = {static_cast<float>(1 - closest.b - closest.c), static_cast<float>(closest.b),
                     static_cast<float>(closest.c)};
    point.area = static_cast<float>(glm::length(glm::cross(p[v[1]] - p[v[0]], p[v[2]] - p[v[0]])));
    if (mesh.normals.empty()) return point;
    const Look here = look_at(mesh_.mesh, v, 1.0 / 3, 1.0 / 3);
    const Look there = look_at(mesh, point.corners, closest.b, closest.c);
    if (glm::dot(here.normal, there.normal) < kSameSide) return std::nullopt;
    return point;
  }

  /// Gives a proxy normals, colours and occlusion that blend to those of level 0.
  void fit(const MeshSurface& surface, const TrianglesAt& at, const ProxyVertices& of,
           ChunkedMesh& proxy) const {
    TriMesh& mesh = proxy.mesh;
    std::vector<FitPoint> points;
    std::vector<glm::vec4> shades;
    std::vector<glm::vec4> colours;
    const std::size_t step =
        std::max<std::size_t>(1, triangles_in(mesh_) / (kFitted * triangles_in(proxy)));
    std::size_t next = 0;
    for (const Chunk& chunk : mesh_.chunks) {
      for (; next < chunk.indices.size() / 3; next += step) {
        std::array<std::uint32_t, 3> v{};
        for (std::size_t k = 0; k < 3; ++k) v[k] = chunk.vertices[chunk.indices[3 * next + k]];
        const std::optional<FitPoint> point = fit_point(v, surface, at, mesh);
        if (!point) continue;
        points.push_back(*point);
        shades.push_back(
            (shade_of(mesh_.mesh, v[0]) + shade_of(mesh_.mesh, v[1]) + shade_of(mesh_.mesh, v[2])) /
            3.0f);
        colours.push_back((colour_of(mesh_.mesh, v[0]) + colour_of(mesh_.mesh, v[1]) +
                           colour_of(mesh_.mesh, v[2])) /
                          3.0f);
      }
      next -= chunk.indices.size() / 3;
    }
    std::vector<glm::vec4> values(mesh.positions.size());
    for (std::uint32_t v = 0; v < values.size(); ++v) values[v] = shade_of(mesh, v);
    fit_attributes(points, shades, of.shades, values);
    for (std::size_t v = 0; v < values.size(); ++v) {
      const glm::vec3 normal(values[v]);
      if (!mesh.normals.empty() && glm::length(normal) > 0)
        mesh.normals[v] = glm::normalize(normal);
      if (!mesh.occlusion.empty()) mesh.occlusion[v] = byte_of(values[v].w, 127);
    }
    if (mesh.colours.empty()) return;
    for (std::uint32_t v = 0; v < values.size(); ++v) values[v] = colour_of(mesh, v);
    fit_attributes(points, colours, of.looks, values);
    for (std::size_t v = 0; v < values.size(); ++v) {
      for (int k = 0; k < 4; ++k) mesh.colours[v][k] = byte_of(values[v][k], 255);
    }
  }

  /// As ChunkLevel::shading. mesh: what the surface is of.
  double shading_of(const MeshSurface& surface, const TrianglesAt& at, const TriMesh& mesh) {
    std::vector<LookDifference> differences(points_.middles.size());
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const std::uint32_t start = triangle_at(points_.triangles[i][0], at);
      if (start == kNoIndex) continue;
      const std::uint32_t t = surface.walk(points_.middles[i], start);
      const ClosestPoint closest = closest_point(points_.middles[i], surface.triangle(t));
      const std::uint32_t* c = surface.corners(t);
      const Look there = look_at(mesh, {c[0], c[1], c[2]}, closest.b, closest.c);
      differences[i] = {there, points_.looks[i], lengths_of_uv_[points_.materials[i]],
                        points_.areas[i]};
    }
    return cells_.smallest_pixel(differences);
  }

  const ChunkedMesh& mesh_;
  const ProxyOptions& options_;
  JoinedSurface joined_;
  MeshCollapser collapser_;
  std::size_t places_;
  LookPoints points_;
  std::vector<double> lengths_of_uv_;
  PixelCells cells_;
  glm::dvec3 low_;
  glm::dvec3 high_;
  std::vector<Measured> measured_;  ///< proxies, finest first
};

}  // namespace

ProxyPlan plan_proxies(const ChunkedMesh& mesh, const LevelOptions& options) {
  ProxyPlan plan;
  const std::size_t triangles = triangles_in(mesh);
  std::uint32_t first = kFirstHalving;
  while (triangles >> first > kMostProxy) ++first;
  if (triangles >> first < kLeastProxy) return plan;
  std::uint32_t last = first;
  while (triangles >> (last + 1) >= kLeastProxy) ++last;
  LevelOptions before = options;
  before.most_halvings = first - 1;
  const std::size_t levels = 1 + halvings_of(triangles, before).size();
  for (std::uint32_t at = first; levels + plan.halvings.size() < options.levels;) {
    plan.halvings.push_back(at);
    if (at == last) break;
    at = std::min(at + kHalvingsApart, last);
  }
  if (!plan.halvings.empty()) {
    plan.start = static_cast<std::size_t>(
        kStart * static_cast<double>(level_triangles(triangles, plan.halvings[0])));
  }
  return plan;
}

Result<std::vector<Proxy>> make_proxies(const ChunkedMesh& mesh,
                                        const std::vector<ProxyStart>& starts,
                                        const ProxyOptions& options, Report& report) {
  std::vector<Proxy> made;
  const std::vector<std::uint32_t>& halvings = options.plan.halvings;
  if (halvings.empty()) return made;
  StageTimer timer(report, "proxies");
  const std::size_t triangles = triangles_in(mesh);
  ProxyMaker maker(mesh, starts, options);
  std::size_t written = 0;
  for (const std::uint32_t halving : halvings) {
    Proxy proxy;
    MODAR_ASSIGN(const bool more, maker.make(level_triangles(triangles, halving), proxy));
    if (!more) break;
    written += triangles_in(proxy.mesh);
    made.push_back(std::move(proxy));
    if (report.progress) {
      report.progress("proxies",
                      static_cast<double>(made.size()) / static_cast<double>(halvings.size()));
    }
  }
  timer.done(triangles, written,
             made.empty() ? 0.0 : made.back().error * mesh.mesh.placement.scale);
  return made;
}

}  // namespace modar
