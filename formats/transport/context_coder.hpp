// Adaptive arithmetic coding of binary decisions: each is predicted from several contexts, whose
// predictions are mixed by weights that learn (Mahoney, "Adaptive weighing of context models for
// lossless data compression", 2005). Integers only: the same bytes on every processor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/transport/range_coder.hpp"

namespace modar {

/// Encodes decisions, or decodes them: a model that calls code() with the same contexts serves both
/// ways. Takes 2.4 MB and some 50 ns a decision on a workstation of 2020.
class ContextCoder {
 public:
  static constexpr std::size_t kContexts = 9;

  /// An encoder. weight_sets: numbers of sets that code() receives.
  explicit ContextCoder(std::size_t weight_sets);
  /// A decoder of those bytes, which must outlive it.
  ContextCoder(std::size_t weight_sets, std::span<const std::byte> coded);

  /// Of the decisions that follow. Differing contexts have differing hashes, as far as possible.
  void set_context(std::size_t index, std::uint32_t hash) { contexts_[index] = hash * 0x9E3779B1u; }
  /// Encodes the decision and answers it, or answers the decoded one. node: which decision of a
  /// symbol this is. first, second: two different sets of weights, chosen by what little tells.
  bool code(bool decision, std::uint32_t node, std::size_t first, std::size_t second);

  /// Coded bytes that decisions so far depend on.
  [[nodiscard]] std::size_t read() const { return range_.read(); }
  /// More was decoded than the bytes hold.
  [[nodiscard]] bool overrun() const { return range_.overrun(); }
  /// The encoded bytes; nothing may be coded after.
  std::vector<std::byte> finish() { return range_.finish(); }

 private:
  static constexpr unsigned kTableBits = 16;
  struct Tables;
  struct Mix {
    std::int32_t* weights;
    int probability;  ///< of a decision that holds, of 65536
  };
  static const Tables& tables();
  void learn(Mix& mix, bool decision) const;

  RangeCoder range_;
  std::vector<std::uint32_t> slots_;   ///< a probability of 22 bits, then a count of 10
  std::vector<std::int32_t> weights_;  ///< 65536: one
  std::array<std::uint32_t, kContexts> contexts_{};
  std::array<std::uint32_t*, kContexts> hits_{};
  std::array<std::int32_t, kContexts> inputs_{};
};

}  // namespace modar
