#include "bake/ship/content_pieces.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace modar {
namespace {

// Bytes of a piece. Smaller pieces shrink updates, larger ones shrink recipes and requests; compare
// with tests/bench/ship_peers.py.
constexpr std::size_t kMinPieceBytes = 8 << 10;
constexpr std::size_t kUsual = 64 << 10;
constexpr std::size_t kMost = 256 << 10;
// The normalised chunking of FastCDC, level 2: two mask bits more before the usual size, two fewer
// after it.
constexpr std::uint64_t kRareMask = ((std::uint64_t{1} << 18) - 1) << 40;
constexpr std::uint64_t kCommonMask = ((std::uint64_t{1} << 14) - 1) << 40;

/// A random number for each byte value (SplitMix64). Never to be changed: other numbers cut other
/// pieces, and devices download everything again.
constexpr std::array<std::uint64_t, 256> make_gear() {
  std::array<std::uint64_t, 256> gear{};
  std::uint64_t state = 0x6d6f646172;  // "modar"
  for (std::uint64_t& number : gear) {
    state += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    number = z ^ z >> 31;
  }
  return gear;
}
constexpr std::array<std::uint64_t, 256> kGear = make_gear();

std::size_t first_piece(std::span<const std::byte> bytes) {
  const std::size_t end = std::min(bytes.size(), kMost);
  std::uint64_t hash = 0;
  for (std::size_t i = std::min(kMinPieceBytes, end); i < end; ++i) {
    hash = (hash << 1) + kGear[std::to_integer<std::size_t>(bytes[i])];
    if ((hash & (i < kUsual ? kRareMask : kCommonMask)) == 0) return i + 1;
  }
  return end;
}

}  // namespace

std::vector<std::size_t> content_pieces(std::span<const std::byte> bytes, std::size_t unit) {
  std::vector<std::size_t> sizes;
  while (!bytes.empty()) {
    const std::size_t size = (first_piece(bytes) + unit - 1) / unit * unit;
    sizes.push_back(std::min(size, bytes.size()));
    bytes = bytes.subspan(sizes.back());
  }
  return sizes;
}

}  // namespace modar
