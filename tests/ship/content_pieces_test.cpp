#include "bake/ship/content_pieces.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <set>
#include <string>

namespace modar {
namespace {

std::vector<std::byte> noise(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return bytes;
}

std::multiset<std::string> pieces_of(const std::vector<std::byte>& bytes) {
  std::multiset<std::string> pieces;
  std::size_t at = 0;
  for (const std::size_t size : content_pieces(bytes, 1)) {
    pieces.emplace(reinterpret_cast<const char*>(bytes.data()) + at, size);
    at += size;
  }
  EXPECT_EQ(at, bytes.size());
  return pieces;
}

TEST(ContentPieces, SizesStayInTheirRange) {
  for (const std::size_t unit : {1u, 8u}) {
    const auto sizes = content_pieces(noise(10'000'000, 1), unit);
    EXPECT_EQ(std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}), 10'000'000u);
    for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
      EXPECT_GE(sizes[i], 8u << 10);
      EXPECT_LE(sizes[i], 256u << 10);
      EXPECT_EQ(sizes[i] % unit, 0u);
    }
    EXPECT_GT(sizes.size(), 10'000'000u / (128 << 10));
    EXPECT_LT(sizes.size(), 10'000'000u / (32 << 10));
  }
}

TEST(ContentPieces, AnInsertionMovesFewCuts) {
  auto bytes = noise(4'000'000, 2);
  const auto before = pieces_of(bytes);
  bytes.insert(bytes.begin() + 1'500'000, std::byte{7});
  std::size_t fresh = 0;
  for (const std::string& piece : pieces_of(bytes)) fresh += before.contains(piece) ? 0u : 1u;
  EXPECT_GE(fresh, 1u);
  EXPECT_LE(fresh, 3u);
}

TEST(ContentPieces, NothingAndLittle) {
  EXPECT_TRUE(content_pieces({}, 1).empty());
  EXPECT_EQ(content_pieces(noise(5, 3), 8), std::vector<std::size_t>{5});
}

}  // namespace
}  // namespace modar
