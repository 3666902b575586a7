// Coarse copies of whole meshes: bounds against brute force, inner borders of chunks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using testing::chunked;
using testing::grid;
using testing::parse;
using testing::welded;

struct Made {
  ChunkedMesh mesh;
  ProxyPlan plan;
  std::vector<Proxy> proxies;
};

/// measured: see LevelOptions.
Made made(TriMesh mesh, std::uint32_t max_vertices, PositionKind kind = PositionKind::kFloat,
          std::size_t measured = kMeasuredTriangles) {
  Made out;
  out.mesh = chunked(std::move(mesh), max_vertices);
  LevelOptions options;
  options.levels = kMaxLevels;
  options.positions = kind;
  options.measured_triangles = measured;
  out.plan = plan_proxies(out.mesh, options);
  EXPECT_FALSE(out.plan.halvings.empty());
  options.most_halvings = out.plan.halvings.empty() ? 0 : out.plan.halvings[0] - 1;
  Report report;
  options.start = out.plan.start;
  const auto starts = make_levels(out.mesh, options, report);
  EXPECT_TRUE(starts);
  if (!starts) return out;
  auto all = make_proxies(out.mesh, *starts, {out.plan, kind, measured}, report);
  EXPECT_TRUE(all);
  if (all) out.proxies = std::move(*all);
  return out;
}

Made made(const std::string& obj, std::uint32_t max_vertices,
          PositionKind kind = PositionKind::kFloat, std::size_t measured = kMeasuredTriangles) {
  return made(welded(parse(obj)), max_vertices, kind, measured);
}

using Triangles = std::vector<TriangleTree::Triangle>;

struct Surface {
  std::vector<glm::dvec3> positions;
  Triangles triangles;
};

/// Level 0, as the device decodes it.
Surface decoded(const ChunkedMesh& mesh, PositionKind kind) {
  Surface surface;
  const std::vector<ChunkGrid> grids = make_grids(mesh, kind);
  for (std::size_t c = 0; c < mesh.chunks.size(); ++c) {
    const auto base = static_cast<std::uint32_t>(surface.positions.size());
    for (const std::uint32_t v : mesh.chunks[c].vertices) {
      surface.positions.push_back(decoded_position(mesh.mesh.positions[v], kind, grids[c]));
    }
    const auto& indices = mesh.chunks[c].indices;
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      surface.triangles.push_back(
          {base + indices[i], base + indices[i + 1], base + indices[i + 2]});
    }
  }
  return surface;
}

/// Greatest distance of some points of a surface from another one.
double sampled_distance(const Surface& from, const Surface& to) {
  TriangleTree tree(to.positions, to.triangles);
  std::mt19937 random(7);
  const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0; };
  double greatest = 0;
  for (const auto& [a, b, c] : from.triangles) {
    for (int i = 0; i < 3; ++i) {
      const double u = std::sqrt(unit());
      const double v = unit();
      greatest = std::max(
          greatest, tree.nearest(from.positions[a] * (1 - u) + from.positions[b] * (u * (1 - v)) +
                                 from.positions[c] * (u * v)));
    }
  }
  return std::sqrt(greatest);
}

/// Root of the mean square, from the vertices of a surface.
double mean_distance(const Surface& from, const Surface& to) {
  TriangleTree tree(to.positions, to.triangles);
  double sum = 0;
  for (const glm::dvec3& p : from.positions) sum += tree.nearest(p);
  return std::sqrt(sum / static_cast<double>(from.positions.size()));
}

TEST(Proxies, HalveDownToAThousandInOneChunkWithinTheirBounds) {
  using enum PositionKind;
  for (const auto& [kind, measured] :
       {std::pair(kHalf, kMeasuredTriangles), std::pair(kInt16, kMeasuredTriangles),
        std::pair(kFloat, kMeasuredTriangles), std::pair(kInt16, std::size_t{0})}) {
    const Made sheet = made(grid(100, 1), 1500, kind, measured);
    ASSERT_GT(sheet.mesh.chunks.size(), 6u);
    EXPECT_EQ(sheet.plan.halvings, (std::vector<std::uint32_t>{3, 4}));
    ASSERT_EQ(sheet.proxies.size(), 2u);  // 2500 and 1250 of 20,000
    const Surface fine = decoded(sheet.mesh, kind);
    double before = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const Proxy& proxy = sheet.proxies[i];
      EXPECT_EQ(proxy.mesh.chunks.size(), 1u);
      const Surface coarse = decoded(proxy.mesh, kind);
      EXPECT_LE(coarse.triangles.size(), 20000u >> (3 + i));
      EXPECT_GE(coarse.triangles.size(), (20000u >> (3 + i)) - 2);
      EXPECT_GE(proxy.error, before);
      before = proxy.error;
      const double off = std::max(sampled_distance(fine, coarse), sampled_distance(coarse, fine));
      EXPECT_LE(off, proxy.error);
      // The waves are a twentieth of the sheet high.
      EXPECT_LT(proxy.error, measured > 0 ? 0.02 : std::max(0.02, 1.01 * proxy.shading));
    }
  }
}

/// The picture stays where it is: what a uv shows is at the place that the source says.
TEST(Proxies, CarryThePictureAndTheRim) {
  const Made sheet = made(grid(100, 1), 1500);
  ASSERT_FALSE(sheet.proxies.empty());
  const TriMesh& source = sheet.mesh.mesh;
  const auto corner = [&](double x, double y) {
    double best = 1e9;
    std::size_t found = 0;
    for (std::size_t v = 0; v < source.positions.size(); ++v) {
      const double off = glm::length(source.uvs[v] - glm::dvec2(x, y));
      if (off < best) best = off, found = v;
    }
    return source.positions[found];
  };
  // grid() has x and y straight along u and 1 - v.
  const glm::dvec3 origin = corner(0, 0);
  const glm::dvec3 along_u = corner(1, 0) - origin;
  const glm::dvec3 along_v = corner(0, 1) - origin;
  const TriMesh& mesh = sheet.proxies.back().mesh.mesh;
  double worst = 0;
  glm::dvec2 low(1e9), high(-1e9);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const glm::dvec3 at = origin + mesh.uvs[v].x * along_u + mesh.uvs[v].y * along_v;
    const glm::dvec3 off = mesh.positions[v] - at;
    const double u = glm::dot(off, glm::normalize(along_u));
    const double w = glm::dot(off, glm::normalize(along_v));
    worst = std::max({worst, std::abs(u), std::abs(w)});
    low = glm::min(low, mesh.uvs[v]);
    high = glm::max(high, mesh.uvs[v]);
  }
  EXPECT_LT(worst, 0.01);
  EXPECT_LT(std::max(low.x, low.y), 0.01);
  EXPECT_GT(std::min(high.x, high.y), 0.99);
  for (const glm::vec3& normal : mesh.normals) EXPECT_NEAR(glm::length(normal), 1.0f, 1e-4f);
}

TEST(Proxies, BlendToTheNormalsAndColoursOfLevelZero) {
  TriMesh mesh = welded(parse(grid(100, 1)));
  const std::size_t count = mesh.positions.size();
  mesh.colours = Array<glm::u8vec4>(count, glm::u8vec4(50, 50, 50, 255));
  std::mt19937 random(5);
  double tilts = 0;
  for (std::size_t v = 0; v < count; ++v) {
    const double tilt = 0.6 * static_cast<double>(random()) / 4294967296.0 - 0.3;
    mesh.normals[v] = glm::normalize(glm::vec3(static_cast<float>(tilt), 0, 1));
    if (random() % 2 == 0) mesh.colours[v] = glm::u8vec4(200, 200, 200, 255);
    tilts += tilt * tilt;
  }
  const Made sheet = made(std::move(mesh), 65535);
  ASSERT_FALSE(sheet.proxies.empty());
  const TriMesh& proxy = sheet.proxies.front().mesh.mesh;
  double left = 0;
  double greys = 0;
  double sum = 0;
  for (std::size_t v = 0; v < proxy.positions.size(); ++v) {
    left += std::pow(static_cast<double>(proxy.normals[v].x), 2);
    greys += std::pow(proxy.colours[v].r - 125.0, 2);
    sum += proxy.colours[v].r - 125.0;
  }
  const auto vertices = static_cast<double>(proxy.positions.size());
  // Vertices that are picked would have all of it, those that are averaged of eight a third.
  EXPECT_LT(std::sqrt(left / vertices), 0.6 * std::sqrt(tilts / static_cast<double>(count)));
  EXPECT_LT(std::sqrt(greys / vertices), 0.6 * 75);
  EXPECT_NEAR(sum / vertices, 0, 5);
}

/// Collapses of chunks leave vertices where they were, on one side of the surface: those that are
/// left are moved to its middle. 0.50 of the distance, 0.65 unmoved.
TEST(Proxies, AreNearerThanChunksLevelsOfAsMany) {
  ChunkedMesh levels = chunked(welded(parse(grid(100, 1))), 1500);
  LevelOptions options;
  options.positions = PositionKind::kFloat;
  Report report;
  ASSERT_TRUE(make_levels(levels, options, report));
  Surface eighth = decoded(levels, PositionKind::kFloat);
  eighth.triangles.clear();
  std::uint32_t base = 0;
  for (const Chunk& chunk : levels.chunks) {
    const auto& indices = chunk.coarser.empty() ? chunk.indices : chunk.coarser.back().indices;
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      eighth.triangles.push_back({base + indices[i], base + indices[i + 1], base + indices[i + 2]});
    }
    base += static_cast<std::uint32_t>(chunk.vertices.size());
  }
  const Made sheet = made(grid(100, 1), 1500);
  const Surface fine = decoded(sheet.mesh, PositionKind::kFloat);
  const Surface proxy = decoded(sheet.proxies.at(0).mesh, PositionKind::kFloat);
  EXPECT_NEAR(static_cast<double>(proxy.triangles.size()),
              static_cast<double>(eighth.triangles.size()), 0.02 * 2500);
  EXPECT_LT(mean_distance(fine, proxy), 0.58 * mean_distance(fine, eighth));
}

TEST(Proxies, KeepBordersOfMaterialsAndGiveEachOneChunk) {
  const Made sheet = made(grid(100, 4), 800);
  ASSERT_FALSE(sheet.proxies.empty());
  const auto areas = [](const ChunkedMesh& mesh) {
    std::map<std::uint32_t, double> sums;
    for (const Chunk& chunk : mesh.chunks) {
      for (std::size_t i = 0; i < chunk.indices.size(); i += 3) {
        const auto at = [&](std::size_t k) {
          return mesh.mesh.positions[chunk.vertices[chunk.indices[i + k]]];
        };
        sums[chunk.material] += glm::length(glm::cross(at(1) - at(0), at(2) - at(0)));
      }
    }
    return sums;
  };
  const auto wanted = areas(sheet.mesh);
  const ChunkedMesh& coarse = sheet.proxies.back().mesh;
  EXPECT_EQ(coarse.chunks.size(), 4u);
  for (const auto& [material, area] : areas(coarse)) {
    EXPECT_NEAR(area, wanted.at(material), 0.03 * wanted.at(material)) << material;
  }
}

/// Half of the triangles are pieces of two, which hold up what keeps all pieces.
TEST(Proxies, LoseTheSmallestPiecesAndCountThem) {
  std::string obj = grid(60, 1);
  int vertex = 61 * 61;
  for (int i = 0; i < 3000; ++i) {
    const double x = 0.7 * (i % 60);
    const double y = i / 60;
    for (const auto& [dx, dy] : {std::pair(0.0, 0.0), {0.2, 0.0}, {0.2, 0.2}, {0.0, 0.2}}) {
      obj += "v " + std::to_string(x + dx) + " " + std::to_string(y + dy) + " 6\n";
    }
    obj += "f " + std::to_string(vertex + 1) + " " + std::to_string(vertex + 2) + " " +
           std::to_string(vertex + 3) + " " + std::to_string(vertex + 4) + "\n";
    vertex += 4;
  }
  for (const std::size_t measured : {kMeasuredTriangles, std::size_t{0}}) {
    const Made scraps = made(obj, 1500, PositionKind::kFloat, measured);
    ASSERT_EQ(scraps.proxies.size(), 1u);
    const Surface fine = decoded(scraps.mesh, PositionKind::kFloat);
    const Surface coarse = decoded(scraps.proxies[0].mesh, PositionKind::kFloat);
    EXPECT_LE(coarse.triangles.size(), fine.triangles.size() / 8);
    const double off = std::max(sampled_distance(fine, coarse), sampled_distance(coarse, fine));
    EXPECT_GT(off, 0.01);
    EXPECT_LE(off, scraps.proxies[0].error);
  }
}

TEST(Proxies, AreNotMadeOfNothing) {
  std::string same = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 0; i < 10'000; ++i) same += "f 1 2 3\n";
  EXPECT_TRUE(made(same, 1500).proxies.empty());
}

TEST(Proxies, ArePlannedByTrianglesAndLevels) {
  LevelOptions options;
  options.levels = kMaxLevels;
  const auto planned = [&](int n) {
    return plan_proxies(chunked(welded(parse(grid(n, 1))), 1500), options).halvings;
  };
  using Halvings = std::vector<std::uint32_t>;
  EXPECT_EQ(planned(60), Halvings());  // an eighth of 7200 are 900
  EXPECT_EQ(planned(100), (Halvings{3, 4}));
  // A phone draws 98,000 triangles of one model, and no more than a third less.
  EXPECT_EQ(level_triangles(392'000, 2), 98'000u);
  EXPECT_EQ(level_triangles(871'280, 3), 98'000u);
  EXPECT_EQ(level_triangles(560'000, 2), 140'000u);
  EXPECT_EQ(level_triangles(280'000, 2), 70'000u);
  // A quarter of 10,000, and the least of 80,000 halved that is above 1000.
  EXPECT_EQ(planned(200), (Halvings{3, 5, 6}));
  options.levels = 4;
  EXPECT_EQ(planned(100), Halvings{3});
  options.levels = 3;
  EXPECT_EQ(planned(100), Halvings());
}

}  // namespace
}  // namespace modar
