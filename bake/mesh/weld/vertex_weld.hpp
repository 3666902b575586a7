// Finds the vertex of an index triple.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "bake/import/source_model.hpp"

namespace modar {

/// Numbers distinct (position, uv, normal) triples by first use. They hang in a list at their
/// position: corners that share a position stand near each other in files, so no hash is needed but
/// for hubs with very many vertices.
class VertexWeld {
 public:
  explicit VertexWeld(std::size_t position_count) : first_(position_count, kNoIndex) {}

  std::uint32_t vertex(const Corner& key) {
    std::uint32_t steps = 0;
    for (std::uint32_t v = first_[key.position]; v != kNoIndex; v = next_[v]) {
      if (keys_[v].uv == key.uv && keys_[v].normal == key.normal) return v;
      if (++steps == kMaxSteps) return from_hub(key);
    }
    return add(key);
  }

  /// The triple of each vertex.
  [[nodiscard]] const Array<Corner>& keys() const { return keys_; }
  /// Ends the search; frees all but the keys.
  void finish() {
    first_.release();
    next_.release();
    hubs_.clear();
  }

 private:
  static constexpr std::uint32_t kMaxSteps = 64;

  std::uint32_t add(const Corner& key);
  std::uint32_t from_hub(const Corner& key);

  Array<std::uint32_t> first_;  // of each position
  Array<std::uint32_t> next_;   // of each vertex
  Array<Corner> keys_;          // of each vertex
  std::unordered_map<std::uint32_t, std::unordered_map<std::uint64_t, std::uint32_t>> hubs_;
};

}  // namespace modar
