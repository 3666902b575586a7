// Triangulation and weld, against areas and hand-made cases.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "bake/mesh/weld/triangulate.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using testing::grid;
using testing::parse;
using testing::welded;

double area(std::span<const glm::dvec3> p, const std::array<std::uint32_t, 3>& t) {
  return glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]).z / 2;
}

void expect_tiles(const std::vector<glm::dvec3>& polygon) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  EXPECT_TRUE(triangulate(polygon, triangles));
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  double shoelace = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3& a = polygon[i];
    const glm::dvec3& b = polygon[(i + 1) % polygon.size()];
    shoelace += (a.x * b.y - a.y * b.x) / 2;
  }
  // All of one winding and the areas add up: no overlap, nothing left out.
  double sum = 0;
  for (const auto& t : triangles) {
    EXPECT_GE(area(polygon, t) * (shoelace > 0 ? 1 : -1), 0);
    sum += area(polygon, t);
  }
  EXPECT_NEAR(sum, shoelace, 1e-9 * std::fabs(shoelace));
}

TEST(Triangulate, ConcavePolygonsAreTiledWithoutOverlap) {
  expect_tiles({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 1, 0}, {0, 4, 0}});
  expect_tiles({{0, 4, 0}, {2, 1, 0}, {4, 4, 0}, {4, 0, 0}, {0, 0, 0}});
  expect_tiles({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 0.5, 0}, {0, 2, 0}});
  std::vector<glm::dvec3> star;
  for (int i = 0; i < 40; ++i) {
    const double r = i % 2 == 0 ? 3.0 : 1.0;
    const double angle = i * 2 * 3.14159265358979 / 40;
    star.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
  }
  expect_tiles(star);
  // A square ring with a bridge between hole and border, as exporters write holes.
  expect_tiles({{0, 0, 0},
                {6, 0, 0},
                {6, 6, 0},
                {0, 6, 0},
                {0, 0, 0},
                {2, 2, 0},
                {2, 4, 0},
                {4, 4, 0},
                {4, 2, 0},
                {2, 2, 0}});
}

TEST(Triangulate, LargeConcavePolygonsAreTiledAsSmallOnes) {
  constexpr double kPi = 3.14159265358979;
  const auto around = [](int corners, const auto& radius) {
    std::vector<glm::dvec3> polygon;
    for (int i = 0; i < corners; ++i) {
      const double angle = i * 2 * kPi / corners;
      polygon.push_back(radius(i) * glm::dvec3(std::cos(angle), std::sin(angle), 0));
    }
    return polygon;
  };
  expect_tiles(around(6000, [](int i) { return 1 + 0.5 * std::cos(9 * i * 2 * kPi / 6000); }));
  expect_tiles(around(6000, [](int i) { return i % 2 == 0 ? 3.0 : 1.0; }));
  // Ears at its two tips alone.
  std::vector<glm::dvec3> crescent;
  for (int i = 0; i <= 3000; ++i) crescent.emplace_back(i, 1e-3 * i * (3000 - i), 0);
  for (int i = 2999; i > 0; --i) crescent.emplace_back(i, 1.1e-3 * i * (3000 - i), 0);
  expect_tiles(crescent);
}

TEST(Triangulate, PolygonsThatGoAroundAgainAreOneRound) {
  const std::vector<glm::dvec3> dart = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 1, 0}, {0, 4, 0}};
  for (const std::size_t corners : {6U, 7U, 10U, 25U, 5000U}) {
    std::vector<glm::dvec3> polygon;
    for (std::size_t i = 0; i < corners; ++i) polygon.push_back(dart[i % 5]);
    std::vector<std::array<std::uint32_t, 3>> triangles;
    EXPECT_TRUE(triangulate(polygon, triangles));
    ASSERT_EQ(triangles.size(), 3U) << corners;
    double sum = 0;
    for (const auto& t : triangles) sum += area(polygon, t);
    EXPECT_DOUBLE_EQ(sum, 10) << corners;
  }
}

TEST(Triangulate, TangledPolygonsEndAndSaySo) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const std::vector<glm::dvec3> bow = {{0, 0, 0}, {2, 2, 0}, {3, 0, 0}, {0, 2, 0}, {-1, 1, 0}};
  triangulate(bow, triangles);
  EXPECT_EQ(triangles.size(), 3u);
  triangles.clear();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<glm::dvec3> noise(60);
  for (auto& p : noise) p = {u(random), u(random), u(random)};
  EXPECT_FALSE(triangulate(noise, triangles));
  EXPECT_EQ(triangles.size(), 58u);
}

TEST(Weld, OneVertexATriple) {
  const TriMesh mesh = welded(parse(grid(4, 1)));
  EXPECT_EQ(mesh.positions.size(), 25u);
  EXPECT_EQ(mesh.triangles.size(), 32u);
  // A seam: the same positions under another uv are other vertices.
  const TriMesh seam = welded(
      parse("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/1 4/1\n"));
  EXPECT_EQ(seam.positions.size(), 5u);
  EXPECT_EQ(seam.uvs[0], glm::dvec2(0, 1)) << "v turns over";
}

TEST(Weld, HubsWithManyVerticesStayExact) {
  // One position with 1,000 normals, each used twice.
  std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 0; i < 1000; ++i) text += "vn 0 " + std::to_string(i) + " 1\n";
  for (int round = 0; round < 2; ++round) {
    for (int i = 1; i <= 1000; ++i) text += "f 1//" + std::to_string(i) + " 2//1 3//1\n";
  }
  EXPECT_EQ(welded(parse(text)).positions.size(), 1002u);
}

TEST(Weld, PlacementBringsBackTheSource) {
  const SourceModel source = parse(
      "v 349011.8489 6648378.3181 9.7628\nv 349013.8489 6648378.3181 9.7628\nv 349011.8489 "
      "6648382.3181 10.7628\nf 1 2 3\n");
  const TriMesh mesh = welded(source);
  EXPECT_NEAR(mesh.placement.scale, 2.0, 1e-9);
  for (std::size_t v = 0; v < 3; ++v) {
    const glm::dvec3 back = mesh.placement.center + mesh.placement.scale * mesh.positions[v];
    EXPECT_LT(
        glm::length(back - source.positions[mesh.source_position(static_cast<std::uint32_t>(v))]),
        2e-9);
    for (int i = 0; i < 3; ++i) EXPECT_LE(std::fabs(mesh.positions[v][i]), 1.0);
  }
}

TEST(Weld, MakesNormalsWithinSmoothingGroups) {
  // Two walls of a cube corner: smooth they share the diagonal, in groups each keeps its own.
  const std::string walls = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 0 1\nv 0 1 1\n";
  const std::string a = "f 1 2 4 3\n";
  const std::string b = "f 1 5 6 2\n";
  const TriMesh smooth = welded(parse(walls + "s 1\n" + a + b));
  EXPECT_EQ(smooth.positions.size(), 6u);
  for (std::size_t v = 0; v < smooth.positions.size(); ++v) {
    if (smooth.source_position(static_cast<std::uint32_t>(v)) > 1) continue;
    // 90 degrees of each wall at the edge, whatever the diagonals of the quads.
    EXPECT_NEAR(glm::dot(smooth.normals[v], glm::normalize(glm::vec3(-1, 0, -1))), 1.0f, 1e-6f);
  }
  for (const char* groups : {"s 1\n", "s off\n"}) {
    const TriMesh hard = welded(parse(walls + groups + a + (groups[2] == '1' ? "s 2\n" : "") + b));
    EXPECT_EQ(hard.positions.size(), 8u);
    for (const glm::vec3& n : hard.normals) EXPECT_NEAR(std::max({-n.x, -n.y, -n.z}), 1.0f, 1e-6f);
  }
}

TEST(Weld, NormalsAreWeighedByAreaAndAngle) {
  std::mt19937 random(12);
  const auto number = [&] { return static_cast<double>(random() % 20001) / 1e4 - 1.0; };
  std::vector<glm::dvec3> points(300);
  std::string vertices;
  for (glm::dvec3& p : points) {
    p = {number(), number(), 0.2 * number()};
    vertices +=
        "v " + std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
  }
  std::vector<glm::dvec3> sums(points.size(), glm::dvec3(0.0));
  std::string faces;
  std::string faces_with_uv;  // whose indices differ: welded the other way
  for (int f = 0; f < 1501; ++f) {
    std::array<std::size_t, 3> t{};
    for (std::size_t& v : t) v = random() % points.size();
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    const glm::dvec3 area = glm::cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
    faces += "f";
    faces_with_uv += "f";
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::dvec3& a = points[t[i]];
      const glm::dvec3 b = points[t[(i + 1) % 3]] - a;
      const glm::dvec3 c = points[t[(i + 2) % 3]] - a;
      sums[t[i]] += area * std::atan2(glm::length(glm::cross(b, c)), glm::dot(b, c));
      faces += " " + std::to_string(t[i] + 1);
      faces_with_uv += " " + std::to_string(t[i] + 1) + "/1";
    }
    faces += "\n";
    faces_with_uv += "\n";
  }
  for (const std::string& text :
       {vertices + "s 1\n" + faces, "vt 0 0\n" + vertices + "s 1\n" + faces_with_uv}) {
    const TriMesh mesh = welded(parse(text));
    for (std::size_t v = 0; v < mesh.normals.size(); ++v) {
      const std::size_t source = mesh.source_positions.empty() ? v : mesh.source_positions[v];
      const glm::dvec3 wanted = glm::normalize(sums[source]);
      EXPECT_LT(glm::length(glm::dvec3(mesh.normals[v]) - wanted), 1e-5) << v;
    }
  }
}

/// A roof of two sloping sides whose faces meet at the angle, ridge along y.
std::string roof(double degrees) {
  const double slope = degrees / 2 * 3.14159265358979 / 180;
  const std::string x = std::to_string(std::cos(slope));
  const std::string z = std::to_string(-std::sin(slope));
  return "v 0 0 0\nv 0 1 0\nv -" + x + " 0 " + z + "\nv -" + x + " 1 " + z + "\nv " + x + " 0 " +
         z + "\nv " + x + " 1 " + z + "\nf 1 2 4 3\nf 2 1 5 6\n";
}

TEST(Weld, EdgesAboveTheCreaseStaySharp) {
  const auto vertices = [](const std::string& text, double crease) {
    Report report;
    return weld(parse(text), report, {1, crease})->positions.size();
  };
  EXPECT_EQ(vertices(roof(39.9), 40), 6u);
  EXPECT_EQ(vertices(roof(40.1), 40), 8u);
  EXPECT_EQ(vertices(roof(40.1), 180), 6u);
  EXPECT_EQ(vertices(roof(20), 10), 8u);
  EXPECT_EQ(vertices("s 1\n" + roof(90), 40), 6u) << "a stated group wins";
  // With uvs of their own, corners are welded the other way.
  const std::string cube =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt 0 0\n";
  for (const char* uv : {"", "/1"}) {
    std::string text = cube;
    for (const char* face : {"4321", "5678", "1265", "2376", "3487", "4158"}) {
      text += "f";
      for (int i = 0; i < 4; ++i) text += " " + std::string(1, face[i]) + uv;
      text += "\n";
    }
    const TriMesh mesh = welded(parse(text));
    EXPECT_EQ(mesh.positions.size(), 24u);
    for (const auto& t : mesh.triangles) {
      const glm::dvec3 face = glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                         mesh.positions[t[2]] - mesh.positions[t[0]]);
      for (const std::uint32_t v : t) {
        EXPECT_NEAR(glm::dot(glm::normalize(face), glm::dvec3(mesh.normals[v])), 1, 1e-6);
        EXPECT_LT(mesh.source_position(v), 8u);
      }
    }
  }
}

TEST(Weld, NoiseIsNoCrease) {
  // A bumpy sheet: heights of up to 0.7 of the mesh width, as of a rough scan.
  std::mt19937 random(5);
  std::string text;
  for (int i = 0; i < 41 * 41; ++i) {
    text += "v " + std::to_string(i % 41) + " " + std::to_string(i / 41) + " " +
            std::to_string(static_cast<double>(random() % 1000) / 1430) + "\n";
  }
  for (int i = 0; i < 40 * 40; ++i) {
    const int a = i / 40 * 41 + i % 40 + 1;
    text += "f " + std::to_string(a) + " " + std::to_string(a + 1) + " " + std::to_string(a + 42) +
            "\nf " + std::to_string(a) + " " + std::to_string(a + 42) + " " +
            std::to_string(a + 41) + "\n";
  }
  Report report;
  EXPECT_EQ(weld(parse(text), report)->positions.size(), 1681u);
  EXPECT_NE(report.diagnostics.back().message.find("noise"), std::string::npos);
}

TEST(Weld, TrianglesInBothWindingsAreLitFromBothSides) {
  for (const char* smoothing : {"", "s 1\n"}) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    const TriMesh mesh = welded(parse(square + smoothing + "f 1 2 3\nf 1 3 4\nf 3 2 1\nf 4 3 1\n"));
    EXPECT_EQ(mesh.positions.size(), 8u);
    for (std::size_t t = 0; t < 4; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        EXPECT_NEAR(mesh.normals[v].z, t < 2 ? 1 : -1, 1e-6) << smoothing << t;
      }
    }
  }
}

TEST(Weld, LostFacesAreToldOfAndMoreThanHalfAreAnError) {
  // Of 20 faces as many name a vertex that does not exist.
  const auto ends = [](int lost) {
    std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int f = 0; f < 20; ++f) text += f < lost ? "f 1 2 9\n" : "f 1 2 3\n";
    Report report;
    const auto mesh = weld(parse(text), report);
    if (!mesh) return mesh.error().code;
    const bool told = std::ranges::any_of(report.diagnostics,
                                          [](const Diagnostic& d) { return d.id == "model.lost"; });
    return std::string(told ? "told" : "");
  };
  EXPECT_EQ(ends(1), "");
  EXPECT_EQ(ends(2), "told");
  EXPECT_EQ(ends(10), "told");
  EXPECT_EQ(ends(11), "model.mostly-lost");
}

TEST(Weld, DropsWhatCannotBeSeenAndSaysSo) {
  Report report;
  const auto mesh = weld(
      parse("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 2\nf 1 2 5\nf 1 2 4\n"),
      report);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->triangles.size(), 1u);
  EXPECT_EQ(mesh->positions.size(), 3u);
  std::map<std::string, std::string> found;
  for (const Diagnostic& f : report.diagnostics) found[f.id] = f.message;
  EXPECT_EQ(found["model.degenerate"].substr(0, 2), "2 ");
  // Two of a handful are many; two of a thousand are not.
  const auto severity_of = [](const std::string& text) {
    Report told;
    EXPECT_TRUE(weld(parse(text), told));
    const auto at = std::find_if(told.diagnostics.begin(), told.diagnostics.end(),
                                 [](const Diagnostic& d) { return d.id == "model.degenerate"; });
    EXPECT_NE(at, told.diagnostics.end());
    return at == told.diagnostics.end() ? DiagnosticSeverity::kError : at->severity;
  };
  EXPECT_EQ(severity_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\n"),
            DiagnosticSeverity::kWarning);
  EXPECT_EQ(severity_of(testing::grid(30, 1) + "f 1 1 2\nf 2 2 1\n"), DiagnosticSeverity::kInfo);
  EXPECT_EQ(found["model.not-finite"].substr(0, 2), "1 ");
  Report other;
  EXPECT_EQ(weld(parse("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), other).error().code, "model.empty");
}

}  // namespace
}  // namespace modar
