// Packed bytes, decoded by the compiler's own half type and held against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/mesh_levels.hpp"
#include "tests/import/samples.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using testing::chunked;
using testing::grid;
using testing::on_a_map;
using testing::packed;
using testing::parse;
using testing::welded;

/// Reads a half the way the compiler's own type does.
float half_at(const std::byte* at) {
  _Float16 value;
  std::memcpy(&value, at, 2);
  return static_cast<float>(value);
}

glm::vec3 position_at(const PackedMesh& mesh, std::uint64_t vertex) {
  const std::byte* at = mesh.vertices.data() + vertex * mesh.layout.stride;
  return {half_at(at), half_at(at + 2), half_at(at + 4)};
}

/// Decoded corners of a level's triangles.
std::multiset<std::array<float, 3>> corners_of(const PackedMesh& mesh, const LevelRecord& level) {
  std::vector<std::uint16_t> indices(level.index_count);
  std::memcpy(indices.data(), mesh.indices.data() + level.index_offset, 2 * indices.size());
  std::multiset<std::array<float, 3>> corners;
  for (const std::uint16_t index : indices) {
    EXPECT_LT(index, level.vertex_count);
    const glm::vec3 p = position_at(mesh, level.vertex_offset / mesh.layout.stride + index);
    corners.insert({p.x, p.y, p.z});
  }
  return corners;
}

TEST(Pack, KnownValuesByteForByte) {
  const PackedMesh mesh = packed(chunked(
      welded(
          parse("v -2 -2 0 1 0 0\nv 2 -2 0 0 1 0\nv -2 2 0 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 "
                "1\nf 1/1/1 2/2/1 3/3/1\n")),
      65535));
  EXPECT_EQ(mesh.layout.stride, 20);
  ASSERT_EQ(mesh.vertices.size(), 60u);
  EXPECT_EQ(mesh.record.scale, 2.0);
  std::set<std::vector<int>> found;
  for (std::size_t v = 0; v < 3; ++v) {
    std::vector<int> bytes;
    for (std::size_t i = 0; i < 20; ++i)
      bytes.push_back(static_cast<int>(mesh.vertices[20 * v + i]));
    found.insert(bytes);
  }
  // +-1 as halves are 3C00 and BC00; the snorm8 of 1 is 127 and of 0 is 0 or -1 (GL ES 2: +-1/255).
  const int zero = static_cast<int>(mesh.vertices[8]);
  EXPECT_TRUE(zero == 0 || zero == 255);
  const std::set<std::vector<int>> expected = {
      {0, 0xBC, 0, 0xBC, 0, 0, 0, 0, zero, zero, 127, 0, 0, 0, 255, 255, 255, 0, 0, 255},
      {0, 0x3C, 0, 0xBC, 0, 0, 0, 0, zero, zero, 127, 0, 255, 255, 255, 255, 0, 255, 0, 255},
      {0, 0xBC, 0, 0x3C, 0, 0, 0, 0, zero, zero, 127, 0, 0, 0, 0, 0, 0, 0, 255, 255}};
  EXPECT_EQ(found, expected);
  EXPECT_EQ(mesh.record.position_error_max, 0.0);
  EXPECT_EQ(mesh.record.uv_error_max_texels, 0.0f);
  EXPECT_LT(mesh.record.normal_error_max_deg, 0.4f);
}

/// Where levels use prefixes they have the same triangles, over the fewest vertices that a prefix
/// can have, and each chunk has its own range.
TEST(Pack, CoarserLevelsUseTheFirstVertices) {
  ChunkedMesh mesh = chunked(welded(parse(grid(40, 2))), 500);
  Report report;
  LevelOptions levels;
  levels.levels = 3;
  ASSERT_TRUE(make_levels(mesh, levels, report));
  const PackedMesh usual = packed(mesh);
  PackOptions options;
  options.prefixes = true;
  const auto made = pack(mesh, std::vector<std::uint32_t>(2, 1024), options, report);
  ASSERT_TRUE(made);
  ASSERT_EQ(made->levels.size(), usual.levels.size());
  EXPECT_EQ(made->vertices.size(), usual.vertices.size());
  std::size_t shorter = 0;
  std::set<std::uint64_t> ranges;
  for (const ChunkRecord& chunk : made->chunks) {
    std::set<std::uint16_t> used;
    for (std::uint32_t l = chunk.level_count; l-- > 0;) {
      const LevelRecord& level = made->levels[chunk.first_level + l];
      EXPECT_EQ(corners_of(*made, level), corners_of(usual, usual.levels[chunk.first_level + l]));
      EXPECT_EQ(level.vertex_offset, made->levels[chunk.first_level].vertex_offset);
      std::vector<std::uint16_t> indices(level.index_count);
      std::memcpy(indices.data(), made->indices.data() + level.index_offset, 2 * indices.size());
      used.insert(indices.begin(), indices.end());
      EXPECT_EQ(used.size(), level.vertex_count) << "of level " << l;
      shorter += level.vertex_count < made->levels[chunk.first_level].vertex_count ? 1u : 0u;
    }
    EXPECT_TRUE(ranges.insert(made->levels[chunk.first_level].vertex_offset).second);
  }
  EXPECT_GE(shorter, made->chunks.size());
}

TEST(Pack, LayoutsTakeWhatTheModelHas) {
  const std::string face = "f 1 2 3\n";
  EXPECT_EQ(
      packed(chunked(welded(parse("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + face)), 65535)).layout.stride,
      12);
  EXPECT_EQ(packed(chunked(welded(parse("v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\n" + face)), 65535))
                .layout.stride,
            16);
  EXPECT_EQ(packed(chunked(welded(parse(grid(2, 1))), 65535)).layout.stride, 16);
}

/// The half nearest to a position, by the compiler.
glm::vec3 nearest_halves(const glm::dvec3& p) {
  return {static_cast<float>(static_cast<_Float16>(static_cast<float>(p.x))),
          static_cast<float>(static_cast<_Float16>(static_cast<float>(p.y))),
          static_cast<float>(static_cast<_Float16>(static_cast<float>(p.z)))};
}

/// Measures what the record states, with the compiler's halves and the mesh's own doubles. Packing
/// moves vertices, so a chunk's triangles are compared as a set of decoded corners.
void expect_stated_errors(const ChunkedMesh& mesh, const PackedMesh& bytes) {
  double greatest = 0;
  double squares = 0;
  std::uint64_t count = 0;
  for (std::size_t c = 0; c < mesh.chunks.size(); ++c) {
    const auto found = corners_of(bytes, bytes.levels[bytes.chunks[c].first_level]);
    std::multiset<std::array<float, 3>> expected;
    for (const std::uint16_t index : mesh.chunks[c].indices) {
      const glm::vec3 p = nearest_halves(mesh.mesh.positions[mesh.chunks[c].vertices[index]]);
      expected.insert({p.x, p.y, p.z});
    }
    EXPECT_EQ(found, expected);
    for (const std::uint32_t v : mesh.chunks[c].vertices) {
      const glm::dvec3& p = mesh.mesh.positions[v];
      const double error =
          glm::length(glm::dvec3(nearest_halves(p)) - p) * mesh.mesh.placement.scale;
      greatest = std::max(greatest, error);
      squares += error * error;
      ++count;
    }
  }
  EXPECT_LE(bytes.record.vertex_count, count);
  EXPECT_DOUBLE_EQ(greatest, bytes.record.position_error_max);
  EXPECT_NEAR(std::sqrt(squares / double(count)), bytes.record.position_error_rms, 1e-9 * greatest);
}

TEST(Pack, ErrorsAreThoseOfTheBytes) {
  const TriMesh mesh = welded(parse(grid(50, 2)));
  for (const std::uint32_t most : {300u, 65535u}) {
    const ChunkedMesh split = chunked(mesh, most);
    const PackedMesh bytes = packed(split);
    expect_stated_errors(split, bytes);
    EXPECT_LT(bytes.record.position_error_max, 1.3e-4 * 1.6 * bytes.record.diagonal);
    EXPECT_LT(bytes.record.normal_error_max_deg, 0.6f);
    EXPECT_LT(bytes.record.uv_error_max_texels, 1024 * 0.75f / 65535);
    EXPECT_GT(bytes.record.uv_error_max_texels, 0.0f);
  }
}

TEST(Pack, SmallModelsShareOneRangeOfVertices) {
  const PackedMesh small = packed(chunked(welded(parse(grid(50, 5))), 65535));
  ASSERT_EQ(small.chunks.size(), 5u);
  for (const LevelRecord& level : small.levels) {
    EXPECT_EQ(level.vertex_offset, 0u);
    EXPECT_EQ(level.vertex_count, small.record.vertex_count);
  }
}

/// Every triangle of every chunk as decoded corners.
template <class Visit>
void for_each_triangle(const PackedMesh& bytes, const Visit& visit) {
  for (std::size_t c = 0; c < bytes.chunks.size(); ++c) {
    const LevelRecord& level = bytes.levels[bytes.chunks[c].first_level];
    for (std::uint32_t i = 0; i < level.index_count; i += 3) {
      std::array<glm::vec3, 3> p;
      for (std::uint32_t k = 0; k < 3; ++k) {
        std::uint16_t index = 0;
        std::memcpy(&index, bytes.indices.data() + level.index_offset + 2 * (i + k), 2);
        p[k] = position_at(bytes, level.vertex_offset / bytes.layout.stride + index);
      }
      visit(bytes.chunks[c], p);
    }
  }
}

/// Brute force: everything is in its box, and where the cone says "invisible" from an eye, each
/// triangle turns its back on that eye.
void expect_conservative(const PackedMesh& bytes, std::uint32_t& culled) {
  std::mt19937 random(9);
  std::normal_distribution<float> normal;
  std::vector<glm::vec3> eyes(200);
  for (glm::vec3& e : eyes)
    e = 4.0f * glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
  std::map<const ChunkRecord*, std::vector<bool>> invisible;
  for (const ChunkRecord& chunk : bytes.chunks) {
    for (const glm::vec3& eye : eyes) {
      bool all = true;
      for (int corner = 0; corner < 8; ++corner) {
        glm::vec3 p;
        for (int i = 0; i < 3; ++i) {
          p[i] = ((corner >> i) & 1) != 0 ? chunk.bounds_max[i] : chunk.bounds_min[i];
        }
        const glm::vec3 axis(chunk.cone_axis[0], chunk.cone_axis[1], chunk.cone_axis[2]);
        all = all && glm::dot(glm::normalize(p - eye), axis) >= chunk.cone_cutoff;
      }
      invisible[&chunk].push_back(all);
      culled += all ? 1 : 0;
    }
  }
  for_each_triangle(bytes, [&](const ChunkRecord& chunk, const std::array<glm::vec3, 3>& p) {
    for (const glm::vec3& q : p) {
      for (int i = 0; i < 3; ++i) {
        ASSERT_GE(q[i], chunk.bounds_min[i]);
        ASSERT_LE(q[i], chunk.bounds_max[i]);
      }
    }
    const glm::dvec3 n = glm::cross(glm::dvec3(p[1] - p[0]), glm::dvec3(p[2] - p[0]));
    for (std::size_t e = 0; e < eyes.size(); ++e) {
      if (!invisible[&chunk][e]) continue;
      ASSERT_GE(glm::dot(glm::dvec3(p[0] - eyes[e]), n), 0.0);
    }
  });
}

TEST(Pack, BoxesAndConesAreConservative) {
  std::uint32_t culled = 0;
  expect_conservative(packed(chunked(welded(parse(grid(40, 1))), 60)), culled);
  EXPECT_GT(culled, 100u) << "the cones never cull anything";
  for (const std::string& path : testing::assimp_obj_files()) {
    if (path.find("spider") == std::string::npos) continue;
    const auto source = read_obj(path);
    ASSERT_TRUE(source);
    expect_conservative(packed(chunked(welded(*source), 40)), culled);
  }
}

TEST(Pack, NoTriangleIsRoundedToALine) {
  // The middle one's two near corners differ in their normals alone once they are halves.
  const PackedMesh mesh =
      packed(chunked(welded(parse("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv 0.50001 0.5 0\nv 0.50002 0.5 0\n"
                                  "vn 0 0 1\nvn 0.6 0 0.8\nf 1//1 2//1 3//1\nf 1//1 4//1 5//2\n"
                                  "f 1//1 3//1 4//1\n")),
                     65535));
  EXPECT_EQ(mesh.record.triangle_count, 2u);
  const auto* const indices = reinterpret_cast<const std::uint16_t*>(mesh.indices.data());
  for (std::size_t i = 0; i < mesh.indices.size() / 2; i += 3) {
    const glm::vec3 a = position_at(mesh, indices[i]);
    const glm::vec3 b = position_at(mesh, indices[i + 1]);
    const glm::vec3 c = position_at(mesh, indices[i + 2]);
    EXPECT_FALSE(a == b || b == c || c == a);
  }
}

/// A sliver whose two near corners round to one reaches out of all else and is left out.
TEST(Pack, BoxesEndWhereTheTrianglesDo) {
  const PackedMesh mesh = packed(chunked(
      welded(parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1e-6 0\nv 1.5 1.5 0\nf 1 2 3\nf 2 5 4\n")),
      65535));
  ASSERT_EQ(mesh.record.triangle_count, 1u);
  ASSERT_EQ(mesh.chunks.size(), 1u);
  glm::vec3 low(9.0f);
  glm::vec3 high(-9.0f);
  for_each_triangle(mesh, [&](const ChunkRecord&, const std::array<glm::vec3, 3>& p) {
    for (const glm::vec3& q : p) {
      low = glm::min(low, q);
      high = glm::max(high, q);
    }
  });
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(mesh.chunks[0].bounds_min[i], low[i]);
    EXPECT_EQ(mesh.chunks[0].bounds_max[i], high[i]);
  }
}

TEST(Pack, RepeatedTexturesFoldAndStayExact) {
  const std::string shifted =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 100.25 -7.5\nvt 102.75 -7.5\nvt 102.75 -6.25\nf 1/1 2/2 3/3\n";
  const PackedMesh mesh = packed(chunked(welded(parse(shifted)), 65535), 256);
  EXPECT_FLOAT_EQ(mesh.chunks[0].uv_offset[0], 0.25f);
  EXPECT_NEAR(mesh.chunks[0].uv_scale[0], 2.5f, 1e-6f);
  EXPECT_LT(mesh.record.uv_error_max_texels, 256 * 2.6f / 65535);
  EXPECT_EQ(packed(chunked(welded(parse(grid(2, 1))), 65535)).chunks[0].uv_scale[0], 1.0f);
}

TEST(Pack, SameInputSameBytes) {
  const std::string text = grid(30, 3);
  const PackedMesh a = packed(chunked(welded(parse(text)), 200));
  const PackedMesh b = packed(chunked(welded(parse(text)), 200));
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.indices, b.indices);
}

TEST(Pack, CoordinatesOfAMapKeepTheirMillimetres) {
  const SourceModel source = on_a_map(parse(grid(40, 3)));
  const ChunkedMesh split = chunked(welded(source), 65535);
  const PackedMesh bytes = packed(split, 0);
  expect_stated_errors(split, bytes);
  // Floats of such coordinates are half a metre apart.
  EXPECT_LT(bytes.record.position_error_rms, 0.02);
  for (std::size_t v = 0; v < split.mesh.positions.size(); v += 97) {
    const glm::dvec3 back =
        split.mesh.placement.center + split.mesh.placement.scale * split.mesh.positions[v];
    ASSERT_LT(
        glm::length(back -
                    source.positions[split.mesh.source_position(static_cast<std::uint32_t>(v))]),
        1e-8);
  }
}

}  // namespace
}  // namespace modar
