// Packs chunk by chunk: vertex bytes, boxes and cones, vertex order, records.
#include "bake/mesh/pack/pack.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include <glm/geometric.hpp>

#include "formats/base/parallel.hpp"
#include "formats/transport/chunk_order.hpp"

namespace modar {

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
  const auto in_255ths = [](float share) { return static_cast<std::uint32_t>(share * 255 + 0.5f); };
  m.flags = (source.two_sided ? kMaterialTwoSided : 0u) |
            (source.occluder() ? kMaterialOccluder : 0u) | in_255ths(source.metalness) << 8 |
            in_255ths(source.reflectance) << 16;
  return m;
}

namespace {

/// Chunks per thread between two joins. More balance load better and hold up to 2 MB each.
constexpr unsigned kWave = 4;

/// One chunk in its final bytes, before its place in the buffers is known.
struct PackedChunk {
  std::vector<std::byte> vertices;                 ///< in their final order
  std::vector<std::vector<std::uint16_t>> levels;  ///< indices, the finest first
  std::vector<double> level_errors;
  std::vector<std::uint32_t> level_vertices;  ///< how many of them a level needs
  std::size_t collapsed = 0;  ///< triangles that rounding left without area, and that are left out
  ChunkRecord record{};       ///< lacks first_level
  PackErrors errors;
};

ChunkRecord chunk_record(const Chunk& chunk, const ChunkGrid& grid, const UvRange& uv,
                         const ChunkBounds& bounds) {
  ChunkRecord record{};
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
  return record;
}

/// Packs one chunk after another, reusing its buffers.
class ChunkPacker {
 public:
  ChunkPacker(const TriMesh& mesh, const VertexOffsets& offsets, const PackOptions& options)
      : packer_(mesh, offsets, options.positions),
        stride_(offsets.stride),
        prefixes_(options.prefixes) {}

  void pack(const Chunk& chunk, const ChunkGrid& grid, const UvRange& uv,
            std::uint32_t texture_side, PackedChunk& out) {
    bytes_.assign(chunk.vertices.size() * stride_, std::byte{0});
    packer_.pack(chunk, grid, uv, texture_side, bytes_.data(), decoded_);
    out.errors = packer_.errors();
    std::vector<std::uint16_t>& finest = out.levels.emplace_back(lasting_triangles(chunk.indices));
    out.record = chunk_record(chunk, grid, uv, chunk_bounds(decoded_, with_coarser(finest, chunk)));
    out.collapsed = (chunk.indices.size() - finest.size()) / 3;
    out.level_errors.push_back(0.0);
    const auto order = orderer_.order(bytes_, stride_, finest);
    for (const ChunkLevel& level : chunk.coarser) {
      std::vector<std::uint16_t> coarse = lasting_triangles(level.indices);
      if (coarse.empty()) break;
      for (std::uint16_t& index : coarse) index = orderer_.place(index);
      out.levels.push_back(std::move(coarse));
      out.level_errors.push_back(std::max({out.level_errors.back(), level.error, level.shading}));
    }
    number_vertices(static_cast<std::uint32_t>(order.size()), out);
    out.vertices.resize(order.size() * stride_);
    for (std::size_t v = 0; v < order.size(); ++v) {
      std::memcpy(out.vertices.data() + numbers_[v] * std::size_t{stride_},
                  bytes_.data() + order[v] * stride_, stride_);
    }
    for (std::size_t level = 1; level < out.levels.size(); ++level) {
      level_orderer_.order(out.levels[level], out.level_vertices[level]);
    }
    out.record.level_count = static_cast<std::uint32_t>(out.levels.size());
  }

 private:
  /// Where levels use prefixes, vertices of the coarsest level come first, then those that the next
  /// finer one adds.
  void number_vertices(std::uint32_t count, PackedChunk& out) {
    const std::size_t levels = out.levels.size();
    groups_.assign(count, std::byte{0});
    out.level_vertices.assign(levels, count);
    if (prefixes_ && levels > 1) {
      groups_.assign(count, static_cast<std::byte>(levels - 1));
      for (std::size_t level = 1; level < levels; ++level) {
        const auto group = static_cast<std::byte>(levels - 1 - level);
        for (const std::uint16_t v : out.levels[level]) groups_[v] = group;
      }
      for (std::size_t level = 1; level < levels; ++level) {
        const auto last = static_cast<std::byte>(levels - 1 - level);
        out.level_vertices[level] = static_cast<std::uint32_t>(std::count_if(
            groups_.begin(), groups_.end(), [&](std::byte group) { return group <= last; }));
      }
    }
    numbers_ = numbers_by_group(groups_);
    for (std::vector<std::uint16_t>& level : out.levels) {
      for (std::uint16_t& index : level) index = numbers_[index];
    }
  }

  /// Without those of which two corners have the same stored position: they have no area.
  [[nodiscard]] std::vector<std::uint16_t> lasting_triangles(
      const std::vector<std::uint16_t>& indices) const {
    const auto same = [this](std::uint16_t a, std::uint16_t b) {
      return decoded_[a] == decoded_[b];
    };
    std::vector<std::uint16_t> lasting;
    lasting.reserve(indices.size());
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      const std::uint16_t* const t = &indices[i];
      if (same(t[0], t[1]) || same(t[1], t[2]) || same(t[2], t[0])) continue;
      lasting.insert(lasting.end(), t, t + 3);
    }
    return lasting;
  }

  /// The triangles of all levels that are written: the box and the cone hold for each, and the box
  /// for nothing else.
  [[nodiscard]] std::vector<std::uint16_t> with_coarser(std::vector<std::uint16_t> all,
                                                        const Chunk& chunk) const {
    for (const ChunkLevel& level : chunk.coarser) {
      const std::vector<std::uint16_t> coarse = lasting_triangles(level.indices);
      if (coarse.empty()) break;
      all.insert(all.end(), coarse.begin(), coarse.end());
    }
    return all;
  }

  VertexPacker packer_;
  std::uint16_t stride_;
  bool prefixes_;
  ChunkOrderer orderer_;
  LevelOrderer level_orderer_;
  std::vector<std::byte> groups_;  ///< of each vertex in the order of orderer_
  std::vector<std::uint16_t> numbers_;
  std::vector<std::byte> bytes_;
  std::vector<glm::vec3> decoded_;
};

/// Concatenates chunks. Successive chunks share one range of vertices (one set-up of attributes) as
/// long as 16-bit indices reach all of it. Their indices of one level are contiguous, so chunks of
/// equal level can be drawn in one call. Chunks whose levels use prefixes have a range each.
class ChunkAppender {
 public:
  ChunkAppender(PackedMesh& out, bool prefixes) : out_(out), prefixes_(prefixes) {}

  void append(PackedChunk& chunk) {
    const auto vertices = static_cast<std::uint32_t>(chunk.vertices.size() / out_.layout.stride);
    if (range_size_ + vertices > kMaxChunkVertices || prefixes_) close_range();
    chunk.record.first_level = static_cast<std::uint32_t>(out_.levels.size());
    out_.chunks.push_back(chunk.record);
    for (std::size_t depth = 0; depth < chunk.levels.size(); ++depth) {
      add_level(depth, chunk.level_errors[depth], chunk.levels[depth]);
      if (prefixes_) out_.levels.back().vertex_count = chunk.level_vertices[depth];
    }
    out_.vertices.insert(out_.vertices.end(), chunk.vertices.begin(), chunk.vertices.end());
    range_size_ += vertices;
    ModelRecord& record = out_.record;
    record.vertex_count += vertices;
    record.triangle_count += chunk.levels[0].size() / 3;
    record.level_count = std::max(record.level_count, chunk.record.level_count);
  }

  /// Writes the size of the open range to its levels, and opens the next.
  void close_range() {
    for (; first_level_ < out_.levels.size() && !prefixes_; ++first_level_) {
      out_.levels[first_level_].vertex_count = range_size_;
    }
    range_begin_ = out_.vertices.size();
    range_size_ = 0;
  }

  /// Closes the last range and appends the indices of coarser levels to those of level 0.
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

  /// Offsets the indices by the chunk's place in its range.
  void add_level(std::size_t depth, double error, std::vector<std::uint16_t>& indices) {
    for (std::uint16_t& index : indices) index = static_cast<std::uint16_t>(index + range_size_);
    if (coarser_.size() < depth) coarser_.resize(depth);
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
  bool prefixes_;
  std::vector<Depth> coarser_;     // from level 1 on
  std::uint64_t range_begin_ = 0;  // bytes
  std::uint32_t range_size_ = 0;   // vertices
  std::size_t first_level_ = 0;    // of the open range
};

void fill_model_record(const ChunkedMesh& chunked, const PackOptions& options,
                       ModelRecord& record) {
  const TriMesh& mesh = chunked.mesh;
  for (int i = 0; i < 3; ++i) record.center[i] = mesh.placement.center[i];
  record.scale = mesh.placement.scale;
  record.diagonal = glm::length(mesh.source_max - mesh.source_min);
  record.unit_metres = options.unit_metres;
  record.source_vertex_count = mesh.source_vertex_count;
  record.source_face_count = mesh.source_face_count;
  record.material_count = static_cast<std::uint32_t>(mesh.materials.size());
}

void report_collapsed(const std::string& name, std::size_t count, PositionKind kind,
                      Report& report) {
  if (count == 0) return;
  report.diagnostics.push_back(
      {"model.collapsed", DiagnosticSeverity::kInfo, name, 0,
       std::to_string(count) +
           " triangles are smaller than the resolution of stored positions and are left out",
       kind == PositionKind::kHalf ? "--positions int16 or --max-error keeps more of them"
                                   : "--max-error keeps more of them"});
}

std::size_t index_count(const ChunkedMesh& chunked) {
  std::size_t count = 0;
  for (const Chunk& chunk : chunked.chunks) count += chunk.indices.size();
  return count;
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
  if (offsets.occlusion != 0) out.occlusion_byte = offsets.occlusion;
  fill_model_record(chunked, options, out.record);
  for (const SourceMaterial& m : mesh.materials) out.materials.push_back(material_record(m));
  out.sources = mesh.materials;
  out.vertices.reserve(mesh.positions.size() * offsets.stride);
  out.indices.reserve(index_count(chunked) * sizeof(std::uint16_t));

  const std::vector<ChunkGrid> grids = make_grids(chunked, options.positions);
  ChunkAppender appender(out, options.prefixes);
  PackErrors errors;
  std::size_t collapsed = 0;
  const unsigned jobs = std::max(1u, options.jobs);
  std::vector<ChunkPacker> packers(jobs, ChunkPacker(mesh, offsets, options));
  // A wave of chunks at a time, a few for each thread; they are joined in order.
  const std::size_t wave = std::size_t{kWave} * jobs;
  for (std::size_t first = 0; first < chunked.chunks.size(); first += wave) {
    const std::size_t count = std::min(wave, chunked.chunks.size() - first);
    std::vector<PackedChunk> packed(count);
    std::atomic<std::size_t> next{0};
    parallel_rows(jobs, jobs, [&](std::uint32_t thread) {
      for (std::size_t i = next++; i < count; i = next++) {
        const Chunk& chunk = chunked.chunks[first + i];
        const UvRange uv = uv_range(mesh, chunk, chunked.repeats[chunk.material]);
        packers[thread].pack(chunk, grids[first + i], uv, texture_side[chunk.material], packed[i]);
      }
    });
    for (PackedChunk& chunk : packed) {
      errors.add(chunk.errors);
      collapsed += chunk.collapsed;
      if (!chunk.levels[0].empty()) appender.append(chunk);
    }
    if (report.progress) {
      report.progress(
          "pack", static_cast<double>(first + count) / static_cast<double>(chunked.chunks.size()));
    }
  }
  appender.finish();
  out.record.chunk_count = static_cast<std::uint32_t>(out.chunks.size());
  if (out.chunks.empty()) {
    return fail(ExitCode::kInvalidInput, "model.no-area", mesh.name,
                "all its triangles are smaller than the resolution of positions",
                "remove parts that are far from the others, or bake it with a --max-error");
  }
  report_collapsed(mesh.name, collapsed, options.positions, report);
  errors.write(mesh.placement.scale, out.record);
  timer.done(out.record.triangle_count, out.vertices.size() + out.indices.size(),
             out.record.position_error_max);
  return out;
}

}  // namespace modar
