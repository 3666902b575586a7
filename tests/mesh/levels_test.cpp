// Levels of detail: no crack between any two, errors that hold against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <span>
#include <tuple>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/chunk_decimate.hpp"
#include "bake/mesh/lod/collapse_bound.hpp"
#include "bake/mesh/lod/level_map.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/lod/pixel_cells.hpp"
#include "bake/mesh/lod/surface_distance.hpp"
#include "tests/import/samples.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using testing::chunked;
using testing::grid;
using testing::parse;
using testing::welded;

/// texture_side: pixels of the texture of every material, 0: none.
/// measured: see LevelOptions.
ChunkedMesh levelled(const TriMesh& mesh, std::uint32_t max_vertices, unsigned jobs = 2,
                     std::uint32_t texture_side = 0, std::size_t measured = kMeasuredTriangles) {
  ChunkedMesh split = chunked(mesh, max_vertices);
  Report report;
  LevelOptions options;
  options.measured_triangles = measured;
  options.jobs = jobs;
  options.texture_sides.assign(mesh.materials.size(), texture_side);
  EXPECT_TRUE(make_levels(split, options, report));
  return split;
}

/// A bumpy closed ball of about 8 n^2 triangles, without uv or normals: nothing is a seam.
std::string ball(int n) {
  std::string text;
  const auto number = [](double x) { return std::to_string(x) + " "; };
  const int around = 4 * n;
  const auto vertex = [&](int ring, int step) {
    const double a = 3.14159265358979 * ring / n;
    const double b = 6.28318530717959 * step / around;
    const double r = 1 + 0.05 * std::sin(7 * a) * std::cos(5 * b);
    text += "v " + number(r * std::sin(a) * std::cos(b)) + number(r * std::sin(a) * std::sin(b)) +
            number(r * std::cos(a)) + "\n";
  };
  vertex(0, 0);
  for (int ring = 1; ring < n; ++ring) {
    for (int step = 0; step < around; ++step) vertex(ring, step);
  }
  vertex(n, 0);
  const auto at = [&](int ring, int step) {
    if (ring == 0) return std::string(" 1");
    if (ring == n) return " " + std::to_string(2 + (n - 1) * around);
    return " " + std::to_string(2 + (ring - 1) * around + step % around);
  };
  for (int ring = 0; ring < n; ++ring) {
    for (int s = 0; s < around; ++s) {
      if (ring > 0) text += "f" + at(ring, s) + at(ring + 1, s) + at(ring, s + 1) + "\n";
      if (ring < n - 1)
        text += "f" + at(ring, s + 1) + at(ring + 1, s) + at(ring + 1, s + 1) + "\n";
    }
  }
  return text;
}

using Point = std::array<float, 3>;
using Edge = std::pair<Point, Point>;

/// Triangles of one level of one chunk as decoded positions (half layout).
std::vector<std::array<Point, 3>> triangles_of(const PackedMesh& mesh, const LevelRecord& level) {
  std::vector<std::array<Point, 3>> triangles(level.index_count / 3);
  for (std::uint32_t i = 0; i < level.index_count; ++i) {
    std::uint16_t index = 0;
    std::memcpy(&index, mesh.indices.data() + level.index_offset + 2 * i, 2);
    EXPECT_LT(index, level.vertex_count);
    const std::byte* at = mesh.vertices.data() + level.vertex_offset + index * mesh.layout.stride;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      _Float16 value;
      std::memcpy(&value, at + 2 * axis, 2);
      triangles[i / 3][i % 3][axis] = static_cast<float>(value);
    }
  }
  return triangles;
}

/// Edges that one triangle has and no other has backwards.
std::multiset<Edge> border_of(const std::vector<std::array<Point, 3>>& triangles) {
  std::multiset<Edge> edges;
  for (const auto& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Edge edge{t[i], t[(i + 1) % 3]};
      const auto back = edges.find({edge.second, edge.first});
      if (back != edges.end()) {
        edges.erase(back);
      } else {
        edges.insert(edge);
      }
    }
  }
  return edges;
}

/// Every level of a chunk has the border of level 0, to the bit, but for the model's own rim:
/// whatever levels neighbours are drawn at, they meet.
void expect_no_cracks(const PackedMesh& mesh, std::uint32_t least_levels) {
  EXPECT_GE(mesh.record.level_count, least_levels);
  std::vector<std::array<Point, 3>> all;
  for (const ChunkRecord& chunk : mesh.chunks) {
    const auto finest = triangles_of(mesh, mesh.levels[chunk.first_level]);
    all.insert(all.end(), finest.begin(), finest.end());
  }
  const std::multiset<Edge> rim = border_of(all);
  std::set<Point> on_rim;
  for (const Edge& edge : rim) on_rim.insert({edge.first, edge.second});
  std::uint64_t coarse = 0;
  std::uint64_t shared = 0;
  for (const ChunkRecord& chunk : mesh.chunks) {
    const auto finest = triangles_of(mesh, mesh.levels[chunk.first_level]);
    const auto border = border_of(finest);
    for (std::uint32_t l = 1; l < chunk.level_count; ++l) {
      const auto coarser = triangles_of(mesh, mesh.levels[chunk.first_level + l]);
      EXPECT_LT(coarser.size() * 5, finest.size() * 4 + 5);
      std::multiset<Edge> now = border_of(coarser);
      for (const Edge& edge : border) {
        if (rim.contains(edge)) continue;
        ++shared;
        EXPECT_EQ(now.count(edge), border.count(edge));
        now.erase(edge);
      }
      for (const Edge& edge : now) {
        EXPECT_TRUE(on_rim.contains(edge.first) && on_rim.contains(edge.second));
      }
      ++coarse;
    }
  }
  EXPECT_GT(coarse, 0u);
  EXPECT_TRUE(shared > 0 || mesh.chunks.size() == 1);
}

TEST(Levels, NeighboursOfAnyTwoLevelsMeet) {
  expect_no_cracks(testing::packed(levelled(welded(parse(grid(40, 2))), 500)), 3);
  expect_no_cracks(testing::packed(levelled(welded(parse(ball(16))), 400)), 3);
}

/// The mesh with three vertices of its own for each triangle, and its normal at them. numbered:
/// they know the position of the file that they had in common.
TriMesh flat_shaded(const TriMesh& mesh, bool numbered) {
  TriMesh flat = mesh;
  flat.positions.release();
  flat.normals.release();
  flat.source_positions.release();
  for (std::array<std::uint32_t, 3>& t : flat.triangles) {
    const std::array<std::uint32_t, 3> corners = t;
    const glm::dvec3 origin = mesh.positions[t[0]];
    const glm::dvec3 normal =
        glm::normalize(glm::cross(mesh.positions[t[1]] - origin, mesh.positions[t[2]] - origin));
    for (std::size_t k = 0; k < 3; ++k) {
      t[k] = static_cast<std::uint32_t>(flat.positions.size());
      flat.positions.push_back(mesh.positions[corners[k]]);
      flat.normals.push_back(glm::vec3(normal));
      flat.source_positions.push_back(numbered ? mesh.source_position(corners[k]) : t[k]);
    }
  }
  if (!numbered) flat.source_vertex_count = flat.positions.size();
  return flat;
}

TEST(Levels, FlatShadedModelsHaveThemToo) {
  const TriMesh smooth = welded(parse(ball(16)));
  const Chunk expected = levelled(smooth, 65535).chunks[0];
  for (const bool numbered : {true, false}) {
    const TriMesh flat = flat_shaded(smooth, numbered);
    expect_no_cracks(testing::packed(levelled(flat, 1500)), 3);
    const ChunkedMesh whole = levelled(flat, 65535);
    const Chunk& chunk = whole.chunks[0];
    ASSERT_EQ(chunk.coarser.size(), expected.coarser.size());
    for (std::size_t l = 0; l < chunk.coarser.size(); ++l) {
      const std::vector<std::uint16_t>& indices = chunk.coarser[l].indices;
      EXPECT_NEAR(static_cast<double>(indices.size()),
                  static_cast<double>(expected.coarser[l].indices.size()), 12);
      EXPECT_NEAR(chunk.coarser[l].error, expected.coarser[l].error,
                  0.5 * expected.coarser[l].error);
      double sum = 0;
      for (std::size_t i = 0; i < indices.size(); i += 3) {
        std::array<glm::dvec3, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
          p[k] = whole.mesh.positions[chunk.vertices[indices[i + k]]];
        }
        const glm::dvec3 normal = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
        for (std::size_t k = 0; k < 3; ++k) {
          sum += glm::dot(normal, glm::dvec3(whole.mesh.normals[chunk.vertices[indices[i + k]]]));
        }
      }
      EXPECT_GT(sum / static_cast<double>(indices.size()), 0.97) << "level " << l + 1;
    }
  }
}

using Place = std::array<double, 3>;

Place place_of(const glm::dvec3& p) {
  return {p.x, p.y, p.z};
}

/// twice: places on a seam, with a vertex of each side. At every level of the only chunk, the seam
/// is there from both sides or from neither, no edge that one triangle has is inside the grid,
/// and the coarsest level has a simpler seam.
void expect_closed_seam(const ChunkedMesh& split, const std::set<Place>& twice) {
  const Chunk& chunk = split.chunks[0];
  ASSERT_GE(chunk.coarser.size(), 2u);
  const auto place = [&](std::uint16_t i) {
    return place_of(split.mesh.positions[chunk.vertices[i]]);
  };
  const auto open_edges = [&](const std::vector<std::uint16_t>& indices) {
    std::map<std::set<Place>, int> uses;
    for (std::size_t i = 0; i < indices.size(); ++i) {
      ++uses[{place(indices[i]), place(indices[i % 3 == 2 ? i - 2 : i + 1])}];
    }
    std::set<Place> ends;
    for (const auto& [edge, count] : uses) {
      if (count == 1) ends.insert(edge.begin(), edge.end());
    }
    return ends;
  };
  const std::set<Place> rim = open_edges(chunk.indices);
  std::size_t left_at_last = twice.size();
  for (const ChunkLevel& level : chunk.coarser) {
    std::map<Place, std::set<std::uint16_t>> left;
    for (const std::uint16_t i : level.indices) left[place(i)].insert(i);
    left_at_last = 0;
    for (const Place& p : twice) {
      if (!left.contains(p)) continue;
      EXPECT_EQ(left[p].size(), 2u);
      ++left_at_last;
    }
    for (const Place& p : open_edges(level.indices)) EXPECT_TRUE(rim.contains(p)) << "a crack";
  }
  EXPECT_LT(2 * left_at_last, twice.size());
}

TEST(Levels, PositionsWrittenTwiceStayTogether) {
  // Every triangle has vertices of its own but for pairs that make strips: no number tells that
  // neighbours meet, only their places do.
  const TriMesh whole = welded(parse(grid(24, 1)));
  TriMesh cut = whole;
  std::map<std::pair<std::uint32_t, bool>, std::uint32_t> copies;
  cut.positions.release();
  cut.normals.release();
  cut.uvs.release();
  for (auto& t : cut.triangles) {
    const glm::dvec3 middle =
        (whole.positions[t[0]] + whole.positions[t[1]] + whole.positions[t[2]]) / 3.0;
    for (std::uint32_t& v : t) {
      const auto next = static_cast<std::uint32_t>(cut.positions.size());
      const auto [at, fresh] = copies.try_emplace({v, middle.x > 0}, next);
      if (fresh) {
        cut.positions.push_back(whole.positions[v]);
        cut.normals.push_back(whole.normals[v]);
        cut.uvs.push_back(whole.uvs[v]);
      }
      v = at->second;
    }
  }
  cut.source_positions.release();
  cut.source_vertex_count = cut.positions.size();
  std::set<Place> twice;
  for (const auto& [key, v] : copies) {
    if (copies.contains({key.first, !key.second})) twice.insert(place_of(cut.positions[v]));
  }
  ASSERT_GT(twice.size(), 10u);
  expect_closed_seam(levelled(cut, 65535), twice);
}

/// Triangles of the model's levels by how often they are halved; nothing where a level is not made.
std::map<std::uint32_t, std::size_t> triangles_of_levels(const ChunkedMesh& mesh) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const Chunk& chunk : mesh.chunks) {
    for (const ChunkLevel& level : chunk.coarser) counts[level.halvings] = 0;
  }
  for (auto& [halvings, count] : counts) {
    for (const Chunk& chunk : mesh.chunks) {
      std::size_t size = chunk.indices.size() / 3;
      for (const ChunkLevel& level : chunk.coarser) {
        if (level.halvings <= halvings) size = level.indices.size() / 3;
      }
      count += size;
    }
  }
  return counts;
}

/// Side of the smallest pixel of the first level of a sheet, after a change of its vertices: all
/// normals are those of a plane before.
template <class Change>
double shading_of_sheet(const Change& change) {
  ChunkedMesh sheet = chunked(welded(parse(grid(60, 1))), 65535);
  for (glm::vec3& normal : sheet.mesh.normals) normal = {0, 0, 1};
  sheet.mesh.occlusion = Array<std::uint8_t>(sheet.mesh.positions.size(), 127);
  std::mt19937 random(3);
  for (std::size_t v = 0; v < sheet.mesh.positions.size(); ++v)
    change(sheet.mesh, v, static_cast<std::uint32_t>(random()));
  Report report;
  EXPECT_TRUE(make_levels(sheet, {}, report));
  EXPECT_EQ(sheet.chunks.size(), 1u);
  return sheet.chunks[0].coarser.at(0).shading;
}

/// Half of the vertices are gone in the first level: of some, the picture shows it.
TEST(Levels, AreDrawnByWhatVerticesThatAreGoneShowed) {
  const auto tilted_below = [](double share) {
    return [share](TriMesh& mesh, std::size_t v, std::uint32_t random) {
      const bool in =
          v < static_cast<std::size_t>(share * static_cast<double>(mesh.normals.size()));
      const double tilt = 0.6 * static_cast<double>(random) / 4294967296.0 - 0.3;
      if (in) mesh.normals[v] = glm::normalize(glm::vec3(static_cast<float>(tilt), 0, 1));
    };
  };
  EXPECT_EQ(shading_of_sheet(tilted_below(0)), 0.0);
  EXPECT_EQ(shading_of_sheet(tilted_below(0.005)), 0.0);  // nobody sees one pixel in a hundred
  EXPECT_GT(shading_of_sheet(tilted_below(0.1)), 0.004);  // on pictures of a tenth of it
  EXPECT_GT(shading_of_sheet(tilted_below(0.8)), 0.02);
  // The sides of a triangle are a sixtieth of the sheet's, which are 2 long.
  EXPECT_LT(shading_of_sheet(tilted_below(1)), 2.0);
  const auto darken = [](TriMesh& mesh, std::size_t v, std::uint32_t random) {
    mesh.occlusion[v] = static_cast<std::uint8_t>(random % 128);
  };
  EXPECT_GT(shading_of_sheet(darken), 0.1);
}

TEST(Levels, CountsAreThoseAsked) {
  const TriMesh mesh = welded(parse(ball(40)));
  const std::size_t all = mesh.triangles.size();
  ChunkedMesh split = chunked(mesh, 3000);
  ASSERT_GT(split.chunks.size(), 1u);
  // Where a half would be many, levels are a quarter of those before.
  for (const std::size_t many : {all, all / 3}) {
    ChunkedMesh levels = split;
    LevelOptions options;
    options.many_triangles = many;
    Report report;
    ASSERT_TRUE(make_levels(levels, options, report));
    const std::vector<std::uint32_t> expected =
        many == all ? std::vector<std::uint32_t>{1, 2, 3} : std::vector<std::uint32_t>{2, 3, 4};
    std::vector<std::uint32_t> made;
    for (const auto& [halvings, count] : triangles_of_levels(levels)) {
      made.push_back(halvings);
      const auto wanted = static_cast<double>(all >> halvings);
      EXPECT_NEAR(static_cast<double>(count), wanted, 0.03 * wanted) << many << " " << halvings;
    }
    EXPECT_EQ(made, expected) << many;
  }
}

/// A grid in two halves with uv of their own along the middle, as the exporters of atlases write
/// them. twice: the places there.
TriMesh cut_grid(int n, std::set<Place>& twice) {
  TriMesh cut = welded(parse(grid(n, 1)));
  std::map<std::uint32_t, std::uint32_t> twin;
  const std::size_t count = cut.positions.size();
  Array<std::uint32_t> sources(count);
  for (std::uint32_t v = 0; v < count; ++v) sources[v] = cut.source_position(v);
  for (std::uint32_t v = 0; v < count; ++v) {
    if (std::abs(cut.uvs[v].x - 0.5) >= 1e-9) continue;
    twin[v] = static_cast<std::uint32_t>(cut.positions.size());
    cut.positions.push_back(cut.positions[v]);
    cut.normals.push_back(cut.normals[v]);
    cut.uvs.push_back({cut.uvs[v].x + 0.25, cut.uvs[v].y});
    sources.push_back(sources[v]);
  }
  cut.source_positions = std::move(sources);
  for (auto& t : cut.triangles) {
    const bool right =
        std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return cut.uvs[v].x > 0.5 + 1e-9; });
    for (std::uint32_t& v : t) v = right && twin.contains(v) ? twin[v] : v;
  }
  for (const auto& [v, w] : twin) twice.insert(place_of(cut.positions[v]));
  return cut;
}

TEST(Levels, SeamsOfUvAndNormalsStayClosed) {
  std::set<Place> twice;
  const TriMesh cut = cut_grid(30, twice);
  ASSERT_EQ(twice.size(), 31u);
  expect_closed_seam(levelled(cut, 65535), twice);
  // Levels end anywhere among the collapses, between the two sides of a seam, too: not there.
  for (int n = 10; n < 40; n += 2) {
    twice.clear();
    const TriMesh mesh = cut_grid(n, twice);
    expect_closed_seam(levelled(mesh, 65535), twice);
  }
}

double brute_distance(const glm::dvec3& p, const std::vector<std::array<glm::dvec3, 3>>& surface) {
  double least = 1e9;
  for (const auto& t : surface) {
    // By minimising over a fine barycentric lattice: slow, and nothing like the code under test.
    for (int i = 0; i <= 12; ++i) {
      for (int j = 0; i + j <= 12; ++j) {
        const glm::dvec3 q =
            (double(i) * t[0] + double(j) * t[1] + double(12 - i - j) * t[2]) / 12.0;
        least = std::min(least, glm::length(p - q));
      }
    }
  }
  return least;
}

/// Holds the distances that levels state against random points of ball(9). measured: see
/// LevelOptions.
void expect_errors_of_ball(std::size_t measured) {
  const ChunkedMesh split = levelled(welded(parse(ball(9))), 65535, 2, 0, measured);
  const PackedMesh mesh = testing::packed(split);
  const ChunkRecord& chunk = mesh.chunks[0];
  ASSERT_GE(chunk.level_count, 3u);
  std::vector<std::vector<std::array<glm::dvec3, 3>>> surfaces;
  double lattice = 0;  // how far the lattice of brute_distance() may miss
  for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
    auto& surface = surfaces.emplace_back();
    for (const auto& t : triangles_of(mesh, mesh.levels[chunk.first_level + l])) {
      auto& out = surface.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) out[i] = glm::dvec3(t[i][0], t[i][1], t[i][2]);
      for (std::size_t i = 0; i < 3; ++i) {
        lattice = std::max(lattice, glm::length(out[i] - out[(i + 1) % 3]) / 12);
      }
    }
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::uint32_t l = 1; l < chunk.level_count; ++l) {
    // The record's counts shading, too.
    const double stated = split.chunks[0].coarser[l - 1].error;
    EXPECT_GE(mesh.levels[chunk.first_level + l].error, static_cast<float>(stated));
    double greatest = 0;
    for (const auto& [from, to] : {std::pair(0u, l), std::pair(l, 0u)}) {
      for (int i = 0; i < 150; ++i) {
        const auto& t = surfaces[from][random() % surfaces[from].size()];
        const double a = std::sqrt(uniform(random));
        const double b = uniform(random);
        const glm::dvec3 p = (1 - a) * t[0] + a * (1 - b) * t[1] + a * b * t[2];
        greatest = std::max(greatest, brute_distance(p, surfaces[to]));
      }
    }
    EXPECT_LE(greatest, stated + lattice);
    // And it says something: half as much would be too little for random points, or nearly so.
    const double hidden = measured > 0 ? 0.0 : 0.5 * split.chunks[0].coarser[l - 1].shading;
    EXPECT_GT(std::max(greatest + lattice, hidden), stated * 0.4) << "level " << l;
  }
}

TEST(Levels, TheStatedErrorBoundsTheDistance) {
  expect_errors_of_ball(kMeasuredTriangles);
  expect_errors_of_ball(0);
}

/// Greatest distance of some points of one surface from all triangles of another.
double sampled_distance(const std::vector<std::array<glm::dvec3, 3>>& from,
                        const std::vector<std::array<glm::dvec3, 3>>& to) {
  double greatest = 0;
  for (const auto& [a, b, c] : from) {
    for (const auto& [u, v] :
         {std::pair(0.0, 0.0), std::pair(1.0 / 3, 1.0 / 3), std::pair(0.5, 0.0),
          std::pair(0.5, 0.5), std::pair(0.0, 0.5), std::pair(0.2, 0.2)}) {
      const glm::dvec3 p = a + u * (b - a) + v * (c - a);
      double least = 1e9;
      for (const auto& t : to) least = std::min(least, distance_square(p, t, least));
      greatest = std::max(greatest, std::sqrt(least));
    }
  }
  return greatest;
}

/// The same of a rough surface. measured: see LevelOptions.
void expect_errors_of_noise(std::size_t measured) {
  // Noise as steep as its triangles are wide: seen along their normals, surfaces fold.
  constexpr int kSide = 20;
  std::mt19937 random(8);
  std::string text;
  for (int i = 0; i < kSide * kSide; ++i) {
    text += "v " + std::to_string(i % kSide) + " " + std::to_string(i / kSide) + " " +
            std::to_string(double(random() % 1000) / 600) + "\n";
  }
  for (int i = 0; i + kSide < kSide * kSide; ++i) {
    if (i % kSide == kSide - 1) continue;
    const auto corner = [&](int v) { return " " + std::to_string(v + 1); };
    text += "f" + corner(i) + corner(i + 1) + corner(i + kSide + 1) + "\nf" + corner(i) +
            corner(i + kSide + 1) + corner(i + kSide) + "\n";
  }
  const ChunkedMesh split = levelled(welded(parse(text)), 65535, 2, 0, measured);
  const PackedMesh mesh = testing::packed(split);
  const ChunkRecord& chunk = mesh.chunks[0];
  ASSERT_GE(chunk.level_count, 4u);
  std::vector<std::vector<std::array<glm::dvec3, 3>>> surfaces;
  for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
    auto& surface = surfaces.emplace_back();
    for (const auto& t : triangles_of(mesh, mesh.levels[chunk.first_level + l])) {
      auto& out = surface.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) out[i] = glm::dvec3(t[i][0], t[i][1], t[i][2]);
    }
    if (l == 0) continue;
    // The record's counts shading, too.
    const double stated = split.chunks[0].coarser[l - 1].error;
    EXPECT_GE(mesh.levels[chunk.first_level + l].error, static_cast<float>(stated));
    const double greatest =
        std::max(sampled_distance(surfaces[0], surface), sampled_distance(surface, surfaces[0]));
    EXPECT_LE(greatest, stated) << "level " << l;
    const double hidden = measured > 0 ? 0.0 : 0.5 * split.chunks[0].coarser[l - 1].shading;
    EXPECT_GT(std::max(greatest, hidden), stated * 0.4) << "level " << l;
  }
}

TEST(Levels, RoughSurfacesStayWithinTheStatedErrors) {
  expect_errors_of_noise(kMeasuredTriangles);
  expect_errors_of_noise(0);
}

/// Where borders stay, vertices go far, and collapses alone tell of some triangles only.
TEST(Levels, ErrorsOfChunksHoldBesideTheirBorders) {
  const TriMesh mesh = welded(parse(grid(50, 1)));
  for (const std::size_t measured : {kMeasuredTriangles, std::size_t{0}}) {
    const ChunkedMesh split = levelled(mesh, 800, 2, 0, measured);
    ASSERT_GE(split.chunks.size(), 4u);
    for (const Chunk& chunk : split.chunks) {
      const auto surface_of = [&](const std::vector<std::uint16_t>& indices) {
        std::vector<std::array<glm::dvec3, 3>> surface(indices.size() / 3);
        for (std::size_t i = 0; i < indices.size(); ++i) {
          surface[i / 3][i % 3] = split.mesh.positions[chunk.vertices[indices[i]]];
        }
        return surface;
      };
      const auto finest = surface_of(chunk.indices);
      for (const ChunkLevel& level : chunk.coarser) {
        const auto coarse = surface_of(level.indices);
        const double off =
            std::max(sampled_distance(finest, coarse), sampled_distance(coarse, finest));
        EXPECT_LE(off, level.error + 2 * kDistanceFloor);
      }
    }
  }
}

TEST(Levels, WaysOfVerticesBoundDistances) {
  // A square of two triangles, the first of which has a corner that moves by 0.1 and stays; the
  // other vanishes without an image. And a piece that is gone.
  const std::vector<glm::dvec3> p = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
  const std::vector<std::uint16_t> indices = {0, 1, 2, 0, 2, 3, 4, 5, 6};
  const double gone = std::numeric_limits<double>::infinity();
  const std::vector<double> moved = {0, 0.01, 0, 0, gone, gone, gone};
  const auto lands = [](std::uint32_t t) { return t == 0; };
  const CollapseBound wide =
      collapse_bound(std::span(p), std::span(indices), std::span(moved), lands, 1.0);
  EXPECT_EQ(wide.settled, (std::vector<std::uint8_t>{1, 1, 0}));
  EXPECT_EQ(wide.open, std::vector<std::uint32_t>{2});
  // The centre of an equilateral triangle is the farthest from all corners.
  EXPECT_NEAR(wide.moved, std::sqrt(2.0 / 3), 1e-9);
  const CollapseBound narrow =
      collapse_bound(std::span(p), std::span(indices), std::span(moved), lands, 0.5);
  EXPECT_EQ(narrow.settled, (std::vector<std::uint8_t>{1, 0, 0}));
  EXPECT_NEAR(narrow.moved, 0.1, 1e-9);
}

TEST(Levels, GoOnUntilTheModelIsAFewPixelsWide) {
  // A ball of 12,800 triangles, in one chunk and in some, whose borders stay.
  for (const auto& [max_vertices, share] : {std::pair(65535u, 64u), std::pair(2500u, 12u)}) {
    ChunkedMesh split = chunked(welded(parse(ball(40))), max_vertices);
    LevelOptions options;
    options.levels = kMaxLevels;
    Report report;
    ASSERT_TRUE(make_levels(split, options, report));
    std::uint64_t drawn = 0;
    for (const Chunk& chunk : split.chunks) {
      // A level off by no more than a pixel where the ball, of 2, is 13 pixels across.
      std::uint64_t indices = chunk.indices.size();
      for (const ChunkLevel& level : chunk.coarser) {
        if (level.error * 6.5 <= 1.0) indices = level.indices.size();
      }
      drawn += indices / 3;
    }
    EXPECT_LT(drawn * share, triangles_in(split))
        << split.chunks.size() << " chunks draw " << drawn;
  }
}

TEST(Levels, DistancesOfKnownSurfaces) {
  // A square, and the same with its middle lifted by 0.5.
  const std::vector<glm::dvec3> p = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0.5}};
  const std::vector<std::uint16_t> flat = {0, 1, 2, 0, 2, 3};
  const std::vector<std::uint16_t> roof = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
  LevelSurface low(p, flat);
  LevelSurface high(p, roof);
  // Known, not known and wrong: the hints change the way, never the answer's truth.
  for (const std::uint32_t near : {1u, kNoIndex, 0u}) {
    const std::vector<std::uint32_t> nearby(p.size(), near);
    const double up = surface_distance(high, low, nearby, 0);
    EXPECT_GE(up, 0.5);
    EXPECT_LE(up, 0.75);
    // From the square's middle to a roof of 45 degrees.
    const double down = surface_distance(low, high, nearby, 0);
    EXPECT_GE(down, 0.5 * std::sqrt(0.5));
    EXPECT_LE(down, 0.75 * std::sqrt(0.5));
    EXPECT_LE(surface_distance(low, low, nearby, 0), kDistanceFloor);
    // Values below the caller's least are not distinguished.
    EXPECT_EQ(surface_distance(low, high, nearby, 2.0), 2.0);
  }
}

TEST(Levels, DistancesWhereCornersDoNotTell) {
  // All corners of a square are on another one, which has a slit.
  const std::vector<glm::dvec3> p = {{0, 0, 0},   {1, 0, 0},   {1, 1, 0},   {0, 1, 0},
                                     {0.8, 0, 0}, {0.8, 1, 0}, {0.9, 0, 0}, {0.9, 1, 0}};
  const std::vector<std::uint16_t> square = {0, 1, 2, 0, 2, 3};
  const std::vector<std::uint16_t> slit = {0, 4, 5, 0, 5, 3, 6, 1, 2, 6, 2, 7};
  LevelSurface with_slit(p, slit);
  const std::vector<std::uint32_t> near = {0, 2, 3, 1, 0, 0, 2, 3};
  const double gap = surface_distance(LevelSurface(p, square), with_slit, near, 0);
  EXPECT_GE(gap, 0.05 - 1e-9);
  EXPECT_LE(gap, 0.075);
  // The middle of a square is under a roof, farther off than a triangle elsewhere is.
  const std::vector<glm::dvec3> q = {{0, 0, 0},       {1, 0, 0},    {1, 1, 0},   {0, 1, 0},
                                     {0.5, 0.5, 0.3}, {3, 0, 0},    {4, 0, 0},   {3, 1, 0},
                                     {3, 0, 0.22},    {4, 0, 0.22}, {3, 1, 0.22}};
  const std::vector<std::uint16_t> flat = {0, 1, 2, 0, 2, 3, 5, 6, 7};
  const std::vector<std::uint16_t> roof = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 8, 9, 10};
  LevelSurface high(q, roof);
  const std::vector<std::uint32_t> under = {0, 0, 1, 2, 0, 4, 4, 4, 4, 4, 4};
  const double middle = surface_distance(LevelSurface(q, flat), high, under, 0);
  EXPECT_GE(middle, 0.3 / std::sqrt(1.36) - 1e-9);  // from a roof that rises 0.3 over 0.5
  EXPECT_LE(middle, 0.45 / std::sqrt(1.36));
}

TEST(Levels, DistancesOfTrianglesWithoutArea) {
  // As half floats leave the finest scans: corners fall together or on one line.
  constexpr std::uint16_t kSide = 9;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  for (int round = 0; round < 40; ++round) {
    std::vector<glm::dvec3> p;
    const glm::dvec3 along(uniform(random), uniform(random), uniform(random));
    const glm::dvec3 across(uniform(random), uniform(random), uniform(random));
    for (std::uint16_t v = 0; v < kSide * kSide; ++v) {
      const glm::dvec3 at =
          static_cast<double>(v % kSide) * along + static_cast<double>(v / kSide) * across;
      // Every third of them no lattice, but a line through one.
      p.push_back((round % 3 == 0 ? at * 0.7 : glm::round(at)) * 0x1p-11 * 7.0 + glm::dvec3(0.3));
    }
    // The two ways to cut the grid's squares.
    std::vector<std::uint16_t> one;
    std::vector<std::uint16_t> other;
    for (std::uint16_t y = 0; y + 1 < kSide; ++y) {
      for (std::uint16_t x = 0; x + 1 < kSide; ++x) {
        const auto a = static_cast<std::uint16_t>(y * kSide + x);
        const auto b = static_cast<std::uint16_t>(a + 1);
        const auto c = static_cast<std::uint16_t>(a + kSide);
        const auto d = static_cast<std::uint16_t>(c + 1);
        one.insert(one.end(), {a, b, d, a, d, c});
        other.insert(other.end(), {a, b, c, b, d, c});
      }
    }
    LevelSurface from(p, one);
    LevelSurface to(p, other);
    double exact = 0;  // at the middles of the diagonals
    for (std::size_t i = 0; i < one.size(); i += 6) {
      const glm::dvec3 middle = 0.5 * (p[one[i]] + p[one[i + 2]]);
      double least = 1e9;
      for (std::uint32_t t = 0; t < other.size() / 3; ++t) {
        least = std::min(least, distance_square(middle, to.triangle(t)));
      }
      exact = std::max(exact, std::sqrt(least));
    }
    for (const std::vector<std::uint32_t>& nearby :
         {to.triangles_of_vertices(), std::vector<std::uint32_t>(p.size(), kNoIndex)}) {
      const double bound = surface_distance(from, to, nearby, 0);
      EXPECT_GE(bound, exact - 1e-12);
      EXPECT_LE(bound, std::max(kDistanceFloor, 1.5 * 7 * 0x1p-11 * 1.8));
    }
  }
}

/// The greatest distance of some points of each of the first triangles from the second ones, by
/// looking at all of them.
double sampled_distance(const LevelSurface& from, const LevelSurface& to) {
  double greatest = 0;
  for (std::uint32_t t = 0; t < from.triangles(); ++t) {
    const std::array<glm::dvec3, 3> corners = from.triangle(t);
    for (const glm::dvec3& weights :
         {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(0.5, 0.5, 0),
          glm::dvec3(0.5, 0, 0.5), glm::dvec3(0, 0.5, 0.5), glm::dvec3(1.0 / 3)}) {
      const glm::dvec3 point =
          weights.x * corners[0] + weights.y * corners[1] + weights.z * corners[2];
      double least = 1e9;
      for (std::uint32_t other = 0; other < to.triangles(); ++other) {
        least = std::min(least, distance_square(point, to.triangle(other), least));
      }
      greatest = std::max(greatest, std::sqrt(least));
    }
  }
  return greatest;
}

TEST(Levels, DistancesBothWays) {
  // A rough square whose rim stays or does not, a tube of it, and one with a hole.
  constexpr std::uint16_t kSide = 12;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 8; ++round) {
    const bool tube = round % 4 == 2;
    const double roughness = 0.02 + 0.03 * (round % 5);
    std::vector<glm::dvec3> p;
    std::vector<std::uint8_t> locked;
    for (std::uint16_t v = 0; v < kSide * kSide; ++v) {
      const int x = v % kSide;
      const int y = v / kSide;
      const double r = roughness * uniform(random);
      const double angle = 6.283185307 * x / kSide;
      p.push_back(tube ? glm::dvec3((1 + r) * std::cos(angle), (1 + r) * std::sin(angle), 0.4 * y)
                       : 0.1 * glm::dvec3(x, y, 10 * r));
      const bool rim = y == 0 || y + 1 == kSide || (!tube && (x == 0 || x + 1 == kSide));
      locked.push_back(rim && round % 4 != 1 ? 1 : 0);
    }
    std::vector<std::uint16_t> all;
    for (std::uint16_t y = 0; y + 1 < kSide; ++y) {
      for (std::uint16_t x = 0; x + (tube ? 0 : 1) < kSide; ++x) {
        if (round % 4 == 3 && x == 5 && y == 8) continue;
        const auto a = static_cast<std::uint16_t>(y * kSide + x);
        const auto b = static_cast<std::uint16_t>(y * kSide + (x + 1) % kSide);
        const auto c = static_cast<std::uint16_t>(a + kSide);
        const auto d = static_cast<std::uint16_t>(b + kSide);
        all.insert(all.end(), {a, b, d, a, d, c});
      }
    }
    const CollapseSequence sequence = decimate_chunk({p, {}}, all, locked, {1.0, 0.0, 0.0, 40});
    for (const double share : {0.5, 1.0}) {
      const std::vector<std::uint16_t> become = collapsed_vertices(
          sequence,
          static_cast<std::size_t>(share * static_cast<double>(sequence.collapses.size())),
          p.size());
      std::vector<std::uint16_t> fewer;
      for (std::size_t i = 0; i < all.size(); i += 3) {
        const std::array<std::uint16_t, 3> t = {become[all[i]], become[all[i + 1]],
                                                become[all[i + 2]]};
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        fewer.insert(fewer.end(), t.begin(), t.end());
      }
      LevelSurface fine(p, all);
      LevelSurface coarse(p, fewer);
      std::vector<std::uint32_t> nearby = coarse.triangles_of_vertices();
      for (std::size_t v = 0; v < p.size(); ++v) {
        if (nearby[v] == kNoIndex) nearby[v] = coarse.walk(p[v], nearby[become[v]]);
      }
      const std::vector<std::uint32_t> of_fine = fine.triangles_of_vertices();
      const double off = std::max(sampled_distance(fine, coarse), sampled_distance(coarse, fine));
      const double bound = level_distance(fine, coarse, nearby, of_fine, 0);
      EXPECT_GE(bound, off - 1e-12) << round << " " << share;
      EXPECT_LE(bound, 1.6 * off) << round << " " << share;
      EXPECT_EQ(level_distance(fine, coarse, nearby, of_fine, 9.0), 9.0);
    }
  }
}

TEST(Levels, NearestTriangleIsTheNearestOfAll) {
  // Scattered, in one plane, and all in one place.
  for (const glm::dvec3& size : {glm::dvec3(1, 1, 1), glm::dvec3(3, 0, 1), glm::dvec3(0, 0, 0)}) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> one(-1, 1);
    const auto any = [&](double scale) {
      const double x = one(random);
      const double y = one(random);
      return scale * glm::dvec3(x, y, one(random));
    };
    std::vector<glm::dvec3> positions;
    std::vector<std::uint16_t> indices;
    for (std::uint16_t t = 0; t < 900; ++t) {
      const glm::dvec3 middle = any(1) * size;
      for (int k = 0; k < 3; ++k) {
        indices.push_back(static_cast<std::uint16_t>(positions.size()));
        positions.push_back(middle + any(0.05) * size);
      }
    }
    LevelSurface surface(positions, indices);
    for (int i = 0; i < 300; ++i) {
      const glm::dvec3 point = any(i % 3 == 0 ? 4 : 1);
      double least = std::numeric_limits<double>::infinity();
      for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        least = std::min(least, distance_square(point, surface.triangle(t)));
      }
      const NearTriangle start{distance_square(point, surface.triangle(7)), 7};
      const NearTriangle found = surface.nearest(point, 0, start);
      EXPECT_EQ(found.square, least);
      EXPECT_EQ(distance_square(point, surface.triangle(found.triangle)), least);
      const NearTriangle enough = surface.nearest(point, 4 * least, start);
      EXPECT_LE(enough.square, std::max(4 * least, 1e-30));
    }
  }
}

TEST(Levels, DistancesOfWhatTheFinerLevelDoesNotCover) {
  struct Case {
    const char* name;
    std::vector<glm::dvec3> positions;
    std::vector<std::uint16_t> fine;
    std::vector<std::uint16_t> coarse;
    std::vector<std::uint32_t> nearby;
    double distance;  ///< of some point of the coarse level
    double least = 0;
  };
  const std::vector<Case> cases = {
      {"a notch that the coarse level fills",
       {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5, 0.2, 0}, {0, 1, 0}},
       {0, 1, 3, 1, 2, 3, 4, 0, 3},
       {0, 1, 4, 1, 2, 4},
       {0, 0, 1, 0, 0},
       0.4 / std::sqrt(0.89)},  // from (0.5, 1) to the line through (1, 1) and (0.5, 0.2)
      {"a triangle next to the border",
       {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 2, 0}},
       {0, 1, 2},
       {0, 1, 2, 0, 2, 3},
       {0, 0, 0, 1},
       std::sqrt(4.5)},  // from (-1, 2) to (0.5, 0.5)
      {"a triangle elsewhere",
       {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 5}, {1, 0, 5}, {1, 1, 5}},
       {0, 1, 2},
       {0, 1, 2, 3, 4, 5},
       {0, 0, 0, kNoIndex, kNoIndex, kNoIndex},
       5.0},
      {"a peak between three places",
       {{-0.87, -0.5, 0},
        {0.87, -0.5, 0},
        {0, 1, 0},
        {-0.3, 0.15, 0},
        {0, -0.35, 0},
        {0.3, 0.15, 0},
        {0, 0, 5}},
       {0, 1, 4, 1, 2, 5, 2, 0, 3, 0, 4, 3, 1, 5, 4, 2, 3, 5, 3, 4, 5},
       {0, 1, 6, 1, 2, 6, 2, 0, 6},
       {0, 1, 2, 2, 0, 1, 0},
       5.0,
       1.0},
      {"a peak on the other side of a flat pocket",
       {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {0, 0, 0.1}, {0, 0, 5}},
       {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3},
       {0, 2, 1, 0, 1, 4, 1, 2, 4, 2, 0, 4},
       {0, 0, 0, 0, kNoIndex},
       4.9},
  };
  for (const Case& c : cases) {
    LevelSurface fine(c.positions, c.fine);
    LevelSurface coarse(c.positions, c.coarse);
    const double bound =
        level_distance(fine, coarse, c.nearby, fine.triangles_of_vertices(), c.least);
    EXPECT_GE(bound, c.distance - 1e-9) << c.name;
    EXPECT_LE(bound, 1.5 * c.distance) << c.name;
  }
}

TEST(Levels, AlikeLevelsAreOne) {
  ChunkedMesh mesh;
  Chunk& chunk = mesh.chunks.emplace_back();
  // Errors, what the shading shows, and whether the level stays: the next that does is compared, or
  // the proxy (0.52).
  const std::vector<std::tuple<double, double, bool>> levels = {
      {0.1, 0.0, true},  {0.2, 0.0, false}, {0.21, 0.0, false}, {0.22, 0.0, true},
      {0.4, 0.0, false}, {0.4, 0.42, true}, {0.5, 0.0, false}};
  std::vector<double> expected;
  for (const auto& [error, shading, stays] : levels) {
    chunk.coarser.push_back({{0, 1, 2}, error, 0.0, shading, 0});
    if (stays) expected.push_back(error);
  }
  drop_alike_levels(mesh, 0.52);
  std::vector<double> left;
  for (const ChunkLevel& level : chunk.coarser) left.push_back(level.error);
  EXPECT_EQ(left, expected);
}

TEST(Levels, WhatShadesABendWiderIsNoCloseLevel) {
  // A sheet, flat and with a bend in its middle: levels of both are exact in place.
  for (const double rise : {0.0, 0.5}) {
    std::string text = "s 1\n";
    constexpr int kSide = 41;
    for (int i = 0; i < kSide * kSide; ++i) {
      text += "v " + std::to_string(i % kSide) + " " + std::to_string(i / kSide) + " " +
              std::to_string(rise * std::abs(i % kSide - kSide / 2)) + "\n";
    }
    for (int y = 1; y < kSide; ++y) {
      for (int x = 1; x < kSide; ++x) {
        const int a = (y - 1) * kSide + x;
        text += "f " + std::to_string(a) + " " + std::to_string(a + 1) + " " +
                std::to_string(a + kSide + 1) + " " + std::to_string(a + kSide) + "\n";
      }
    }
    const ChunkedMesh split = levelled(welded(parse(text)), 65535);
    ASSERT_EQ(split.chunks.size(), 1u);
    ASSERT_EQ(split.chunks[0].coarser.size(), 3u);
    for (const ChunkLevel& level : split.chunks[0].coarser) {
      EXPECT_LE(level.error, 2 * kDistanceFloor);
      EXPECT_EQ(level.shading > 0, rise > 0);
    }
    const PackedMesh packed = testing::packed(split);
    const float stated = packed.levels.back().error;
    EXPECT_EQ(stated > 0.004f, rise > 0) << stated;
    EXPECT_GE(stated, static_cast<float>(split.chunks[0].coarser.back().shading));
  }
}

TEST(Levels, PixelsAreAsLargeAsWhatDiffersInThem) {
  constexpr int kSide = 64;
  constexpr double kStep = 2.0 / (kSide - 1);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < kSide * kSide; ++i) {
    points.emplace_back(-1 + i % kSide * kStep, -1 + i / kSide * kStep, 0.0);
  }
  PixelCells cells(points);
  // Of each point, of which the surface is even: the smallest pixel that shows no difference.
  const auto pixel = [&](const auto& difference_at) {
    std::vector<LookDifference> differences(points.size());
    for (int i = 0; i < kSide * kSide; ++i) {
      differences[static_cast<std::size_t>(i)] = difference_at(i % kSide, i / kSide);
      differences[static_cast<std::size_t>(i)].area = 1;
    }
    return cells.smallest_pixel(differences);
  };
  const auto normal = [](float x) {
    LookDifference difference;
    difference.normal = {0.0f, x, 0.0f};
    return difference;
  };
  EXPECT_EQ(pixel([&](int, int) { return normal(0.01f); }), 0.0);
  // It shows as long as the whole is a pixel.
  const double whole = pixel([&](int, int) { return normal(0.03f); });
  EXPECT_GE(whole, 2.0);
  // In larger pixels, by the part of their area: four times as much does in twice the side.
  EXPECT_NEAR(pixel([&](int, int) { return normal(0.12f); }), 2 * whole, 1e-3);
  // From point to point, and in bands of eight, one way and the other.
  const double fine = pixel([&](int x, int) { return normal(x % 2 == 0 ? 0.1f : -0.1f); });
  EXPECT_GT(fine, kStep / 2);
  EXPECT_LT(fine, 4 * kStep);
  const double wide = pixel([&](int x, int) { return normal(x / 8 % 2 == 0 ? 0.1f : -0.1f); });
  EXPECT_GT(wide, 4 * kStep);
  EXPECT_LT(wide, 32 * kStep);
  // What 1.5 of 255 are in the mean may differ, no more.
  EXPECT_EQ(pixel([&](int x, int y) { return normal(x % 16 + y % 8 == 0 ? 1.0f : 0.0f); }), 0.0);
  EXPECT_GT(pixel([&](int x, int y) { return normal(x % 4 + y % 4 == 0 ? 1.0f : 0.0f); }), kStep);
  // Colours count by half; a texture's slide by the pixels that it is wide.
  LookDifference colour;
  colour.colour = {0.0f, 2.5f, 0.0f};
  EXPECT_EQ(pixel([&](int, int) { return colour; }), 0.0);
  colour.colour = {0.0f, 0.0f, 3.5f};
  EXPECT_GE(pixel([&](int, int) { return colour; }), 2.0);
  LookDifference slid;
  slid.slide = {0.003f, 0.0f};
  const double slide = pixel([&](int, int) { return slid; });
  EXPECT_GT(slide, 0.06);
  EXPECT_LE(slide, 0.25);
}

TEST(Levels, ThreeTrianglesAtAnEdgeAreKept) {
  // A fan of many triangles round a common edge, none of which may go.
  const std::vector<glm::dvec3> p = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  const std::vector<std::uint16_t> fan = {0, 1, 2, 0, 1, 3, 0, 1, 4};
  const std::vector<std::uint8_t> free(p.size(), 0);
  const CollapseSequence result = decimate_chunk({p, {}}, fan, free, {1.0, 0.0, 0.0, 1});
  EXPECT_TRUE(result.collapses.empty());
}

/// uv of the triangles of a flat level at a point, by searching all of them.
glm::dvec2 uv_at(const TriMesh& mesh, const Chunk& chunk, std::span<const std::uint16_t> indices,
                 const glm::dvec2& p) {
  const auto area = [](const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  glm::dvec2 best(0.0);
  double least_outside = 1e9;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    std::array<std::uint32_t, 3> v{};
    std::array<glm::dvec2, 3> at;
    for (std::size_t k = 0; k < 3; ++k) {
      v[k] = chunk.vertices[indices[i + k]];
      at[k] = glm::dvec2(mesh.positions[v[k]]);
    }
    const double whole = area(at[0], at[1], at[2]);
    if (std::abs(whole) < 1e-6) continue;  // along the border
    const std::array<double, 3> share = {area(p, at[1], at[2]) / whole,
                                         area(at[0], p, at[2]) / whole,
                                         area(at[0], at[1], p) / whole};
    const double outside = -*std::min_element(share.begin(), share.end());
    if (outside >= least_outside) continue;
    least_outside = outside;
    best = share[0] * mesh.uvs[v[0]] + share[1] * mesh.uvs[v[1]] + share[2] * mesh.uvs[v[2]];
  }
  EXPECT_LT(least_outside, 0.05);
  return best;
}

TEST(Levels, TexturesSlideNoFartherThanStated) {
  // Flat, so that the surface alone forbids nothing, under a texture that is sheared unevenly.
  constexpr std::uint32_t kSide = 1024;
  constexpr double kRounding =
      1.0;  // texels: half floats move the vertices that levels are made of
  TriMesh mesh = welded(parse(grid(40, 1)));
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    mesh.positions[v].z = 0;
    glm::dvec2& uv = mesh.uvs[v];
    uv = {uv.x + 0.12 * std::sin(14 * uv.y + 6 * uv.x), uv.y + 0.05 * uv.x * uv.x};
  }
  const auto greatest_shift = [&](const ChunkedMesh& split, std::size_t level) {
    const Chunk& chunk = split.chunks[0];
    double greatest = 0;
    for (const std::uint32_t v : chunk.vertices) {
      const glm::dvec2 there = uv_at(split.mesh, chunk, chunk.coarser[level].indices,
                                     glm::dvec2(split.mesh.positions[v]));
      greatest = std::max(greatest, kSide * glm::length(there - split.mesh.uvs[v]));
    }
    return greatest;
  };
  const ChunkedMesh bounded = levelled(mesh, 65535, 2, kSide);
  ASSERT_EQ(bounded.chunks.size(), 1u);
  ASSERT_GE(bounded.chunks[0].coarser.size(), 2u);
  // The grid is 28 by 40: 1 % of its diagonal, in texels of an even texture of its area.
  const double bound = 0.01 * std::hypot(28, 40) / std::sqrt(28.0 * 40) * kSide;
  for (std::size_t l = 0; l < bounded.chunks[0].coarser.size(); ++l) {
    const double stated = bounded.chunks[0].coarser[l].uv_shift;
    EXPECT_NEAR(greatest_shift(bounded, l), stated, kRounding) << "level " << l + 1;
    EXPECT_LE(stated, 1.05 * bound) << "level " << l + 1;
    EXPECT_GT(stated, 0.02 * bound) << "level " << l + 1;
  }
  // Without a texture nothing is stated, and the uvs are off by far more.
  const ChunkedMesh free = levelled(mesh, 65535, 2, 0);
  ASSERT_GE(free.chunks[0].coarser.size(), 2u);
  EXPECT_EQ(free.chunks[0].coarser[1].uv_shift, 0);
  EXPECT_GT(greatest_shift(free, 1), 2 * greatest_shift(bounded, 1));
}

TEST(Levels, ThreadsChangeNothing) {
  const TriMesh mesh = welded(parse(grid(40, 2)));
  const PackedMesh one = testing::packed(levelled(mesh, 300, 1));
  const PackedMesh eight = testing::packed(levelled(mesh, 300, 8));
  EXPECT_EQ(one.indices, eight.indices);
  EXPECT_EQ(one.vertices, eight.vertices);
  ASSERT_EQ(one.levels.size(), eight.levels.size());
  for (std::size_t l = 0; l < one.levels.size(); ++l) {
    EXPECT_EQ(one.levels[l].error, eight.levels[l].error);
  }
}

TEST(Stages, SayThatNothingIsLeft) {
  Report report;
  EXPECT_EQ(chunk({}, {}, report).error().code, "model.empty");
  ChunkedMesh nothing;
  EXPECT_EQ(make_levels(nothing, {}, report).error().code, "model.empty");
  const Error packed = pack(nothing, {}, {}, report).error();
  EXPECT_EQ(packed.code, "model.no-area");
  EXPECT_EQ(packed.cure.find("int16"), std::string::npos) << "it was tried";
}

TEST(Levels, LevelZeroAndVerticesAreThoseWithoutLevels) {
  const TriMesh mesh = welded(parse(grid(40, 2)));
  const PackedMesh plain = testing::packed(chunked(mesh, 300));
  const PackedMesh levels = testing::packed(levelled(mesh, 300));
  EXPECT_EQ(plain.vertices, levels.vertices);
  ASSERT_GT(levels.indices.size(), plain.indices.size());
  EXPECT_TRUE(std::equal(plain.indices.begin(), plain.indices.end(), levels.indices.begin()));
}

}  // namespace
}  // namespace modar
