// The order of triangles and vertices inside a chunk: a pure integer function of the chunk's
// content, so that baker and installer agree on every processor and an order never has to travel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace modar {

/// Puts chunks in order. Keeps its working memory between calls; it grows to what the largest chunk
/// needs, about 40 bytes a triangle.
class ChunkOrderer {
 public:
  /// Merges vertices of equal bytes, orders the triangles for a vertex cache, then the vertices by
  /// first use. The result depends on what the chunk *holds* and on nothing else: the same
  /// triangles over the same vertices, in whatever order and from whichever corner they come, give
  /// the same bytes. The winding of each triangle stays. vertices: vertex_count * stride bytes, at
  /// most 65536 vertices. indices: 3 a triangle, each below vertex_count; on return the ordered
  /// triangles, their indices counting in the new order. Returns an old number for each vertex of
  /// the new order (vertices that no triangle uses come last, in the order of their bytes); valid
  /// until the next call.
  std::span<const std::uint16_t> order(std::span<const std::byte> vertices, std::uint32_t stride,
                                       std::span<std::uint16_t> indices);
  /// The new number of a vertex of the last call, by its old one.
  [[nodiscard]] std::uint16_t place(std::uint16_t vertex) const {
    return static_cast<std::uint16_t>(new_of_old_[rank_[vertex]]);
  }

 private:
  void sort_by_digits();
  void rank_vertices(std::span<const std::byte> vertices, std::uint32_t stride);
  void sort_triangles(std::span<std::uint16_t> indices);
  void link_triangles(std::span<const std::uint16_t> indices);
  void order_triangles(std::span<const std::uint16_t> indices);
  std::uint32_t next_fan(std::size_t ring_begin);
  void number_by_first_use(std::span<std::uint16_t> indices);

  struct Key {
    std::uint64_t head;  // the first bytes of the vertex, compared as a number
    std::uint32_t vertex;
  };
  struct Place {
    std::uint32_t live = 0;     // triangles that are not out yet
    std::uint32_t entered = 0;  // when the vertex last entered the cache
  };
  std::vector<Key> unsorted_;
  std::vector<Key> keys_;
  std::vector<std::uint32_t> places_of_digits_;
  std::vector<std::uint16_t> rank_;            // of each old vertex: its place among distinct bytes
  std::vector<std::uint16_t> vertex_of_rank_;  // the lowest old number with those bytes
  std::vector<std::uint64_t> triangles_;       // canonical: lowest rank first, then sorted
  std::uint32_t distinct_ = 0;
  std::vector<std::uint32_t> first_;   // of each vertex: where its triangles begin in around_
  std::vector<std::uint32_t> around_;  // triangles by vertex
  std::vector<Place> places_;          // of each vertex
  std::vector<std::uint64_t>
      waiting_;                        // of each triangle: its corners, 16 bits each; all ones: out
  std::vector<std::uint16_t> recent_;  // vertices seen, latest last: where to go at a dead end
  std::vector<std::uint16_t> ordered_;  // the new triangles
  std::size_t recent_count_ = 0;
  std::size_t ordered_count_ = 0;
  std::vector<std::uint16_t> old_of_new_;
  std::vector<std::uint32_t> new_of_old_;
  std::uint32_t time_ = 0;
  std::uint32_t cursor_ = 0;
};

/// Orders the triangles of a coarser level, whose vertices stay where level 0 has them.
class LevelOrderer {
 public:
  /// indices: 3 a triangle, each below vertex_count (at most 65536). The result depends only on the
  /// set of triangles.
  void order(std::span<std::uint16_t> indices, std::uint32_t vertex_count);

 private:
  ChunkOrderer orderer_;
  std::vector<std::uint16_t> numbers_;
};

/// Numbers vertices by their groups, the lowest first, and inside a group in the order that they
/// have: of each its new number. groups: one a vertex, at most 65536.
std::vector<std::uint16_t> numbers_by_group(std::span<const std::byte> groups);

/// Vertices that a first-in-first-out cache of `cache_size` entries transforms for these triangles;
/// divided by the triangles it is the average cache miss ratio (0.5 is ideal, 3 the worst).
std::uint64_t count_cache_misses(std::span<const std::uint16_t> indices, std::uint32_t cache_size);

}  // namespace modar
