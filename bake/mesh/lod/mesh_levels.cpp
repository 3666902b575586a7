// Decimates chunk by chunk, on several threads, and measures the error.
#include "bake/mesh/lod/mesh_levels.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/mesh/lod/chunk_decimate.hpp"
#include "bake/mesh/lod/surface_distance.hpp"
#include "bake/parallel.hpp"

namespace modar {
namespace {

/// Chunks of fewer triangles get no coarser level: they cost a draw call either way. Set by hand.
constexpr std::size_t kFewTriangles = 24;
/// A level that keeps more of the previous one's triangles is not worth its bytes. Set by hand.
constexpr double kWorthwhile = 0.8;
/// Of the chunk's diagonal: no collapse moves the surface farther. A level that is off by a pixel
/// is then good for chunks down to four pixels across; what is smaller costs a draw call either
/// way.
constexpr double kMaxCollapse = 0.25;
/// Of the chunk's diagonal: the texture may slide this far. Set by hand.
constexpr double kMaxSlide = 0.01;
constexpr std::size_t kChunksPerUpdate = 8;  ///< chunks between two updates of the progress bar

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

/// uvs in texels, and how far they may be off. Empty where no texture shows it.
std::vector<glm::dvec2> texels_of(const TriMesh& mesh, const Chunk& chunk,
                                  std::span<const glm::dvec3> positions,
                                  std::span<const std::uint32_t> sides, DecimateLimits& limits) {
  if (mesh.uvs.empty() || chunk.material >= sides.size() || sides[chunk.material] == 0) return {};
  std::vector<glm::dvec2> texels;
  for (const std::uint32_t v : chunk.vertices) {
    texels.push_back(mesh.uvs[v] * static_cast<double>(sides[chunk.material]));
  }
  double area = 0;
  double texel_area = 0;
  for (std::size_t i = 0; i < chunk.indices.size(); i += 3) {
    const std::uint16_t* t = &chunk.indices[i];
    area += glm::length(
        glm::cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]));
    const glm::dvec2 ab = texels[t[1]] - texels[t[0]];
    const glm::dvec2 ac = texels[t[2]] - texels[t[0]];
    texel_area += std::abs(ab.x * ac.y - ab.y * ac.x);
  }
  // One colour everywhere: nothing can slide.
  if (!(texel_area > 0)) return {};
  limits.length_of_uv = std::sqrt(area / texel_area);
  limits.max_uv_shift = kMaxSlide * diagonal_of(positions) / limits.length_of_uv;
  return texels;
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
  DecimateLimits limits;
  limits.max_error = kMaxCollapse * diagonal_of(positions);
  const std::vector<glm::dvec2> texels =
      texels_of(mesh, chunk, positions, options.texture_sides, limits);
  for (auto& [indices, nearby, uv_shift] :
       decimate_chunk({positions, texels}, chunk.indices, locked, targets, limits)) {
    if (indices.empty() ||
        static_cast<double>(indices.size()) > kWorthwhile * static_cast<double>(before)) {
      break;
    }
    before = indices.size();
    LevelSurface coarser(positions, indices);
    error = surface_distance(finest, coarser, nearby, error);
    error = surface_distance(coarser, finest, on_finest, error);
    chunk.coarser.push_back({std::move(indices), error, uv_shift});
  }
}

}  // namespace

Result<void> LevelOptions::validate() const {
  if (levels >= 1 && levels <= kMaxLevels) return {};
  return fail(ExitCode::kUsage, "levels.count", "", "a chunk has 1 to 12 levels of detail",
              "choose a number in that range");
}

Result<void> make_levels(ChunkedMesh& mesh, const LevelOptions& options, Report& report) {
  MODAR_TRY(options.validate());
  if (options.levels == 1) return {};
  StageTimer timer(report, "levels");
  const Array<std::uint32_t> owners = owners_of_positions(mesh);
  const std::vector<ChunkGrid> grids = make_grids(mesh, options.positions);
  for (std::size_t first = 0; first < mesh.chunks.size(); first += kChunksPerUpdate) {
    const std::size_t count = std::min(kChunksPerUpdate, mesh.chunks.size() - first);
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
  LevelFigures figures;
  double error = 0;
  for (const Chunk& chunk : mesh.chunks) {
    fine += chunk.indices.size() / 3;
    for (const ChunkLevel& level : chunk.coarser) {
      triangles += level.indices.size() / 3;
      error = std::max(error, level.error);
      figures.uv_shift_max_texels = std::max(figures.uv_shift_max_texels, level.uv_shift);
    }
  }
  figures.position_error_max = error * mesh.mesh.placement.scale;
  timer.done(fine, triangles, figures.position_error_max);
  report.levels.push_back(figures);
  return {};
}

}  // namespace modar
