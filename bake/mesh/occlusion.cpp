// Ambient occlusion by casting rays.
#include "bake/mesh/occlusion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include <glm/geometric.hpp>

#include "bake/mesh/triangle_tree.hpp"
#include "bake/parallel.hpp"

namespace modar {
namespace {

/// Rays of a model: more smooth the shading, and take time (about 1 us each). Set by hand: a model
/// of 60,000 vertices gets the most rays a vertex.
constexpr std::size_t kRays = 2'000'000;
constexpr std::size_t kLeastRays = 6;  ///< a vertex; below, no smoothing helps
/// Against 1024 rays, the share is off by 0.016 (pottery) and 0.021 (spider), root of the mean
/// square; with 64 rays by 0.009 and 0.012, in twice the time.
constexpr std::size_t kMostRays = 32;
/// With fewer rays a vertex, neighbours are averaged: such meshes are dense.
constexpr std::size_t kSmoothRays = 32;
/// Triangles of the tree, where levels allow: 100 bytes each.
constexpr std::size_t kTreeTriangles = 500'000;
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

/// The level that a depth asks for: the coarsest that the chunk has, if it has fewer.
const std::vector<std::uint16_t>& level_of(const Chunk& chunk, std::size_t depth) {
  if (depth == 0 || chunk.coarser.empty()) return chunk.indices;
  return chunk.coarser[std::min(depth, chunk.coarser.size()) - 1].indices;
}

std::size_t triangles_at(const ChunkedMesh& chunked, std::size_t depth) {
  std::size_t count = 0;
  for (const Chunk& chunk : chunked.chunks) count += level_of(chunk, depth).size() / 3;
  return count;
}

std::vector<TriangleTree::Triangle> solid_triangles(const ChunkedMesh& chunked) {
  std::size_t deepest = 0;
  for (const Chunk& chunk : chunked.chunks) deepest = std::max(deepest, chunk.coarser.size());
  std::size_t depth = 0;
  while (depth < deepest && triangles_at(chunked, depth) > kTreeTriangles) ++depth;
  std::vector<TriangleTree::Triangle> triangles;
  for (const Chunk& chunk : chunked.chunks) {
    if (!solid(chunked.mesh.materials[chunk.material])) continue;
    const std::vector<std::uint16_t>& indices = level_of(chunk, depth);
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      triangles.push_back({chunk.vertices[indices[i]], chunk.vertices[indices[i + 1]],
                           chunk.vertices[indices[i + 2]]});
    }
  }
  return triangles;
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

double visible_share(const TriangleTree& tree, const glm::dvec3& position, const glm::dvec3& normal,
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

/// Each vertex becomes the mean of itself and its neighbours, twice.
void smooth(const ChunkedMesh& chunked, Array<float>& shares) {
  Array<float> sums;
  Array<float> weights(shares.size());
  for (int pass = 0; pass < 2; ++pass) {
    sums = shares;
    std::fill(weights.begin(), weights.end(), 1.0f);
    for (const Chunk& chunk : chunked.chunks) {
      for (std::size_t i = 0; i < chunk.indices.size(); ++i) {
        const std::uint32_t a = chunk.vertices[chunk.indices[i]];
        const std::uint32_t b = chunk.vertices[chunk.indices[i % 3 == 2 ? i - 2 : i + 1]];
        sums[a] += shares[b];
        sums[b] += shares[a];
        weights[a] += 1.0f;
        weights[b] += 1.0f;
      }
    }
    for (std::size_t v = 0; v < shares.size(); ++v) shares[v] = sums[v] / weights[v];
  }
}

}  // namespace

Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report) {
  StageTimer timer(report, "occlusion");
  const TriMesh& mesh = chunked.mesh;
  const std::size_t count = mesh.positions.size();
  Array<std::uint8_t> occlusion(count, 127);
  std::vector<TriangleTree::Triangle> triangles = solid_triangles(chunked);
  if (triangles.empty()) return occlusion;
  const TriangleTree tree({mesh.positions.data(), count}, std::move(triangles));
  const std::size_t rays = std::clamp(kRays / count, kLeastRays, kMostRays);
  const std::vector<glm::dvec3> directions = cosine_directions(rays);
  Array<float> shares(count);
  constexpr std::size_t kRow = 256;  // vertices that a thread takes at a time
  parallel_rows(
      static_cast<std::uint32_t>((count + kRow - 1) / kRow), jobs, [&](std::uint32_t row) {
        for (std::size_t v = row * kRow; v < std::min(count, (row + 1) * kRow); ++v) {
          shares[v] = static_cast<float>(
              visible_share(tree, mesh.positions[v], glm::dvec3(mesh.normals[v]), directions));
        }
      });
  if (rays < kSmoothRays) smooth(chunked, shares);
  for (std::size_t v = 0; v < count; ++v) {
    // Light that bounces between surfaces of one albedo, summed over all bounces.
    const double share = std::clamp(static_cast<double>(shares[v]), 0.0, 1.0);
    const double bounced = share / (1 - kAlbedo * (1 - share));
    occlusion[v] = static_cast<std::uint8_t>(std::lround(127 * bounced));
  }
  timer.done(count, rays);
  return occlusion;
}

}  // namespace modar
