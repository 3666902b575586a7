// A bundle's vertex layout as GL takes it, and the same with floats for contexts without halves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/layout.hpp"
#include "runtime/render/program.hpp"

namespace modar {

/// One attribute as glVertexAttribPointer takes it; components 0: the layout has none.
struct VertexAttribute {
  GLint components = 0;
  GLenum type = 0;
  GLboolean normalised = 0;
  std::uint32_t offset = 0;         ///< in the uploaded vertex
  std::uint32_t source_offset = 0;  ///< in the vertex as the bundle has it
  std::uint32_t bytes = 0;          ///< as the bundle has it
};

/// Indexed by AttributeSlot.
struct VertexFormat {
  std::array<VertexAttribute, kAttributeCount> attributes{};
  NormalKind normal = NormalKind::kAbsent;
  std::uint32_t source_stride = 0;
  std::uint32_t stride = 0;   ///< as uploaded
  bool widened = false;       ///< halves become floats
  std::uint32_t enabled = 0;  ///< bit mask of AttributeSlot, without the next one's
  std::uint32_t moving = 0;   ///< the same of what bones and morph targets need
};

/// half_type: what the context calls half floats; 0: it reads none. Attributes of unknown semantics
/// are left out. occlusion: see occlusion_byte(); behind a normal of bytes, it is that attribute's
/// fourth component, elsewhere it is not looked at.
VertexFormat vertex_format(const LayoutRecord& layout, GLenum half_type, std::uint32_t occlusion);

/// Rewrites vertices of format.source_stride to format.stride. to.size() and from.size() hold the
/// same number of whole vertices.
void widen_vertices(const VertexFormat& format, std::span<const std::byte> from,
                    std::span<std::byte> to);

}  // namespace modar
