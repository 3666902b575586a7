// Encodes chunks as mesh objects and coarser levels (modar/piece.hpp decodes them).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/layout.hpp"

namespace modar {

/// The highest level without more memory for the decoder: time of publishing for download bytes.
inline constexpr int kZstdLevel = 19;

/// One attribute for Draco: values, and the value of each vertex.
struct DracoInput {
  enum class Kind { kPosition, kNormal, kUv, kOther };
  Kind kind = Kind::kOther;
  std::uint32_t components = 0;
  std::vector<std::int32_t> values;  ///< octahedral normals: 3 components, any length
  std::vector<std::uint32_t> value_of_vertex;
};

inline constexpr int kNoMap = 0;  ///< for values that are numbers only, and that nobody predicts

/// Encodes with Draco's best compression; nothing if Draco refuses. indices: triangles with 3
/// distinct position values each. normal_bits: of the octahedral map, or kNoMap.
std::optional<std::vector<std::byte>> encode_draco(std::span<const DracoInput> attributes,
                                                   std::span<const std::uint16_t> indices,
                                                   std::uint32_t vertex_count, int normal_bits);

/// A mesh object, verified by decoding it; nothing if the chunk cannot travel this way (layout, -0,
/// or an order that is not ChunkOrderer's in groups of vertices). vertices: of `layout`. indices:
/// local to them.
std::optional<std::vector<std::byte>> encode_mesh_object(std::span<const std::byte> vertices,
                                                         std::span<const std::uint16_t> indices,
                                                         const LayoutRecord& layout);

/// Encodes the indices of a coarser level for decode_level(), verified by decoding them; nothing if
/// their order is not LevelOrderer's.
std::optional<std::vector<std::byte>> encode_level(std::span<const std::uint16_t> indices);

}  // namespace modar
