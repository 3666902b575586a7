// Quantises chunks to their final bytes, decodes them again and states the error that was found.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/model/chunk_bounds.hpp"
#include "bake/model/packed_mesh.hpp"
#include "formats/chunk_order.hpp"
#include "formats/quantise.hpp"

namespace modar {
namespace {

/// How far uv may leave [0,1] and still count as inside: half a texel at 4096, as exporters leave.
constexpr double kUvSlack = 1e-4;
constexpr double kDegrees = 57.29577951308232;

/// Byte offsets of the attributes; 0 where there is none but the position.
struct Offsets {
  std::uint16_t normal = 8;
  std::uint16_t uv = 0;
  std::uint16_t colour = 0;
  std::uint16_t stride = 12;
};

LayoutRecord make_layout(const TriMesh& mesh, Offsets& offsets) {
  LayoutRecord layout{};
  const auto add = [&](Semantic semantic, ComponentType type, std::uint8_t components,
                       std::uint16_t offset) {
    AttributeRecord& a = layout.attributes[layout.attribute_count++];
    a.semantic = static_cast<std::uint8_t>(semantic);
    a.type = static_cast<std::uint8_t>(type);
    a.components = components;
    a.normalised = type == ComponentType::kHalf ? 0 : 1;
    a.offset = offset;
  };
  add(Semantic::kPosition, ComponentType::kHalf, 3, 0);
  add(Semantic::kNormal, ComponentType::kI8, 3, offsets.normal);
  if (!mesh.uvs.empty()) {
    offsets.uv = offsets.stride;
    add(Semantic::kUv, ComponentType::kU16, 2, offsets.uv);
    offsets.stride = static_cast<std::uint16_t>(offsets.stride + 4);
  }
  if (!mesh.colours.empty()) {
    offsets.colour = offsets.stride;
    add(Semantic::kColour, ComponentType::kU8, 4, offsets.colour);
    offsets.stride = static_cast<std::uint16_t>(offsets.stride + 4);
  }
  layout.stride = offsets.stride;
  return layout;
}

/// Greatest and summed squares of one kind of error.
struct ErrorTally {
  double greatest = 0;
  double squares = 0;
  std::uint64_t count = 0;

  void add(double error) {
    greatest = std::max(greatest, error);
    squares += error * error;
    ++count;
  }
  [[nodiscard]] double rms() const {
    return count == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(count));
  }
};

/// uv = offset + scale * attribute, and the whole numbers that were taken off first.
struct UvRange {
  glm::dvec2 shift{0.0};
  glm::vec2 offset{0.0f};
  glm::vec2 scale{1.0f};
};

UvRange uv_range(const TriMesh& mesh, const Chunk& chunk, bool repeats) {
  UvRange range;
  if (mesh.uvs.empty()) return range;
  glm::dvec2 low(mesh.uvs[chunk.vertices[0]]);
  glm::dvec2 high(low);
  for (const std::uint32_t v : chunk.vertices) {
    low = glm::min(low, mesh.uvs[v]);
    high = glm::max(high, mesh.uvs[v]);
  }
  for (int i = 0; i < 2; ++i) {
    // A texture that repeats looks the same a whole number on; near 0 the device's floats are
    // finer.
    if (repeats) range.shift[i] = std::floor(low[i]);
    const double from = low[i] - range.shift[i];
    const double to = high[i] - range.shift[i];
    if (from >= -kUvSlack && to <= 1 + kUvSlack) continue;
    range.offset[i] = static_cast<float>(from);
    // Rounded up, so that the far end is still reached.
    range.scale[i] = std::nextafter(static_cast<float>(to - static_cast<double>(range.offset[i])),
                                    std::numeric_limits<float>::infinity());
  }
  return range;
}

/// Writes vertices and measures what their bytes decode to.
class VertexPacker {
 public:
  VertexPacker(const TriMesh& mesh, const Offsets& offsets) : mesh_(mesh), offsets_(offsets) {}

  void pack(const Chunk& chunk, const UvRange& uv, std::uint32_t texture_side, std::byte* bytes,
            std::vector<glm::vec3>& decoded) {
    decoded.resize(chunk.vertices.size());
    for (std::size_t i = 0; i < chunk.vertices.size(); ++i, bytes += offsets_.stride) {
      const std::uint32_t v = chunk.vertices[i];
      decoded[i] = put_position(mesh_.positions[v], bytes);
      put_normal(glm::dvec3(mesh_.normals[v]), bytes + offsets_.normal);
      if (offsets_.uv != 0) put_uv(mesh_.uvs[v], uv, texture_side, bytes + offsets_.uv);
      if (offsets_.colour != 0) std::memcpy(bytes + offsets_.colour, &mesh_.colours[v], 4);
    }
  }

  /// In source units, degrees and texels.
  void write_errors(ModelRecord& record) const {
    record.position_error_max = position_.greatest * mesh_.placement.scale;
    record.position_error_rms = position_.rms() * mesh_.placement.scale;
    record.normal_error_max_deg = static_cast<float>(normal_.greatest);
    record.normal_error_rms_deg = static_cast<float>(normal_.rms());
    record.uv_error_max_texels = static_cast<float>(uv_.greatest);
    record.uv_error_rms_texels = static_cast<float>(uv_.rms());
  }

 private:
  glm::vec3 put_position(const glm::dvec3& p, std::byte* bytes) {
    std::uint16_t halves[3];
    glm::vec3 decoded;
    for (int i = 0; i < 3; ++i) {
      halves[i] = float_to_half(static_cast<float>(p[i]));
      decoded[i] = half_to_float(halves[i]);
    }
    std::memcpy(bytes, halves, sizeof halves);
    position_.add(glm::length(glm::dvec3(decoded) - p));
    return decoded;
  }

  void put_normal(const glm::dvec3& n, std::byte* bytes) {
    std::int8_t values[3];
    glm::dvec3 decoded;
    for (int i = 0; i < 3; ++i) {
      values[i] = float_to_snorm8(static_cast<float>(n[i]));
      decoded[i] = static_cast<double>(snorm8_to_float(values[i]));
    }
    std::memcpy(bytes, values, sizeof values);
    // Small angles drown in an arc cosine.
    const double angle = std::atan2(glm::length(glm::cross(decoded, n)), glm::dot(decoded, n));
    normal_.add(angle * kDegrees);
  }

  void put_uv(const glm::dvec2& uv, const UvRange& range, std::uint32_t texture_side,
              std::byte* bytes) {
    std::uint16_t values[2];
    glm::dvec2 error;
    for (int i = 0; i < 2; ++i) {
      const double wanted = uv[i] - range.shift[i];
      const auto offset = static_cast<double>(range.offset[i]);
      const auto scale = static_cast<double>(range.scale[i]);
      values[i] = float_to_unorm16(static_cast<float>((wanted - offset) / scale));
      error[i] = offset + scale * static_cast<double>(unorm16_to_float(values[i])) - wanted;
    }
    std::memcpy(bytes, values, sizeof values);
    if (texture_side != 0) uv_.add(glm::length(error) * texture_side);
  }

  const TriMesh& mesh_;
  Offsets offsets_;
  ErrorTally position_;
  ErrorTally normal_;
  ErrorTally uv_;
};

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
  return m;
}

std::vector<bool> repeating_materials(const ChunkedMesh& chunked) {
  std::vector<bool> repeats(chunked.mesh.materials.size(), false);
  if (chunked.mesh.uvs.empty()) return repeats;
  for (const Chunk& chunk : chunked.chunks) {
    for (const std::uint32_t v : chunk.vertices) {
      const glm::dvec2& uv = chunked.mesh.uvs[v];
      if (uv.x < -kUvSlack || uv.y < -kUvSlack || uv.x > 1 + kUvSlack || uv.y > 1 + kUvSlack) {
        repeats[chunk.material] = true;
        break;
      }
    }
  }
  return repeats;
}

/// Puts chunks in order and behind each other. Chunks that follow each other share one range of
/// vertices, hence one set-up of attributes, as long as 16 bits reach all of it.
class ChunkAppender {
 public:
  explicit ChunkAppender(PackedMesh& out) : out_(out) {}

  /// vertices: as packed. indices: into them; put in order.
  void append(std::span<const std::byte> vertices, std::vector<std::uint16_t> indices) {
    const std::size_t stride = out_.layout.stride;
    const auto order = orderer_.order(vertices, out_.layout.stride, indices);
    if (range_size_ + order.size() > kMaxChunkVertices) close_range();
    LevelRecord level{};
    level.vertex_offset = range_begin_;
    level.index_offset = out_.indices.size();
    level.index_count = static_cast<std::uint32_t>(indices.size());
    out_.levels.push_back(level);
    for (std::uint16_t& index : indices) {
      index = static_cast<std::uint16_t>(index + range_size_);
    }
    const auto bytes = std::as_bytes(std::span(indices));
    out_.indices.insert(out_.indices.end(), bytes.begin(), bytes.end());
    for (const std::uint16_t old : order) {
      const auto vertex = vertices.subspan(old * stride, stride);
      out_.vertices.insert(out_.vertices.end(), vertex.begin(), vertex.end());
    }
    range_size_ += static_cast<std::uint32_t>(order.size());
    out_.record.vertex_count += order.size();
    out_.record.triangle_count += indices.size() / 3;
  }

  /// States the size of the open range in its levels, and opens the next.
  void close_range() {
    for (; first_level_ < out_.levels.size(); ++first_level_) {
      out_.levels[first_level_].vertex_count = range_size_;
    }
    range_begin_ = out_.vertices.size();
    range_size_ = 0;
  }

 private:
  PackedMesh& out_;
  ChunkOrderer orderer_;
  std::uint64_t range_begin_ = 0;  // bytes
  std::uint32_t range_size_ = 0;   // vertices
  std::size_t first_level_ = 0;    // of the open range
};

ChunkRecord chunk_record(const Chunk& chunk, const UvRange& uv, std::uint32_t first_level,
                         const std::vector<glm::vec3>& decoded) {
  ChunkRecord record{};
  const ChunkBounds bounds = chunk_bounds(decoded, chunk.indices);
  for (int i = 0; i < 3; ++i) {
    record.bounds_min[i] = bounds.low[i];
    record.bounds_max[i] = bounds.high[i];
    record.cone_axis[i] = bounds.cone_axis[i];
  }
  record.cone_cutoff = bounds.cone_cutoff;
  record.position_step = 1.0f;
  for (int i = 0; i < 2; ++i) {
    record.uv_offset[i] = uv.offset[i];
    record.uv_scale[i] = uv.scale[i];
  }
  record.material = chunk.material;
  record.first_level = first_level;
  record.level_count = 1;
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
  record.level_count = 1;
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
  Offsets offsets;
  out.layout = make_layout(mesh, offsets);
  fill_model_record(chunked, options, out.record);
  for (const SourceMaterial& m : mesh.materials) out.materials.push_back(material_record(m));
  out.sources = mesh.materials;
  out.material_repeats = repeating_materials(chunked);
  out.vertices.reserve(mesh.positions.size() * offsets.stride);
  out.indices.reserve(mesh.triangles.size() * 6);

  VertexPacker packer(mesh, offsets);
  ChunkAppender appender(out);
  std::vector<std::byte> bytes;
  std::vector<glm::vec3> decoded;
  for (const Chunk& chunk : chunked.chunks) {
    const UvRange uv = uv_range(mesh, chunk, out.material_repeats[chunk.material]);
    bytes.assign(chunk.vertices.size() * offsets.stride, std::byte{0});
    packer.pack(chunk, uv, texture_side[chunk.material], bytes.data(), decoded);
    out.chunks.push_back(
        chunk_record(chunk, uv, static_cast<std::uint32_t>(out.levels.size()), decoded));
    appender.append(bytes, chunk.indices);
  }
  appender.close_range();
  packer.write_errors(out.record);
  timer.done(out.record.triangle_count, out.vertices.size() + out.indices.size(),
             out.record.position_error_max);
  return out;
}

}  // namespace modar
