// The order of triangles and vertices inside a chunk: a pure function of integers, so that baker
// and installer agree on every processor and an order never has to travel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace modar {

/// Puts chunks in order. Holds its scratch between chunks: memory grows to the largest one (about
/// 30 bytes a triangle), then nothing is allocated.
class ChunkOrderer {
 public:
  /// Orders a chunk's triangles for a vertex cache, then its vertices by first use.
  /// indices: 3 a triangle, each below vertex_count (at most 65536); on return the ordered
  /// triangles, their indices counting in the new vertex order.
  /// Returns the old number of each vertex in the new order, vertex_count entries (vertices that no
  /// triangle uses come last, in their old order); valid until the next call.
  /// The winding of each triangle stays. The result depends on nothing but the arguments.
  std::span<const std::uint16_t> order(std::span<std::uint16_t> indices,
                                       std::uint32_t vertex_count);

 private:
  void link_triangles(std::span<const std::uint16_t> indices, std::uint32_t vertex_count);
  void order_triangles(std::span<const std::uint16_t> indices, std::uint32_t vertex_count);
  std::uint32_t next_fan(std::uint32_t vertex_count, std::size_t ring_begin);

  std::vector<std::uint32_t> first_;    // of each vertex: where its triangles begin in around_
  std::vector<std::uint32_t> around_;   // triangles by vertex
  std::vector<std::uint32_t> live_;     // triangles of each vertex that are not out yet
  std::vector<std::uint32_t> entered_;  // of each vertex: when it last entered the cache
  std::vector<std::uint8_t> done_;      // of each triangle
  std::vector<std::uint16_t> recent_;   // vertices seen, latest last: where to go at a dead end
  std::vector<std::uint16_t> ordered_;  // the new triangles
  std::vector<std::uint16_t> old_of_new_;
  std::vector<std::uint32_t> new_of_old_;
  std::uint32_t time_ = 0;
  std::uint32_t cursor_ = 0;
};

/// Vertices that a first-in-first-out cache of `cache_size` entries transforms for these triangles;
/// divided by the triangles it is the average cache miss ratio (0.5 is ideal, 3 the worst).
std::uint64_t count_cache_misses(std::span<const std::uint16_t> indices, std::uint32_t cache_size);

}  // namespace modar
