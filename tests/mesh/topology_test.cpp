// Topology: shapes whose figures every textbook has, and brute force over random soups.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bake/mesh/repair/repair.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using Face = std::array<int, 3>;

/// OBJ text of faces over vertices in general position, so that the weld drops none.
std::string obj_of(const std::vector<Face>& faces, int vertices) {
  std::mt19937 random(7);
  std::string text;
  for (int v = 0; v < vertices; ++v) {
    text += "v";
    for (int i = 0; i < 3; ++i) text += " " + std::to_string(random() % 1000003);
    text += "\n";
  }
  for (const Face& f : faces) {
    text += "f";
    for (const int v : f) text += " " + std::to_string(v + 1);
    text += "\n";
  }
  return text;
}

MeshTopology measure(const std::string& text) {
  Report report;
  return measure_topology(testing::welded(testing::parse(text)), 0, report);
}

MeshTopology measure(const std::vector<Face>& faces, int vertices) {
  return measure(obj_of(faces, vertices));
}

/// A grid of n by m quads whose opposite sides may be glued, the first pair with a twist.
std::vector<Face> glued_grid(int n, int m, bool glue_x, bool glue_y, bool twist) {
  const int rows = glue_y ? m : m + 1;
  const auto vertex = [&](int x, int y) {
    if (glue_x && x == n) {
      x = 0;
      if (twist) y = m - y;
    }
    return x * rows + (glue_y ? y % m : y);
  };
  std::vector<Face> faces;
  for (int x = 0; x < n; ++x) {
    for (int y = 0; y < m; ++y) {
      const int a = vertex(x, y);
      const int b = vertex(x + 1, y);
      const int c = vertex(x + 1, y + 1);
      const int d = vertex(x, y + 1);
      faces.push_back({a, b, c});
      faces.push_back({a, c, d});
    }
  }
  return faces;
}

TEST(Topology, CubeWithSeamsIsOneClosedSphere) {
  // Normals of their own on each side: 24 vertices over 8 positions.
  std::string text;
  for (int i = 0; i < 8; ++i) {
    text += "v " + std::to_string(i & 1) + " " + std::to_string(i >> 1 & 1) + " " +
            std::to_string(i >> 2) + "\n";
  }
  text += "s off\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  const MeshTopology t = measure(text);
  EXPECT_EQ(t.vertices, 8u);
  EXPECT_EQ(t.edges, 18u);
  EXPECT_EQ(t.triangles, 12u);
  EXPECT_EQ(t.euler(), 2);
  EXPECT_EQ(t.components, 1u);
  EXPECT_EQ(t.boundary_edges + t.boundary_loops + t.non_manifold_edges + t.flipped_edges, 0u);
  EXPECT_EQ(t.non_manifold_vertices + t.duplicate_triangles + t.half_edges->copied_faces, 0u);
}

TEST(Topology, TorusCylinderAndMoebiusStrip) {
  const MeshTopology torus = measure(glued_grid(6, 5, true, true, false), 30);
  EXPECT_EQ(torus.euler(), 0);
  EXPECT_EQ(torus.boundary_loops, 0u);
  const MeshTopology cylinder = measure(glued_grid(6, 5, true, false, false), 36);
  EXPECT_EQ(cylinder.euler(), 0);
  EXPECT_EQ(cylinder.boundary_loops, 2u);
  EXPECT_EQ(cylinder.flipped_edges, 0u);
  // One side only: along the seam triangles wind against each other, which half-edges cannot hold.
  const MeshTopology strip = measure(glued_grid(6, 5, true, false, true), 36);
  EXPECT_EQ(strip.euler(), 0);
  EXPECT_EQ(strip.boundary_edges, 12u);
  EXPECT_EQ(strip.flipped_edges, 5u);
  EXPECT_EQ(strip.non_manifold_edges + strip.non_manifold_vertices, 0u);
  EXPECT_EQ(strip.boundary_loops, 1u);
  EXPECT_EQ(cylinder.half_edges->boundary_loops, 2u);
  EXPECT_GT(strip.half_edges->copied_faces, 0u);
  EXPECT_EQ(strip.half_edges->copied_vertices, 3 * strip.half_edges->copied_faces);
}

TEST(Topology, BowTieBookAndDuplicates) {
  // Two triangles that share a vertex alone.
  const MeshTopology bow = measure({{0, 1, 2}, {0, 3, 4}}, 5);
  EXPECT_EQ(bow.components, 1u);
  EXPECT_EQ(bow.non_manifold_vertices, 1u);
  EXPECT_EQ(bow.non_manifold_edges, 0u);
  EXPECT_EQ(bow.boundary_edges, 6u);
  EXPECT_EQ(bow.boundary_loops, 2u);
  // Three pages at one spine.
  const MeshTopology book = measure({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, 5);
  EXPECT_EQ(book.non_manifold_edges, 1u);
  EXPECT_EQ(book.non_manifold_vertices, 2u);
  EXPECT_EQ(book.half_edges->copied_faces, 1u);
  // The same triangle again, from another corner, and turned over.
  const MeshTopology twice = measure({{0, 1, 2}, {1, 2, 0}, {2, 1, 0}, {3, 4, 5}}, 6);
  EXPECT_EQ(twice.duplicate_triangles, 2u);
  EXPECT_EQ(twice.components, 2u);
  EXPECT_EQ(twice.non_manifold_edges, 3u);
}

/// The same figures out of maps of edges, by definition.
struct Brute {
  std::uint64_t edges = 0;
  std::uint64_t boundary = 0;
  std::uint64_t crowded = 0;
  std::uint64_t flipped = 0;
  std::uint64_t vertices = 0;
  std::uint64_t bad_vertices = 0;
  std::uint64_t components = 0;
  std::uint64_t duplicates = 0;
  std::uint64_t loops = 0;
};

/// Parts of a graph over `nodes`, by spreading the lowest number of each.
template <class Node>
std::size_t parts(const std::set<Node>& nodes, const std::vector<std::pair<Node, Node>>& links) {
  std::map<Node, Node> mark;
  for (const Node& n : nodes) mark[n] = n;
  for (std::size_t round = 0; round < nodes.size(); ++round) {
    for (const auto& [a, b] : links) mark[a] = mark[b] = std::min(mark[a], mark[b]);
  }
  std::set<Node> marks;
  for (const auto& [node, value] : mark) marks.insert(value);
  return marks.size();
}

/// Boundary edges are joined where triangles of one fan at a vertex lead from one to the other.
std::size_t count_loops(const std::vector<Face>& faces, const std::set<std::pair<int, int>>& rim) {
  using HalfEdge = std::pair<int, int>;
  std::set<HalfEdge> nodes;  // all edges of the mesh, seen from one of their ends: (end, other end)
  std::vector<std::pair<HalfEdge, HalfEdge>> links;
  for (const Face& f : faces) {
    for (std::size_t i = 0; i < 3; ++i) {
      const HalfEdge out(f[i], f[(i + 1) % 3]);
      const HalfEdge in(f[i], f[(i + 2) % 3]);
      nodes.insert({out, in});
      links.emplace_back(out, in);
    }
  }
  for (const auto& [a, b] : rim) links.push_back({{a, b}, {b, a}});
  // Parts without a boundary edge are no loops.
  std::map<HalfEdge, HalfEdge> mark;
  for (const HalfEdge& n : nodes) mark[n] = n;
  for (std::size_t round = 0; round < nodes.size(); ++round) {
    for (const auto& [a, b] : links) mark[a] = mark[b] = std::min(mark[a], mark[b]);
  }
  std::set<HalfEdge> loops;
  for (const auto& [a, b] : rim) loops.insert(mark[{a, b}]);
  return loops.size();
}

Brute brute_force(const std::vector<Face>& faces) {
  Brute brute;
  std::map<std::pair<int, int>, std::pair<int, int>> edges;  // forward and backward uses
  std::set<std::set<int>> seen;
  std::set<int> used;
  std::vector<std::pair<int, int>> links;
  for (const Face& f : faces) {
    if (!seen.insert({f[0], f[1], f[2]}).second) ++brute.duplicates;
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = f[i];
      const int b = f[(i + 1) % 3];
      used.insert(a);
      links.emplace_back(a, b);
      auto& [forward, backward] = edges[{std::min(a, b), std::max(a, b)}];
      ++(a < b ? forward : backward);
    }
  }
  std::set<int> bad;
  std::set<std::pair<int, int>> rim;
  for (const auto& [edge, uses] : edges) {
    const int all = uses.first + uses.second;
    if (all == 1) rim.insert(edge);
    brute.boundary += all == 1 ? 1u : 0u;
    brute.flipped += all == 2 && uses.first != 1 ? 1u : 0u;
    if (all <= 2) continue;
    ++brute.crowded;
    bad.insert({edge.first, edge.second});
  }
  for (const int v : used) {
    std::set<int> ring;
    std::vector<std::pair<int, int>> spokes;
    for (const Face& f : faces) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (f[i] != v) continue;
        ring.insert({f[(i + 1) % 3], f[(i + 2) % 3]});
        spokes.emplace_back(f[(i + 1) % 3], f[(i + 2) % 3]);
      }
    }
    if (parts(ring, spokes) > 1) bad.insert(v);
  }
  brute.loops = count_loops(faces, rim);
  brute.edges = edges.size();
  brute.vertices = used.size();
  brute.bad_vertices = bad.size();
  brute.components = parts(used, links);
  return brute;
}

TEST(Topology, RandomSoupsAreAsBruteForceCountsThem) {
  std::mt19937 random(11);
  for (int round = 0; round < 60; ++round) {
    const int vertices = 6 + static_cast<int>(random() % 14);
    std::vector<Face> faces;
    while (faces.size() < 4 + random() % 30) {
      Face f{};
      for (int& v : f) v = static_cast<int>(random() % static_cast<unsigned>(vertices));
      if (f[0] != f[1] && f[1] != f[2] && f[2] != f[0]) faces.push_back(f);
    }
    const Brute brute = brute_force(faces);
    const MeshTopology t = measure(faces, vertices);
    EXPECT_EQ(t.edges, brute.edges) << round;
    EXPECT_EQ(t.boundary_loops, brute.loops) << round;
    EXPECT_EQ(t.boundary_edges, brute.boundary) << round;
    EXPECT_EQ(t.non_manifold_edges, brute.crowded) << round;
    EXPECT_EQ(t.flipped_edges, brute.flipped) << round;
    EXPECT_EQ(t.vertices, brute.vertices) << round;
    EXPECT_EQ(t.non_manifold_vertices, brute.bad_vertices) << round;
    EXPECT_EQ(t.components, brute.components) << round;
    EXPECT_EQ(t.duplicate_triangles, brute.duplicates) << round;
  }
}

TEST(Topology, AGridIsADiskAndFindingsTell) {
  const MeshTopology grid = measure(testing::grid(150, 3));
  EXPECT_EQ(grid.boundary_edges, 600u);
  EXPECT_EQ(grid.boundary_loops, 1u);
  EXPECT_EQ(grid.euler(), 1);
  Report report;
  const auto mesh = testing::welded(testing::parse(
      obj_of({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {0, 1, 2}, {5, 6, 7}, {5, 6, 8}}, 9)));
  measure_topology(mesh, 0, report);
  ASSERT_EQ(report.diagnostics.size(), 4u);
  EXPECT_EQ(report.diagnostics[0].id, "model.non-manifold");
  EXPECT_EQ(report.diagnostics[1].id, "model.duplicate-faces");
  EXPECT_EQ(report.diagnostics[2].id, "model.flipped");
  EXPECT_EQ(report.diagnostics[3].id, "model.copied-faces");
  // Where OpenMesh would take too much, it is left out, and nothing is said of it.
  EXPECT_FALSE(measure_topology(mesh, 100, report).half_edges);
}

}  // namespace
}  // namespace modar
