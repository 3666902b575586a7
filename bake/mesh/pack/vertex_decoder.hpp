// Reads vertices of any layout back as GL would hand them to a shader.
#pragma once

#include <cstddef>
#include <span>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "formats/layout.hpp"

namespace modar {

/// The direction, not normalised, of octahedral coordinates in [-1,1].
glm::dvec3 oct_to_normal(double x, double y);

/// Decodes attributes of one layout. The caller keeps indices inside the bytes.
class VertexDecoder {
 public:
  explicit VertexDecoder(const LayoutRecord& layout);

  [[nodiscard]] bool has(Semantic semantic) const { return find(semantic) != nullptr; }
  [[nodiscard]] std::uint32_t stride() const { return layout_.stride; }
  /// Model space, in [-1,1].
  [[nodiscard]] glm::dvec3 position(const std::byte* vertex, const ChunkRecord& chunk) const;
  /// Unit length; (0, 0, 1) where there is none.
  [[nodiscard]] glm::dvec3 normal(const std::byte* vertex) const;
  /// v down.
  [[nodiscard]] glm::dvec2 uv(const std::byte* vertex, const ChunkRecord& chunk) const;
  /// RGBA in [0,1].
  [[nodiscard]] glm::dvec4 colour(const std::byte* vertex) const;

 private:
  [[nodiscard]] const AttributeRecord* find(Semantic semantic) const;
  [[nodiscard]] static double component(const AttributeRecord& attribute, const std::byte* vertex,
                                        unsigned index);
  LayoutRecord layout_;
};

}  // namespace modar
