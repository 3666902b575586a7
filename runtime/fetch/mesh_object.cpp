// A mesh object back to the chunk's exact bytes.
#include <cstring>

#include <zstd.h>

#include "formats/transport/chunk_order.hpp"
#include "formats/transport/vertex_streams.hpp"
#include "modar/mesh_transport.hpp"

namespace modar {
namespace {

constexpr std::uint64_t kMaxVertices = 65536;
constexpr std::uint32_t kMaxLooseTriangles = 65536;

tl::unexpected<Error> broken(const char* code, const char* cause) {
  return fail(ExitCode::kInvalidInput, code, "mesh object", cause, "publish the release again");
}

/// The parts of an object, bounded.
struct ObjectParts {
  MeshObjectHeader header{};
  std::vector<AttributeRecord> attributes;
  std::span<const std::byte> draco;
  std::span<const std::byte> fine;
  std::span<const std::byte> corrections;
};

Result<ObjectParts> split_object(std::span<const std::byte> object) {
  ObjectParts parts;
  if (object.size() < sizeof parts.header) return broken("mesh.truncated", "it ends in its header");
  std::memcpy(&parts.header, object.data(), sizeof parts.header);
  const MeshObjectHeader& h = parts.header;
  const std::uint64_t size = sizeof h + std::uint64_t{h.attribute_count} * sizeof(AttributeRecord) +
                             h.draco_size + h.fine_size + h.corrections_size;
  if (h.version != 1 || h.reserved != 0 || h.attributes_reserved != 0 || h.attribute_count > 8 ||
      h.stride == 0 || h.stride > kMaxVertexStride || h.normal_bits > 16 ||
      h.loose_triangles > kMaxLooseTriangles) {
    return broken("mesh.header", "its header makes no sense");
  }
  if (size != object.size()) return broken("mesh.truncated", "its parts do not add up to its size");
  parts.attributes.resize(h.attribute_count);
  std::size_t at = sizeof h;
  const auto take = [&](std::size_t bytes) {
    at += bytes;
    return object.subspan(at - bytes, bytes);
  };
  const auto records = take(parts.attributes.size() * sizeof(AttributeRecord));
  if (!records.empty()) std::memcpy(parts.attributes.data(), records.data(), records.size());
  parts.draco = take(h.draco_size);
  parts.fine = take(h.fine_size);
  parts.corrections = take(h.corrections_size);
  return parts;
}

/// Reads bits, lowest first. Reading past the end gives zeros and is remembered.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint32_t read(int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i, ++bit_) {
      if (bit_ / 8 >= bytes_.size()) continue;
      value |= (std::to_integer<std::uint32_t>(bytes_[bit_ / 8]) >> bit_ % 8 & 1u) << i;
    }
    return value;
  }
  [[nodiscard]] bool used_up() const { return (bit_ + 7) / 8 == bytes_.size(); }

 private:
  std::span<const std::byte> bytes_;
  std::size_t bit_ = 0;
};

/// Puts the bits beside the codec back into the values.
Result<void> restore_positions(DracoValues& positions, std::span<const std::byte> fine) {
  BitReader bits(fine);
  for (std::int32_t& value : positions.values) {
    if (value < -2048 || value > 2048) return broken("mesh.position", "a position is off the grid");
    const int count = fine_bits(value);
    const std::uint32_t low = bits.read(count) << (13 - count);
    value = join_half({value, low});
  }
  if (!bits.used_up()) return broken("mesh.fine", "its fine bits do not fit its positions");
  return {};
}

Result<void> restore_normals(DracoValues& normals, int bits,
                             std::span<const std::byte> corrections) {
  const std::size_t count = normals.values.size() / 2;
  const std::int32_t last = (1 << bits) - 2;
  std::vector<std::int32_t> bytes(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t s = normals.values[2 * i];
    const std::int32_t t = normals.values[2 * i + 1];
    if (s < 0 || t < 0 || s > last || t > last)
      return broken("mesh.normal", "a normal is off the map");
    const auto near = snorm8_of_octahedral(s, t, bits);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto exact =
          static_cast<std::uint8_t>(static_cast<std::uint8_t>(near[c]) +
                                    std::to_integer<std::uint8_t>(corrections[c * count + i]));
      bytes[3 * i + c] = static_cast<std::int8_t>(exact);
    }
  }
  normals.components = 3;
  normals.values = std::move(bytes);
  return {};
}

std::uint32_t travelling_components(const VertexStream& stream) {
  return stream.kind == VertexStream::Kind::kNormal ? 2u : stream.attribute.components;
}

Result<std::vector<std::byte>> unpack_corrections(const ObjectParts& parts, std::size_t size) {
  std::vector<std::byte> out(size);
  const std::size_t got =
      ZSTD_decompress(out.data(), out.size(), parts.corrections.data(), parts.corrections.size());
  if (size == 0 && parts.corrections.empty()) return out;
  if (ZSTD_isError(got) != 0 || got != size) {
    return broken("mesh.corrections", "its corrections do not unpack");
  }
  return out;
}

Result<void> write_points(const DracoMesh& mesh, const std::vector<VertexStream>& streams,
                          std::size_t stride, std::vector<std::byte>& vertices) {
  for (std::size_t a = 0; a < streams.size(); ++a) {
    const DracoValues& from = mesh.attributes[a];
    for (std::uint32_t p = 0; p < mesh.point_count; ++p) {
      const std::size_t value = std::size_t{from.value_of_point[p]} * from.components;
      for (std::uint32_t c = 0; c < from.components; ++c) {
        if (!streams[a].store(vertices.data() + p * stride, c, from.values[value + c])) {
          return broken("mesh.value", "a value does not fit its attribute");
        }
      }
    }
  }
  return {};
}

/// Orders the points and triangles as the bake ordered the chunk.
MeshBytes order_chunk(std::span<const std::byte> vertices, std::size_t stride,
                      std::vector<std::uint16_t> indices) {
  MeshBytes chunk;
  ChunkOrderer orderer;
  for (const std::uint16_t old :
       orderer.order(vertices, static_cast<std::uint32_t>(stride), indices)) {
    const auto vertex = vertices.subspan(old * stride, stride);
    chunk.vertices.insert(chunk.vertices.end(), vertex.begin(), vertex.end());
  }
  chunk.indices = std::move(indices);
  return chunk;
}

}  // namespace

Result<MeshBytes> decode_mesh_object(std::span<const std::byte> object) {
  auto parts = split_object(object);
  if (!parts) return tl::unexpected(parts.error());
  const auto streams = plan_streams(parts->header.stride, parts->attributes);
  if (!streams) return broken("mesh.attributes", "its attributes cannot travel this way");
  auto mesh = decode_draco(parts->draco);
  if (!mesh) return tl::unexpected(mesh.error());
  if (mesh->attributes.size() != streams->size()) {
    return broken("mesh.attributes", "Draco's attributes are not those of the layout");
  }
  std::size_t normal_values = 0;
  for (std::size_t a = 0; a < streams->size(); ++a) {
    if (mesh->attributes[a].components != travelling_components((*streams)[a])) {
      return broken("mesh.attributes", "Draco's attributes are not those of the layout");
    }
    if ((*streams)[a].kind == VertexStream::Kind::kNormal) {
      if (normal_values != 0 || parts->header.normal_bits < 2) {
        return broken("mesh.attributes", "its normals make no sense");
      }
      normal_values = mesh->attributes[a].values.size() / 2;
    }
  }
  const std::size_t stride = parts->header.stride;
  const std::size_t loose_bytes = std::size_t{parts->header.loose_triangles} * 3 * stride;
  auto corrections = unpack_corrections(*parts, 3 * normal_values + loose_bytes);
  if (!corrections) return tl::unexpected(corrections.error());
  for (std::size_t a = 0; a < streams->size(); ++a) {
    Result<void> done;
    if ((*streams)[a].kind == VertexStream::Kind::kHalfPosition) {
      done = restore_positions(mesh->attributes[a], parts->fine);
    } else if ((*streams)[a].kind == VertexStream::Kind::kNormal) {
      done = restore_normals(mesh->attributes[a], parts->header.normal_bits, *corrections);
    }
    if (!done) return tl::unexpected(done.error());
  }
  const std::size_t loose = 3 * std::size_t{parts->header.loose_triangles};
  if (mesh->point_count + loose > kMaxVertices)
    return broken("mesh.size", "it has too many vertices");
  std::vector<std::byte> vertices((mesh->point_count + loose) * stride);
  if (auto done = write_points(*mesh, *streams, stride, vertices); !done) {
    return tl::unexpected(done.error());
  }
  std::vector<std::uint16_t> indices(mesh->corners.begin(), mesh->corners.end());
  if (loose_bytes != 0) {
    std::memcpy(vertices.data() + mesh->point_count * stride,
                corrections->data() + 3 * normal_values, loose_bytes);
    for (std::size_t i = 0; i < loose; ++i) {
      indices.push_back(static_cast<std::uint16_t>(mesh->point_count + i));
    }
  }
  return order_chunk(vertices, stride, std::move(indices));
}

}  // namespace modar
