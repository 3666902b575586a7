// Decimates a chunk: a sequence of edge collapses over its vertices. Internal to lod.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace modar {

inline constexpr std::uint16_t kNoTwin = 0xFFFF;

/// The vertices of a chunk. uvs: one a position, in a unit of the caller's, or none. twins: for
/// each vertex the other one at its place, across a seam; kNoTwin if none; or none at
/// all.
struct ChunkVertices {
  std::span<const glm::dvec3> positions;
  std::span<const glm::dvec2> uvs;
  std::span<const std::uint16_t> twins = {};
};

struct DecimateLimits {
  /// No collapse whose vertex is farther from the planes that it represents (root mean square,
  /// weighted by area).
  double max_error = 0;
  /// No collapse that shifts the uv of a removed vertex by more.
  double max_uv_shift = 0;
  /// Length on the surface that a unit of uv covers: the price of a collapse counts both.
  double length_of_uv = 0;
  /// Stops at this number of triangles.
  std::size_t least_triangles = 0;
};

/// Collapses of one chunk, cheapest first: any number of the first of them is a coarser level.
struct CollapseSequence {
  struct Collapse {
    std::uint16_t from = 0;
    std::uint16_t to = 0;
  };
  std::vector<Collapse> collapses;
  std::vector<float> prices;             ///< greatest up to each collapse: never falling
  std::vector<std::uint8_t> paired;      ///< 1: the next one is of the same seam's other side
  std::vector<std::uint32_t> triangles;  ///< left after each collapse
};

/// Collapses edges in the order of quadric errors (Garland and Heckbert, "Surface simplification
/// using quadric error metrics", 1997) and of the shift of uvs. Every collapse keeps one of its two
/// vertices unchanged, so that the result indexes the same vertices. Vertices on a rim (an edge of
/// one triangle) move along it, twins along their seam, both to one place in two successive
/// collapses. Kept unchanged: vertices that are `locked`, and those that are not manifold.
CollapseSequence decimate_chunk(const ChunkVertices& vertices,
                                std::span<const std::uint16_t> indices,
                                std::span<const std::uint8_t> locked, const DecimateLimits& limits);

/// The vertex that each vertex has become after the first `count` collapses.
std::vector<std::uint16_t> collapsed_vertices(const CollapseSequence& sequence, std::size_t count,
                                              std::size_t vertex_count);

}  // namespace modar
