// Repair of meshes: defects made on purpose, and every count by brute force over maps of edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bake/mesh/repair/repair.hpp"
#include "formats/base/ranges.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

struct Shape {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<int, 3>> faces;

  int at(double x, double y, double z) {
    positions.push_back({x, y, z});
    return static_cast<int>(positions.size()) - 1;
  }
  [[nodiscard]] std::string obj() const {
    std::string text;
    char line[128];
    for (const auto& p : positions) {
      std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", p[0], p[1], p[2]);
      text += line;
      std::snprintf(line, sizeof line, "vt %.17g %.17g\n", p[0] / 200 + 0.5, p[1] / 200 + 0.5);
      text += line;
    }
    for (const auto& f : faces) {
      text += "f";
      for (const int v : f) text += " " + std::to_string(v + 1) + "/" + std::to_string(v + 1);
      text += "\n";
    }
    return text;
  }
};

/// A closed pillow: n by n squares above, as many below.
Shape pillow(int n) {
  Shape shape;
  std::map<std::array<int, 3>, int> known;
  const auto vertex = [&](int x, int y, int side) {
    const bool rim = x == 0 || y == 0 || x == n || y == n;
    const std::array<int, 3> key = {x, y, rim ? 0 : side};
    const auto [at, fresh] = known.try_emplace(key, 0);
    if (fresh) at->second = shape.at(x, y, 5 * key[2]);
    return at->second;
  };
  for (const int side : {1, -1}) {
    for (int x = 0; x < n; ++x) {
      for (int y = 0; y < n; ++y) {
        const int a = vertex(x, y, side);
        const int b = vertex(x + 1, y, side);
        const int c = vertex(x + 1, y + 1, side);
        const int d = vertex(x, y + 1, side);
        const bool corner = x != y && (x == 0 || y == 0) && (x == n - 1 || y == n - 1);
        const std::array<int, 3> one = corner ? std::array{a, b, d} : std::array{a, b, c};
        const std::array<int, 3> other = corner ? std::array{b, c, d} : std::array{a, c, d};
        for (const auto& f : {one, other}) {
          shape.faces.push_back(side > 0 ? f : std::array{f[0], f[2], f[1]});
        }
      }
    }
  }
  return shape;
}

/// Defects of faces, each by its definition.
struct CountedDefects {
  std::size_t edges = 0, winding = 0, repeated = 0, touching = 0, open = 0;
  CountedDefects(
      const std::vector<std::array<std::uint32_t, 3>>& faces) {  // NOLINT: a count of faces
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<bool>> walks;
    std::map<std::uint32_t, std::vector<std::set<std::uint32_t>>> fans;
    std::set<std::array<std::uint32_t, 3>> seen;
    for (const auto& f : faces) {
      std::array<std::uint32_t, 3> sorted = f;
      std::sort(sorted.begin(), sorted.end());
      repeated += seen.insert(sorted).second ? 0u : 1u;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = f[i], b = f[(i + 1) % 3], c = f[(i + 2) % 3];
        walks[std::minmax(a, b)].push_back(a < b);
        std::set<std::uint32_t> fan = {b, c};
        auto& around = fans[a];
        for (auto other = around.begin(); other != around.end();) {
          const bool touches = other->contains(b) || other->contains(c);
          if (touches) fan.insert(other->begin(), other->end());
          other = touches ? around.erase(other) : other + 1;
        }
        around.push_back(fan);
      }
    }
    for (const auto& [edge, up] : walks) {
      edges += up.size() > 2 ? 1u : 0u;
      open += up.size() == 1 ? 1u : 0u;
      winding += up.size() == 2 && up[0] == up[1] ? 1u : 0u;
    }
    for (const auto& [vertex, around] : fans) touching += around.size() > 1 ? 1u : 0u;
  }
};

std::vector<std::array<std::uint32_t, 3>> faces_of(const TriMesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (const auto& t : mesh.triangles) {
    faces.push_back(
        {mesh.source_position(t[0]), mesh.source_position(t[1]), mesh.source_position(t[2])});
  }
  return faces;
}

struct Repaired {
  MeshDefects before, done, left;
  TriMesh mesh;
  std::vector<Diagnostic> said;
  std::uint64_t found(Defect defect) { return before.of(defect).count; }
  std::uint64_t repaired(Defect defect) { return done.of(defect).count; }
};

constexpr glm::dvec3 kAbove(0, 0, 1);

Repaired repair(const Shape& shape, bool support = false) {
  Repaired result;
  Report report;
  result.before =
      count_defects(testing::welded(testing::parse(shape.obj())), false, kAbove, report);
  SourceModel model = testing::parse(shape.obj());
  result.done = repair_model(model, support, report);
  result.mesh = testing::welded(model);
  result.left = count_defects(result.mesh, true, kAbove, report);
  result.said = report.diagnostics;
  return result;
}

void expect_clean(Repaired& result) {
  const CountedDefects brute(faces_of(result.mesh));
  EXPECT_EQ(brute.edges + brute.winding + brute.repeated + brute.touching, 0u);
  for (const DefectCount& count : result.left.counts) EXPECT_EQ(count.count, 0u);
}

TEST(Repair, LeavesACleanModelAsItIs) {
  const Shape shape = pillow(20);
  Repaired result = repair(shape);
  for (const DefectCount& count : result.before.counts) EXPECT_EQ(count.count, 0u);
  for (const DefectCount& count : result.done.counts) EXPECT_EQ(count.count, 0u);
  const TriMesh plain = testing::welded(testing::parse(shape.obj()));
  ASSERT_EQ(result.mesh.triangles.size(), plain.triangles.size());
  for (std::size_t t = 0; t < plain.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = plain.triangles[t][i];
      const std::uint32_t b = result.mesh.triangles[t][i];
      EXPECT_EQ(plain.positions[a], result.mesh.positions[b]);
      EXPECT_EQ(plain.uvs[a], result.mesh.uvs[b]);
      EXPECT_EQ(plain.normals[a], result.mesh.normals[b]);
    }
  }
}

TEST(Repair, TurnsTrianglesAndRemovesRepeatedOnes) {
  Shape shape = pillow(20);
  std::swap(shape.faces[100][1], shape.faces[100][2]);
  std::swap(shape.faces[300][1], shape.faces[300][2]);
  shape.faces.push_back({shape.faces[7][1], shape.faces[7][2], shape.faces[7][0]});
  const TriMesh plain = testing::welded(testing::parse(shape.obj()));
  const CountedDefects brute(faces_of(plain));
  Repaired result = repair(shape);
  EXPECT_EQ(result.found(Defect::kWinding), brute.winding);
  EXPECT_EQ(result.found(Defect::kDuplicate), 1u);
  EXPECT_EQ(result.found(Defect::kEdge), brute.edges);
  EXPECT_EQ(result.repaired(Defect::kWinding), 2u);
  EXPECT_EQ(result.repaired(Defect::kDuplicate), 1u);
  expect_clean(result);
  EXPECT_EQ(CountedDefects(faces_of(result.mesh)).open, 0u);
}

TEST(Repair, SplitsFinsAndTouchingParts) {
  Shape shape = pillow(20);
  const auto f = shape.faces[210];
  shape.faces.push_back({f[0], f[1], shape.at(30, 30, 60)});  // a third triangle at an edge
  const int tip = shape.faces[410][0];                        // a cone that touches a vertex
  std::array<int, 8> rim{};
  for (std::size_t i = 0; i < 8; ++i) {
    const auto angle = static_cast<double>(i);
    rim[i] = shape.at(20 * std::cos(angle), 20 * std::sin(angle), 70 + angle);
  }
  for (std::size_t i = 0; i < 7; ++i) shape.faces.push_back({tip, rim[i], rim[i + 1]});
  const CountedDefects brute(faces_of(testing::welded(testing::parse(shape.obj()))));
  Repaired result = repair(shape);
  EXPECT_EQ(brute.edges, 1u);
  EXPECT_EQ(brute.touching, 1u);
  EXPECT_EQ(result.found(Defect::kEdge), brute.edges);
  EXPECT_EQ(result.found(Defect::kVertex), brute.touching);
  expect_clean(result);
  EXPECT_EQ(result.mesh.triangles.size(), shape.faces.size());  // split, not removed
}

TEST(Repair, ClosesSmallHolesOnly) {
  Shape shape = pillow(110);
  const std::size_t all = shape.faces.size();
  std::vector<std::array<int, 3>> kept;
  for (std::size_t t = 0; t < all; ++t) {
    const std::size_t x = t / 220, y = t / 2 % 110;  // one square, and ten by ten
    const bool small = t < all / 2 && x == 30 && y == 30;
    const bool large = t < all / 2 && x >= 60 && x < 70 && y >= 60 && y < 70;
    if (!small && !large) kept.push_back(shape.faces[t]);
  }
  shape.faces = kept;
  Repaired result = repair(shape);
  EXPECT_EQ(result.found(Defect::kHole), 1u);
  EXPECT_EQ(result.repaired(Defect::kHole), 1u);
  EXPECT_NEAR(result.done.of(Defect::kHole).area, 1, 1e-9);
  expect_clean(result);
  EXPECT_EQ(CountedDefects(faces_of(result.mesh)).open, 40u);  // the rim of the large one
  const TriMesh& mesh = result.mesh;
  const std::size_t last = mesh.triangles.size() - 1;  // its colour is that around it
  for (const std::uint32_t v : mesh.triangles[last]) {
    const double x = mesh.placement.center.x + mesh.placement.scale * mesh.positions[v].x;
    EXPECT_NEAR(mesh.uvs[v].x, x / 200 + 0.5, 1e-6);
  }
}

TEST(Repair, RemovesDebrisAndKeepsParts) {
  Shape shape = pillow(60);
  const auto tetra = [&](double x, double size) {
    const int a = shape.at(x, 80, 0), b = shape.at(x + size, 80, 0);
    const int c = shape.at(x, 80 + size, 0), d = shape.at(x, 80, size);
    shape.faces.insert(shape.faces.end(), {{a, c, b}, {a, b, d}, {a, d, c}, {b, c, d}});
  };
  tetra(0, 0.5);
  const int a = shape.at(10, 80, 0), b = shape.at(10.5, 80, 0), c = shape.at(10, 80.5, 0);
  shape.faces.push_back({a, b, c});
  const std::size_t with_debris = shape.faces.size();
  tetra(30, 9);  // too large
  Shape ball = pillow(4);
  const int first = static_cast<int>(shape.positions.size());
  for (const auto& p : ball.positions) shape.at(60 + p[0] / 8, 80 + p[1] / 8, p[2] / 20);
  for (const auto& f : ball.faces) {
    shape.faces.push_back({f[0] + first, f[1] + first, f[2] + first});  // closed: a rivet, an eye
  }
  Repaired result = repair(shape);
  EXPECT_EQ(result.found(Defect::kIsland), 2u);
  EXPECT_EQ(result.repaired(Defect::kIsland), 2u);
  EXPECT_NEAR(result.done.of(Defect::kIsland).area, 0.125 + 0.375 + 0.25 * std::sqrt(3) / 2, 1e-3);
  EXPECT_EQ(result.mesh.triangles.size(), shape.faces.size() - 5);
  EXPECT_GT(shape.faces.size(), with_debris);
}

TEST(Repair, WarnsOfAnIslandThatMakesTheModelSmall) {
  for (const double x : {100.0, 400.0}) {
    Shape shape = pillow(60);
    const int a = shape.at(x, 0, 0), b = shape.at(x + 0.5, 0, 0), c = shape.at(x, 0.5, 0);
    shape.faces.push_back({a, b, c});
    const Repaired result = repair(shape);
    EXPECT_EQ(ranges::count(result.said, "model.stray", &Diagnostic::id), x > 200 ? 1 : 0) << x;
  }
}

TEST(Repair, KeepsIslandsThatAreMuchOfTheModel) {
  Shape shape = pillow(60);
  for (int i = 0; i < 1600; ++i) {  // leaves
    const double x = i % 60, y = 80 + i / 60;
    const int a = shape.at(x, y, i % 7), b = shape.at(x + 0.5, y, i % 7),
              c = shape.at(x, y + 0.5, i % 7);
    shape.faces.push_back({a, b, c});
  }
  Repaired result = repair(shape);
  EXPECT_EQ(result.repaired(Defect::kIsland), 0u);
  EXPECT_EQ(result.mesh.triangles.size(), shape.faces.size());
  EXPECT_TRUE(std::any_of(result.said.begin(), result.said.end(),
                          [](const Diagnostic& d) { return d.id == "model.islands-kept"; }));
}

/// A table with a cylinder on it as a scanner sees them from above, turned; inside: the cylinder's
/// triangles. two: instead of it two blocks of which one corner each is next to one place.
Shape scan(double noise, double height, std::vector<bool>& inside, bool two = false) {
  constexpr int kSide = 80;
  Shape shape;
  std::uint32_t seed = 1;
  std::vector<bool> high;
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) {
      seed = seed * 1664525 + 1013904223;
      const auto block = [&](int from_x, int from_y) {
        return x >= from_x && x < from_x + 16 && y >= from_y && y < from_y + 16;
      };
      high.push_back(two ? block(20, 27) || block(37, 44) : std::hypot(x - 35, y - 42) < 12);
      const double z = (high.back() ? height : 0) + noise * (seed / 4294967296.0 - 0.5);
      shape.at(0.8 * x - 0.6 * z, y, 0.6 * x + 0.8 * z);
    }
  }
  inside.clear();
  for (int x = 0; x + 1 < kSide; ++x) {
    for (int y = 0; y + 1 < kSide; ++y) {
      const int a = x * kSide + y, b = a + kSide;
      for (const auto& f : {std::array{a, b, b + 1}, std::array{a, b + 1, a + 1}}) {
        shape.faces.push_back(f);
        inside.push_back(std::any_of(f.begin(), f.end(), [&](int v) {
          return static_cast<bool>(high[static_cast<std::size_t>(v)]);
        }));
      }
    }
  }
  return shape;
}

TEST(Repair, RemovesTheTableThatAScanIsOn) {
  for (const double noise : {0.0, 0.6}) {
    std::vector<bool> inside;
    const Shape shape = scan(noise, 30, inside);
    Repaired result = repair(shape, true);
    EXPECT_EQ(result.repaired(Defect::kSupport), 1u);
    const auto kept = std::count(inside.begin(), inside.end(), true);
    ASSERT_EQ(result.mesh.triangles.size(), static_cast<std::size_t>(kept));
    std::size_t next = 0;  // the cylinder's triangles, in their places
    for (std::size_t t = 0; t < inside.size(); ++t) {
      if (!inside[t]) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto& p = shape.positions[static_cast<std::size_t>(shape.faces[t][i])];
        const TriMesh& mesh = result.mesh;
        const glm::dvec3 q =
            mesh.placement.center + mesh.placement.scale * mesh.positions[mesh.triangles[next][i]];
        EXPECT_NEAR(glm::distance(q, glm::dvec3(p[0], p[1], p[2])), 0, 1e-9);
      }
      ++next;
    }
    if (noise != 0) continue;
    const double square = 79 * 79 - static_cast<double>(kept) / 2;
    EXPECT_NEAR(result.done.of(Defect::kSupport).area, square, 1e-6);
  }
}

TEST(Repair, WhatStoodOnTheTableIsManifoldWithoutIt) {
  std::vector<bool> inside;
  Repaired result = repair(scan(0, 30, inside, true), true);
  EXPECT_EQ(result.repaired(Defect::kSupport), 1u);
  EXPECT_EQ(result.mesh.triangles.size(),
            static_cast<std::size_t>(std::count(inside.begin(), inside.end(), true)));
  EXPECT_EQ(result.repaired(Defect::kVertex), 1u);
  expect_clean(result);
}

TEST(Repair, KeepsModelsThatAreOnNothing) {
  std::vector<bool> inside;
  Shape turned = scan(0, 30, inside);  // a cavity: the plane is in front of it
  for (auto& f : turned.faces) std::swap(f[1], f[2]);
  for (const Shape& shape : {pillow(20), turned}) {
    Repaired result = repair(shape, true);
    EXPECT_EQ(result.repaired(Defect::kSupport), 0u);
    EXPECT_EQ(result.mesh.triangles.size(), shape.faces.size());
    EXPECT_TRUE(std::any_of(result.said.begin(), result.said.end(),
                            [](const Diagnostic& d) { return d.id == "model.no-support"; }));
  }
}

TEST(Repair, JoinsSeamsThatWereWrittenTwice) {
  Shape shape = pillow(20);
  const int count = static_cast<int>(shape.positions.size());
  shape.positions.insert(shape.positions.end(), shape.positions.begin(), shape.positions.end());
  for (std::size_t t = 0; t < shape.faces.size() / 2; ++t) {
    for (int& v : shape.faces[t]) v += count;
  }
  EXPECT_GT(CountedDefects(faces_of(testing::welded(testing::parse(shape.obj())))).open, 0u);
  Repaired result = repair(shape);
  for (const DefectCount& found : result.before.counts) EXPECT_EQ(found.count, 0u);
  EXPECT_EQ(CountedDefects(faces_of(result.mesh)).open, 0u);
}

/// The lower half of a sphere of radius 10, open above; its normals point outwards.
Shape bowl(double depth = 1) {
  Shape shape;
  constexpr int kRings = 8, kSides = 24;
  for (int r = 0; r <= kRings; ++r) {
    const double down = 1.5707963 * r / kRings;
    for (int s = 0; s < kSides; ++s) {
      const double turn = 6.2831853 * s / kSides;
      shape.at(10 * std::cos(down) * std::cos(turn), 10 * std::cos(down) * std::sin(turn),
               -10 * depth * std::sin(down));
      if (r == kRings) continue;
      const int a = r * kSides + s, b = r * kSides + (s + 1) % kSides;
      shape.faces.push_back({a, a + kSides, b});
      shape.faces.push_back({b, a + kSides, b + kSides});
    }
  }
  return shape;
}

Shape turned(Shape shape) {
  for (auto& face : shape.faces) std::swap(face[1], face[2]);
  return shape;
}

TEST(Sides, BacksOfOpenAndInsideOutSurfacesAreSeen) {
  const auto backs = [](const Shape& shape, glm::dvec3 viewer = kAbove) {
    Report report;
    const TriMesh mesh = testing::welded(testing::parse(shape.obj()));
    const std::vector<bool> seen = count_defects(mesh, false, viewer, report).backs;
    return seen.size() == 1 && seen[0];
  };
  EXPECT_TRUE(backs(bowl())) << "people look into it";
  EXPECT_TRUE(backs(turned(bowl()))) << "its walls are seen from the side";
  EXPECT_FALSE(backs(turned(bowl(0.1)))) << "a valley";
  EXPECT_FALSE(backs(turned(bowl(-1)))) << "a dome on the ground";
  EXPECT_TRUE(backs(turned(bowl(-1)), {0, 0, -1})) << "a dome from below";
  EXPECT_TRUE(backs(bowl(-1))) << "a dome inside out";
  EXPECT_TRUE(backs(turned(bowl()), {1, 0, 0})) << "it is tipped over";
  EXPECT_TRUE(backs(turned(bowl()), {0, 0, 0})) << "scenes show it differently";
  EXPECT_FALSE(backs(pillow(20)));
  EXPECT_TRUE(backs(turned(pillow(20))));
  Shape soup = pillow(20);
  for (std::size_t f = 0; f < soup.faces.size(); f += 3)
    std::swap(soup.faces[f][1], soup.faces[f][2]);
  EXPECT_TRUE(backs(soup)) << "of no winding";
  Shape hole = pillow(40);
  hole.faces.erase(hole.faces.begin() + 1000, hole.faces.begin() + 1002);
  std::swap(hole.faces[7][1], hole.faces[7][2]);
  EXPECT_FALSE(backs(hole)) << "a scan with a hole and a turned triangle";
  Shape hollow = pillow(20);
  const Shape inner = turned(pillow(20));
  for (const auto& p : inner.positions) hollow.at(0.5 * p[0] + 5, 0.5 * p[1] + 5, 0.5 * p[2]);
  for (const auto& f : inner.faces) {
    const int first = static_cast<int>(inner.positions.size());
    hollow.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  EXPECT_FALSE(backs(hollow)) << "a print with a cavity";
}

TEST(Repair, MakesAStripOfOneSideTwoSided) {
  Shape shape;  // a Moebius strip of 30 squares
  std::array<std::array<int, 2>, 30> rungs{};
  for (std::size_t i = 0; i < 30; ++i) {
    const double t = 2 * 3.14159265358979 * static_cast<double>(i) / 30;
    for (const unsigned side : {0u, 1u}) {
      const double w = (side == 0 ? -1 : 1) * 3.0;
      rungs[i][side] = shape.at((10 + w * std::cos(t / 2)) * std::cos(t),
                                (10 + w * std::cos(t / 2)) * std::sin(t), w * std::sin(t / 2));
    }
  }
  for (std::size_t i = 0; i < 30; ++i) {
    const bool last = i == 29;
    const int c = rungs[(i + 1) % 30][last ? 0 : 1], d = rungs[(i + 1) % 30][last ? 1 : 0];
    shape.faces.push_back({rungs[i][0], rungs[i][1], c});
    shape.faces.push_back({rungs[i][0], c, d});
  }
  Repaired result = repair(shape);
  expect_clean(result);
  EXPECT_EQ(result.mesh.triangles.size(), 60u);
}

}  // namespace
}  // namespace modar
