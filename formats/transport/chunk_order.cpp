// Tipsify (Sander, Nehab, Barczak, "Fast triangle reordering for vertex locality and reduced
// overdraw", 2007): fans round one vertex after another, choosing the next among those in the
// cache.
#include "formats/transport/chunk_order.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

namespace modar {
namespace {

/// Entries of the cache that is planned for: the smallest that phones of the class have.
constexpr std::uint32_t kCacheSize = 16;
/// Vertices are sorted by their first bits, three digits of this many, then compared where these
/// are the same: 33 bits hold two of a position's 16-bit coordinates.
constexpr unsigned kDigitBits = 11;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr std::uint64_t kOut = ~std::uint64_t{0};  ///< no corners: they have 48 bits
constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;

}  // namespace

/// Sorts keys_ by their first bits, the last digit first; those with the same stay in order.
void ChunkOrderer::sort_by_digits() {
  for (unsigned shift = 64 - 3 * kDigitBits; shift < 64; shift += kDigitBits) {
    const auto digit = [&](const Key& key) {
      return static_cast<std::size_t>(key.head >> shift) & (kDigits - 1);
    };
    places_of_digits_.assign(kDigits + 1, 0);
    for (const Key& key : keys_) ++places_of_digits_[digit(key) + 1];
    for (std::size_t d = 0; d < kDigits; ++d) places_of_digits_[d + 1] += places_of_digits_[d];
    unsorted_.swap(keys_);
    keys_.resize(unsorted_.size());
    for (const Key& key : unsorted_) keys_[places_of_digits_[digit(key)]++] = key;
  }
}

void ChunkOrderer::rank_vertices(std::span<const std::byte> vertices, std::uint32_t stride) {
  const std::size_t count = vertices.size() / stride;
  const std::size_t head_bytes = std::min<std::size_t>(stride, 8);
  keys_.resize(count);
  for (std::size_t v = 0; v < count; ++v) {
    std::uint64_t head = 0;
    for (std::size_t i = 0; i < head_bytes; ++i) {
      head = head << 8 | std::to_integer<std::uint64_t>(vertices[v * stride + i]);
    }
    // A stride below 8 bytes fills only the high bytes of the head.
    head <<= 8 * (8 - head_bytes);
    keys_[v] = {head, static_cast<std::uint32_t>(v)};
  }
  sort_by_digits();
  const auto compare = [&](const Key& a, const Key& b) {
    return std::memcmp(vertices.data() + std::size_t{a.vertex} * stride,
                       vertices.data() + std::size_t{b.vertex} * stride, stride);
  };
  const auto before = [&](const Key& a, const Key& b) {
    if (a.head != b.head) return a.head < b.head;
    const int bytes = compare(a, b);
    return bytes != 0 ? bytes < 0 : a.vertex < b.vertex;
  };
  const auto same_digits = [](const Key& a, const Key& b) {
    return (a.head ^ b.head) >> (64 - 3 * kDigitBits) == 0;
  };
  for (std::size_t begin = 0, end = 0; begin < count; begin = end) {
    for (end = begin + 1; end < count && same_digits(keys_[begin], keys_[end]);) ++end;
    if (end - begin == 1) continue;
    std::sort(keys_.begin() + static_cast<std::ptrdiff_t>(begin),
              keys_.begin() + static_cast<std::ptrdiff_t>(end), before);
  }
  rank_.resize(count);
  vertex_of_rank_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    if (i == 0 || keys_[i].head != keys_[i - 1].head || compare(keys_[i], keys_[i - 1]) != 0) {
      vertex_of_rank_.push_back(static_cast<std::uint16_t>(keys_[i].vertex));
    }
    rank_[keys_[i].vertex] = static_cast<std::uint16_t>(vertex_of_rank_.size() - 1);
  }
  distinct_ = static_cast<std::uint32_t>(vertex_of_rank_.size());
}

/// Writes the triangles as ranks, each starting at its lowest one, and sorts them: a counting sort
/// on the first corner, then comparisons among the few triangles that share it.
void ChunkOrderer::sort_triangles(std::span<std::uint16_t> indices) {
  first_.assign(distinct_ + 1, 0);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    std::uint16_t* t = indices.data() + i;
    for (std::size_t c = 0; c < 3; ++c) t[c] = rank_[t[c]];
    // Where the lowest rank occurs twice, start at the one followed by lower ranks.
    const auto from = [&](std::size_t c) {
      return std::uint64_t{t[c]} << 32 | std::uint64_t{t[(c + 1) % 3]} << 16 | t[(c + 2) % 3];
    };
    const std::uint64_t least = std::min({from(0), from(1), from(2)});
    for (std::size_t c = 0; c < 3; ++c) t[c] = static_cast<std::uint16_t>(least >> (32 - 16 * c));
    ++first_[t[0] + std::size_t{1}];
  }
  for (std::uint32_t v = 0; v < distinct_; ++v) first_[v + 1] += first_[v];
  triangles_.resize(indices.size() / 3);
  new_of_old_.assign(first_.begin(), first_.end() - 1);  // the next free place of each vertex
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    triangles_[new_of_old_[indices[i]]++] =
        std::uint64_t{indices[i + 1]} << 16 | std::uint64_t{indices[i + 2]};
  }
  for (std::uint32_t v = 0; v < distinct_; ++v) {
    const auto all = triangles_.begin();
    std::sort(all + static_cast<std::ptrdiff_t>(first_[v]),
              all + static_cast<std::ptrdiff_t>(first_[v + 1]));
    for (std::size_t t = first_[v]; t < first_[v + 1]; ++t) {
      indices[3 * t] = static_cast<std::uint16_t>(v);
      indices[3 * t + 1] = static_cast<std::uint16_t>(triangles_[t] >> 16);
      indices[3 * t + 2] = static_cast<std::uint16_t>(triangles_[t]);
    }
  }
}

void ChunkOrderer::link_triangles(std::span<const std::uint16_t> indices) {
  places_.assign(distinct_, Place());
  for (const std::uint16_t v : indices) ++places_[v].live;
  first_.resize(distinct_ + 1);
  std::uint32_t sum = 0;
  for (std::uint32_t v = 0; v < distinct_; ++v) {
    first_[v] = sum;
    sum += places_[v].live;
  }
  first_[distinct_] = sum;
  around_.resize(indices.size());
  new_of_old_.assign(first_.begin(), first_.end() - 1);  // the next free place of each vertex
  for (std::size_t i = 0; i < indices.size(); ++i) {
    around_[new_of_old_[indices[i]]++] = static_cast<std::uint32_t>(i / 3);
  }
}

/// The vertex to fan round next: of those just emitted the one that will still be in the cache when
/// its triangles are out, the oldest such; else the latest seen that has triangles left; else the
/// next in number.
std::uint32_t ChunkOrderer::next_fan(std::size_t ring_begin) {
  std::uint32_t best = kNoVertex;
  std::uint32_t best_age = 0;
  for (std::size_t i = ring_begin; i < ordered_count_; ++i) {
    const std::uint32_t v = ordered_[i];
    const Place place = places_[v];
    if (place.live == 0) continue;
    const std::uint32_t age = time_ - place.entered;
    const std::uint32_t rank = age + 2 * place.live <= kCacheSize ? age + 1 : 1;
    if (rank > best_age) {
      best = v;
      best_age = rank;
    }
  }
  if (best != kNoVertex) return best;
  while (recent_count_ != 0) {
    const std::uint16_t v = recent_[--recent_count_];
    if (places_[v].live != 0) return v;
  }
  for (; cursor_ < distinct_; ++cursor_) {
    if (places_[cursor_].live != 0) return cursor_;
  }
  return kNoVertex;
}

void ChunkOrderer::order_triangles(std::span<const std::uint16_t> indices) {
  // One read tells whether the triangle has been emitted and what its corners are.
  waiting_.resize(indices.size() / 3);
  for (std::size_t t = 0; t < waiting_.size(); ++t) {
    waiting_[t] = std::uint64_t{indices[3 * t]} | std::uint64_t{indices[3 * t + 1]} << 16 |
                  std::uint64_t{indices[3 * t + 2]} << 32;
  }
  recent_.resize(indices.size());
  ordered_.resize(indices.size());
  recent_count_ = ordered_count_ = 0;
  time_ = kCacheSize + 1;
  cursor_ = 0;
  std::uint32_t fan = next_fan(0);
  while (fan != kNoVertex) {
    const std::size_t ring_begin = ordered_count_;
    for (std::uint32_t k = first_[fan]; k < first_[fan + 1]; ++k) {
      std::uint64_t& waiting = waiting_[around_[k]];
      const std::uint64_t corners = waiting;
      if (corners == kOut) continue;
      waiting = kOut;
      for (unsigned c = 0; c < 3; ++c) {
        const auto v = static_cast<std::uint16_t>(corners >> (16 * c));
        ordered_[ordered_count_++] = v;
        recent_[recent_count_++] = v;
        Place& place = places_[v];
        --place.live;
        if (time_ - place.entered > kCacheSize) place.entered = time_++;
      }
    }
    fan = next_fan(ring_begin);
  }
}

void ChunkOrderer::number_by_first_use(std::span<std::uint16_t> indices) {
  new_of_old_.assign(distinct_, kNoVertex);
  old_of_new_.clear();
  old_of_new_.reserve(distinct_);
  for (std::size_t i = 0; i < ordered_.size(); ++i) {
    const std::uint16_t v = ordered_[i];
    if (new_of_old_[v] == kNoVertex) {
      new_of_old_[v] = static_cast<std::uint32_t>(old_of_new_.size());
      old_of_new_.push_back(vertex_of_rank_[v]);
    }
    indices[i] = static_cast<std::uint16_t>(new_of_old_[v]);
  }
  for (std::uint32_t v = 0; v < distinct_; ++v) {
    if (new_of_old_[v] != kNoVertex) continue;
    new_of_old_[v] = static_cast<std::uint32_t>(old_of_new_.size());
    old_of_new_.push_back(vertex_of_rank_[v]);
  }
}

std::span<const std::uint16_t> ChunkOrderer::order(std::span<const std::byte> vertices,
                                                   std::uint32_t stride,
                                                   std::span<std::uint16_t> indices) {
  rank_vertices(vertices, stride);
  sort_triangles(indices);
  link_triangles(indices);
  order_triangles(indices);
  number_by_first_use(indices);
  return old_of_new_;
}

void LevelOrderer::order(std::span<std::uint16_t> indices, std::uint32_t vertex_count) {
  for (std::size_t v = numbers_.size(); v < vertex_count; ++v) {
    numbers_.push_back(static_cast<std::uint16_t>(v));
  }
  // Vertices are ranked by number here, so that none are merged.
  const auto numbers = std::span<const std::uint16_t>(numbers_).first(vertex_count);
  const auto old = orderer_.order(std::as_bytes(numbers), sizeof numbers_[0], indices);
  for (std::uint16_t& index : indices) index = old[index];
}

std::vector<std::uint16_t> numbers_by_group(std::span<const std::byte> groups) {
  std::array<std::uint32_t, 257> next{};  // of each group: the next number
  for (const std::byte group : groups) ++next[std::to_integer<std::size_t>(group) + 1];
  for (std::size_t g = 1; g < next.size(); ++g) next[g] += next[g - 1];
  std::vector<std::uint16_t> numbers;
  numbers.reserve(groups.size());
  for (const std::byte group : groups) {
    numbers.push_back(static_cast<std::uint16_t>(next[std::to_integer<std::size_t>(group)]++));
  }
  return numbers;
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
