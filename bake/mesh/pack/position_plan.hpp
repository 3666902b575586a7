// How a model's positions are stored, and how finely.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/mesh/pack/chunked_mesh.hpp"

namespace modar {

enum class PositionKind : std::uint8_t {
  kHalf,   ///< half floats in the model's [-1,1]
  kInt16,  ///< 16-bit integers, counted from a point of each chunk, on one grid for all chunks
};

/// What the user asks of positions.
struct PositionRequest {
  std::optional<PositionKind> kind;  ///< nothing: half floats where they are exact enough
  double max_error = 0.0;            ///< source units; 0: any
};

struct PositionPlan {
  PositionKind kind = PositionKind::kHalf;
  double max_side = 0.0;  ///< model space: longest side that a chunk may have; 0: any
};

/// Errors: kUnsupported "model.max-error" where neither layout, or not the one asked for, is exact
/// enough.
Result<PositionPlan> plan_positions(const TriMesh& mesh, const PositionRequest& request);

/// Greatest error of half floats in [-1,1] for these positions, model space.
double half_error(const TriMesh& mesh);

/// A chunk's part of the grid: position = step * (middle + c) with c in [-32767, 32767].
struct ChunkGrid {
  glm::ivec3 middle{0};
  double step = 1.0;
};

/// One grid for all chunks, so that a vertex of two chunks decodes to one point from both: its step
/// is the smallest power of two with which 16 bits span the largest chunk, but no finer than what a
/// float holds exactly in [-1,1]. For PositionKind::kHalf the grid of every chunk is the whole.
std::vector<ChunkGrid> make_grids(const ChunkedMesh& chunked, PositionKind kind);

/// The point of the grid nearest to a coordinate, in steps.
int grid_index(double coordinate, double step);

/// What a position decodes to, in model space.
glm::dvec3 decoded_position(const glm::dvec3& position, PositionKind kind, const ChunkGrid& grid);

}  // namespace modar
