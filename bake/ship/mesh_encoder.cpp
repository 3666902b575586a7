#include "bake/ship/mesh_encoder.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <string_view>

#include <meshoptimizer.h>
#include <zstd.h>

#include "formats/component.hpp"
#include "formats/transport/chunk_order.hpp"
#include "formats/transport/coded_bytes.hpp"
#include "formats/transport/vertex_streams.hpp"
#include "modar/piece.hpp"

namespace modar {
namespace {

/// Values of one attribute that differ in their bytes, and the value of each vertex.
DracoInput distinct_values(const VertexStream& stream, std::span<const std::byte> vertices,
                           std::size_t stride) {
  DracoInput input;
  input.components = stream.attribute.components;
  const std::size_t size = std::size_t{input.components} * component_bytes(stream.attribute.type);
  std::map<std::string_view, std::uint32_t> known;
  for (std::size_t at = 0; at < vertices.size(); at += stride) {
    const std::byte* vertex = vertices.data() + at;
    const std::string_view key(reinterpret_cast<const char*>(vertex + stream.attribute.offset),
                               size);
    const auto [entry, fresh] = known.emplace(key, static_cast<std::uint32_t>(known.size()));
    input.value_of_vertex.push_back(entry->second);
    if (!fresh) continue;
    for (std::uint32_t c = 0; c < input.components; ++c) {
      input.values.push_back(stream.load(vertex, c));
    }
  }
  return input;
}

/// Triangles that Draco keeps, and those that it drops because they have a corner twice.
struct SplitTriangles {
  std::vector<std::uint16_t> kept;
  std::vector<std::uint16_t> loose;
};

SplitTriangles split_triangles(std::span<const std::uint16_t> indices,
                               const DracoInput& positions) {
  SplitTriangles split;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const auto at = [&](std::size_t c) { return positions.value_of_vertex[indices[i + c]]; };
    const bool keeps = at(0) != at(1) && at(1) != at(2) && at(2) != at(0);
    auto& list = keeps ? split.kept : split.loose;
    list.insert(list.end(), indices.begin() + static_cast<std::ptrdiff_t>(i),
                indices.begin() + static_cast<std::ptrdiff_t>(i) + 3);
  }
  return split;
}

/// Values of every attribute in the order in which Draco returns them. That order depends on the
/// connectivity alone, so it is found by encoding the numbers of the values instead of the values.
std::optional<std::vector<std::vector<std::uint32_t>>> travelling_order(
    std::span<const DracoInput> attributes, std::span<const std::uint16_t> indices,
    std::uint32_t vertex_count) {
  std::vector<DracoInput> numbers(attributes.begin(), attributes.end());
  for (DracoInput& input : numbers) {
    const std::size_t count = input.values.size() / input.components;
    if (input.kind != DracoInput::Kind::kPosition) input.kind = DracoInput::Kind::kOther;
    const std::uint32_t components = input.kind == DracoInput::Kind::kPosition ? 3 : 1;
    input.components = components;
    input.values.assign(components * count, 0);
    for (std::size_t v = 0; v < count; ++v) {
      input.values[v * components] = static_cast<std::int32_t>(v);
    }
  }
  const auto buffer = encode_draco(numbers, indices, vertex_count, kNoMap);
  if (!buffer) return std::nullopt;
  const auto decoded = decode_draco(*buffer);
  if (!decoded || decoded->attributes.size() != attributes.size()) return std::nullopt;
  std::vector<std::vector<std::uint32_t>> order(attributes.size());
  for (std::size_t a = 0; a < attributes.size(); ++a) {
    const DracoValues& values = decoded->attributes[a];
    for (std::size_t v = 0; v < values.values.size(); v += values.components) {
      order[a].push_back(static_cast<std::uint32_t>(values.values[v]));
    }
  }
  return order;
}

/// Collects bits, lowest first.
class BitWriter {
 public:
  void write(std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i, ++bit_) {
      if (bit_ % 8 == 0) bytes_.push_back(std::byte{0});
      bytes_.back() |= static_cast<std::byte>((value >> i & 1u) << bit_ % 8);
    }
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
  std::size_t bit_ = 0;
};

std::vector<std::byte> squeeze(const std::vector<std::byte>& bytes, int level) {
  if (bytes.empty()) return {};
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), level));
  return packed;
}

/// Encodes one chunk: the part in Draco, and the part sent next to it.
class MeshObjectMaker {
 public:
  MeshObjectMaker(std::span<const std::byte> vertices, std::span<const std::uint16_t> indices,
                  const LayoutRecord& layout, std::vector<VertexStream> streams)
      : vertices_(vertices), layout_(layout), streams_(std::move(streams)) {
    for (const VertexStream& stream : streams_) {
      exact_.push_back(distinct_values(stream, vertices_, layout_.stride));
      exact_.back().kind = kind_of(stream.kind);
    }
    triangles_ = split_triangles(indices, exact_.front());
  }

  /// zstd_level: of the corrections.
  std::optional<std::vector<std::byte>> make(int normal_bits, int zstd_level = kZstdLevel) {
    const auto vertex_count = static_cast<std::uint32_t>(vertices_.size() / layout_.stride);
    if (triangles_.kept.empty()) return std::nullopt;
    if (order_.empty()) {
      auto order = travelling_order(exact_, triangles_.kept, vertex_count);
      if (!order) return std::nullopt;
      order_ = std::move(*order);
    }
    std::vector<DracoInput> inputs = exact_;
    for (std::size_t a = 0; a < streams_.size(); ++a) {
      if (streams_[a].kind == VertexStream::Kind::kNormal) aim_normals(inputs[a], normal_bits);
    }
    if (streams_.front().kind == VertexStream::Kind::kHalfPosition && !coarsen(inputs.front())) {
      return std::nullopt;
    }
    const auto draco = encode_draco(inputs, triangles_.kept, vertex_count, normal_bits);
    if (!draco) return std::nullopt;
    return join(*draco, fine_parts(), squeeze(corrections(inputs), zstd_level), normal_bits);
  }

  [[nodiscard]] bool has_normals() const {
    return std::any_of(streams_.begin(), streams_.end(),
                       [](const VertexStream& s) { return s.kind == VertexStream::Kind::kNormal; });
  }

 private:
  static DracoInput::Kind kind_of(VertexStream::Kind kind) {
    switch (kind) {
      case VertexStream::Kind::kHalfPosition:
      case VertexStream::Kind::kPosition:
        return DracoInput::Kind::kPosition;
      case VertexStream::Kind::kNormal:
        return DracoInput::Kind::kNormal;
      case VertexStream::Kind::kUv:
        return DracoInput::Kind::kUv;
      default:
        return DracoInput::Kind::kOther;
    }
  }

  /// Moves a normal to a place of the octahedral map that decodes to its exact bytes, if there is
  /// one.
  static void aim_normals(DracoInput& normals, int bits) {
    for (std::size_t i = 0; i + 2 < normals.values.size(); i += 3) {
      std::int32_t* n = normals.values.data() + i;
      const auto aimed =
          octahedral_of_snorm8({static_cast<std::int8_t>(n[0]), static_cast<std::int8_t>(n[1]),
                                static_cast<std::int8_t>(n[2])},
                               bits);
      for (std::size_t c = 0; c < 3; ++c) n[c] = aimed[c];
    }
  }

  static bool coarsen(DracoInput& positions) {
    for (std::int32_t& value : positions.values) {
      const auto parts = split_half(static_cast<std::uint16_t>(value));
      if (!parts) return false;
      value = parts->coarse;
    }
    return true;
  }

  [[nodiscard]] std::vector<std::byte> fine_parts() const {
    BitWriter bits;
    if (streams_.front().kind != VertexStream::Kind::kHalfPosition) return {};
    for (const std::uint32_t v : order_.front()) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto parts = split_half(static_cast<std::uint16_t>(exact_.front().values[3 * v + c]));
        const int count = fine_bits(parts->coarse);
        bits.write(parts->fine >> (13 - count), count);
      }
    }
    return bits.bytes();
  }

  /// Three planes of what the octahedral map is off by, then the loose triangles.
  [[nodiscard]] std::vector<std::byte> corrections(const std::vector<DracoInput>& inputs) const {
    std::vector<std::byte> bytes;
    for (std::size_t a = 0; a < streams_.size(); ++a) {
      if (streams_[a].kind != VertexStream::Kind::kNormal) continue;
      const std::size_t count = order_[a].size();
      bytes.resize(3 * count);
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t value = 3 * std::size_t{order_[a][i]};
        const std::int32_t* aimed = inputs[a].values.data() + value;
        const auto near = snorm8_of_direction({aimed[0], aimed[1], aimed[2]});
        for (std::size_t c = 0; c < 3; ++c) {
          bytes[c * count + i] = static_cast<std::byte>(exact_[a].values[value + c] - near[c]);
        }
      }
    }
    for (const std::uint16_t v : triangles_.loose) {
      const auto vertex = vertices_.subspan(v * std::size_t{layout_.stride}, layout_.stride);
      bytes.insert(bytes.end(), vertex.begin(), vertex.end());
    }
    return bytes;
  }

  [[nodiscard]] std::vector<std::byte> join(const std::vector<std::byte>& draco,
                                            const std::vector<std::byte>& fine,
                                            const std::vector<std::byte>& beside,
                                            int normal_bits) const {
    MeshObjectHeader header{};
    header.version = 1;
    header.attribute_count = static_cast<std::uint8_t>(layout_.attribute_count);
    header.normal_bits = static_cast<std::uint8_t>(has_normals() ? normal_bits : 0);
    header.stride = layout_.stride;
    header.draco_size = static_cast<std::uint32_t>(draco.size());
    header.fine_size = static_cast<std::uint32_t>(fine.size());
    header.corrections_size = static_cast<std::uint32_t>(beside.size());
    header.loose_triangles = static_cast<std::uint32_t>(triangles_.loose.size() / 3);
    std::vector<std::byte> object;
    const auto append = [&](std::span<const std::byte> bytes) {
      object.insert(object.end(), bytes.begin(), bytes.end());
    };
    append(std::as_bytes(std::span(&header, 1)));
    append(std::as_bytes(std::span(layout_.attributes, layout_.attribute_count)));
    append(draco);
    append(fine);
    append(beside);
    return object;
  }

  std::span<const std::byte> vertices_;
  const LayoutRecord& layout_;
  std::vector<VertexStream> streams_;
  std::vector<DracoInput> exact_;  // the integers that the bytes are
  SplitTriangles triangles_;
  std::vector<std::vector<std::uint32_t>> order_;
};

/// Triangles of a chunk that choose the size of its octahedral map. More take time and save few
/// bytes.
constexpr std::size_t kSampleTriangles = 4000;

/// The size of map that makes the object of a chunk's first triangles smallest.
int choose_normal_bits(std::span<const std::byte> vertices, std::span<const std::uint16_t> indices,
                       const LayoutRecord& layout, const std::vector<VertexStream>& streams) {
  constexpr int kSmallest = 8;
  constexpr int kTrialLevel = 3;  // of zstd: fast
  const auto sample = indices.first(std::min(indices.size(), 3 * kSampleTriangles));
  if (sample.empty()) return kSmallest;
  // Vertices are in the order of their first use.
  const std::size_t count = *std::max_element(sample.begin(), sample.end()) + std::size_t{1};
  MeshObjectMaker maker(vertices.first(std::min(vertices.size(), count * layout.stride)), sample,
                        layout, streams);
  if (!maker.has_normals()) return kSmallest;
  int best = kSmallest;
  std::size_t least = SIZE_MAX;
  for (int bits = kSmallest; bits <= 10; ++bits) {
    const auto object = maker.make(bits, kTrialLevel);
    if (!object) return kSmallest;
    if (object->size() >= least) continue;
    least = object->size();
    best = bits;
  }
  return best;
}

/// A chunk in the order of ChunkOrderer, and the group of each vertex; none where all are of one.
struct UngroupedChunk {
  std::vector<std::byte> vertices;
  std::vector<std::uint16_t> indices;
  std::vector<std::byte> groups;
};

/// Nothing where vertices are not in groups whose order inside is ChunkOrderer's.
std::optional<UngroupedChunk> ungroup(std::span<const std::byte> vertices,
                                      std::span<const std::uint16_t> indices, std::size_t stride) {
  constexpr std::size_t kMostGroups = 256;
  UngroupedChunk chunk;
  chunk.indices.assign(indices.begin(), indices.end());
  ChunkOrderer orderer;
  const auto order = orderer.order(vertices, static_cast<std::uint32_t>(stride), chunk.indices);
  if (order.size() * stride != vertices.size()) return std::nullopt;
  std::vector<std::uint16_t> place(order.size());
  for (std::size_t v = 0; v < order.size(); ++v) {
    place[order[v]] = static_cast<std::uint16_t>(v);
    const auto vertex = vertices.subspan(order[v] * stride, stride);
    chunk.vertices.insert(chunk.vertices.end(), vertex.begin(), vertex.end());
  }
  // A group ends where the order goes back.
  std::size_t group = 0;
  std::vector<std::byte> groups(place.size());
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (v > 0 && place[v] < place[v - 1] && ++group == kMostGroups) return std::nullopt;
    groups[place[v]] = static_cast<std::byte>(group);
  }
  if (group > 0) chunk.groups = std::move(groups);
  return chunk;
}

bool restores(std::span<const std::byte> object, std::span<const std::byte> vertices,
              std::span<const std::uint16_t> indices) {
  const auto chunk = decode_mesh_object(object);
  return chunk &&
         std::equal(chunk->vertices.begin(), chunk->vertices.end(), vertices.begin(),
                    vertices.end()) &&
         std::equal(chunk->indices.begin(), chunk->indices.end(), indices.begin(), indices.end());
}

}  // namespace

std::optional<std::vector<std::byte>> encode_mesh_object(std::span<const std::byte> vertices,
                                                         std::span<const std::uint16_t> indices,
                                                         const LayoutRecord& layout) {
  auto streams = plan_streams(layout.stride, std::span(layout.attributes, layout.attribute_count));
  if (!streams || vertices.empty()) return std::nullopt;
  const auto chunk = ungroup(vertices, indices, layout.stride);
  if (!chunk) return std::nullopt;
  const int bits = choose_normal_bits(chunk->vertices, chunk->indices, layout, *streams);
  auto object =
      MeshObjectMaker(chunk->vertices, chunk->indices, layout, std::move(*streams)).make(bits);
  if (!object) return std::nullopt;
  if (!chunk->groups.empty()) {
    object->front() = std::byte{2};  // MeshObjectHeader::version
    const std::vector<std::byte> coded = encode_bytes(chunk->groups, 1);
    object->insert(object->end(), coded.begin(), coded.end());
  }
  if (!restores(*object, vertices, indices)) return std::nullopt;
  return object;
}

std::optional<std::vector<std::byte>> encode_level(std::span<const std::uint16_t> indices) {
  if (indices.empty() || indices.size() % 3 != 0) return std::nullopt;
  const std::size_t vertices = *std::max_element(indices.begin(), indices.end()) + std::size_t{1};
  // LevelOrderer puts any order right. Levels of scans and a terrain are 0.72 to 0.75 of what they
  // are in its own: in strips, most triangles are next to the last one.
  std::vector<std::uint16_t> strips(indices.size());
  meshopt_optimizeVertexCacheStrip(strips.data(), indices.data(), indices.size(), vertices);
  std::vector<unsigned char> coded(meshopt_encodeIndexBufferBound(indices.size(), vertices));
  coded.resize(meshopt_encodeIndexBuffer(coded.data(), coded.size(), strips.data(), strips.size()));
  const auto bytes = std::as_bytes(std::span(coded));
  const auto back = decode_level(bytes, indices.size());
  if (!back || !std::equal(back->begin(), back->end(), indices.begin(), indices.end())) {
    return std::nullopt;
  }
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace modar
