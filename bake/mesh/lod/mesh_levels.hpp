// Levels of detail of a chunked mesh: of its chunks, and of the whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/mesh/lod/quadric.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"

namespace modar {

/// See LevelOptions. Measuring takes half of a bake's time at this size.
inline constexpr std::size_t kMeasuredTriangles = 20'000;

struct LevelOptions {
  std::uint32_t levels = 4;  ///< greatest number a chunk, the finest counted; 1 to kMaxLevels
  PositionKind positions = PositionKind::kHalf;  ///< whose decoded positions the errors are of
  unsigned jobs = 1;                             ///< threads; the result does not depend on it
  /// A level of more triangles than this is a quarter of the level before it, not a half: up to a
  /// million a phone draws the finest, and each level takes bytes and has to be measured. Without
  /// its half, a scan of 0.9 million triangles is baked in 0.92 of the time.
  std::size_t many_triangles = 300'000;
  /// The distances of levels of larger models are derived from the ways of their vertices, where
  /// the shading shows far more: the bound holds, but is loose. Measuring those of a scan of 0.9
  /// million triangles takes a quarter of its bake.
  std::size_t measured_triangles = kMeasuredTriangles;
  /// Coarser levels do not belong to chunks (see plan_proxies()).
  std::uint32_t most_halvings = 0xFFFFFFFFu;
  std::size_t start = 0;  ///< as ProxyPlan's; 0: none is requested
  /// Pixels of each material's texture along a side, 0 where it has none; may be empty.
  std::vector<std::uint32_t> texture_sides;
  [[nodiscard]] Result<void> validate() const;
};

inline constexpr std::uint32_t kMaxLevels = 12;

/// The rest of a chunk where proxies begin: after more collapses than its coarsest level has,
/// with which borders of chunks stay where they are, and which are cheaper than those of a whole
/// mesh.
struct ProxyStart {
  std::vector<std::uint16_t> indices;   ///< what each corner of that level has become
  std::vector<std::uint16_t> vertices;  ///< that are left, of those that differ in normals one
  std::vector<std::uint16_t> become;    ///< of each vertex: one of these
  std::vector<Quadric>
      quadrics;  ///< of each of these: of the triangles of level 0 that it represents
};

/// Triangles of level 0.
std::size_t triangles_in(const ChunkedMesh& mesh);

/// Triangles of a level of a model of that size: as often halved, or what a phone without ES 3
/// draws where that is at most 30 % less.
std::size_t level_triangles(std::size_t triangles, std::uint32_t halvings);

/// How often the triangles of a model of that size are halved at each coarser level.
std::vector<std::uint32_t> halvings_of(std::size_t triangles, const LevelOptions& options);

/// Gives chunks coarser levels over their own vertices. Each level of the model has about half of
/// the triangles of the one before (see many_triangles), shared out among the chunks so that the
/// price of the last collapse is the same in all; a chunk that would lose less than a fifth has no
/// level of its own there. Where the model cannot be halved any more, there is a last level that is
/// only somewhat worse than the one before. Positions shared with other chunks stay, so that chunks
/// of any two levels meet without a crack; seams inside a chunk are simplified on both sides alike,
/// open rims of the model too. Vertices that differ in their normals only are one meanwhile where
/// most do (flat shading): corners of coarser triangles take the normal that is nearest to the
/// triangle's. A level's error bounds the distance between it and level 0, both as the device
/// decodes them, measured from either to the other (see level_distance()), for coarse levels by way
/// of a finer one that is hardly off, or told by the ways of vertices (see measured_triangles); the
/// far larger error that normals, colours and texture show (see PixelCells) is a separate figure.
/// Where vertices of level 0 are gone, the texture has slid by no more than 1 % of the chunk's
/// diagonal. Figures go to report.levels. Answers where proxies begin in each chunk, if the
/// options have a start.
Result<std::vector<ProxyStart>> make_levels(ChunkedMesh& mesh, const LevelOptions& options,
                                            Report& report);

/// Takes out the levels that are hardly nearer to the finest than the next coarser one is.
/// proxy: the error that the renderer goes by of the one that comes after all of a chunk's
/// levels; infinite if none, or where chunks are drawn instead.
void drop_alike_levels(ChunkedMesh& mesh, double proxy);

/// A whole mesh as one coarse level, with vertices and chunks of its own.
struct Proxy {
  ChunkedMesh mesh;    ///< its chunks have no coarser levels
  double error = 0;    ///< model space: bounds the distance from level 0, and of level 0 from it
  double shading = 0;  ///< as ChunkLevel's
};

/// Which levels of a mesh are proxies: how often its triangles are halved at each, none: chunks
/// have all levels, else those before.
struct ProxyPlan {
  std::vector<std::uint32_t> halvings;
  std::size_t start = 0;  ///< triangles of all chunks from which the first is made
};

/// Small meshes need none. The coarsest is the only one that a preview contains of the model
/// (see LoadStage::kShow; of a scan of 70,000 triangles 12 KB instead of 546). options: of the
/// chunks' levels, with which proxies are counted.
ProxyPlan plan_proxies(const ChunkedMesh& mesh, const LevelOptions& options);

struct ProxyOptions {
  ProxyPlan plan;
  PositionKind positions = PositionKind::kHalf;  ///< whose decoded positions the errors are of
  std::size_t measured_triangles = kMeasuredTriangles;  ///< as LevelOptions'
};

/// Makes the proxies of a mesh whose chunks have their levels, the finest first, from where they
/// begin in each chunk. Borders of chunks mean nothing to them, those of materials and uv islands
/// are kept as long as anything else costs less. Fewer than planned where a mesh is in too many
/// pieces. Vertices carry uvs of level 0, and normals, colours and occlusion that blend to its own.
Result<std::vector<Proxy>> make_proxies(const ChunkedMesh& mesh,
                                        const std::vector<ProxyStart>& starts,
                                        const ProxyOptions& options, Report& report);

}  // namespace modar
