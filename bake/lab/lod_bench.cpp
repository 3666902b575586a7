// Makes levels in both ways and samples the distances between surfaces.
#include "bake/lab/lod_bench.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <random>
#include <set>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/import/read_model.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/triangle_tree.hpp"
#include "bake/mesh/weld/weld.hpp"

namespace modar {
namespace {

using Triangles = std::vector<TriangleTree::Triangle>;

/// Points a surface: the 99th percentile then stands on 500 of them.
constexpr std::size_t kSamples = 50'000;
/// Pixels that every material's texture is taken to have, where a model has uv: what scans usually
/// have. Slides are of that scale.
constexpr std::uint32_t kTextureSide = 2048;

double cpu_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Distances of one surface from another, in the unit of the positions.
struct Distances {
  double rms = 0;
  double p99 = 0;
  double greatest = 0;
};

/// Samples `from` evenly by area. Both index `positions`.
Distances distances(const std::vector<glm::dvec3>& positions, const Triangles& from,
                    const Triangles& to) {
  std::vector<double> areas;  // summed up
  double area = 0;
  for (const auto& [a, b, c] : from) {
    area += glm::length(glm::cross(positions[b] - positions[a], positions[c] - positions[a]));
    areas.push_back(area);
  }
  TriangleTree tree(positions, to);
  std::mt19937_64 random(1);
  const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<double> at(kSamples);
  for (double& x : at) x = unit() * area;
  std::sort(at.begin(), at.end());
  std::vector<double> squares;
  double sum = 0;
  std::size_t t = 0;
  for (const double x : at) {
    while (t + 1 < areas.size() && areas[t] < x) ++t;
    const auto& [a, b, c] = from[t];
    const double v = std::sqrt(unit());
    const double w = unit();
    const glm::dvec3 point =
        positions[a] * (1 - v) + positions[b] * (v * (1 - w)) + positions[c] * (v * w);
    squares.push_back(tree.nearest(point));
    sum += squares.back();
  }
  const auto p99 = squares.begin() + kSamples * 99 / 100;
  std::nth_element(squares.begin(), p99, squares.end());
  return {std::sqrt(sum / kSamples), std::sqrt(*p99),
          std::sqrt(*std::max_element(p99, squares.end()))};
}

/// The worse of both ways.
Distances both_ways(const std::vector<glm::dvec3>& positions, const Triangles& a,
                    const Triangles& b) {
  const Distances there = distances(positions, a, b);
  const Distances back = distances(positions, b, a);
  return {std::max(there.rms, back.rms), std::max(there.p99, back.p99),
          std::max(there.greatest, back.greatest)};
}

/// All chunks at the level of the model that has so many halvings; its stated error, and slide.
Triangles level_of(const ChunkedMesh& mesh, std::uint32_t halvings, double& error, double& slide) {
  Triangles triangles;
  error = slide = 0;
  for (const Chunk& chunk : mesh.chunks) {
    const std::vector<std::uint16_t>* indices = &chunk.indices;
    const ChunkLevel* last = nullptr;
    for (const ChunkLevel& level : chunk.coarser) {
      if (level.halvings <= halvings) last = &level;
    }
    if (last != nullptr) {
      indices = &last->indices;
      error = std::max(error, last->error);
      slide = std::max(slide, last->uv_shift);
    }
    for (std::size_t i = 0; i < indices->size(); i += 3) {
      const std::uint16_t* t = indices->data() + i;
      triangles.push_back({chunk.vertices[t[0]], chunk.vertices[t[1]], chunk.vertices[t[2]]});
    }
  }
  return triangles;
}

/// meshopt_simplify on a whole mesh, each level from the one before, as its manual says.
class WholeMesh {
 public:
  WholeMesh(const std::vector<glm::dvec3>& positions, const Triangles& triangles) {
    for (const glm::dvec3& p : positions) {
      for (int i = 0; i < 3; ++i) positions_.push_back(static_cast<float>(p[i]));
    }
    for (const auto& t : triangles) indices_.insert(indices_.end(), t.begin(), t.end());
  }

  Triangles simplify(std::size_t triangles) {
    std::vector<unsigned> result(indices_.size());
    const double begin = cpu_seconds();
    result.resize(meshopt_simplify(result.data(), indices_.data(), indices_.size(),
                                   positions_.data(), positions_.size() / 3, 3 * sizeof(float),
                                   3 * triangles, std::numeric_limits<float>::max(), 0, nullptr));
    cpu_ += cpu_seconds() - begin;
    indices_ = std::move(result);
    Triangles out;
    for (std::size_t i = 0; i < indices_.size(); i += 3) {
      out.push_back({indices_[i], indices_[i + 1], indices_[i + 2]});
    }
    return out;
  }
  [[nodiscard]] double cpu() const { return cpu_; }

 private:
  std::vector<float> positions_;
  std::vector<unsigned> indices_;
  double cpu_ = 0;
};

Result<void> bench_one(const std::string& path, unsigned jobs, std::vector<BenchRow>& rows) {
  const std::string name = std::filesystem::path(path).stem().string();
  const auto add = [&](const std::string& measure, double ours, double reference) {
    rows.push_back({measure + " " + name, ours, reference, ours / reference});
  };
  Report report;
  MODAR_ASSIGN(SourceModel source, read_model(path, jobs));
  MODAR_ASSIGN(TriMesh mesh, weld(std::move(source), report, {jobs}));
  const std::vector<glm::dvec3> positions(mesh.positions.begin(), mesh.positions.end());
  const Triangles finest(mesh.triangles.begin(), mesh.triangles.end());
  glm::dvec3 low = positions[0];
  glm::dvec3 high = low;
  for (const glm::dvec3& p : positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const double percent = 100 / glm::length(high - low);
  ChunkOptions chunk_options;
  chunk_options.max_vertices = chunk_vertices_for(positions.size());
  LevelOptions options;
  options.jobs = jobs;
  if (!mesh.uvs.empty()) options.texture_sides.assign(mesh.materials.size(), kTextureSide);
  MODAR_ASSIGN(ChunkedMesh chunked, chunk(std::move(mesh), chunk_options, report));
  const double begin = cpu_seconds();
  MODAR_TRY(make_levels(chunked, options, report));
  const double cpu = cpu_seconds() - begin;
  WholeMesh whole(positions, finest);
  std::set<std::uint32_t> made;
  for (const Chunk& chunk : chunked.chunks) {
    for (const ChunkLevel& level : chunk.coarser) made.insert(level.halvings);
  }
  for (const std::uint32_t halvings : made) {
    const std::string level = "1/" + std::to_string(1u << halvings) + " ";
    double stated = 0;
    double slide = 0;
    const Triangles ours = level_of(chunked, halvings, stated, slide);
    const Triangles theirs = whole.simplify(ours.size());
    const Distances our_own = both_ways(positions, finest, ours);
    const Distances their_own = both_ways(positions, finest, theirs);
    add(level + "triangles/asked", static_cast<double>(ours.size()),
        static_cast<double>(finest.size() >> halvings));
    add(level + "triangles/meshopt_simplify", static_cast<double>(ours.size()),
        static_cast<double>(theirs.size()));
    add(level + "rms_percent/meshopt_simplify", percent * our_own.rms, percent * their_own.rms);
    add(level + "p99_percent/meshopt_simplify", percent * our_own.p99, percent * their_own.p99);
    add(level + "greatest_percent/meshopt_simplify", percent * our_own.greatest,
        percent * their_own.greatest);
    add(level + "stated_percent/greatest_found", percent * stated, percent * our_own.greatest);
    if (!options.texture_sides.empty()) add(level + "slide_texels/side", slide, kTextureSide);
  }
  add("cpu_s/meshopt_simplify", cpu, whole.cpu());
  return {};
}

}  // namespace

Result<std::vector<BenchRow>> bench_lod(const std::vector<std::string>& models, unsigned jobs) {
  std::vector<BenchRow> rows;
  for (const std::string& model : models) MODAR_TRY(bench_one(model, jobs, rows));
  return rows;
}

}  // namespace modar
