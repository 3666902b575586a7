// Decodes the pieces that bundles travel as (formats/shipping.md). Decoding restores exact bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// The raw bytes of a piece: raw_size bytes whose hash is raw_hash. For kFeatureText `stored` is
/// the section of mapped features, taken from the bundle under construction.
/// Errors: kInvalidInput "piece.*", "mesh.*".
Result<std::vector<std::byte>> decode_piece(const PieceRecord& piece,
                                            std::span<const std::byte> stored);

/// Unpacks one zstd frame of exactly `size` bytes. Errors: kInvalidInput "piece.zstd".
Result<std::vector<std::byte>> unpack_zstd(std::span<const std::byte> frame, std::size_t size);

/// A chunk as the bundle stores it: vertices of the layout, indices local to them.
struct MeshBytes {
  std::vector<std::byte> vertices;
  std::vector<std::uint16_t> indices;
};

/// Header of a mesh object: Draco encodes the connectivity and what it predicts well, plain bits
/// the rest. It is followed by `attribute_count` AttributeRecords, the Draco buffer, the fine bits,
/// the corrections, and in version 2 the group of each vertex, coded by encode_bytes().
struct MeshObjectHeader {
  std::uint8_t version;               ///< 1; 2 where vertices are in groups
  std::uint8_t attribute_count;       ///< 1 to 8
  std::uint8_t normal_bits;           ///< of the octahedral map, 2 to 16; 0: no such normals
  std::uint8_t reserved;              ///< 0
  std::uint16_t stride;               ///< bytes of a vertex
  std::uint16_t attributes_reserved;  ///< 0
  std::uint32_t draco_size;           ///< bytes
  std::uint32_t fine_size;            ///< bytes: fine bits of the position values, lowest bit first
  std::uint32_t corrections_size;     ///< bytes, zstd: 3 per normal value, then loose triangles
  std::uint32_t loose_triangles;      ///< triangles that Draco drops, as 3 whole vertices each
};
static_assert(sizeof(MeshObjectHeader) == 24);

/// The chunk of a mesh object. Errors: kInvalidInput "mesh.*".
Result<MeshBytes> decode_mesh_object(std::span<const std::byte> object);

/// Indices of a coarser level of detail: meshoptimizer's index codec, put in the order of
/// LevelOrderer. Errors: kInvalidInput "mesh.level".
Result<std::vector<std::uint16_t>> decode_level(std::span<const std::byte> buffer,
                                                std::size_t index_count);

/// An attribute as Draco decodes it: its values in Draco's order, and the value of each point
/// (Draco's word for a vertex).
struct DracoValues {
  std::uint32_t components = 0;
  std::vector<std::int32_t> values;  ///< `components` each
  std::vector<std::uint32_t> value_of_point;
};
struct DracoMesh {
  std::vector<DracoValues> attributes;  ///< in the order in which they were added
  std::vector<std::uint32_t> corners;   ///< points, 3 per triangle
  std::uint32_t point_count = 0;
};

/// Decodes a Draco buffer of integer attributes (octahedral normals stay integers). Refuses counts
/// beyond a chunk's limits. Errors: kInvalidInput "mesh.draco".
Result<DracoMesh> decode_draco(std::span<const std::byte> buffer);

}  // namespace modar
