// Chooses the layout of positions and lays the grid of the 16-bit one.
#include "bake/mesh/pack/position_plan.hpp"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "formats/quantise.hpp"

namespace modar {
namespace {

/// Floats hold all multiples of it in [-1,1] exactly, so that decoding rounds nothing.
constexpr double kFinestStep = 0x1p-23;
constexpr double kSteps = 65534.0;                    ///< that 16 bits span, with both ends at hand
constexpr double kHalfDiagonal = 0.8660254037844387;  ///< of a cube of side 1

/// Lowest and highest point of the grid that a chunk's vertices fall on.
struct GridBox {
  glm::ivec3 low;
  glm::ivec3 high;
};

GridBox grid_box(const TriMesh& mesh, const Chunk& chunk, double step) {
  glm::dvec3 low(mesh.positions[chunk.vertices[0]]);
  glm::dvec3 high(low);
  for (const std::uint32_t v : chunk.vertices) {
    low = glm::min(low, mesh.positions[v]);
    high = glm::max(high, mesh.positions[v]);
  }
  GridBox box;
  for (int i = 0; i < 3; ++i) {
    box.low[i] = grid_index(low[i], step);
    box.high[i] = grid_index(high[i], step);
  }
  return box;
}

double longest_side(const GridBox& box) {
  const glm::ivec3 side = box.high - box.low;
  return std::max({side.x, side.y, side.z});
}

/// Rounds towards minus infinity, on every machine.
glm::ivec3 middle_of(const GridBox& box) {
  glm::ivec3 middle;
  for (int i = 0; i < 3; ++i) middle[i] = (box.low[i] + box.high[i]) >> 1;
  return middle;
}

tl::unexpected<Error> too_fine(const TriMesh& mesh, const PositionRequest& request,
                               const std::string& cause) {
  return fail(ExitCode::kUnsupported, "model.max-error", mesh.name,
              "an error of at most " + std::to_string(request.max_error) + " units: " + cause,
              "allow a greater --max-error, or split the model in several");
}

}  // namespace

int grid_index(double coordinate, double step) {
  return static_cast<int>(std::floor(coordinate / step + 0.5));
}

double half_error(const TriMesh& mesh) {
  double greatest = 0;
  for (const glm::dvec3& p : mesh.positions) {
    const glm::dvec3 error = decoded_position(p, PositionKind::kHalf, {}) - p;
    greatest = std::max(greatest, glm::dot(error, error));
  }
  return std::sqrt(greatest);
}

glm::dvec3 decoded_position(const glm::dvec3& position, PositionKind kind, const ChunkGrid& grid) {
  glm::dvec3 decoded;
  for (int i = 0; i < 3; ++i) {
    decoded[i] =
        kind == PositionKind::kHalf
            ? static_cast<double>(half_to_float(float_to_half(static_cast<float>(position[i]))))
            : grid.step * grid_index(position[i], grid.step);
  }
  return decoded;
}

Result<PositionPlan> plan_positions(const TriMesh& mesh, const PositionRequest& request) {
  PositionPlan plan;
  if (!(request.max_error > 0)) {
    plan.kind = request.kind.value_or(PositionKind::kHalf);
    return plan;
  }
  const double wanted = request.max_error / mesh.placement.scale;
  if (request.kind != PositionKind::kInt16 && half_error(mesh) <= wanted) return plan;
  if (request.kind == PositionKind::kHalf) {
    return too_fine(
        mesh, request,
        "half floats have one of " + std::to_string(half_error(mesh) * mesh.placement.scale));
  }
  plan.kind = PositionKind::kInt16;
  const double step = std::exp2(std::floor(std::log2(wanted / kHalfDiagonal)));
  if (step < kFinestStep) {
    return too_fine(mesh, request,
                    "the finest grid has one of " +
                        std::to_string(kFinestStep * kHalfDiagonal * mesh.placement.scale));
  }
  // Rounding to the grid moves each end by up to half a step.
  plan.max_side = step * (kSteps - 1);
  return plan;
}

std::vector<ChunkGrid> make_grids(const ChunkedMesh& chunked, PositionKind kind) {
  std::vector<ChunkGrid> grids(chunked.chunks.size());
  if (kind == PositionKind::kHalf) return grids;
  double side = 0;
  for (const Chunk& chunk : chunked.chunks) {
    side = std::max(side, longest_side(grid_box(chunked.mesh, chunk, kFinestStep)));
  }
  double step = kFinestStep;
  while (side * kFinestStep > step * (kSteps - 1)) step *= 2;
  for (std::size_t c = 0; c < grids.size(); ++c) {
    grids[c] = {middle_of(grid_box(chunked.mesh, chunked.chunks[c], step)), step};
  }
  return grids;
}

}  // namespace modar
