// A mesh with fewer triangles: how many, what stays closed, the stated loss.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <glm/common.hpp>

#include "bake/mesh/lod/reduce.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using testing::grid;
using testing::parse;
using testing::welded;

std::tuple<double, double, double> key(const glm::dvec3& p) {
  return {p.x, p.y, p.z};
}

/// Edges, by position, of one triangle alone must be on the outline of the grid.
void expect_closed_inside(const TriMesh& mesh) {
  std::map<std::set<std::tuple<double, double, double>>, int> uses;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      ++uses[{key(mesh.positions[t[i]]), key(mesh.positions[t[(i + 1) % 3]])}];
    }
  }
  glm::dvec3 low = mesh.positions[0];
  glm::dvec3 high = low;
  for (const glm::dvec3& p : mesh.positions) low = glm::min(low, p), high = glm::max(high, p);
  std::size_t open = 0;
  for (const auto& [edge, count] : uses) {
    if (count != 1) continue;
    ++open;
    for (const auto& [x, y, z] : edge) {
      ASSERT_TRUE(x == low.x || x == high.x || y == low.y || y == high.y) << "a hole inside";
    }
  }
  EXPECT_GT(open, 8u);
}

TEST(Reduce, KeepsCountsBordersAndAttributes) {
  const TriMesh whole = welded(parse(grid(60, 3)));
  ASSERT_EQ(whole.triangles.size(), 7200u);
  Report report;
  const TriMesh mesh = reduce(whole, 700, report);
  EXPECT_LE(mesh.triangles.size(), 700u);
  EXPECT_GE(mesh.triangles.size(), 679u);  // within 3 %
  expect_closed_inside(mesh);
  // Stripes of three materials, each with about a third of the area (x and y do not change it).
  std::array<double, 3> area{};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const glm::dvec3 ab = mesh.positions[b] - mesh.positions[a];
    const glm::dvec3 ac = mesh.positions[c] - mesh.positions[a];
    area.at(mesh.triangle_material[t]) += 0.5 * (ab.x * ac.y - ab.y * ac.x);
  }
  for (const double part : area) EXPECT_NEAR(part / (area[0] + area[1] + area[2]), 1.0 / 3, 1e-9);
  // What remains are vertices of the source with all they had.
  ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  std::map<std::tuple<double, double, double>, std::uint32_t> places;
  for (std::uint32_t v = 0; v < whole.positions.size(); ++v) places[key(whole.positions[v])] = v;
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    const auto found = places.find(key(mesh.positions[v]));
    ASSERT_NE(found, places.end());
    EXPECT_EQ(mesh.uvs[v], whole.uvs[found->second]);
    EXPECT_EQ(mesh.source_position(v), whole.source_position(found->second));
  }
  EXPECT_EQ(mesh.placement.scale, whole.placement.scale);
}

TEST(Reduce, StatesTheDistanceThatBruteForceFinds) {
  const TriMesh whole = welded(parse(grid(40, 1)));
  Report report;
  const TriMesh mesh = reduce(whole, 300, report);
  double greatest = 0;
  for (const glm::dvec3& p : whole.positions) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : mesh.triangles) {
      least = std::min(
          least, distance_square(p, {mesh.positions[a], mesh.positions[b], mesh.positions[c]}));
    }
    greatest = std::max(greatest, least);
  }
  ASSERT_EQ(report.stages.size(), 1u);
  EXPECT_NEAR(report.stages[0].max_error, std::sqrt(greatest) * whole.placement.scale, 1e-9);
  EXPECT_GT(report.stages[0].max_error, 0.0);
  ASSERT_EQ(report.diagnostics.size(), 1u);
  EXPECT_EQ(report.diagnostics[0].id, "model.reduced");
  EXPECT_EQ(report.diagnostics[0].severity, DiagnosticSeverity::kInfo);
}

TEST(Reduce, SmallMeshesStayAndStubbornOnesWarn) {
  Report report;
  const TriMesh whole = welded(parse(grid(10, 1)));
  EXPECT_EQ(reduce(whole, 200, report).triangles, whole.triangles);
  EXPECT_TRUE(report.diagnostics.empty());
  // Twenty triangles on one edge: none can go without another one's border.
  std::string fan = "v 0 0 0\nv 0 0 1\n";
  for (int i = 0; i < 20; ++i) {
    fan += "v " + std::to_string(std::cos(0.3 * i)) + " " + std::to_string(std::sin(0.3 * i)) +
           " 0.5\nf 1 2 -1\n";
  }
  EXPECT_GT(reduce(welded(parse(fan)), 5, report).triangles.size(), 5u);
  ASSERT_EQ(report.diagnostics.size(), 1u);
  EXPECT_EQ(report.diagnostics[0].severity, DiagnosticSeverity::kWarning);
}

}  // namespace
}  // namespace modar
