// Decimates chunk by chunk, on several threads, and measures what it did.
#include "bake/model/mesh_levels.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/model/chunk_decimate.hpp"
#include "bake/model/surface_distance.hpp"
#include "bake/texture/parallel.hpp"

namespace modar {
namespace {

constexpr std::size_t kFewTriangles = 24;  ///< not worth a coarser level
/// A level with more of the triangles of the one before is not worth its bytes.
constexpr double kWorthwhile = 0.8;
/// Of the chunk's diagonal: a collapse that moves the surface by more spoils even a coarse level.
constexpr double kMaxCollapse = 0.03;
constexpr std::size_t kStretch = 8;  ///< chunks between two words to the progress bar

/// The chunk that uses each source position, kShared where there are several.
constexpr std::uint32_t kShared = kNoIndex - 1;

Array<std::uint32_t> owners_of_positions(const ChunkedMesh& mesh) {
  Array<std::uint32_t> owners(mesh.mesh.source_vertex_count, kNoIndex);
  for (std::uint32_t c = 0; c < mesh.chunks.size(); ++c) {
    for (const std::uint32_t v : mesh.chunks[c].vertices) {
      std::uint32_t& owner = owners[mesh.mesh.source_position(v)];
      owner = owner == kNoIndex || owner == c ? c : kShared;
    }
  }
  return owners;
}

double diagonal_of(std::span<const glm::dvec3> positions) {
  glm::dvec3 low = positions[0];
  glm::dvec3 high = low;
  for (const glm::dvec3& p : positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return glm::length(high - low);
}

/// Fills one chunk's coarser levels.
void level_chunk(const TriMesh& mesh, const Array<std::uint32_t>& owners, const ChunkGrid& grid,
                 const LevelOptions& options, Chunk& chunk) {
  std::vector<std::size_t> targets;
  std::size_t count = chunk.indices.size() / 3;
  while (targets.size() + 1 < options.levels && count / 2 >= kFewTriangles) {
    count /= 2;
    targets.push_back(count);
  }
  if (targets.empty()) return;
  std::vector<glm::dvec3> positions;
  std::vector<std::uint8_t> locked;
  for (const std::uint32_t v : chunk.vertices) {
    positions.push_back(decoded_position(mesh.positions[v], options.positions, grid));
    locked.push_back(owners[mesh.source_position(v)] == kShared ? 1 : 0);
  }
  double error = 0;
  std::size_t before = chunk.indices.size();
  LevelSurface finest(positions, chunk.indices);
  const std::vector<std::uint32_t> on_finest = finest.triangles_of_vertices();
  for (auto& [indices, nearby] : decimate_chunk(positions, chunk.indices, locked, targets,
                                                kMaxCollapse * diagonal_of(positions))) {
    if (indices.empty() ||
        static_cast<double>(indices.size()) > kWorthwhile * static_cast<double>(before)) {
      break;
    }
    before = indices.size();
    LevelSurface coarser(positions, indices);
    error = surface_distance(finest, coarser, nearby, error);
    error = surface_distance(coarser, finest, on_finest, error);
    chunk.coarser.push_back({std::move(indices), error});
  }
}

}  // namespace

Result<void> LevelOptions::validate() const {
  if (levels >= 1 && levels <= kMaxLevels) return {};
  return fail(ExitCode::kUsage, "levels.count", "", "a chunk has 1 to 12 levels of detail",
              "choose a number in that range");
}

Result<void> make_levels(ChunkedMesh& mesh, const LevelOptions& options, Report& report) {
  if (auto valid = options.validate(); !valid) return valid;
  if (options.levels == 1) return {};
  StageTimer timer(report, "levels");
  const Array<std::uint32_t> owners = owners_of_positions(mesh);
  const std::vector<ChunkGrid> grids = make_grids(mesh, options.positions);
  for (std::size_t first = 0; first < mesh.chunks.size(); first += kStretch) {
    const std::size_t count = std::min(kStretch, mesh.chunks.size() - first);
    parallel_rows(static_cast<std::uint32_t>(count), options.jobs, [&](std::uint32_t i) {
      level_chunk(mesh.mesh, owners, grids[first + i], options, mesh.chunks[first + i]);
    });
    if (report.progress) {
      report.progress("levels",
                      static_cast<double>(first + count) / static_cast<double>(mesh.chunks.size()));
    }
  }
  std::uint64_t fine = 0;
  std::uint64_t triangles = 0;
  double error = 0;
  for (const Chunk& chunk : mesh.chunks) {
    fine += chunk.indices.size() / 3;
    for (const ChunkLevel& level : chunk.coarser) {
      triangles += level.indices.size() / 3;
      error = std::max(error, level.error);
    }
  }
  timer.done(fine, triangles, error * mesh.mesh.placement.scale);
  return {};
}

}  // namespace modar
