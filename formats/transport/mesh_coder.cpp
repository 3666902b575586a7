#include "formats/transport/mesh_coder.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "formats/component.hpp"
#include "formats/transport/chunk_order.hpp"
#include "formats/transport/triangle_coder.hpp"
#include "formats/transport/vertex_coder.hpp"

namespace modar {
namespace {

constexpr std::size_t kMostGroups = 256;
constexpr std::uint32_t kMostMeshStride = 256;

tl::unexpected<Error> broken_mesh(const char* code, const char* cause) {
  return fail(ExitCode::kInvalidInput, code, "mesh object", cause, "publish the release again");
}

/// The attributes in the order in which they travel: the position first. Nothing where they cannot.
std::optional<std::vector<AttributeRecord>> travelling(std::span<const AttributeRecord> attributes,
                                                       std::size_t stride) {
  std::vector<AttributeRecord> order;
  for (const AttributeRecord& a : attributes) {
    const std::size_t bytes = component_bytes(a.type);
    const bool position = a.semantic == static_cast<std::uint8_t>(Semantic::kPosition);
    if (bytes == 0 || bytes > 2 || a.components == 0 || a.components > 4 ||
        a.offset + a.components * bytes > stride || (position && a.components < 3)) {
      return std::nullopt;
    }
    order.insert(position ? order.begin() : order.end(), a);
  }
  const auto is_position = [](const AttributeRecord& a) {
    return a.semantic == static_cast<std::uint8_t>(Semantic::kPosition);
  };
  if (std::count_if(order.begin(), order.end(), is_position) != 1) return std::nullopt;
  return order;
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

/// Of each corner the place of its vertex: vertices with the same bytes of the position are at one.
std::vector<std::uint16_t> places_of(const UngroupedChunk& chunk, std::size_t stride,
                                     const AttributeRecord& position) {
  const std::size_t size = std::size_t{position.components} * component_bytes(position.type);
  std::unordered_map<std::string_view, std::uint16_t> known;
  std::vector<std::uint16_t> of_vertices;
  for (std::size_t at = 0; at < chunk.vertices.size(); at += stride) {
    const auto* bytes = reinterpret_cast<const char*>(chunk.vertices.data()) + at + position.offset;
    const auto number = static_cast<std::uint16_t>(known.size());
    of_vertices.push_back(known.emplace(std::string_view(bytes, size), number).first->second);
  }
  std::vector<std::uint16_t> places;
  places.reserve(chunk.indices.size());
  for (const std::uint16_t vertex : chunk.indices) places.push_back(of_vertices[vertex]);
  return places;
}

/// Orders vertices and triangles as the bake ordered the chunk. groups: may be empty.
MeshBytes order_chunk(std::span<const std::byte> vertices, std::size_t stride,
                      std::vector<std::uint16_t> indices, std::span<const std::byte> groups) {
  ChunkOrderer orderer;
  const auto order = orderer.order(vertices, static_cast<std::uint32_t>(stride), indices);
  std::vector<std::byte> ordered(order.size());
  for (std::size_t v = 0; v < ordered.size() && !groups.empty(); ++v) ordered[v] = groups[order[v]];
  const std::vector<std::uint16_t> numbers = numbers_by_group(ordered);
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

std::vector<std::byte> mesh_object(std::span<const AttributeRecord> records, std::uint16_t stride,
                                   std::uint32_t vertices, std::uint32_t triangles, bool groups,
                                   const std::vector<std::byte>& coded) {
  MeshObjectHeader header{};
  header.version = 3;
  header.attribute_count = static_cast<std::uint8_t>(records.size());
  header.has_groups = groups ? 1 : 0;
  header.stride = stride;
  header.vertex_count = static_cast<std::uint16_t>(vertices - 1);
  header.triangle_count = triangles;
  std::vector<std::byte> object;
  for (const auto part :
       {std::span<const std::byte>(std::as_bytes(std::span(&header, 1))),
        std::span<const std::byte>(std::as_bytes(records)), std::span<const std::byte>(coded)}) {
    object.insert(object.end(), part.begin(), part.end());
  }
  return object;
}

/// Codes all attributes, then the groups if there are any, both ways.
bool code_vertices(RangeCoder& coder, const CodedTriangles& triangles,
                   std::span<const AttributeRecord> attributes, std::size_t stride,
                   std::span<std::byte> vertices, std::span<std::byte> groups) {
  VertexCoder model(coder, triangles);
  for (const AttributeRecord& attribute : attributes) {
    if (!model.code(attribute, vertices, stride)) return false;
  }
  AttributeRecord group{};
  group.semantic = kTravellingGroup;
  group.type = static_cast<std::uint8_t>(ComponentType::kU8);
  group.components = 1;
  return groups.empty() || model.code(group, groups, 1);
}

}  // namespace

std::optional<std::vector<std::byte>> encode_mesh(std::span<const std::byte> vertices,
                                                  std::span<const std::uint16_t> indices,
                                                  const LayoutRecord& layout) {
  const std::size_t stride = layout.stride;
  const std::span records(layout.attributes, layout.attribute_count);
  const auto attributes = travelling(records, stride);
  if (!attributes || indices.empty() || indices.size() / 3 > kMostMeshTriangles ||
      stride > kMostMeshStride) {
    return std::nullopt;
  }
  const auto chunk = ungroup(vertices, indices, stride);
  if (!chunk) return std::nullopt;
  const auto count = static_cast<std::uint32_t>(indices.size() / 3);
  RangeCoder coder;
  const auto places = places_of(*chunk, stride, attributes->front());
  const CodedTriangles triangles = TriangleCoder(coder, count, 0).encode({chunk->indices, places});
  std::vector<std::byte> ordered;
  std::vector<std::byte> groups;
  for (const std::uint32_t v : triangles.source_vertices) {
    const auto vertex = chunk->vertices.begin() + static_cast<std::ptrdiff_t>(v * stride);
    ordered.insert(ordered.end(), vertex, vertex + static_cast<std::ptrdiff_t>(stride));
    if (!chunk->groups.empty()) groups.push_back(chunk->groups[v]);
  }
  if (ordered.size() != vertices.size()) return std::nullopt;  // some are of no triangle
  code_vertices(coder, triangles, *attributes, stride, ordered, groups);

  const auto object = mesh_object(records, layout.stride, triangles.vertex_count, count,
                                  !groups.empty(), coder.finish());
  const auto back = decode_mesh(object);
  if (!back ||
      !std::equal(back->vertices.begin(), back->vertices.end(), vertices.begin(), vertices.end()) ||
      !std::equal(back->indices.begin(), back->indices.end(), indices.begin(), indices.end())) {
    return std::nullopt;
  }
  return object;
}

Result<MeshBytes> decode_mesh(std::span<const std::byte> object) {
  MeshObjectHeader header{};
  if (object.size() < sizeof header) return broken_mesh("mesh.truncated", "it ends in its header");
  std::memcpy(&header, object.data(), sizeof header);
  if (header.version != 3) {
    return fail(ExitCode::kUnsupported, "mesh.version", "mesh object", "its version is unknown",
                "use a newer modar-fetch, or publish the release again");
  }
  const std::size_t records_size = header.attribute_count * sizeof(AttributeRecord);
  if (header.reserved != 0 || header.attribute_count > 8 || header.has_groups > 1 ||
      header.stride == 0 || header.stride > kMostMeshStride || header.triangle_count == 0 ||
      header.triangle_count > kMostMeshTriangles) {
    return broken_mesh("mesh.header", "its header is out of range");
  }
  if (object.size() - sizeof header < records_size) {
    return broken_mesh("mesh.truncated", "it ends in its attributes");
  }
  std::vector<AttributeRecord> records(header.attribute_count);
  if (!records.empty()) {
    std::memcpy(records.data(), object.data() + sizeof header, records_size);
  }
  const auto attributes = travelling(records, header.stride);
  if (!attributes) return broken_mesh("mesh.attributes", "its attributes cannot travel this way");

  RangeCoder coder(object.subspan(sizeof header + records_size));
  const std::uint32_t count = header.vertex_count + 1u;
  const auto triangles = TriangleCoder(coder, header.triangle_count, 0).decode(count);
  if (!triangles || triangles->vertex_count != count) {
    return broken_mesh("mesh.triangles", "its triangles do not unpack");
  }
  std::vector<std::byte> vertices(std::size_t{count} * header.stride);
  std::vector<std::byte> groups(header.has_groups != 0 ? count : 0);
  if (!code_vertices(coder, *triangles, *attributes, header.stride, vertices, groups)) {
    return broken_mesh("mesh.truncated", "it ends in its vertices");
  }
  if (!coder.used_up()) return broken_mesh("mesh.truncated", "bytes follow its vertices");
  const std::vector<std::uint16_t> indices(triangles->vertices.begin(), triangles->vertices.end());
  return order_chunk(vertices, header.stride, indices, groups);
}

std::optional<std::vector<std::byte>> encode_level(std::span<const std::uint16_t> indices) {
  if (indices.empty() || indices.size() % 3 != 0 || indices.size() / 3 > kMostMeshTriangles) {
    return std::nullopt;
  }
  const std::uint32_t numbers = *std::max_element(indices.begin(), indices.end()) + 1u;
  RangeCoder coder;
  coder.code_bits(numbers - 1, 16);
  TriangleCoder(coder, static_cast<std::uint32_t>(indices.size() / 3), numbers)
      .encode({indices, indices});
  auto coded = coder.finish();
  const auto back = decode_level(coded, indices.size());
  if (!back || !std::equal(back->begin(), back->end(), indices.begin(), indices.end())) {
    return std::nullopt;
  }
  return coded;
}

Result<std::vector<std::uint16_t>> decode_level(std::span<const std::byte> coded,
                                                std::size_t index_count) {
  const auto bad = fail(ExitCode::kInvalidInput, "mesh.level", "level of detail",
                        "its triangles do not unpack", "publish the release again");
  if (index_count % 3 != 0 || index_count == 0 || index_count / 3 > kMostMeshTriangles) return bad;
  RangeCoder coder(coded);
  const std::uint32_t numbers = coder.code_bits(0, 16) + 1;
  const auto triangles =
      TriangleCoder(coder, static_cast<std::uint32_t>(index_count / 3), numbers).decode(65536);
  if (!triangles || !coder.used_up()) return bad;
  std::vector<std::uint16_t> indices;
  indices.reserve(index_count);
  for (const std::uint32_t place : triangles->places) {
    indices.push_back(static_cast<std::uint16_t>(triangles->source_places[place]));
  }
  LevelOrderer orderer;
  orderer.order(indices, numbers);
  return indices;
}

}  // namespace modar
