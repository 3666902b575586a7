// The stages of a mesh take time in proportion to its triangles, whatever their structure: basic
// blocks are counted, by the compiler's hooks, in this program's own copy of bake/mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/lod/reduce.hpp"
#include "bake/mesh/rays/occlusion.hpp"
#include "bake/mesh/repair/repair.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/mesh/weld/triangulate.hpp"
#include "tests/fuzz/made_model.hpp"
#include "tests/mesh/stages.hpp"
#include "tests/soak.hpp"

namespace {

std::uint64_t blocks = 0;

}  // namespace

extern "C" void __sanitizer_cov_trace_pc();
extern "C" void __sanitizer_cov_trace_pc() {
  ++blocks;
}

namespace modar {
namespace {

using test::Seams;
using test::Structure;

/// Largest growth of the blocks for four times as many triangles; quadratic growth makes it 16.
constexpr double kMostGrowth = 10;
/// A triangle; fewer are in order however they grow: a stage that only large meshes have is new.
constexpr double kFewBlocks = 70'000;
/// Far fewer do not reach the limits that are a multiple of the triangles.
constexpr std::uint32_t kTriangles = 4250;

/// Blocks that all stages take.
std::uint64_t blocks_of(const test::Part& part) {
  test::ModelMaker maker;
  maker.add(part);
  const SourceModel source = testing::parse(test::obj_of(maker.model));
  const std::uint64_t before = blocks;
  Report report;
  Result<TriMesh> mesh = weld(source, report);
  if (!mesh) return blocks - before;
  find_up(*mesh);
  measure_topology(*mesh, 0, report);
  reduce(TriMesh(*mesh), part.triangles / 4, report);
  ChunkedMesh chunked = testing::chunked(std::move(*mesh), kMaxChunkVertices);
  chunked.mesh.occlusion = measure_occlusion(chunked, 1, report);
  const std::vector<std::uint32_t> sides(chunked.mesh.materials.size(), 256);
  LevelOptions options;
  options.levels = kMaxLevels;
  options.texture_sides = sides;
  const ProxyPlan plan = plan_proxies(chunked, options);
  if (!plan.halvings.empty()) options.most_halvings = plan.halvings[0] - 1;
  options.start = plan.start;
  const auto starts = make_levels(chunked, options, report);
  EXPECT_TRUE(starts);
  if (!starts) return blocks - before;
  EXPECT_TRUE(make_proxies(chunked, *starts, {plan, options.positions}, report));
  testing::packed(chunked, 256);
  return blocks - before;
}

TEST(Budget, PolygonsTakeWorkInProportionToTheirCorners) {
  enum class Shape { kStar, kTangle, kCrescent };
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(0.2, 1);
  const auto corner = [&](Shape shape, int i, int corners) -> glm::dvec3 {
    if (shape == Shape::kCrescent) {
      const double x = std::min(i, corners - i) / (0.5 * corners);
      return {x, (2 * i > corners ? 1.1 : 1.0) * x * (1 - x), 0};
    }
    const double angle = shape == Shape::kTangle ? 9 * u(random) : i * 6.283185 / corners;
    return u(random) * glm::dvec3(std::cos(angle), std::sin(angle), 0);
  };
  const auto cost = [&](Shape shape, int corners) {
    std::vector<glm::dvec3> polygon;
    for (int i = 0; i < corners; ++i) polygon.push_back(corner(shape, i, corners));
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const std::uint64_t before = blocks;
    EXPECT_EQ(triangulate(polygon, triangles), shape != Shape::kTangle);
    return static_cast<double>(blocks - before);
  };
  for (const Shape shape : {Shape::kStar, Shape::kTangle, Shape::kCrescent}) {
    const double few = cost(shape, 4000);
    EXPECT_LE(cost(shape, 16000), kMostGrowth * few) << static_cast<int>(shape);
  }
}

TEST(Budget, WorkGrowsWithTheTriangles) {
  for (int s = 0; s < static_cast<int>(Structure::kCount); ++s) {
    for (int u = 0; u < (testing::soak() ? static_cast<int>(Seams::kCount) : 1); ++u) {
      test::Part part{static_cast<Structure>(s), static_cast<Seams>(u), kTriangles};
      const auto few = static_cast<double>(blocks_of(part));
      part.triangles *= 4;
      const auto many = static_cast<double>(blocks_of(part));
      EXPECT_LE(many, std::max(kMostGrowth * few, kFewBlocks * part.triangles))
          << "structure " << s << ", seams " << u;
    }
  }
}

}  // namespace
}  // namespace modar
