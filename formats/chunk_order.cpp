// Tipsify (Sander, Nehab, Barczak, "Fast triangle reordering for vertex locality and reduced
// overdraw", 2007): fans round one vertex after another, choosing the next among those in the
// cache.
#include "formats/chunk_order.hpp"

#include <algorithm>
#include <cstddef>

namespace modar {
namespace {

/// Entries of the cache that is planned for: the smallest that phones of the class have.
constexpr std::uint32_t kCacheSize = 16;
constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

}  // namespace

void ChunkOrderer::link_triangles(std::span<const std::uint16_t> indices,
                                  std::uint32_t vertex_count) {
  live_.assign(vertex_count, 0);
  for (const std::uint16_t v : indices) ++live_[v];
  first_.resize(vertex_count + 1);
  std::uint32_t sum = 0;
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    first_[v] = sum;
    sum += live_[v];
  }
  first_[vertex_count] = sum;
  around_.resize(indices.size());
  new_of_old_.assign(first_.begin(), first_.end() - 1);  // the next free place of each vertex
  for (std::size_t i = 0; i < indices.size(); ++i) {
    around_[new_of_old_[indices[i]]++] = static_cast<std::uint32_t>(i / 3);
  }
}

/// The vertex to fan round next: of those just emitted the one that will still be in the cache when
/// its triangles are out, the oldest such; else the latest seen that has triangles left; else the
/// next in number.
std::uint32_t ChunkOrderer::next_fan(std::uint32_t vertex_count, std::size_t ring_begin) {
  std::uint32_t best = kNoVertex;
  std::uint32_t best_age = 0;
  for (std::size_t i = ring_begin; i < ordered_.size(); ++i) {
    const std::uint32_t v = ordered_[i];
    if (live_[v] == 0) continue;
    const std::uint32_t age = time_ - entered_[v];
    const std::uint32_t rank = age + 2 * live_[v] <= kCacheSize ? age + 1 : 1;
    if (rank > best_age) {
      best = v;
      best_age = rank;
    }
  }
  if (best != kNoVertex) return best;
  while (!recent_.empty()) {
    const std::uint16_t v = recent_.back();
    recent_.pop_back();
    if (live_[v] != 0) return v;
  }
  for (; cursor_ < vertex_count; ++cursor_) {
    if (live_[cursor_] != 0) return cursor_;
  }
  return kNoVertex;
}

void ChunkOrderer::order_triangles(std::span<const std::uint16_t> indices,
                                   std::uint32_t vertex_count) {
  entered_.assign(vertex_count, 0);
  done_.assign(indices.size() / 3, 0);
  recent_.clear();
  ordered_.clear();
  ordered_.reserve(indices.size());
  time_ = kCacheSize + 1;
  cursor_ = 0;
  std::uint32_t fan = next_fan(vertex_count, 0);
  while (fan != kNoVertex) {
    const std::size_t ring_begin = ordered_.size();
    for (std::uint32_t k = first_[fan]; k < first_[fan + 1]; ++k) {
      const std::uint32_t triangle = around_[k];
      if (done_[triangle] != 0) continue;
      done_[triangle] = 1;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint16_t v = indices[3 * std::size_t{triangle} + c];
        ordered_.push_back(v);
        recent_.push_back(v);
        --live_[v];
        if (time_ - entered_[v] > kCacheSize) entered_[v] = time_++;
      }
    }
    fan = next_fan(vertex_count, ring_begin);
  }
}

std::span<const std::uint16_t> ChunkOrderer::order(std::span<std::uint16_t> indices,
                                                   std::uint32_t vertex_count) {
  link_triangles(indices, vertex_count);
  order_triangles(indices, vertex_count);
  new_of_old_.assign(vertex_count, kNoVertex);
  old_of_new_.clear();
  old_of_new_.reserve(vertex_count);
  for (std::size_t i = 0; i < ordered_.size(); ++i) {
    const std::uint16_t v = ordered_[i];
    if (new_of_old_[v] == kNoVertex) {
      new_of_old_[v] = static_cast<std::uint32_t>(old_of_new_.size());
      old_of_new_.push_back(v);
    }
    indices[i] = static_cast<std::uint16_t>(new_of_old_[v]);
  }
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    if (new_of_old_[v] == kNoVertex) old_of_new_.push_back(static_cast<std::uint16_t>(v));
  }
  return old_of_new_;
}

std::uint64_t count_cache_misses(std::span<const std::uint16_t> indices, std::uint32_t cache_size) {
  std::vector<std::uint64_t> entered(65536, 0);
  std::uint64_t misses = 0;
  std::uint64_t time = cache_size + 1;
  for (const std::uint16_t v : indices) {
    if (time - entered[v] <= cache_size) continue;
    entered[v] = time++;
    ++misses;
  }
  return misses;
}

}  // namespace modar
