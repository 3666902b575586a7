// Bakes with default options, and samples the distances between the source and the bundle's levels.
#include "bake/extensions/lab/lod_bench.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <random>

#include <glm/geometric.hpp>

#include "bake/import/read_model.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/process/process.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

using Triangles = std::vector<TriangleTree::Triangle>;

/// Points a surface: the 99th percentile then has 500 of them.
constexpr std::size_t kSamples = 50'000;
double cpu_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Distances of one surface from another, in the unit of the positions.
struct Distances {
  double rms = 0;
  double p99 = 0;
  double greatest = 0;
};

/// A surface in source units.
struct LevelSurface {
  std::vector<glm::dvec3> positions;
  Triangles triangles;
};

/// Samples `from` evenly by area.
Distances distances(const LevelSurface& from, const LevelSurface& to) {
  std::vector<double> areas;  // summed up
  double area = 0;
  const std::vector<glm::dvec3>& positions = from.positions;
  for (const auto& [a, b, c] : from.triangles) {
    area += glm::length(glm::cross(positions[b] - positions[a], positions[c] - positions[a]));
    areas.push_back(area);
  }
  TriangleTree tree(to.positions, to.triangles);
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
    const auto& [a, b, c] = from.triangles[t];
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
Distances both_ways(const LevelSurface& a, const LevelSurface& b) {
  const Distances there = distances(a, b);
  const Distances back = distances(b, a);
  return {std::max(there.rms, back.rms), std::max(there.p99, back.p99),
          std::max(there.greatest, back.greatest)};
}

constexpr std::uint32_t kMostHalvings = 16;
/// Triangles that a level of this many halvings may have, times those requested: halving stops a
/// little early where a chunk's border is in the way.
constexpr double kNearlyHalved = 1.3;

/// A group of chunks, each at its first level of at most this many halvings, or its coarsest;
/// error: the greatest that these levels state.
LevelSurface level_of_group(const BundleView& bundle, const ChunkGroup& group,
                            std::uint32_t halvings, double& error) {
  LevelSurface surface;
  const ModelRecord& model = bundle.models()[0];
  const VertexDecoder decoder(bundle.layouts()[model.layout]);
  const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
  error = 0;
  for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
    const LevelRecord* level = &bundle.levels()[chunk.first_level];
    const double most = kNearlyHalved * level->index_count / std::exp2(halvings);
    for (std::uint32_t l = 1; l < chunk.level_count && level->index_count > most; ++l) ++level;
    error = std::max(error, model.scale * static_cast<double>(level->error));
    const auto base = static_cast<std::uint32_t>(surface.positions.size());
    for (std::uint32_t v = 0; v < level->vertex_count; ++v) {
      const std::byte* vertex =
          bundle.vertices().data() + level->vertex_offset + std::size_t{v} * decoder.stride();
      surface.positions.push_back(center + model.scale * decoder.position(vertex, chunk));
    }
    const auto* indices =
        reinterpret_cast<const std::uint16_t*>(bundle.indices().data() + level->index_offset);
    for (std::uint32_t i = 0; i < level->index_count; i += 3) {
      surface.triangles.push_back(
          {base + indices[i], base + indices[i + 1], base + indices[i + 2]});
    }
  }
  return surface;
}

/// The model of a bundle at a number of halvings: its chunks, or its first proxy of few enough
/// triangles, or its coarsest.
LevelSurface level_of(const BundleView& bundle, std::uint32_t halvings, double& error) {
  LevelSurface surface = level_of_group(bundle, bundle.chunk_group(0), halvings, error);
  const double most =
      kNearlyHalved * static_cast<double>(bundle.models()[0].triangle_count) / std::exp2(halvings);
  for (std::uint32_t g = 1; g < bundle.chunk_groups(); ++g) {
    if (static_cast<double>(surface.triangles.size()) <= most) break;
    surface = level_of_group(bundle, bundle.chunk_group(g), 0, error);
  }
  return surface;
}

/// Bakes a model as people who set nothing do; answers the processor time.
Result<double> bake_default(const std::string& path, const std::string& bundle, unsigned jobs,
                            bool levels) {
  std::vector<std::string> words = {
      program_folder() + "/modar", "bake",    "--model", path,  "--jobs",
      std::to_string(jobs),        "--quiet", "-o",      bundle};
  if (!levels) words.emplace_back("--no-lods");
  const ProcessOutcome outcome = run_measured({std::move(words), {}, ""});
  if (outcome.exit == 0) return outcome.cpu_seconds;
  return fail(ExitCode::kInvalidInput, "bench.bake", path, "it does not bake",
              "look at what `modar bake --model` says of it");
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

/// The model's surface as its file holds it.
Result<LevelSurface> source_of(const std::string& path, unsigned jobs) {
  Report report;
  MODAR_ASSIGN(SourceModel source, read_model(path, {jobs}));
  MODAR_ASSIGN(const TriMesh mesh, weld(std::move(source), report, {jobs}));
  LevelSurface surface;
  for (const glm::dvec3& p : mesh.positions) {
    surface.positions.push_back(mesh.placement.center + mesh.placement.scale * p);
  }
  surface.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
  return surface;
}

Result<void> bench_one(const std::string& path, unsigned jobs, std::vector<BenchRow>& rows) {
  const std::string name = std::filesystem::path(path).stem().string();
  const auto add = [&](const std::string& measure, double ours, double reference) {
    rows.push_back({measure + " " + name, ours, reference, ours / reference});
  };
  MODAR_ASSIGN(const LevelSurface finest, source_of(path, jobs));
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/levels.modar";
  MODAR_ASSIGN(const double without, bake_default(path, out, jobs, false));
  MODAR_ASSIGN(const double with, bake_default(path, out, jobs, true));
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(out));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(file.bytes()));
  const double percent = 100 / bundle.models()[0].diagonal;
  WholeMesh whole(finest.positions, finest.triangles);
  std::size_t last = finest.triangles.size();
  for (std::uint32_t halvings = 1; halvings <= kMostHalvings; ++halvings) {
    const std::string level = "1/" + std::to_string(1u << halvings) + " ";
    double stated = 0;
    const LevelSurface ours = level_of(bundle, halvings, stated);
    if (ours.triangles.size() == last) continue;  // no level of that few
    last = ours.triangles.size();
    const LevelSurface theirs{finest.positions, whole.simplify(ours.triangles.size())};
    const Distances our_own = both_ways(finest, ours);
    const Distances their_own = both_ways(finest, theirs);
    add(level + "triangles/asked", static_cast<double>(ours.triangles.size()),
        static_cast<double>(finest.triangles.size() >> halvings));
    add(level + "triangles/meshopt_simplify", static_cast<double>(ours.triangles.size()),
        static_cast<double>(theirs.triangles.size()));
    add(level + "rms_percent/meshopt_simplify", percent * our_own.rms, percent * their_own.rms);
    add(level + "p99_percent/meshopt_simplify", percent * our_own.p99, percent * their_own.p99);
    add(level + "greatest_percent/meshopt_simplify", percent * our_own.greatest,
        percent * their_own.greatest);
    add(level + "stated_percent/greatest_found", percent * stated, percent * our_own.greatest);
  }
  add("cpu_s/meshopt_simplify", with - without, whole.cpu());
  return {};
}

}  // namespace

Result<std::vector<BenchRow>> bench_lod(const std::vector<std::string>& models, unsigned jobs) {
  std::vector<BenchRow> rows;
  for (const std::string& model : models) MODAR_TRY(bench_one(model, jobs, rows));
  return rows;
}

}  // namespace modar
