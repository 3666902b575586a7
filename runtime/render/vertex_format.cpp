// A bundle's vertex layout as GL takes it.
#include "runtime/render/vertex_format.hpp"

#include <cstring>

#include "formats/component.hpp"

namespace modar {
namespace {

GLenum gl_type(ComponentType type, GLenum half_type) {
  switch (type) {
    case ComponentType::kHalf:
      return half_type;
    case ComponentType::kI16:
      return GL_SHORT;
    case ComponentType::kU16:
      return GL_UNSIGNED_SHORT;
    case ComponentType::kI8:
      return GL_BYTE;
    case ComponentType::kU8:
      return GL_UNSIGNED_BYTE;
    case ComponentType::kF32:
      break;
  }
  return GL_FLOAT;
}

/// kAttributeCount where a model shader has no such attribute.
std::uint32_t place_of(Semantic semantic) {
  switch (semantic) {
    case Semantic::kPosition:
      return kAttributePosition;
    case Semantic::kNormal:
    case Semantic::kNormalOct:
      return kAttributeNormal;
    case Semantic::kUv:
      return kAttributeUv;
    case Semantic::kColour:
      return kAttributeColour;
    case Semantic::kJoints:
      return kAttributeJoints;
    case Semantic::kWeights:
      return kAttributeJoints + 1;
    case Semantic::kMorphX:
      return kAttributeMorphX;
    case Semantic::kMorphY:
      return kAttributeMorphY;
    case Semantic::kMorphZ:
      return kAttributeMorphZ;
  }
  return kAttributeCount;
}

bool has_halves(const LayoutRecord& layout) {
  for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
    if (static_cast<ComponentType>(layout.attributes[i].type) == ComponentType::kHalf) return true;
  }
  return false;
}

/// Whether two bytes of a vertex are of no attribute. offset: a multiple of 2, where one ends.
bool free_pair(const LayoutRecord& layout, std::uint32_t offset, std::uint32_t occlusion) {
  bool taken = offset == layout.stride || (occlusion & ~1u) == offset;
  for (std::uint32_t i = 0; i < layout.attribute_count; ++i)
    taken = taken || layout.attributes[i].offset == offset;
  return !taken;
}

}  // namespace

VertexFormat vertex_format(const LayoutRecord& layout, GLenum half_type, std::uint32_t occlusion) {
  VertexFormat format;
  format.source_stride = layout.stride;
  format.widened = half_type == 0 && has_halves(layout);
  std::uint32_t end = 0;
  for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
    const AttributeRecord& record = layout.attributes[i];
    const Semantic semantic = static_cast<Semantic>(record.semantic);
    const std::uint32_t place = place_of(semantic);
    if (place >= format.attributes.size()) continue;
    const ComponentType type = static_cast<ComponentType>(record.type);
    const bool widen = format.widened && type == ComponentType::kHalf;
    VertexAttribute& attribute = format.attributes[place];
    attribute.components = record.components;
    attribute.type = widen ? GLenum{GL_FLOAT} : gl_type(type, half_type);
    attribute.normalised = record.normalised != 0 ? GLboolean{GL_TRUE} : GLboolean{GL_FALSE};
    attribute.source_offset = record.offset;
    attribute.bytes = component_bytes(record.type) * record.components;
    if (semantic == Semantic::kNormal && type == ComponentType::kI8 && record.normalised != 0 &&
        occlusion == record.offset + attribute.bytes) {
      ++attribute.components;
      ++attribute.bytes;
    }
    // Four components of two bytes are drawn unchanged everywhere; of three, drivers of Vulkan
    // and Direct3D make a copy: 9 MB in Chromium's GPU process, of 38 MB.
    if (semantic == Semantic::kPosition && attribute.bytes == 6 && !format.widened &&
        free_pair(layout, record.offset + 6u, occlusion)) {
      attribute.components = 4;
      attribute.bytes = 8;
    }
    attribute.offset = format.widened ? end : record.offset;
    // Attributes of a rewritten vertex start at multiples of 4, which every GPU reads fastest.
    end += ((widen ? 2 * attribute.bytes : attribute.bytes) + 3) & ~3u;
    (semantic < Semantic::kJoints ? format.enabled : format.moving) |= 1u << place;
    if (semantic == Semantic::kNormal) format.normal = NormalKind::kXyz;
    if (semantic == Semantic::kNormalOct) format.normal = NormalKind::kOctahedral;
  }
  format.stride = format.widened ? end : layout.stride;
  return format;
}

void widen_vertices(const VertexFormat& format, std::span<const std::byte> from,
                    std::span<std::byte> to) {
  const std::size_t count = from.size() / format.source_stride;
  if (!to.empty()) std::memset(to.data(), 0, to.size());
  for (const VertexAttribute& attribute : format.attributes) {
    if (attribute.components == 0) continue;
    const bool widen = attribute.type == GL_FLOAT &&
                       attribute.bytes == 2 * static_cast<std::uint32_t>(attribute.components);
    const std::byte* source = from.data() + attribute.source_offset;
    std::byte* target = to.data() + attribute.offset;
    for (std::size_t v = 0; v < count; ++v) {
      if (widen) {
        for (std::size_t c = 0; c < static_cast<std::size_t>(attribute.components); ++c) {
          std::uint16_t half = 0;
          std::memcpy(&half, source + 2 * c, sizeof half);
          const float value = half_to_float(half);
          std::memcpy(target + 4 * c, &value, sizeof value);
        }
      } else {
        std::memcpy(target, source, attribute.bytes);
      }
      source += format.source_stride;
      target += format.stride;
    }
  }
}

}  // namespace modar
