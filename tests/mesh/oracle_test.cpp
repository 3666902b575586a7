// Whole models against independent eyes: assimp's parse, rays, brute force over the decoded bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "tests/import/samples.hpp"
#include "tests/mesh/assimp_oracle.hpp"
#include "tests/mesh/stages.hpp"
#include "tests/soak.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;
using testing::soak;
using testing::SurfaceFigures;

SurfaceFigures figures_of(const SourceModel& model) {
  SurfaceFigures figures;
  figures.loaded = true;
  figures.faces = model.face_count();
  figures.corners = model.corner_count();
  for (std::size_t f = 0; f < model.face_count(); ++f) {
    const std::size_t first = model.face_first(f);
    const std::size_t size = model.face_size(f);
    const glm::dvec3 origin = model.positions[model.corner(first).position];
    glm::dvec3 area(0.0);
    for (std::size_t i = 0; i < size; ++i) {
      const glm::dvec3 p = model.positions[model.corner(first + i).position];
      const glm::dvec3 q = model.positions[model.corner(first + (i + 1) % size).position];
      area += glm::cross(p - origin, q - origin);
      figures.low = glm::min(figures.low, p);
      figures.high = glm::max(figures.high, p);
    }
    figures.area += 0.5 * glm::length(area);
  }
  return figures;
}

/// Files that assimp reads otherwise, and why ours is right.
const std::map<std::string, std::string>& known_differences() {
  static const std::map<std::string, std::string> known = {
      {"cube-vertex-w-component.obj", "it divides by the weight, which is for curves alone"},
      {"test-nan.obj", "it makes infinities of NaN"}};
  return known;
}

/// Answers whether both read it.
bool expect_same_as_assimp(const std::string& path) {
  const auto ours = read_model(path, {});
  if (!ours || known_differences().contains(fs::path(path).filename().string())) return false;
  const SurfaceFigures theirs = testing::load_with_assimp(path);
  if (!theirs.loaded || theirs.faces == 0) return false;
  const SurfaceFigures mine = figures_of(*ours);
  EXPECT_EQ(mine.faces, theirs.faces) << path;
  EXPECT_EQ(mine.corners, theirs.corners) << path;
  const double size = glm::length(mine.high - mine.low);
  // Floats there: the farther from the origin, the coarser.
  const double far = std::max(glm::length(mine.high), glm::length(mine.low));
  const double rounding = 1e-6 * std::max(far, size);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(mine.low[i], theirs.low[i], rounding) << path;
    EXPECT_NEAR(mine.high[i], theirs.high[i], rounding) << path;
  }
  if (rounding < 1e-4 * size) {
    EXPECT_NEAR(mine.area, theirs.area, 1e-3 * mine.area + 1e-12) << path;
  }
  return true;
}

std::vector<std::string> own_models() {
  const char* const source = std::getenv("MODAR_SOURCE_DIR");
  return source == nullptr ? std::vector<std::string>()
                           : testing::obj_files_below(std::string(source) + "/assets/models");
}

TEST(Eyes, AssimpReadsTheSame) {
  std::vector<std::string> files = own_models();
  ASSERT_FALSE(files.empty());
  for (const std::string& path : testing::assimp_obj_files()) files.push_back(path);
  std::size_t compared = 0;
  for (const std::string& path : files) {
    if (!soak() && fs::file_size(path) > 3'000'000) continue;
    compared += expect_same_as_assimp(path) ? 1u : 0u;
  }
  EXPECT_GE(compared, own_models().size());
  RecordProperty("compared", static_cast<int>(compared));
  std::printf("%zu of %zu files compared\n", compared, files.size());
}

TEST(Eyes, AssimpReadsTheSameOfScans) {
  const fs::path folder = "/usr/share/assimp/models";
  std::size_t compared = 0;
  for (const char* kind : {"PLY", "STL"}) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder / kind, error)) {
      if (is_model_file(entry.path().string()) && expect_same_as_assimp(entry.path().string())) {
        ++compared;
      }
    }
  }
  std::printf("%zu PLY and STL files compared\n", compared);
  EXPECT_GE(compared, fs::exists(folder / "PLY") ? 8u : 0u);
}

using Corners = std::array<glm::dvec3, 3>;

/// Level `level` (or the coarsest that a chunk has) of all chunks, in source units.
std::vector<Corners> decoded_surface(const PackedMesh& mesh, std::uint32_t level) {
  const VertexDecoder decoder(mesh.layout);
  const glm::dvec3 center(mesh.record.center[0], mesh.record.center[1], mesh.record.center[2]);
  std::vector<Corners> surface;
  for (const ChunkRecord& chunk : mesh.chunks) {
    const LevelRecord& l = mesh.levels[chunk.first_level + std::min(level, chunk.level_count - 1)];
    for (std::uint32_t i = 0; i < l.index_count; ++i) {
      std::uint16_t index = 0;
      std::memcpy(&index, mesh.indices.data() + l.index_offset + 2 * i, 2);
      const std::byte* at = mesh.vertices.data() + l.vertex_offset + index * mesh.layout.stride;
      if (i % 3 == 0) surface.emplace_back();
      surface.back()[i % 3] = center + mesh.record.scale * decoder.position(at, chunk);
    }
  }
  return surface;
}

std::vector<Corners> source_surface(const TriMesh& mesh) {
  std::vector<Corners> surface;
  for (const auto& t : mesh.triangles) {
    Corners& corners = surface.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = mesh.placement.center + mesh.placement.scale * mesh.positions[t[i]];
    }
  }
  return surface;
}

/// Where a ray meets a triangle (Moeller and Trumbore, "Fast, minimum storage ray-triangle
/// intersection", 1997); infinity where it does not.
double hit(const glm::dvec3& from, const glm::dvec3& along, const Corners& t) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const glm::dvec3 u = t[1] - t[0];
  const glm::dvec3 v = t[2] - t[0];
  const glm::dvec3 p = glm::cross(along, v);
  const double determinant = glm::dot(u, p);
  if (determinant == 0) return kMiss;
  const glm::dvec3 s = from - t[0];
  const double a = glm::dot(s, p) / determinant;
  const glm::dvec3 q = glm::cross(s, u);
  const double b = glm::dot(along, q) / determinant;
  const double distance = glm::dot(v, q) / determinant;
  return a < 0 || b < 0 || a + b > 1 || distance < 0 ? kMiss : distance;
}

/// Distance of a point from a triangle, by its plane and its edges.
double distance_from(const glm::dvec3& p, const Corners& t) {
  const glm::dvec3 n = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double area = glm::length(n);
  double least = std::numeric_limits<double>::infinity();
  if (area > 0) {
    const double off = glm::dot(p - t[0], n) / area;
    if (std::isfinite(
            hit(p + n * ((off > 0 ? 1.0 : -1.0) * 1e-9), n * (off > 0 ? -1.0 : 1.0), t))) {
      least = std::abs(off);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 edge = t[(i + 1) % 3] - t[i];
    const double square = glm::dot(edge, edge);
    const double at = square > 0 ? std::clamp(glm::dot(p - t[i], edge) / square, 0.0, 1.0) : 0.0;
    least = std::min(least, glm::length(p - (t[i] + at * edge)));
  }
  return least;
}

/// Rays from a sphere round the model at its triangles: where one meets a surface first, the other
/// is within `bound`.
void expect_rays_agree(const std::vector<Corners>& from, const std::vector<Corners>& to,
                       double bound, int rays, const std::string& what) {
  glm::dvec3 low = from[0][0];
  glm::dvec3 high = low;
  for (const Corners& t : from) {
    for (const glm::dvec3& p : t) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  }
  const double radius = 0.5 * glm::length(high - low);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  int hits = 0;
  for (int i = 0; i < rays; ++i) {
    const glm::dvec3 start =
        0.5 * (low + high) +
        radius * glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    const Corners& at = from[random() % from.size()];
    const glm::dvec3 along = glm::normalize((at[0] + at[1] + at[2]) / 3.0 - start);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Corners& t : from) nearest = std::min(nearest, hit(start, along, t));
    if (!std::isfinite(nearest)) continue;
    ++hits;
    const glm::dvec3 point = start + nearest * along;
    double least = std::numeric_limits<double>::infinity();
    for (const Corners& t : to) {
      // A point farther than the bound in one coordinate cannot be it.
      const glm::dvec3 near = glm::clamp(point, glm::min(t[0], glm::min(t[1], t[2])),
                                         glm::max(t[0], glm::max(t[1], t[2])));
      if (glm::length(near - point) < least) least = std::min(least, distance_from(point, t));
    }
    EXPECT_LE(least, bound + 1e-14 * radius) << what;  // what doubles round the hit by
  }
  EXPECT_GT(hits, rays / 2) << what;
}

/// Brute force over every vertex of every triangle of every level: inside the box; and no direction
/// that the cone rules out sees a triangle's front.
void expect_bounds_hold(const PackedMesh& mesh, const std::string& what) {
  const VertexDecoder decoder(mesh.layout);
  for (const ChunkRecord& chunk : mesh.chunks) {
    const glm::dvec3 axis(chunk.cone_axis[0], chunk.cone_axis[1], chunk.cone_axis[2]);
    for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
      const LevelRecord& level = mesh.levels[chunk.first_level + l];
      Corners t;
      for (std::uint32_t i = 0; i < level.index_count; ++i) {
        std::uint16_t index = 0;
        std::memcpy(&index, mesh.indices.data() + level.index_offset + 2 * i, 2);
        const glm::dvec3 p = decoder.position(
            mesh.vertices.data() + level.vertex_offset + index * mesh.layout.stride, chunk);
        for (int k = 0; k < 3; ++k) {
          ASSERT_GE(p[k], static_cast<double>(chunk.bounds_min[k])) << what;
          ASSERT_LE(p[k], static_cast<double>(chunk.bounds_max[k])) << what;
        }
        t[i % 3] = p;
        if (i % 3 != 2 || chunk.cone_cutoff > 1) continue;
        const glm::dvec3 n = glm::cross(t[1] - t[0], t[2] - t[0]);
        if (glm::length(n) == 0) continue;
        // The widest direction that is ruled out stands acos(cutoff) from the axis; the normal may
        // stand no farther from the axis than the rest of a right angle.
        const double apart = std::atan2(glm::length(glm::cross(n, axis)), glm::dot(n, axis));
        const double ruled = std::acos(static_cast<double>(chunk.cone_cutoff));
        ASSERT_LE(apart + ruled, 1.5707963267948966) << what;
      }
    }
  }
}

/// Edges of a chunk's level that one triangle has, in decoded points.
using Point = std::array<double, 3>;
using Rim = std::map<std::pair<Point, Point>, int>;

Rim rim_of(const PackedMesh& mesh, const ChunkRecord& chunk, std::uint32_t l) {
  const VertexDecoder decoder(mesh.layout);
  const LevelRecord& level = mesh.levels[chunk.first_level + l];
  Rim edges;
  std::array<Point, 3> t;
  for (std::uint32_t i = 0; i < level.index_count; ++i) {
    std::uint16_t index = 0;
    std::memcpy(&index, mesh.indices.data() + level.index_offset + 2 * i, 2);
    const glm::dvec3 p = decoder.position(
        mesh.vertices.data() + level.vertex_offset + index * mesh.layout.stride, chunk);
    t[i % 3] = {p.x, p.y, p.z};
    if (i % 3 != 2) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Point& a = t[k];
      const Point& b = t[(k + 1) % 3];
      if (a == b) continue;  // two vertices of the source at one point of the grid
      edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  std::erase_if(edges, [](const auto& edge) { return edge.second == 0; });
  return edges;
}

/// What chunks share stays at every level, and what a coarser level opens is on the model's own
/// rim.
void expect_no_cracks(const PackedMesh& mesh, const std::string& what) {
  std::map<std::pair<Point, Point>, int> chunks_at;  // of each edge of the finest level
  for (const ChunkRecord& chunk : mesh.chunks) {
    for (const auto& [edge, uses] : rim_of(mesh, chunk, 0)) ++chunks_at[edge];
  }
  std::set<Point> open;  // ends of the edges that one chunk alone has
  for (const auto& [edge, chunks] : chunks_at) {
    if (chunks == 1) open.insert({edge.first, edge.second});
  }
  for (const ChunkRecord& chunk : mesh.chunks) {
    Rim shared = rim_of(mesh, chunk, 0);
    std::erase_if(shared, [&](const auto& edge) { return chunks_at.at(edge.first) == 1; });
    for (std::uint32_t l = 1; l < chunk.level_count; ++l) {
      Rim rim = rim_of(mesh, chunk, l);
      for (const auto& edge : shared) {
        EXPECT_TRUE(rim.erase(edge.first)) << what << " level " << l;
      }
      for (const auto& [edge, uses] : rim) {
        EXPECT_TRUE(open.contains(edge.first) && open.contains(edge.second))
            << what << " level " << l;
      }
    }
  }
}

void look_at(const std::string& path, PositionKind kind, int rays) {
  Report report;
  const auto source = read_obj(path, {2});
  ASSERT_TRUE(source) << path;
  const TriMesh mesh = testing::welded(*source);
  ChunkedMesh chunks = testing::chunked(mesh, 4000);
  LevelOptions options;
  options.levels = 3;
  options.positions = kind;
  options.jobs = 2;
  ASSERT_TRUE(make_levels(chunks, options, report));
  PackOptions pack_options;
  pack_options.positions = kind;
  pack_options.jobs = 2;
  const auto packed =
      pack(chunks, std::vector<std::uint32_t>(mesh.materials.size(), 0), pack_options, report);
  ASSERT_TRUE(packed);
  const std::string what = fs::path(path).filename().string();
  expect_bounds_hold(*packed, what);
  expect_no_cracks(*packed, what);
  const auto fine = source_surface(mesh);
  const double stated = packed->record.position_error_max * (1 + 1e-6);
  expect_rays_agree(fine, decoded_surface(*packed, 0), stated, rays, what + " to bundle");
  expect_rays_agree(decoded_surface(*packed, 0), fine, stated, rays, what + " from bundle");
  double level_error = 0;
  for (const LevelRecord& level : packed->levels) {
    level_error = std::max(level_error, static_cast<double>(level.error));
  }
  const double coarse = stated + level_error * packed->record.scale;
  expect_rays_agree(fine, decoded_surface(*packed, 2), coarse, rays, what + " to its levels");
}

TEST(Eyes, RaysBoxesConesAndCracksOfOurOwnModels) {
  const auto files = own_models();
  ASSERT_FALSE(files.empty());
  for (const std::string& path : files) {
    if (!soak() && fs::file_size(path) > 1'000'000) continue;
    look_at(path, PositionKind::kHalf, soak() ? 400 : 60);
    look_at(path, PositionKind::kInt16, soak() ? 400 : 60);
  }
}

}  // namespace
}  // namespace modar
