#include "formats/transport/context_coder.hpp"

#include <algorithm>

namespace modar {
namespace {

/// Initial weight of the mixed predictions. [0.2, 0.3]
constexpr std::int32_t kFirstWeight = 65536 / 5;
/// Rate at which weights follow, in fractions of error times input. Higher is less exact. [2, 14]
constexpr std::int64_t kLearning = 2;
/// Decisions after which a slot follows no slower.
constexpr std::uint32_t kMostCount = 255;
/// Predictions are held this far from certainty, of 65536.
constexpr int kMinProbability = 16;

}  // namespace

/// The logistic function at 256ths from -8 to 8 (`squash`, of 65536), its inverse (`stretch`, at
/// 4096ths), and shares of an error by which a slot moves, by its count.
struct ContextCoder::Tables {
  std::array<std::int32_t, 4096> squash{};
  std::array<std::int32_t, 4096> stretch{};
  std::array<std::int32_t, kMostCount + 1> share{};

  Tables() {
    constexpr double kStep = 0.99610136947011749;  // e to the power -1/256
    double power = 1;
    for (std::size_t i = 0; i < 2048; ++i, power *= kStep) {
      squash[2048 + i] = std::min(static_cast<std::int32_t>(65536.0 / (1.0 + power)), 65519);
      squash[2048 - i] = 65536 - squash[2048 + i];
    }
    squash[0] = squash[1];
    std::size_t at = 0;
    for (std::size_t p = 0; p < stretch.size(); ++p) {
      while (at + 1 < squash.size() && squash[at] < static_cast<std::int32_t>(p * 16 + 8)) ++at;
      stretch[p] = static_cast<std::int32_t>(at) - 2048;
    }
    // 1 / (count + 1.8): a slot's first decision says most.
    for (std::size_t n = 0; n < share.size(); ++n) {
      share[n] = static_cast<std::int32_t>(655360 / (10 * n + 18));
    }
  }
  [[nodiscard]] int squashed(std::int64_t sum) const {
    return squash[static_cast<std::size_t>(std::clamp<std::int64_t>(sum, -2047, 2047) + 2048)];
  }
};

const ContextCoder::Tables& ContextCoder::tables() {
  static const Tables kTables;
  return kTables;
}

ContextCoder::ContextCoder(std::size_t weight_sets)
    : slots_(kContexts << kTableBits, 0x80000000u),
      weights_(weight_sets * kContexts, kFirstWeight) {}

ContextCoder::ContextCoder(std::size_t weight_sets, std::span<const std::byte> coded)
    : ContextCoder(weight_sets) {
  range_ = RangeCoder(coded);
}

void ContextCoder::learn(Mix& mix, bool decision) const {
  const std::int64_t error = ((decision ? 65535 : 0) - mix.probability) * kLearning;
  for (std::size_t i = 0; i < kContexts; ++i) {
    mix.weights[i] += static_cast<std::int32_t>((inputs_[i] * error + 0x8000) >> 16);
  }
}

bool ContextCoder::code(bool decision, std::uint32_t node, std::size_t first, std::size_t second) {
  const Tables& table = tables();
  Mix mixes[2] = {{weights_.data() + first * kContexts, 0},
                  {weights_.data() + second * kContexts, 0}};
  std::int64_t sums[2] = {0, 0};
  for (std::size_t i = 0; i < kContexts; ++i) {
    std::uint32_t hash = (contexts_[i] + node) * 0x85EBCA6Bu;
    hash ^= hash >> 15;
    hits_[i] = slots_.data() + ((i << kTableBits) | (hash & ((1u << kTableBits) - 1)));
    inputs_[i] = table.stretch[*hits_[i] >> 20];
    sums[0] += std::int64_t{inputs_[i]} * mixes[0].weights[i];
    sums[1] += std::int64_t{inputs_[i]} * mixes[1].weights[i];
  }
  for (std::size_t m = 0; m < 2; ++m) mixes[m].probability = table.squashed(sums[m] >> 16);
  const int mixed = table.squashed((sums[0] + sums[1]) >> 17);
  decision = range_.code(decision, static_cast<std::uint32_t>(std::clamp(mixed, kMinProbability,
                                                                         65536 - kMinProbability)));
  for (Mix& mix : mixes) learn(mix, decision);
  for (std::uint32_t* slot : hits_) {
    const std::uint32_t count = *slot & 1023;
    const std::int64_t error = (decision ? 0x3FFFFF : 0) - static_cast<std::int64_t>(*slot >> 10);
    const auto step = static_cast<std::int32_t>((error * table.share[count]) >> 16);
    const std::uint32_t moved = (*slot >> 10) + static_cast<std::uint32_t>(step);
    *slot = moved << 10 | std::min(count + 1, kMostCount);
  }
  return decision;
}

}  // namespace modar
