#include "modar/piece.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include <meshoptimizer.h>
#include <zstd.h>

#include "formats/transport/chunk_order.hpp"
#include "formats/transport/coded_bytes.hpp"
#include "formats/transport/feature_text.hpp"
#include "formats/transport/vertex_streams.hpp"
#include "modar/arriving_bundle.hpp"

namespace modar {
namespace {

constexpr const char* kCure = "publish the release again";

std::vector<std::byte> join_halves(const std::vector<std::byte>& halves) {
  std::vector<std::byte> blocks(halves.size());
  const std::size_t count = halves.size() / 8;
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(blocks.data() + 8 * i, halves.data() + 4 * i, 4);
    std::memcpy(blocks.data() + 8 * i + 4, halves.data() + 4 * (count + i), 4);
  }
  return blocks;
}

Result<std::vector<std::byte>> mesh_bytes(std::span<const std::byte> stored) {
  MODAR_ASSIGN(auto chunk, decode_mesh_object(stored));
  const auto indices = std::as_bytes(std::span(chunk.indices));
  chunk.vertices.insert(chunk.vertices.end(), indices.begin(), indices.end());
  return std::move(chunk.vertices);
}

/// The OpenCV text of a section of mapped features.
Result<std::vector<std::byte>> text_bytes(std::span<const std::byte> twin) {
  FeatureHeader header{};
  const auto bad = fail(ExitCode::kInvalidInput, "piece.twin", "mapped features",
                        "the header does not match the size", kCure);
  if (twin.size() < sizeof header) return bad;
  std::memcpy(&header, twin.data(), sizeof header);
  const std::uint64_t keypoint_bytes = std::uint64_t{header.count} * sizeof(KeypointRecord);
  const std::uint64_t descriptor_bytes = std::uint64_t{header.count} * header.descriptor_bytes;
  const auto fits = [&](std::uint64_t offset, std::uint64_t size) {
    return offset <= twin.size() && size <= twin.size() - offset;
  };
  if (!fits(header.keypoints_offset, keypoint_bytes) ||
      !fits(header.descriptors_offset, descriptor_bytes)) {
    return bad;
  }
  std::vector<KeypointRecord> keypoints(header.count);
  if (keypoint_bytes != 0) {
    std::memcpy(keypoints.data(), twin.data() + header.keypoints_offset,
                static_cast<std::size_t>(keypoint_bytes));
  }
  FeatureView view;
  view.keypoints = keypoints;
  view.descriptors = twin.subspan(static_cast<std::size_t>(header.descriptors_offset),
                                  static_cast<std::size_t>(descriptor_bytes));
  view.descriptor_bytes = header.descriptor_bytes;
  const std::string text = feature_text(view);
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::vector<std::byte>> level_bytes(const PieceRecord& piece,
                                           std::span<const std::byte> stored) {
  const auto size = ZSTD_getFrameContentSize(stored.data(), stored.size());
  MODAR_ASSIGN(const auto buffer,
               unpack_zstd(stored, static_cast<std::size_t>(size <= kMaxPieceBytes ? size : 0)));
  MODAR_ASSIGN(const auto indices, decode_level(buffer, piece.raw_size / 2));
  const auto bytes = std::as_bytes(std::span(indices));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<std::vector<std::byte>> raw_bytes(const PieceRecord& piece,
                                         std::span<const std::byte> stored) {
  switch (static_cast<PieceForm>(piece.form)) {
    case PieceForm::kStored:
    case PieceForm::kTrackerRecord:
    case PieceForm::kCoded:
      return decode_own_piece(piece, stored);
    case PieceForm::kZstd:
      return unpack_zstd(stored, piece.raw_size);
    case PieceForm::kZstdHalves:
      return unpack_zstd(stored, piece.raw_size).map([](const auto& b) { return join_halves(b); });
    case PieceForm::kMesh:
      return mesh_bytes(stored);
    case PieceForm::kFeatureText:
      return text_bytes(stored);
    case PieceForm::kLevel:
      return level_bytes(piece, stored);
  }
  return fail(ExitCode::kUnsupported, "piece.form", "piece", "its form is unknown",
              "use a newer modar-fetch");
}

}  // namespace

Result<std::vector<std::byte>> unpack_zstd(std::span<const std::byte> frame, std::size_t size) {
  std::vector<std::byte> out(size);
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), frame.data(), frame.size());
  if (ZSTD_isError(got) != 0 || got != size) {
    return fail(ExitCode::kInvalidInput, "piece.zstd", "piece",
                ZSTD_isError(got) != 0 ? ZSTD_getErrorName(got) : "it unpacks to another size",
                kCure);
  }
  return out;
}

Result<std::vector<std::byte>> decode_piece(const PieceRecord& piece,
                                            std::span<const std::byte> stored) {
  auto raw = raw_bytes(piece, stored);
  if (!raw) return raw;
  if (raw->size() != piece.raw_size || raw_hash(*raw) != piece.raw_hash) {
    return fail(ExitCode::kInvalidInput, "piece.hash", "piece",
                "it decodes to different bytes than were published", kCure);
  }
  return raw;
}

Result<std::vector<std::uint16_t>> decode_level(std::span<const std::byte> buffer,
                                                std::size_t index_count) {
  std::vector<std::uint16_t> indices(index_count);
  if (index_count % 3 != 0 || index_count == 0 ||
      meshopt_decodeIndexBuffer(indices.data(), indices.size(), sizeof indices[0],
                                reinterpret_cast<const unsigned char*>(buffer.data()),
                                buffer.size()) != 0) {
    return fail(ExitCode::kInvalidInput, "mesh.level", "level of detail",
                "meshoptimizer cannot decode it", "publish the release again");
  }
  // The codec keeps triangles and their winding, but may start them at another corner.
  LevelOrderer orderer;
  orderer.order(indices, *std::max_element(indices.begin(), indices.end()) + 1u);
  return indices;
}

namespace {

constexpr std::uint64_t kMaxVertices = 65536;
constexpr std::uint32_t kMaxLooseTriangles = 65536;

tl::unexpected<Error> broken(const char* code, const char* cause) {
  return fail(ExitCode::kInvalidInput, code, "mesh object", cause, "publish the release again");
}

/// The parts of an object, within its bounds.
struct ObjectParts {
  MeshObjectHeader header{};
  std::vector<AttributeRecord> attributes;
  std::span<const std::byte> draco;
  std::span<const std::byte> fine;
  std::span<const std::byte> corrections;
  std::span<const std::byte> groups;  ///< coded; of version 2
};

Result<ObjectParts> split_object(std::span<const std::byte> object) {
  ObjectParts parts;
  if (object.size() < sizeof parts.header) return broken("mesh.truncated", "it ends in its header");
  std::memcpy(&parts.header, object.data(), sizeof parts.header);
  const MeshObjectHeader& h = parts.header;
  const std::uint64_t size = sizeof h + std::uint64_t{h.attribute_count} * sizeof(AttributeRecord) +
                             h.draco_size + h.fine_size + h.corrections_size;
  if (h.version > 2) {
    return fail(ExitCode::kUnsupported, "mesh.version", "mesh object",
                "it is of version " + std::to_string(h.version) + ", not 1 or 2",
                "use a newer modar-fetch");
  }
  if (h.version == 0 || h.reserved != 0 || h.attributes_reserved != 0 || h.attribute_count > 8 ||
      h.stride == 0 || h.stride > kMaxVertexStride || h.normal_bits > 16 ||
      h.loose_triangles > kMaxLooseTriangles) {
    return broken("mesh.header", "its header is out of range");
  }
  if (size > object.size() || (h.version == 1) != (size == object.size()))
    return broken("mesh.truncated", "its parts do not add up to its size");
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
  parts.groups = object.subspan(at);
  return parts;
}

/// Reads bits, lowest first. Bits past the end are zero; used_up() is false then.
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

/// Joins the coarse positions of Draco with their fine bits.
Result<void> restore_positions(DracoValues& positions, std::span<const std::byte> fine) {
  BitReader bits(fine);
  for (std::int32_t& value : positions.values) {
    if (value < -2048 || value > 2048) return broken("mesh.position", "a position is off the grid");
    const int count = fine_bits(value);
    const std::uint32_t low = bits.read(count) << (13 - count);
    value = join_half({value, low});
  }
  if (!bits.used_up()) return broken("mesh.fine", "its fine bits do not match its positions");
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
      return broken("mesh.normal", "a normal is outside the octahedral map");
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

/// Orders the points and triangles as the bake ordered the chunk. coded_groups: may be empty.
Result<MeshBytes> order_chunk(std::span<const std::byte> vertices, std::size_t stride,
                              std::vector<std::uint16_t> indices,
                              std::span<const std::byte> coded_groups) {
  ChunkOrderer orderer;
  const auto order = orderer.order(vertices, static_cast<std::uint32_t>(stride), indices);
  std::vector<std::byte> groups(order.size());
  if (!coded_groups.empty()) {
    auto decoded = decode_bytes(coded_groups, order.size(), 1);
    if (!decoded) return broken("mesh.groups", "the groups of its vertices do not unpack");
    groups = *std::move(decoded);
  }
  const std::vector<std::uint16_t> numbers = numbers_by_group(groups);
  MeshBytes chunk;
  chunk.vertices.resize(order.size() * stride);
  for (std::size_t v = 0; v < order.size(); ++v) {
    std::memcpy(chunk.vertices.data() + numbers[v] * stride, vertices.data() + order[v] * stride,
                stride);
  }
  for (std::uint16_t& index : indices) index = numbers[index];
  chunk.indices = std::move(indices);
  return chunk;
}

}  // namespace

Result<MeshBytes> decode_mesh_object(std::span<const std::byte> object) {
  MODAR_ASSIGN(auto parts, split_object(object));
  const auto streams = plan_streams(parts.header.stride, parts.attributes);
  if (!streams) return broken("mesh.attributes", "its attributes cannot travel this way");
  MODAR_ASSIGN(auto mesh, decode_draco(parts.draco));
  if (mesh.attributes.size() != streams->size()) {
    return broken("mesh.attributes", "Draco's attributes are not those of the layout");
  }
  std::size_t normal_values = 0;
  for (std::size_t a = 0; a < streams->size(); ++a) {
    if (mesh.attributes[a].components != travelling_components((*streams)[a])) {
      return broken("mesh.attributes", "Draco's attributes are not those of the layout");
    }
    if ((*streams)[a].kind == VertexStream::Kind::kNormal) {
      if (normal_values != 0 || parts.header.normal_bits < 2) {
        return broken("mesh.attributes", "it has normals twice, or without a map");
      }
      normal_values = mesh.attributes[a].values.size() / 2;
    }
  }
  const std::size_t stride = parts.header.stride;
  const std::size_t loose_bytes = std::size_t{parts.header.loose_triangles} * 3 * stride;
  MODAR_ASSIGN(auto corrections, unpack_corrections(parts, 3 * normal_values + loose_bytes));
  for (std::size_t a = 0; a < streams->size(); ++a) {
    Result<void> done;
    if ((*streams)[a].kind == VertexStream::Kind::kHalfPosition) {
      done = restore_positions(mesh.attributes[a], parts.fine);
    } else if ((*streams)[a].kind == VertexStream::Kind::kNormal) {
      done = restore_normals(mesh.attributes[a], parts.header.normal_bits, corrections);
    }
    if (!done) return tl::unexpected(done.error());
  }
  const std::size_t loose = 3 * std::size_t{parts.header.loose_triangles};
  if (mesh.point_count + loose > kMaxVertices)
    return broken("mesh.size", "it has too many vertices");
  std::vector<std::byte> vertices((mesh.point_count + loose) * stride);
  MODAR_TRY(write_points(mesh, *streams, stride, vertices));
  std::vector<std::uint16_t> indices(mesh.corners.begin(), mesh.corners.end());
  if (loose_bytes != 0) {
    std::memcpy(vertices.data() + mesh.point_count * stride, corrections.data() + 3 * normal_values,
                loose_bytes);
    for (std::size_t i = 0; i < loose; ++i) {
      indices.push_back(static_cast<std::uint16_t>(mesh.point_count + i));
    }
  }
  return order_chunk(vertices, stride, std::move(indices), parts.groups);
}

}  // namespace modar
