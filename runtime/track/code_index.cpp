// Hash tables over sampled bits of all patterns' codes.
#include "code_index.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "kernels.hpp"

namespace modar::loop {
namespace {

constexpr std::size_t kTables = 8;
constexpr unsigned kKeyBits = 14;  // and one for the corner's polarity
constexpr std::size_t kKeys = std::size_t{1} << (kKeyBits + 1);
constexpr std::size_t kIndexed = 512;  // codes of a pattern and polarity
constexpr int kSampleBits = 9;         // of 32: those of one place differ in some 5, chance in 16

using Code = std::array<std::uint8_t, kCodeBytes>;

/// Which 14 and 32 bits of a code each table looks at: a fixed shuffle of all 256.
struct Bits {
  std::array<std::uint8_t, kKeyBits> key{};
  std::array<std::uint8_t, 32> sample{};
};

std::array<Bits, kTables> shuffled_bits() {
  std::array<Bits, kTables> tables{};
  std::array<std::uint8_t, 256> order{};
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint8_t>(i);
  std::uint64_t state = 0x9E3779B97F4A7C15ull;
  for (Bits& bits : tables) {
    for (std::size_t i = order.size() - 1; i > 0; --i) {
      state = state * 6364136223846793005ull + 1442695040888963407ull;
      std::swap(order[i], order[static_cast<std::size_t>(state >> 33) % (i + 1)]);
    }
    std::copy_n(order.begin(), kKeyBits, bits.key.begin());
    std::copy_n(order.begin() + kKeyBits, bits.sample.size(), bits.sample.begin());
  }
  return tables;
}

template <std::size_t N>
std::uint32_t gather(const Code& code, const std::array<std::uint8_t, N>& bits) {
  std::uint32_t out = 0;
  for (const std::uint8_t bit : bits) {
    out = out << 1 | ((static_cast<std::uint32_t>(code[bit / 8]) >> (bit % 8)) & 1u);
  }
  return out;
}

const std::array<Bits, kTables>& table_bits() {
  static const std::array<Bits, kTables> kBits = shuffled_bits();
  return kBits;
}

std::uint32_t key_of(const Code& code, bool dark, const Bits& bits) {
  return gather(code, bits.key) << 1 | (dark ? 1u : 0u);
}

/// Calls visit(code, dark) for the codes of a pattern that the index holds.
template <class Visit>
void each_code(const LoopPattern& pattern, Visit&& visit) {
  for (const bool dark : {false, true}) {
    const std::size_t first = dark ? pattern.bright_count : 0;
    const std::size_t last = dark ? pattern.features.size() : pattern.bright_count;
    for (std::size_t i = first; i < std::min(last, first + kIndexed); ++i) {
      const std::uint8_t* block = pattern.codes + i / kBlockCodes * kBlockCodes * kCodeBytes;
      Code code;
      for (std::size_t k = 0; k < code.size(); ++k) {
        code[k] = block[k * kBlockCodes + i % kBlockCodes];
      }
      visit(code, dark);
    }
  }
}

}  // namespace

CodeIndex::CodeIndex(std::span<const LoopPattern> patterns)
    : tables_(kTables), votes_(patterns.size()), voted_(patterns.size()) {
  for (std::size_t t = 0; t < kTables; ++t) {
    const Bits& bits = table_bits()[t];
    Table& table = tables_[t];
    table.starts.assign(kKeys + 1, 0);
    const auto count = [&](const Code& code, bool dark) {
      ++table.starts[key_of(code, dark, bits) + 1];
    };
    for (const LoopPattern& pattern : patterns) each_code(pattern, count);
    for (std::size_t key = 0; key < kKeys; ++key) table.starts[key + 1] += table.starts[key];
    table.entries.resize(table.starts[kKeys]);
    std::vector<std::uint32_t> next(table.starts.begin(), table.starts.end() - 1);
    for (std::uint32_t p = 0; p < patterns.size(); ++p) {
      each_code(patterns[p], [&](const Code& code, bool dark) {
        table.entries[next[key_of(code, dark, bits)]++] = {gather(code, bits.sample), p};
      });
    }
  }
}

std::span<const std::uint16_t> CodeIndex::vote(std::span<const LoopFeature> features) {
  std::fill(votes_.begin(), votes_.end(), std::uint16_t{0});
  std::fill(voted_.begin(), voted_.end(), 0u);
  std::uint32_t now = 0;
  for (const LoopFeature& feature : features) {
    ++now;
    for (std::size_t t = 0; t < kTables; ++t) {
      const Bits& bits = table_bits()[t];
      const Table& table = tables_[t];
      const std::uint32_t key = key_of(feature.code, feature.dark != 0, bits);
      const std::uint32_t last = table.starts[key + 1];
      if (table.starts[key] == last) continue;
      const std::uint32_t sample = gather(feature.code, bits.sample);
      for (std::uint32_t i = table.starts[key]; i < last; ++i) {
        const Entry& entry = table.entries[i];
        if (std::popcount(entry.sample ^ sample) > kSampleBits || voted_[entry.pattern] == now) {
          continue;
        }
        voted_[entry.pattern] = now;
        ++votes_[entry.pattern];
      }
    }
  }
  return votes_;
}

}  // namespace modar::loop
