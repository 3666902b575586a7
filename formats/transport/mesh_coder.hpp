// Chunks and levels of detail as they travel (PieceForm::kMesh, kLevel), restored byte for byte.
// formats/shipping.md is the normative text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// Semantic of the byte that OcclusionRecord names, where it travels; a layout has no such
/// attribute.
inline constexpr std::uint8_t kTravellingOcclusion = 255;

/// Begins a mesh object, followed by `attribute_count` AttributeRecords and the coded chunk.
struct MeshObjectHeader {
  std::uint8_t version;          ///< 3
  std::uint8_t attribute_count;  ///< 1 to 8
  std::uint8_t has_groups;       ///< 1: of each vertex its group travels
  std::uint8_t reserved;         ///< 0
  std::uint16_t stride;          ///< bytes of a vertex
  std::uint16_t vertex_count;    ///< less 1
  std::uint32_t triangle_count;  ///< at most kMostMeshTriangles
};
static_assert(sizeof(MeshObjectHeader) == 12);
inline constexpr std::uint32_t kMostMeshTriangles = 1u << 20;

/// A chunk as the bundle stores it: vertices of the layout, indices local to them.
struct MeshBytes {
  std::vector<std::byte> vertices;
  std::vector<std::uint16_t> indices;
};

/// A mesh object, verified by decoding it; nothing if the chunk cannot travel this way: a layout
/// with 32-bit floats or bytes outside its attributes, unused vertices, or an order that is not
/// ChunkOrderer's in groups of vertices. vertices: of `layout`. indices: local to them.
std::optional<std::vector<std::byte>> encode_mesh(std::span<const std::byte> vertices,
                                                  std::span<const std::uint16_t> indices,
                                                  const LayoutRecord& layout);
/// Errors: kInvalidInput "mesh.*".
Result<MeshBytes> decode_mesh(std::span<const std::byte> object);

/// The indices of a coarser level, verified by decoding them; nothing if their order is not
/// LevelOrderer's.
std::optional<std::vector<std::byte>> encode_level(std::span<const std::uint16_t> indices);
/// Errors: kInvalidInput "mesh.level".
Result<std::vector<std::uint16_t>> decode_level(std::span<const std::byte> coded,
                                                std::size_t index_count);

}  // namespace modar
