// Ambient occlusion by casting rays.
#include "bake/mesh/rays/occlusion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "bake/mesh/rays/triangle_tree.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

/// Against 1024 rays, the share is off by 0.016 (pottery) and 0.021 (spider), root of the mean
/// square; with 64 rays by 0.009 and 0.012, in twice the time.
constexpr std::size_t kRays = 32;
/// Of all clusters, whose shares are averaged with those around them, and of one at least. Four
/// times as many take 1.8 times the time of the stage; a scan of 96,900 vertices is then off by
/// 0.125 rather than 0.126.
constexpr std::size_t kClusterRays = 250'000;
constexpr std::size_t kLeastRays = 8;
/// Model space, half a side is 1: farther surfaces hide nothing. Rooms seen from inside would be
/// dark without a limit. Set by hand, on pictures.
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
  Array<glm::dvec3> positions;
  Array<glm::dvec3> normals;
  std::vector<RayTree::Triangle> hiding;
  /// Of each vertex, the point that stands for it; empty where every vertex is one.
  Array<std::uint32_t> of_vertices;
  double side = 0;  ///< of the cells that clusters lie in
};

/// Calls back with the vertices of every triangle, and whether it hides what is behind it.
template <class Callback>
void each_triangle(const ChunkedMesh& chunked, const Callback& callback) {
  for (const Chunk& chunk : chunked.chunks) {
    const bool hides = solid(chunked.mesh.materials[chunk.material]);
    for (std::size_t i = 0; i + 2 < chunk.indices.size(); i += 3) {
      const std::uint16_t* t = &chunk.indices[i];
      callback(RayTree::Triangle{chunk.vertices[t[0]], chunk.vertices[t[1]], chunk.vertices[t[2]]},
               hides);
    }
  }
}

/// Side of the cells that a surface is to be cut into: about as many hold some of it.
double cell_side(const ChunkedMesh& chunked, std::size_t cells) {
  const Array<glm::dvec3>& p = chunked.mesh.positions;
  double area = 0;
  each_triangle(chunked, [&](const RayTree::Triangle& t, bool) {
    area += 0.5 * glm::length(glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]));
  });
  constexpr double kLeastSide = 1e-4;  // 15 bits a coordinate
  return std::max(kLeastSide, std::sqrt(area / static_cast<double>(cells)));
}

/// One number for the cell and the axis that the normal is nearest to.
std::uint64_t cluster_key(const glm::dvec3& position, const glm::vec3& normal, double side) {
  std::uint64_t key = 0;
  int axis = 0;
  for (int i = 0; i < 3; ++i) {
    key = key << 16 | static_cast<std::uint64_t>((position[i] + 1.0) / side + 1.0);
    if (std::fabs(normal[i]) > std::fabs(normal[axis])) axis = i;
  }
  return key << 3 | static_cast<std::uint64_t>(2 * axis + (normal[axis] < 0 ? 1 : 0));
}

/// Clusters in the order of their first vertices, whose positions they have; normals are means.
OcclusionPoints cluster(const ChunkedMesh& chunked, std::size_t most_points) {
  const TriMesh& mesh = chunked.mesh;
  OcclusionPoints points;
  points.side = cell_side(chunked, most_points);
  points.of_vertices.resize(mesh.positions.size());
  std::unordered_map<std::uint64_t, std::uint32_t> numbers;
  numbers.reserve(2 * most_points);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const auto next = static_cast<std::uint32_t>(points.positions.size());
    const auto [place, added] =
        numbers.try_emplace(cluster_key(mesh.positions[v], mesh.normals[v], points.side), next);
    if (added) {
      points.positions.push_back(mesh.positions[v]);
      points.normals.push_back(glm::dvec3(0.0));
    }
    points.of_vertices[v] = place->second;
    points.normals[place->second] += glm::dvec3(mesh.normals[v]);
  }
  for (glm::dvec3& normal : points.normals) normal = glm::normalize(normal);
  each_triangle(chunked, [&](const RayTree::Triangle& t, bool hides) {
    const RayTree::Triangle c = {points.of_vertices[t[0]], points.of_vertices[t[1]],
                                 points.of_vertices[t[2]]};
    if (hides && c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) points.hiding.push_back(c);
  });
  return points;
}

OcclusionPoints points_of(const ChunkedMesh& chunked, std::size_t most_points) {
  if (chunked.mesh.positions.size() > most_points) return cluster(chunked, most_points);
  OcclusionPoints points;
  points.positions = chunked.mesh.positions;
  points.normals.reserve(chunked.mesh.normals.size());
  for (const glm::vec3& normal : chunked.mesh.normals) points.normals.push_back(glm::dvec3(normal));
  each_triangle(chunked, [&](const RayTree::Triangle& t, bool hides) {
    if (hides) points.hiding.push_back(t);
  });
  return points;
}

/// Directions about +z whose density is that of the cosine: Hammersley's points on a disc, lifted.
std::vector<glm::dvec3> cosine_directions(std::size_t count) {
  std::vector<glm::dvec3> directions;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t bits = static_cast<std::uint32_t>(i);
    double turn = 0;
    for (double digit = 0.5; bits != 0; bits >>= 1, digit /= 2) turn += bits % 2 != 0 ? digit : 0;
    const double square = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double angle = 6.283185307179586 * turn;
    directions.emplace_back(std::sqrt(square) * std::cos(angle),
                            std::sqrt(square) * std::sin(angle), std::sqrt(1 - square));
  }
  return directions;
}

/// An angle that only the place decides, so that vertices of one place see the same.
double turn_of(const glm::dvec3& position) {
  std::uint64_t hash = 0x9E3779B97F4A7C15u;
  for (int axis = 0; axis < 3; ++axis) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(position[axis] + 0.0)) * 0xBF58476D1CE4E5B9u;
    hash ^= hash >> 31;
  }
  return 6.283185307179586 * static_cast<double>(hash >> 11) * 0x1p-53;
}

/// Runs the body for every number below count, on several threads.
template <class Body>
void each_row(std::size_t count, unsigned jobs, const Body& body) {
  constexpr std::size_t kRow = 256;  // that a thread takes at a time
  parallel_rows(static_cast<std::uint32_t>((count + kRow - 1) / kRow), jobs,
                [&](std::uint32_t row) {
                  const std::size_t end = std::min(count, (row + 1) * kRow);
                  for (std::size_t i = row * kRow; i < end; ++i) body(i);
                });
}

double visible_share(const RayTree& tree, const glm::dvec3& position, const glm::dvec3& normal,
                     const std::vector<glm::dvec3>& directions) {
  const glm::dvec3 other = std::fabs(normal.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 across = glm::normalize(glm::cross(other, normal));
  const glm::dvec3 along = glm::cross(normal, across);
  const double turn = turn_of(position);
  const glm::dvec3 u = std::cos(turn) * across + std::sin(turn) * along;
  const glm::dvec3 v = std::cos(turn) * along - std::sin(turn) * across;
  double hidden = 0;
  for (const glm::dvec3& d : directions) {
    const auto hit =
        tree.first_hit(position + kLift * normal, d.x * u + d.y * v + d.z * normal, kLift, kReach);
    if (!hit) continue;
    const double near = hit->distance / kReach;
    hidden += 1 - near * near;
  }
  return 1 - hidden / static_cast<double>(directions.size());
}

/// Pairs of clusters that a triangle's edge joins, both ways, sorted.
std::vector<std::pair<std::uint32_t, std::uint32_t>> cluster_pairs(const ChunkedMesh& chunked,
                                                                   const OcclusionPoints& points) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  each_triangle(chunked, [&](const RayTree::Triangle& t, bool) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = points.of_vertices[t[i]];
      const std::uint32_t b = points.of_vertices[t[(i + 1) % 3]];
      if (a == b) continue;
      const std::pair pair(std::min(a, b), std::max(a, b));
      if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);
    }
  });
  const auto tidy = [&] {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  };
  tidy();
  for (std::size_t i = pairs.size(); i-- > 0;) pairs.emplace_back(pairs[i].second, pairs[i].first);
  tidy();
  return pairs;
}

/// Shares of the vertices from those of the clusters, which are averaged with those around them,
/// twice: near ones that look the same way weigh most.
Array<float> spread_shares(const ChunkedMesh& chunked, const OcclusionPoints& points,
                           Array<float> shares, unsigned jobs) {
  const auto pairs = cluster_pairs(chunked, points);
  std::vector<std::size_t> first(points.positions.size() + 1, 0);
  for (const auto& [a, b] : pairs) ++first[a + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  for (int pass = 0; pass < 2; ++pass) {
    Array<float> means = shares;
    for (std::size_t c = 0; c < means.size(); ++c) {
      double sum = static_cast<double>(shares[c]);
      double weights = 1;
      for (std::size_t i = first[c]; i < first[c + 1]; ++i) {
        const std::uint32_t beside = pairs[i].second;
        const double facing = std::max(0.0, glm::dot(points.normals[c], points.normals[beside]));
        sum += facing * static_cast<double>(shares[beside]);
        weights += facing;
      }
      means[c] = static_cast<float>(sum / weights);
    }
    shares.swap(means);
  }
  const TriMesh& mesh = chunked.mesh;
  Array<float> result(mesh.positions.size());
  const double near = 0.1 * points.side * points.side;  // where weights stop growing; set by hand
  each_row(mesh.positions.size(), jobs, [&](std::size_t v) {
    double sum = 0;
    double weights = 0;
    const auto add = [&](std::uint32_t c) {
      const glm::dvec3 away = points.positions[c] - mesh.positions[v];
      const double facing = glm::dot(points.normals[c], glm::dvec3(mesh.normals[v]));
      const double distance = glm::dot(away, away) + near;
      const double weight = std::max(facing, 0.01) / (distance * distance);
      sum += weight * static_cast<double>(shares[c]);
      weights += weight;
    };
    const std::uint32_t own = points.of_vertices[v];
    add(own);
    for (std::size_t i = first[own]; i < first[own + 1]; ++i) add(pairs[i].second);
    result[v] = static_cast<float>(sum / weights);
  });
  return result;
}

}  // namespace

Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report,
                                      std::size_t most_points) {
  StageTimer timer(report, "occlusion");
  const std::size_t count = chunked.mesh.positions.size();
  Array<std::uint8_t> occlusion(count, 127);
  OcclusionPoints points = points_of(chunked, most_points);
  if (points.hiding.empty()) return occlusion;
  const std::size_t measured = points.positions.size();
  const RayTree tree({points.positions.data(), measured}, points.hiding);
  const std::size_t rays =
      points.of_vertices.empty() ? kRays : std::clamp(kClusterRays / measured, kLeastRays, kRays);
  const std::vector<glm::dvec3> directions = cosine_directions(rays);
  Array<float> shares(measured);
  each_row(measured, jobs, [&](std::size_t i) {
    shares[i] =
        static_cast<float>(visible_share(tree, points.positions[i], points.normals[i], directions));
  });
  if (!points.of_vertices.empty()) shares = spread_shares(chunked, points, std::move(shares), jobs);
  for (std::size_t v = 0; v < count; ++v) {
    // Light that bounces between surfaces of one albedo, summed over all bounces.
    const double share = std::clamp(static_cast<double>(shares[v]), 0.0, 1.0);
    const double bounced = share / (1 - kAlbedo * (1 - share));
    occlusion[v] = static_cast<std::uint8_t>(std::lround(127 * bounced));
  }
  timer.done(count, measured);
  return occlusion;
}

}  // namespace modar
