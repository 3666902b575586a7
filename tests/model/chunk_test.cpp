// Order and chunks: nothing lost, nothing twice, kinder to the cache.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <set>

#include "formats/chunk_order.hpp"
#include "tests/model/stages.hpp"

namespace modar {
namespace {

using testing::chunked;
using testing::grid;
using testing::parse;
using testing::welded;

using Triangle = std::array<std::uint32_t, 3>;
Triangle rotated(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

TEST(ChunkOrder, KeepsTrianglesAndHelpsTheCache) {
  const int n = 100;
  std::vector<std::uint16_t> indices;
  const auto at = [&](int x, int y) { return static_cast<std::uint16_t>(y * (n + 1) + x); };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      indices.insert(indices.end(), {at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y),
                                     at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  std::vector<std::array<std::uint16_t, 3>> shuffled(indices.size() / 3);
  std::memcpy(shuffled.data(), indices.data(), 2 * indices.size());
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(5));
  std::memcpy(indices.data(), shuffled.data(), 2 * indices.size());

  std::multiset<Triangle> before;
  for (const auto& t : shuffled) before.insert(rotated({t[0], t[1], t[2]}));
  const double random_ratio = double(count_cache_misses(indices, 16)) / double(shuffled.size());
  std::vector<std::uint16_t> ordered = indices;
  ChunkOrderer orderer;
  const std::vector<std::uint16_t> old = [&] {
    const auto span = orderer.order(ordered, (n + 1) * (n + 1));
    return std::vector<std::uint16_t>(span.begin(), span.end());
  }();
  std::multiset<Triangle> after;
  std::uint32_t highest = 0;
  for (std::size_t i = 0; i < ordered.size(); i += 3) {
    after.insert(rotated({old[ordered[i]], old[ordered[i + 1]], old[ordered[i + 2]]}));
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_LE(ordered[i + c], highest) << "vertices come in the order of their first use";
      highest = std::max(highest, ordered[i + c] + 1u);
    }
  }
  EXPECT_EQ(before, after);
  EXPECT_EQ(std::set<std::uint16_t>(old.begin(), old.end()).size(), old.size());
  const double ratio = double(count_cache_misses(ordered, 16)) / double(shuffled.size());
  EXPECT_GT(random_ratio, 2.5);
  EXPECT_LT(ratio, 0.80);
}

TEST(ChunkOrder, DuplicateTrianglesAndUnusedVertices) {
  std::vector<std::uint16_t> indices = {5, 3, 1, 5, 3, 1, 5, 5, 3};
  ChunkOrderer orderer;
  const auto old = orderer.order(indices, 7);
  EXPECT_EQ(old.size(), 7u);
  EXPECT_EQ(std::set<std::uint16_t>(old.begin(), old.end()).size(), 7u);
  EXPECT_EQ(std::vector<std::uint16_t>(old.begin() + 3, old.end()),
            (std::vector<std::uint16_t>{0, 2, 4, 6}));
}

TEST(Chunk, EveryTriangleOnceWithItsMaterial) {
  const TriMesh mesh = welded(parse(grid(60, 3)));
  for (const std::uint32_t most : {100u, 3000u, 65535u}) {
    const ChunkedMesh result = chunked(mesh, most);
    std::multiset<std::pair<std::uint32_t, Triangle>> expected;
    std::multiset<std::pair<std::uint32_t, Triangle>> found;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      expected.insert({mesh.triangle_material[t], rotated(mesh.triangles[t])});
    }
    for (const Chunk& c : result.chunks) {
      ASSERT_LE(c.vertices.size(), most);
      EXPECT_EQ(std::set<std::uint32_t>(c.vertices.begin(), c.vertices.end()).size(),
                c.vertices.size());
      for (std::size_t i = 0; i < c.indices.size(); i += 3) {
        found.insert(
            {c.material, rotated({c.vertices.at(c.indices[i]), c.vertices.at(c.indices[i + 1]),
                                  c.vertices.at(c.indices[i + 2])})});
      }
    }
    EXPECT_EQ(expected, found) << most;
  }
  EXPECT_EQ(chunked(mesh, 65535).chunks.size(), 3u);
}

TEST(Chunk, OptionsAreHeldToTheirRange) {
  for (const std::uint32_t most : {0u, 2u, 65536u}) {
    Report report;
    ChunkOptions options;
    options.max_vertices = most;
    EXPECT_EQ(chunk(welded(parse(grid(2, 1))), options, report).error().code, "chunk.max-vertices");
  }
}

}  // namespace
}  // namespace modar
