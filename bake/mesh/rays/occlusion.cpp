// Ambient occlusion by casting rays of few directions, the same from all points.
#include "bake/mesh/rays/occlusion.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "bake/mesh/rays/parallel_rays.hpp"
#include "bake/mesh/rays/surface_cells.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

/// Directions in which every point has a ray. More are smoother; time is proportional.
constexpr std::size_t kAxes = 32;
/// The same from clusters, whose own error exceeds that of fewer directions.
constexpr std::size_t kClusterAxes = 20;
/// Relative thickness above which clusters are layers or noise and get four times as many rays.
/// [0.034, 0.17]
constexpr double kThick = 0.08;
/// Model space, half a side is 1: farther surfaces hide nothing. Rooms seen from inside would be
/// dark without a limit. Chosen on pictures.
constexpr double kReach = 0.7;
/// Model space: rays start so far above the surface, since normals are not the triangles' own.
constexpr double kLift = 2e-3;
/// Linear; what hides light gives back some.
constexpr double kAlbedo = 0.4;

bool solid(const SourceMaterial& material) {
  return material.opacity >= 1.0f && !material.see_through && material.alpha_map.empty();
}

/// Where occlusion is measured, and the triangles between those points that hide.
struct OcclusionPoints {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<ParallelRays::Triangle> hiding;
};

/// Calls back with the vertices of every triangle, and whether it is opaque.
template <class Callback>
void each_triangle(const ChunkedMesh& chunked, const Callback& callback) {
  for (const Chunk& chunk : chunked.chunks) {
    const bool hides = solid(chunked.mesh.materials[chunk.material]);
    for (std::size_t i = 0; i + 2 < chunk.indices.size(); i += 3) {
      const std::uint16_t* t = &chunk.indices[i];
      callback(
          ParallelRays::Triangle{chunk.vertices[t[0]], chunk.vertices[t[1]], chunk.vertices[t[2]]},
          hides);
    }
  }
}

constexpr double kLeastSide = 1e-4;  // 15 bits a coordinate

/// Side of the cells that a surface is to be cut into: about as many hold some of it.
double cell_side(const ChunkedMesh& chunked, std::size_t cells) {
  const Array<glm::dvec3>& p = chunked.mesh.positions;
  double area = 0;
  each_triangle(chunked, [&](const ParallelRays::Triangle& t, bool) {
    area += 0.5 * glm::length(glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]));
  });
  return std::max(kLeastSide, std::sqrt(area / static_cast<double>(cells)));
}

SurfaceCells clusters_of(const ChunkedMesh& chunked, std::size_t most_points) {
  const TriMesh& mesh = chunked.mesh;
  const std::span<const glm::dvec3> positions(mesh.positions.data(), mesh.positions.size());
  const std::span<const glm::vec3> normals(mesh.normals.data(), mesh.normals.size());
  const double side = cell_side(chunked, most_points / 4);
  SurfaceCells coarse(positions, normals, side);
  if (coarse.thickness() <= kThick) return coarse;
  return SurfaceCells(positions, normals, std::max(side / 2, kLeastSide));
}

OcclusionPoints points_of(const ChunkedMesh& chunked, const SurfaceCells* clusters) {
  OcclusionPoints points;
  if (clusters != nullptr) {
    points.positions = clusters->positions();
    points.normals = clusters->normals();
  } else {
    points.positions.assign(chunked.mesh.positions.begin(), chunked.mesh.positions.end());
    points.normals.assign(chunked.mesh.normals.begin(), chunked.mesh.normals.end());
  }
  each_triangle(chunked, [&](ParallelRays::Triangle t, bool hides) {
    if (!hides) return;
    if (clusters != nullptr) {
      for (std::uint32_t& corner : t) corner = clusters->of_vertices()[corner];
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return;
    }
    points.hiding.push_back(t);
  });
  return points;
}

/// Directions over half a sphere, evenly: Fibonacci's lattice. The same on every machine, as no
/// library turns them.
std::vector<glm::vec3> half_sphere(std::size_t count) {
  const glm::dvec2 golden(-0.73736887807831990, 0.67549029426152364);  // cosine and sine
  std::vector<glm::vec3> directions;
  glm::dvec2 turn(1, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const double z = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double radius = std::sqrt(1 - z * z);
    directions.emplace_back(radius * turn.x, radius * turn.y, z);
    turn = {turn.x * golden.x - turn.y * golden.y, turn.x * golden.y + turn.y * golden.x};
  }
  return directions;
}

/// Sums over all directions, in whole numbers, which threads may add in any order.
struct HiddenSum {
  std::uint32_t hidden = 0;
  std::uint32_t all = 0;
};

bool add_axis(ParallelRays& rays, const glm::vec3& axis, std::vector<HiddenSum>& sums) {
  constexpr float kUnit = 65536;
  constexpr float kInverseReach = static_cast<float>(1 / kReach);
  if (!rays.cast(axis, {static_cast<float>(kLift), static_cast<float>(kReach)})) return false;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    HiddenSum& sum = sums[rays.point(i)];
    const float near = rays.distance(i) * kInverseReach;
    const float weight = rays.cosine(i) * kUnit;
    sum.all += static_cast<std::uint32_t>(weight);
    sum.hidden += static_cast<std::uint32_t>(weight * std::max(0.0f, 1 - near * near));
  }
  return true;
}

/// Of each point, the share of the light that reaches it; empty where so great a number of
/// triangles overlap that it would take too long.
std::vector<float> visible_shares(const OcclusionPoints& points, std::size_t axes, unsigned jobs) {
  std::vector<glm::vec3> origins = points.positions;
  for (std::size_t i = 0; i < origins.size(); ++i) {
    origins[i] += static_cast<float>(kLift) * points.normals[i];
  }
  const std::vector<glm::vec3> directions = half_sphere(axes);
  const std::size_t parts = std::clamp<std::size_t>(jobs, 1, axes);
  std::vector<std::vector<HiddenSum>> sums(parts);
  std::atomic<bool> all{true};
  parallel_rows(static_cast<std::uint32_t>(parts), jobs, [&](std::uint32_t part) {
    sums[part].resize(origins.size());
    ParallelRays rays(origins, points.normals, points.positions, points.hiding);
    for (std::size_t i = part; i < axes && all; i += parts) {
      if (!add_axis(rays, directions[i], sums[part])) all = false;
    }
  });
  if (!all) return {};
  std::vector<float> shares(origins.size());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    HiddenSum sum;
    for (const std::vector<HiddenSum>& part : sums) {
      sum.hidden += part[i].hidden;
      sum.all += part[i].all;
    }
    shares[i] =
        sum.all == 0 ? 1.0f : 1 - static_cast<float>(sum.hidden) / static_cast<float>(sum.all);
  }
  return shares;
}

/// Light that bounces between surfaces of one albedo, summed over all bounces.
std::uint8_t with_bounces(float visible) {
  const double share = std::clamp(static_cast<double>(visible), 0.0, 1.0);
  return static_cast<std::uint8_t>(std::lround(127 * share / (1 - kAlbedo * (1 - share))));
}

/// Fills in the vertices from their clusters' shares.
void spread_shares(const ChunkedMesh& chunked, const SurfaceCells& clusters,
                   const std::vector<float>& shares, unsigned jobs,
                   Array<std::uint8_t>& occlusion) {
  constexpr std::size_t kRow = 4096;  // vertices that a thread takes at a time
  const std::size_t count = occlusion.size();
  parallel_rows(
      static_cast<std::uint32_t>((count + kRow - 1) / kRow), jobs, [&](std::uint32_t row) {
        SurfaceCells::Reader reader(clusters, shares);
        const std::size_t end = std::min(count, (row + 1) * kRow);
        for (std::size_t v = row * kRow; v < end; ++v) {
          occlusion[v] = with_bounces(reader.at(chunked.mesh.positions[v], chunked.mesh.normals[v],
                                                shares[clusters.of_vertices()[v]]));
        }
      });
}

}  // namespace

Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report,
                                      std::size_t most_points) {
  StageTimer timer(report, "occlusion");
  const std::size_t count = chunked.mesh.positions.size();
  Array<std::uint8_t> occlusion(count, 127);
  std::optional<SurfaceCells> clusters;
  std::vector<float> shares;
  for (; shares.empty(); most_points = std::min(count, most_points) / 8) {
    if (most_points == 0) return occlusion;
    if (count > most_points) clusters.emplace(clusters_of(chunked, most_points));
    const OcclusionPoints points = points_of(chunked, clusters ? &*clusters : nullptr);
    if (points.hiding.empty()) return occlusion;
    shares = visible_shares(points, clusters ? kClusterAxes : kAxes, jobs);
  }
  if (clusters) {
    spread_shares(chunked, *clusters, shares, jobs, occlusion);
  } else {
    std::transform(shares.begin(), shares.end(), occlusion.begin(), with_bounces);
  }
  timer.done(count, shares.size());
  return occlusion;
}

}  // namespace modar
