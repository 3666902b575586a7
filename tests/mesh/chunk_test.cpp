// Order and chunks: nothing lost, nothing twice, kinder to the cache.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/transport/chunk_order.hpp"
#include "tests/mesh/stages.hpp"

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

/// Four bytes a vertex, none like another, in no order.
std::vector<std::uint32_t> distinct_vertices(std::uint32_t count) {
  std::vector<std::uint32_t> vertices(count);
  for (std::uint32_t v = 0; v < count; ++v) vertices[v] = v * 2654435761u;
  return vertices;
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
  const std::vector<std::uint32_t> vertices = distinct_vertices((n + 1) * (n + 1));
  const std::vector<std::uint16_t> old = [&] {
    const auto span = orderer.order(std::as_bytes(std::span(vertices)), 4, ordered);
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
  const std::vector<std::uint32_t> vertices = {0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16};
  ChunkOrderer orderer;
  const auto old = orderer.order(std::as_bytes(std::span(vertices)), 4, indices);
  EXPECT_EQ(indices.size(), 9u);
  EXPECT_EQ(old.size(), 7u);
  EXPECT_EQ(std::set<std::uint16_t>(old.begin(), old.end()).size(), 7u);
  EXPECT_EQ(std::vector<std::uint16_t>(old.begin() + 3, old.end()),
            (std::vector<std::uint16_t>{0, 2, 4, 6}));
}

TEST(ChunkOrder, VerticesOfEqualBytesBecomeOne) {
  const std::vector<std::uint32_t> vertices = {7, 9, 7, 8};
  std::vector<std::uint16_t> indices = {0, 1, 3, 2, 3, 1};
  ChunkOrderer orderer;
  const auto old = orderer.order(std::as_bytes(std::span(vertices)), 4, indices);
  ASSERT_EQ(old.size(), 3u);
  std::vector<std::uint32_t> corners;
  for (const std::uint16_t i : indices) corners.push_back(vertices[old[i]]);
  EXPECT_EQ(std::multiset<std::uint32_t>(corners.begin(), corners.end()),
            (std::multiset<std::uint32_t>{7, 7, 8, 8, 9, 9}));
}

/// The bytes that a chunk is stored as.
std::vector<std::uint32_t> stored(const std::vector<std::uint32_t>& vertices,
                                  std::vector<std::uint16_t> indices) {
  ChunkOrderer orderer;
  std::vector<std::uint32_t> bytes;
  for (const std::uint16_t old : orderer.order(std::as_bytes(std::span(vertices)), 4, indices)) {
    bytes.push_back(vertices[old]);
  }
  bytes.insert(bytes.end(), indices.begin(), indices.end());
  return bytes;
}

TEST(ChunkOrder, VerticesAreInTheOrderOfTheirBytes) {
  // Of few different bytes, so that many agree in all but their last. No triangle uses any.
  std::mt19937 random(8);
  for (std::uint32_t stride = 2; stride <= 16; ++stride) {
    std::vector<std::string> vertices(1 + random() % 3000);
    for (std::string& v : vertices) {
      for (std::uint32_t i = 0; i < stride; ++i) v += "\0\1\x7f\xff"[random() % 4];
    }
    std::string bytes;
    for (const std::string& v : vertices) bytes += v;
    ChunkOrderer orderer;
    std::vector<std::string> ours;
    for (const std::uint16_t old : orderer.order(std::as_bytes(std::span(bytes)), stride, {})) {
      ours.push_back(vertices[old]);
    }
    const std::set<std::string> sorted(vertices.begin(), vertices.end());
    ASSERT_EQ(ours, std::vector<std::string>(sorted.begin(), sorted.end())) << stride;
  }
}

TEST(ChunkOrder, HangsOnTheContentAlone) {
  // Triangles at random, degenerate and doubled ones among them.
  std::mt19937 random(3);
  std::vector<std::uint32_t> vertices = distinct_vertices(500);
  std::vector<std::array<std::uint16_t, 3>> triangles(1500);
  for (auto& t : triangles) {
    for (auto& v : t) v = static_cast<std::uint16_t>(random() % 500);
    if (random() % 20 == 0) t[1] = t[0];
  }
  for (std::size_t i = 0; i < 30; ++i) triangles[3 * i] = triangles[3 * i + 1];
  const auto flat = [](const auto& list) {
    std::vector<std::uint16_t> indices;
    for (const auto& t : list) indices.insert(indices.end(), t.begin(), t.end());
    return indices;
  };
  const auto expected = stored(vertices, flat(triangles));
  for (int round = 0; round < 20; ++round) {
    std::vector<std::uint16_t> place(vertices.size());
    std::iota(place.begin(), place.end(), std::uint16_t{0});
    std::shuffle(place.begin(), place.end(), random);
    std::vector<std::uint32_t> moved(vertices.size());
    for (std::size_t v = 0; v < vertices.size(); ++v) moved[place[v]] = vertices[v];
    auto turned = triangles;
    std::shuffle(turned.begin(), turned.end(), random);
    for (auto& t : turned) {
      for (auto& v : t) v = place[v];
      std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    }
    ASSERT_EQ(stored(moved, flat(turned)), expected) << round;
  }
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

/// A triangle's number in the file, and its centre in 65,536ths of [-1,1].
struct Centre {
  std::uint32_t triangle = 0;
  std::array<int, 3> at{};
};

/// Are all of `front` lower than all of `behind` along one axis? The file decides the upright axis.
bool divided(std::span<const std::vector<Centre>> front,
             std::span<const std::vector<Centre>> behind, std::size_t axis) {
  using Place = std::pair<int, std::uint32_t>;
  Place highest = {-1, 0};
  Place lowest = {65536, 0};
  for (const auto& chunk : front) {
    for (const Centre& c : chunk) highest = std::max(highest, Place(c.at[axis], c.triangle));
  }
  for (const auto& chunk : behind) {
    for (const Centre& c : chunk) lowest = std::min(lowest, Place(c.at[axis], c.triangle));
  }
  return highest < lowest;
}

bool is_kd_tree(std::span<const std::vector<Centre>> chunks) {
  if (chunks.size() < 2) return true;
  for (std::size_t k = 1; k < chunks.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (divided(chunks.first(k), chunks.subspan(k), axis)) {
        return is_kd_tree(chunks.first(k)) && is_kd_tree(chunks.subspan(k));
      }
    }
  }
  return false;
}

TEST(Chunk, ChunksAreTheLeavesOfAKdTree) {
  // In no order, and many centres at one height.
  TriMesh mesh = welded(parse(grid(40, 1)));
  std::mt19937 random(4);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  for (glm::dvec3& p : mesh.positions) p = glm::dvec3(glm::ivec3(p * 8.0)) / 8.0;
  std::map<Triangle, Centre> centres;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    Centre& centre = centres[mesh.triangles[t]];
    centre.triangle = t;
    const auto& [a, b, c] = mesh.triangles[t];
    const glm::dvec3 sum = mesh.positions[a] + mesh.positions[b] + mesh.positions[c];
    for (int i = 0; i < 3; ++i) {
      const double at = (sum[i] / 3.0 + 1.0) * 32768.0;
      centre.at[static_cast<std::size_t>(i)] = std::clamp(static_cast<int>(at), 0, 65535);
    }
  }
  const ChunkedMesh cut = chunked(mesh, 100);
  std::vector<std::vector<Centre>> chunks;
  for (const Chunk& chunk : cut.chunks) {
    std::vector<Centre>& all = chunks.emplace_back();
    for (std::size_t i = 0; i < chunk.indices.size(); i += 3) {
      const auto vertex = [&](std::size_t k) { return chunk.vertices[chunk.indices[i + k]]; };
      const auto found = centres.find({vertex(0), vertex(1), vertex(2)});
      ASSERT_NE(found, centres.end());
      ASSERT_TRUE(all.empty() || all.back().triangle < found->second.triangle);
      all.push_back(found->second);
      centres.erase(found);
    }
  }
  EXPECT_TRUE(centres.empty());
  EXPECT_GT(chunks.size(), 16u);
  EXPECT_TRUE(is_kd_tree(chunks));
}

TEST(Chunk, OptionsAreHeldToTheirRange) {
  for (const std::uint32_t most : {0u, 2u, 65536u}) {
    Report report;
    ChunkOptions options;
    options.max_vertices = most;
    EXPECT_EQ(chunk(welded(parse(grid(2, 1))), options, report).error().code, "chunk.max-vertices");
  }
}

TEST(Chunk, LargeModelsHaveFinerChunks) {
  EXPECT_EQ(chunk_vertices_for(3), 65535u);
  EXPECT_EQ(chunk_vertices_for(4 * 65535), 65535u);
  EXPECT_EQ(chunk_vertices_for(4 * 65535 + 1), 16384u);
}

}  // namespace
}  // namespace modar
