// The two layouts of positions: which one is chosen, what its bytes decode to, and that no chunk
// cracks away from its neighbour.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include <glm/geometric.hpp>

#include "tests/import/samples.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using testing::chunked;
using testing::grid;
using testing::on_a_map;
using testing::parse;
using testing::welded;

PackedMesh packed_as(const ChunkedMesh& mesh, PositionKind kind) {
  Report report;
  PackOptions options;
  options.positions = kind;
  auto result =
      pack(mesh, std::vector<std::uint32_t>(mesh.mesh.materials.size(), 1024), options, report);
  EXPECT_TRUE(result);
  return result ? std::move(*result) : PackedMesh();
}

/// A vertex as bundle.md says, by the compiler's own half type.
glm::dvec3 decoded(const PackedMesh& mesh, const ChunkRecord& chunk, std::size_t vertex) {
  const std::byte* at = mesh.vertices.data() + vertex * mesh.layout.stride;
  glm::dvec3 p;
  for (int i = 0; i < 3; ++i) {
    double a = 0;
    if (mesh.layout.attributes[0].type == static_cast<std::uint8_t>(ComponentType::kF32)) {
      float value = 0;
      std::memcpy(&value, at + 4 * i, 4);
      a = static_cast<double>(value);
    } else if (mesh.layout.attributes[0].type == static_cast<std::uint8_t>(ComponentType::kHalf)) {
      _Float16 value;
      std::memcpy(&value, at + 2 * i, 2);
      a = static_cast<double>(value);
    } else {
      std::int16_t value = 0;
      std::memcpy(&value, at + 2 * i, 2);
      a = value;
    }
    p[i] = double(chunk.position_offset[i]) + double(chunk.position_step) * a;
  }
  return p;
}

/// Degrees between a vertex's normal, three signed bytes decoded as bundle.md says, and another.
double normal_error(const PackedMesh& mesh, std::size_t vertex, const glm::dvec3& wanted) {
  const std::byte* at =
      mesh.vertices.data() + vertex * mesh.layout.stride + mesh.layout.attributes[1].offset;
  glm::dvec3 normal;
  for (int i = 0; i < 3; ++i) {
    normal[i] = (2.0 * static_cast<double>(static_cast<std::int8_t>(at[i])) + 1.0) / 255.0;
  }
  const double cosine = glm::dot(glm::normalize(normal), glm::normalize(wanted));
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / 3.14159265358979323846;
}

/// Each source corner's nearest decoded vertex of its chunk must be one and the same point wherever
/// the vertex appears, and no farther off than stated.
void expect_no_cracks(const ChunkedMesh& mesh, const PackedMesh& bytes) {
  std::map<std::uint32_t, glm::dvec3> point_of_source;
  std::uint64_t shared = 0;
  double greatest = 0;
  double squares = 0;
  double turns = 0;
  std::uint64_t count = 0;
  for (std::size_t c = 0; c < mesh.chunks.size(); ++c) {
    const ChunkRecord& chunk = bytes.chunks[c];
    const LevelRecord& level = bytes.levels[chunk.first_level];
    std::vector<glm::dvec3> points;
    std::vector<std::size_t> vertices;
    std::set<std::uint16_t> used;
    for (std::uint32_t i = 0; i < level.index_count; ++i) {
      std::uint16_t index = 0;
      std::memcpy(&index, bytes.indices.data() + level.index_offset + 2 * i, 2);
      if (used.insert(index).second) {
        vertices.push_back(level.vertex_offset / bytes.layout.stride + index);
        points.push_back(decoded(bytes, chunk, vertices.back()));
      }
    }
    for (const std::uint32_t v : mesh.chunks[c].vertices) {
      const glm::dvec3& p = mesh.mesh.positions[v];
      const auto nearest = std::min_element(points.begin(), points.end(),
                                            [&](const glm::dvec3& a, const glm::dvec3& b) {
                                              return glm::length(a - p) < glm::length(b - p);
                                            });
      const double error = glm::length(*nearest - p) * mesh.mesh.placement.scale;
      greatest = std::max(greatest, error);
      squares += error * error;
      if (bytes.layout.attributes[1].components == 3) {
        const auto index = static_cast<std::size_t>(nearest - points.begin());
        const double turn = normal_error(bytes, vertices[index], glm::dvec3(mesh.mesh.normals[v]));
        turns += turn * turn;
      }
      ++count;
      const auto [at, fresh] = point_of_source.emplace(mesh.mesh.source_position(v), *nearest);
      if (fresh) continue;
      ++shared;
      ASSERT_EQ(at->second, *nearest) << "chunk " << c << " moved a shared vertex";
    }
  }
  EXPECT_GT(shared, 30u) << "chunks share nothing: the test proves nothing";
  EXPECT_NEAR(greatest, bytes.record.position_error_max, 1e-12 * bytes.record.diagonal);
  EXPECT_NEAR(std::sqrt(squares / double(count)), bytes.record.position_error_rms, 1e-9 * greatest);
  if (bytes.layout.attributes[1].components != 3) return;
  EXPECT_NEAR(std::sqrt(turns / double(count)), double(bytes.record.normal_error_rms_deg), 1e-4);
}

TEST(Positions, SharedVerticesDecodeToOnePointInAllLayouts) {
  const TriMesh mesh = welded(parse(grid(40, 2)));
  const ChunkedMesh split = chunked(mesh, 250);
  for (const PositionKind kind :
       {PositionKind::kHalf, PositionKind::kInt16, PositionKind::kFloat}) {
    const PackedMesh bytes = packed_as(split, kind);
    expect_no_cracks(split, bytes);
  }
}

TEST(Positions, SixteenBitsStandOnOnePowerOfTwo) {
  const TriMesh mesh = welded(parse(grid(40, 2)));
  const ChunkedMesh split = chunked(mesh, 250);
  const PackedMesh bytes = packed_as(split, PositionKind::kInt16);
  EXPECT_EQ(bytes.layout.stride, 12);
  double side = 0;
  for (const ChunkRecord& chunk : bytes.chunks) {
    EXPECT_EQ(chunk.position_step, bytes.chunks[0].position_step);
    int exponent = 0;
    EXPECT_EQ(std::frexp(chunk.position_step, &exponent), 0.5f);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(std::fmod(chunk.position_offset[i], chunk.position_step), 0.0f);
      side = std::max(side, double(chunk.bounds_max[i]) - double(chunk.bounds_min[i]));
    }
  }
  // The finest step that 65,534 of them span the largest chunk with.
  EXPECT_LE(side, 65534.0 * double(bytes.chunks[0].position_step));
  EXPECT_GT(side, 65534.0 * double(bytes.chunks[0].position_step) / 2 * 0.99);
  EXPECT_LT(bytes.record.position_error_max,
            bytes.record.scale * double(bytes.chunks[0].position_step) * 0.8661);
  EXPECT_LT(bytes.record.normal_error_max_deg, 1.1f);
  EXPECT_LT(bytes.record.normal_error_rms_deg, 0.5f);
  EXPECT_LT(bytes.record.position_error_max,
            packed_as(split, PositionKind::kHalf).record.position_error_max / 10);
}

TEST(Positions, TheAskedErrorIsKept) {
  const TriMesh mesh = welded(parse(grid(40, 2)));
  const double diagonal = glm::length(mesh.source_max - mesh.source_min);
  for (const double part : {1e-3, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6}) {
    Report report;
    const auto plan = plan_positions(mesh, {std::nullopt, part * diagonal});
    ASSERT_TRUE(plan) << part;
    EXPECT_EQ(plan->kind, part > 2e-4 ? PositionKind::kHalf : PositionKind::kInt16) << part;
    ChunkOptions options;
    options.max_side = plan->max_side;
    const auto split = chunk(mesh, options, report);
    ASSERT_TRUE(split) << part;
    const PackedMesh bytes = packed_as(*split, plan->kind);
    EXPECT_LE(bytes.record.position_error_max, part * diagonal);
    if (plan->kind == PositionKind::kInt16) expect_no_cracks(*split, bytes);
  }
}

/// Two pieces of triangles that are as small as those of scans of buildings, at the ends of a
/// model. cells: of a piece's side of 0.1; the pieces are 10 apart.
TriMesh two_pieces(std::uint32_t cells) {
  std::string text = "vn 0 0 1\n";
  std::string faces;
  for (std::uint32_t piece = 0; piece < 2; ++piece) {
    for (std::uint32_t i = 0; i <= cells; ++i) {
      for (std::uint32_t j = 0; j <= cells; ++j) {
        const double x = 10.0 * piece + 0.1 * i / cells;
        text += "v " + std::to_string(x) + " " + std::to_string(0.1 * j / cells) + " 0\n";
        if (i == cells || j == cells) continue;
        const std::uint32_t a = 1 + (piece * (cells + 1) + i) * (cells + 1) + j;
        faces += "f " + std::to_string(a) + "//1 " + std::to_string(a + cells + 1) + "//1 " +
                 std::to_string(a + 1) + "//1\n";
      }
    }
  }
  return welded(parse(text + faces));
}

TEST(Positions, FineTrianglesAreNotFolded) {
  // Steps of half floats at the ends, 5 from the middle: 0.0025.
  for (const auto& [cells, kind] :
       {std::pair{4u, PositionKind::kHalf}, std::pair{64u, PositionKind::kInt16}}) {
    const TriMesh mesh = two_pieces(cells);
    const auto plan = plan_positions(mesh, {});
    ASSERT_TRUE(plan);
    EXPECT_EQ(plan->kind, kind) << cells;
    EXPECT_EQ(plan_positions(mesh, {PositionKind::kHalf, 0.0})->kind, PositionKind::kHalf);
    const ChunkedMesh split = chunked(mesh, 1000);
    EXPECT_EQ(packed_as(split, plan->kind).record.triangle_count, 2 * cells * cells);
    const bool folds =
        packed_as(split, PositionKind::kHalf).record.triangle_count < 2 * cells * cells;
    EXPECT_EQ(folds, kind == PositionKind::kInt16);
  }
}

TEST(Positions, NoTriangleIsLostToRounding) {
  // Steps of half floats between 0.5 and 1 are 2^-11: a third vertex a quarter of one off the line
  // of the others vanishes, in a mesh whose mean edge is a thousand steps.
  const std::string corners = "vn 0 0 1\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 ";
  for (const auto& [height, kind] :
       {std::pair{"0.9375", PositionKind::kHalf}, std::pair{"0.999878", PositionKind::kInt16}}) {
    const TriMesh mesh =
        welded(parse(corners + height + " 0\nf 1//1 2//1 3//1\nf 3//1 4//1 5//1\n"));
    const auto plan = plan_positions(mesh, {});
    ASSERT_TRUE(plan);
    EXPECT_EQ(plan->kind, kind) << height;
    EXPECT_EQ(packed_as(chunked(mesh, 1000), plan->kind).record.triangle_count, 2u);
  }
}

TEST(Positions, FloatsTakeWhatNoGridSpans) {
  // A floor of 200 units under a grid of small triangles, an error of a millionth of it.
  std::string text = grid(40, 1);
  text += "v -100 -100 0\nv 100 -100 0\nv 100 100 0\nf -3//1 -2//1 -1//1\n";
  const TriMesh mesh = welded(parse("vn 0 0 1\n" + text));
  const auto plan = plan_positions(mesh, {std::nullopt, 2e-4});
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->kind, PositionKind::kFloat);
  EXPECT_EQ(plan->max_side, 0.0);
  EXPECT_FALSE(plan_positions(mesh, {PositionKind::kInt16, 2e-4}));
  const ChunkedMesh split = chunked(mesh, 250);
  const PackedMesh bytes = packed_as(split, plan->kind);
  EXPECT_EQ(bytes.layout.stride, 20);
  EXPECT_LE(bytes.record.position_error_max, 2e-4);
  expect_no_cracks(split, bytes);
}

TEST(Positions, WhatCannotBeReachedIsSaid) {
  const TriMesh mesh = welded(parse(grid(40, 2)));
  const auto finest = plan_positions(mesh, {std::nullopt, 1e-9});
  ASSERT_FALSE(finest);
  EXPECT_EQ(finest.error().code, "model.max-error");
  EXPECT_FALSE(plan_positions(mesh, {PositionKind::kHalf, 1e-4}));
  Report report;
  ChunkOptions options;
  options.max_side = 1e-3;  // shorter than any triangle
  const auto split = chunk(mesh, options, report);
  ASSERT_FALSE(split);
  EXPECT_EQ(split.error().code, "model.max-error");
}

TEST(Positions, OnAMapTenTimesFinerThanHalves) {
  const TriMesh mesh = welded(on_a_map(parse(grid(40, 3))));
  const double wanted = half_error(mesh) * mesh.placement.scale / 10;
  const auto plan = plan_positions(mesh, {std::nullopt, wanted});
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->kind, PositionKind::kInt16);
  Report report;
  ChunkOptions options;
  options.max_side = plan->max_side;
  const auto split = chunk(mesh, options, report);
  ASSERT_TRUE(split);
  const PackedMesh bytes = packed_as(*split, plan->kind);
  EXPECT_LE(bytes.record.position_error_max, wanted);
  expect_no_cracks(*split, bytes);
}

}  // namespace
}  // namespace modar
