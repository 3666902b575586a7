// A chunk to the object that it travels as (modar/piece.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/layout.hpp"

namespace modar {

/// One attribute for Draco: values, and the value of each vertex.
struct DracoInput {
  enum class Kind { kPosition, kNormal, kUv, kOther };
  Kind kind = Kind::kOther;
  std::uint32_t components = 0;
  std::vector<std::int32_t> values;  ///< octahedral normals: 3 components, any length
  std::vector<std::uint32_t> value_of_vertex;
};

/// Draco's smallest buffer for these triangles (3 distinct position values each); nothing if it
/// refuses. normal_bits: of the octahedral map.
std::optional<std::vector<std::byte>> encode_draco(std::span<const DracoInput> attributes,
                                                   std::span<const std::uint16_t> indices,
                                                   std::uint32_t vertex_count, int normal_bits);

/// The object, which decode_mesh_object() was seen to turn back into these very bytes; nothing if
/// the chunk cannot travel this way (layout, -0, another order than the bake's).
/// vertices: of `layout`. indices: local to them.
std::optional<std::vector<std::byte>> encode_mesh_object(std::span<const std::byte> vertices,
                                                         std::span<const std::uint16_t> indices,
                                                         const LayoutRecord& layout);

/// The indices of a coarser level for decode_level(), which was seen to give them back; nothing if
/// they stand in another order than the bake's.
std::optional<std::vector<std::byte>> encode_level(std::span<const std::uint16_t> indices);

}  // namespace modar
