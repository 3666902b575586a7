// One index over the codes of all patterns, which tells which of them a frame's features may belong
// to. Internal to runtime/track.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "loop_pattern.hpp"
#include "modar/loop_features.hpp"

namespace modar::loop {

/// Locality-sensitive hashing by bit sampling (Indyk & Motwani, 1998): codes that agree in the bits
/// of one of a few tables are compared by 32 further bits. A frame's features are looked up once,
/// whatever the number of patterns; what the look-up costs grows with chance neighbours only.
class CodeIndex {
 public:
  /// Takes the most repeatable codes of each pattern (each group's first). The memory is
  /// proportional to the patterns; nothing is allocated later.
  explicit CodeIndex(std::span<const LoopPattern> patterns);
  /// For each pattern, how many of the features look like one of its own.
  std::span<const std::uint16_t> vote(std::span<const LoopFeature> features);

 private:
  struct Entry {
    std::uint32_t sample = 0;
    std::uint32_t pattern = 0;
  };
  struct Table {
    std::vector<std::uint32_t> starts;  ///< by key, one more than there are keys
    std::vector<Entry> entries;
  };
  std::vector<Table> tables_;
  std::vector<std::uint16_t> votes_;
  std::vector<std::uint32_t> voted_;  ///< by pattern: the last feature that voted for it, plus one
};

}  // namespace modar::loop
