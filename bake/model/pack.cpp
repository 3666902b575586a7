// Packs chunk by chunk: bytes, boxes and cones, order, records.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include <glm/geometric.hpp>

#include "bake/model/chunk_bounds.hpp"
#include "bake/model/packed_mesh.hpp"
#include "bake/model/vertex_packer.hpp"
#include "formats/chunk_order.hpp"

namespace modar {
namespace {

MaterialRecord material_record(const SourceMaterial& source) {
  MaterialRecord m{};
  for (int i = 0; i < 3; ++i) {
    m.ambient[i] = source.ambient[i];
    m.diffuse[i] = source.diffuse[i];
    m.specular[i] = source.specular[i];
    m.emission[i] = source.emission[i];
  }
  m.shininess = source.shininess;
  m.opacity = source.opacity;
  m.texture = kNone;
  m.flags = source.two_sided ? kMaterialTwoSided : 0u;
  return m;
}

/// Coarse triangles in the numbers of the packed vertices. Those of which two vertices became one
/// are left out: they had no area.
std::vector<std::uint16_t> coarse_triangles(const std::vector<std::uint16_t>& indices,
                                            const ChunkOrderer& places) {
  std::vector<std::uint16_t> coarse;
  coarse.reserve(indices.size());
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const std::array<std::uint16_t, 3> t = {places.place(indices[i]), places.place(indices[i + 1]),
                                            places.place(indices[i + 2])};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    coarse.insert(coarse.end(), t.begin(), t.end());
  }
  return coarse;
}

/// Puts chunks in order and behind each other. Chunks that follow each other share one range of
/// vertices, hence one set-up of attributes, as long as 16 bits reach all of it. Their indices of
/// one level lie side by side: chunks of equal level can be drawn in one call.
class ChunkAppender {
 public:
  explicit ChunkAppender(PackedMesh& out) : out_(out) {}

  /// vertices: as packed. chunk: its indices and levels count in them. Answers its level count.
  std::uint32_t append(std::span<const std::byte> vertices, const Chunk& chunk) {
    const std::size_t stride = out_.layout.stride;
    std::vector<std::uint16_t> indices = chunk.indices;
    const auto order = orderer_.order(vertices, out_.layout.stride, indices);
    if (range_size_ + order.size() > kMaxChunkVertices) close_range();
    const std::size_t first = out_.levels.size();
    add_level(0, 0.0, indices);
    for (const ChunkLevel& level : chunk.coarser) {
      std::vector<std::uint16_t> coarse = coarse_triangles(level.indices, orderer_);
      if (coarse.empty()) break;
      level_orderer_.order(coarse, static_cast<std::uint32_t>(order.size()));
      add_level(out_.levels.size() - first, level.error, coarse);
    }
    for (const std::uint16_t old : order) {
      const auto vertex = vertices.subspan(old * stride, stride);
      out_.vertices.insert(out_.vertices.end(), vertex.begin(), vertex.end());
    }
    range_size_ += static_cast<std::uint32_t>(order.size());
    out_.record.vertex_count += order.size();
    out_.record.triangle_count += indices.size() / 3;
    return static_cast<std::uint32_t>(out_.levels.size() - first);
  }

  /// States the size of the open range in its levels, and opens the next.
  void close_range() {
    for (; first_level_ < out_.levels.size(); ++first_level_) {
      out_.levels[first_level_].vertex_count = range_size_;
    }
    range_begin_ = out_.vertices.size();
    range_size_ = 0;
  }

  /// Closes the last range and puts the indices of coarser levels behind those of level 0.
  void finish() {
    close_range();
    for (std::size_t depth = 0; depth < coarser_.size(); ++depth) {
      for (const auto& [level, offset] : coarser_[depth].levels) {
        out_.levels[level].index_offset = out_.indices.size() + offset;
      }
      out_.indices.insert(out_.indices.end(), coarser_[depth].indices.begin(),
                          coarser_[depth].indices.end());
    }
  }

 private:
  /// Indices of all levels of one depth, and where each level's begin.
  struct Depth {
    std::vector<std::byte> indices;
    std::vector<std::pair<std::size_t, std::size_t>> levels;
  };

  void add_level(std::size_t depth, double error, std::vector<std::uint16_t> indices) {
    for (std::uint16_t& index : indices) index = static_cast<std::uint16_t>(index + range_size_);
    if (depth > coarser_.size()) coarser_.emplace_back();
    std::vector<std::byte>& to = depth == 0 ? out_.indices : coarser_[depth - 1].indices;
    LevelRecord level{};
    level.vertex_offset = range_begin_;
    level.index_offset = to.size();
    level.index_count = static_cast<std::uint32_t>(indices.size());
    if (depth > 0) {
      level.error = std::nextafter(static_cast<float>(error), 4.0f);  // never below the truth
      coarser_[depth - 1].levels.emplace_back(out_.levels.size(), to.size());
    }
    out_.levels.push_back(level);
    const auto bytes = std::as_bytes(std::span(indices));
    to.insert(to.end(), bytes.begin(), bytes.end());
  }

  PackedMesh& out_;
  ChunkOrderer orderer_;
  LevelOrderer level_orderer_;
  std::vector<Depth> coarser_;     // from level 1 on
  std::uint64_t range_begin_ = 0;  // bytes
  std::uint32_t range_size_ = 0;   // vertices
  std::size_t first_level_ = 0;    // of the open range
};

/// Triangles of all levels: what a box and a cone have to hold for.
std::vector<std::uint16_t> all_indices(const Chunk& chunk) {
  std::vector<std::uint16_t> indices = chunk.indices;
  for (const ChunkLevel& level : chunk.coarser) {
    indices.insert(indices.end(), level.indices.begin(), level.indices.end());
  }
  return indices;
}

ChunkRecord chunk_record(const Chunk& chunk, const ChunkGrid& grid, const UvRange& uv,
                         std::uint32_t first_level, const std::vector<glm::vec3>& decoded) {
  ChunkRecord record{};
  const ChunkBounds bounds = chunk_bounds(decoded, all_indices(chunk));
  for (int i = 0; i < 3; ++i) {
    record.bounds_min[i] = bounds.low[i];
    record.bounds_max[i] = bounds.high[i];
    record.cone_axis[i] = bounds.cone_axis[i];
  }
  record.cone_cutoff = bounds.cone_cutoff;
  record.position_step = static_cast<float>(grid.step);
  for (int i = 0; i < 3; ++i) {
    record.position_offset[i] = static_cast<float>(grid.middle[i]) * record.position_step;
  }
  for (int i = 0; i < 2; ++i) {
    record.uv_offset[i] = uv.offset[i];
    record.uv_scale[i] = uv.scale[i];
  }
  record.material = chunk.material;
  record.first_level = first_level;
  return record;
}

void fill_model_record(const ChunkedMesh& chunked, const PackOptions& options,
                       ModelRecord& record) {
  const TriMesh& mesh = chunked.mesh;
  for (int i = 0; i < 3; ++i) record.center[i] = mesh.placement.center[i];
  record.scale = mesh.placement.scale;
  record.diagonal = glm::length(mesh.source_max - mesh.source_min);
  record.unit_metres = options.unit_metres;
  record.source_vertex_count = mesh.source_vertex_count;
  record.source_face_count = mesh.source_face_count;
  record.chunk_count = static_cast<std::uint32_t>(chunked.chunks.size());
  record.material_count = static_cast<std::uint32_t>(mesh.materials.size());
}

}  // namespace

Result<PackedMesh> pack(const ChunkedMesh& chunked, const std::vector<std::uint32_t>& texture_side,
                        const PackOptions& options, Report& report) {
  StageTimer timer(report, "pack");
  const TriMesh& mesh = chunked.mesh;
  if (texture_side.size() != mesh.materials.size()) {
    return fail(ExitCode::kInternal, "pack.texture-side", mesh.name,
                "texture sides and materials differ in number", "report this as a bug");
  }
  PackedMesh out;
  out.name = mesh.name;
  VertexOffsets offsets;
  out.layout = make_layout(mesh, options.positions, offsets);
  fill_model_record(chunked, options, out.record);
  for (const SourceMaterial& m : mesh.materials) out.materials.push_back(material_record(m));
  out.sources = mesh.materials;
  const std::vector<bool> repeats = repeating_materials(chunked);
  out.vertices.reserve(mesh.positions.size() * offsets.stride);
  out.indices.reserve(mesh.triangles.size() * 6);

  VertexPacker packer(mesh, offsets, options.positions);
  const std::vector<ChunkGrid> grids = make_grids(chunked, options.positions);
  ChunkAppender appender(out);
  std::vector<std::byte> bytes;
  std::vector<glm::vec3> decoded;
  for (std::size_t c = 0; c < chunked.chunks.size(); ++c) {
    const Chunk& chunk = chunked.chunks[c];
    const UvRange uv = uv_range(mesh, chunk, repeats[chunk.material]);
    bytes.assign(chunk.vertices.size() * offsets.stride, std::byte{0});
    packer.pack(chunk, grids[c], uv, texture_side[chunk.material], bytes.data(), decoded);
    out.chunks.push_back(
        chunk_record(chunk, grids[c], uv, static_cast<std::uint32_t>(out.levels.size()), decoded));
    ChunkRecord& record = out.chunks.back();
    record.level_count = appender.append(bytes, chunk);
    out.record.level_count = std::max(out.record.level_count, record.level_count);
  }
  appender.finish();
  packer.write_errors(out.record);
  timer.done(out.record.triangle_count, out.vertices.size() + out.indices.size(),
             out.record.position_error_max);
  return out;
}

}  // namespace modar
