// A chunk of a bundle as it travels: Draco's connectivity and predictions for what predicts well,
// plain bits for what does not. Decoding restores the chunk's exact bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// A chunk as the bundle stores it: vertices of the layout, indices local to them.
struct MeshBytes {
  std::vector<std::byte> vertices;
  std::vector<std::uint16_t> indices;
};

/// Start of a mesh object; `attribute_count` AttributeRecords, the Draco buffer, the fine bits and
/// the corrections (zstd) follow it.
struct MeshObjectHeader {
  std::uint8_t version;               ///< 1
  std::uint8_t attribute_count;       ///< 1 to 8
  std::uint8_t normal_bits;           ///< of the octahedral map, 2 to 16; 0: no such normals
  std::uint8_t reserved;              ///< 0
  std::uint16_t stride;               ///< bytes of a vertex
  std::uint16_t attributes_reserved;  ///< 0
  std::uint32_t draco_size;           ///< bytes
  std::uint32_t fine_size;            ///< bytes: fine bits of the position values, lowest bit first
  std::uint32_t corrections_size;     ///< bytes, zstd: 3 a normal value, then loose triangles
  std::uint32_t loose_triangles;      ///< triangles that Draco drops, as 3 whole vertices each
};
static_assert(sizeof(MeshObjectHeader) == 24);

/// What Draco gives back before our own part: values of each attribute in Draco's order, and for
/// each point (vertex) the value that it uses.
struct DracoValues {
  std::uint32_t components = 0;
  std::vector<std::int32_t> values;  ///< components each
  std::vector<std::uint32_t> value_of_point;
};
struct DracoMesh {
  std::vector<DracoValues> attributes;  ///< in the order that they were added
  std::vector<std::uint32_t> corners;   ///< points, 3 a triangle
  std::uint32_t point_count = 0;
};

/// Decodes a Draco buffer of integer attributes (octahedral normals stay integers). Counts are held
/// to a chunk's limits. Errors: kInvalidInput "mesh.draco".
Result<DracoMesh> decode_draco(std::span<const std::byte> buffer);

/// The indices of a coarser level, in the order of LevelOrderer, from meshoptimizer's index codec.
/// Errors: kInvalidInput "mesh.level".
Result<std::vector<std::uint16_t>> decode_level(std::span<const std::byte> buffer,
                                                std::size_t index_count);

/// The chunk of a mesh object. Errors: kInvalidInput "mesh.*".
Result<MeshBytes> decode_mesh_object(std::span<const std::byte> object);

}  // namespace modar
