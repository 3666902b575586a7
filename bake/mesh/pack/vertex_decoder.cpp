// Decodes vertex attributes by their layout record.
#include "bake/mesh/pack/vertex_decoder.hpp"

#include <cmath>
#include <cstring>

#include <glm/geometric.hpp>

#include "formats/quantise.hpp"

namespace modar {
namespace {

template <class T>
T read(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

}  // namespace

VertexDecoder::VertexDecoder(const LayoutRecord& layout) : layout_(layout) {}

const AttributeRecord* VertexDecoder::find(Semantic semantic) const {
  for (std::uint16_t i = 0; i < layout_.attribute_count; ++i) {
    if (layout_.attributes[i].semantic == static_cast<std::uint8_t>(semantic)) {
      return &layout_.attributes[i];
    }
  }
  return nullptr;
}

double VertexDecoder::component(const AttributeRecord& attribute, const std::byte* vertex,
                                unsigned index) {
  const std::byte* at = vertex + attribute.offset;
  const bool normalised = attribute.normalised != 0;
  switch (static_cast<ComponentType>(attribute.type)) {
    case ComponentType::kHalf:
      return static_cast<double>(half_to_float(read<std::uint16_t>(at + 2 * index)));
    case ComponentType::kI16: {
      const auto value = static_cast<double>(read<std::int16_t>(at + 2 * index));
      return normalised ? (2 * value + 1) / 65535.0 : value;
    }
    case ComponentType::kU16: {
      const auto value = static_cast<double>(read<std::uint16_t>(at + 2 * index));
      return normalised ? value / 65535.0 : value;
    }
    case ComponentType::kI8: {
      const auto value = static_cast<double>(read<std::int8_t>(at + index));
      return normalised ? (2 * value + 1) / 255.0 : value;
    }
    case ComponentType::kU8: {
      const auto value = static_cast<double>(read<std::uint8_t>(at + index));
      return normalised ? value / 255.0 : value;
    }
    case ComponentType::kF32:
      return static_cast<double>(read<float>(at + 4 * index));
  }
  return 0.0;
}

glm::dvec3 VertexDecoder::position(const std::byte* vertex, const ChunkRecord& chunk) const {
  const AttributeRecord* a = find(Semantic::kPosition);
  glm::dvec3 p(0.0);
  for (int i = 0; a != nullptr && i < 3; ++i) {
    p[i] =
        static_cast<double>(chunk.position_offset[i]) +
        static_cast<double>(chunk.position_step) * component(*a, vertex, static_cast<unsigned>(i));
  }
  return p;
}

glm::dvec3 oct_to_normal(double x, double y) {
  // Meyer et al., "On floating-point normal vectors", 2010: the octahedron's lower half is folded
  // over its upper one.
  const double z = 1.0 - std::abs(x) - std::abs(y);
  if (z >= 0) return {x, y, z};
  return {(1.0 - std::abs(y)) * (x < 0 ? -1.0 : 1.0), (1.0 - std::abs(x)) * (y < 0 ? -1.0 : 1.0),
          z};
}

glm::dvec3 VertexDecoder::normal(const std::byte* vertex) const {
  glm::dvec3 n(0.0);
  if (const AttributeRecord* a = find(Semantic::kNormal); a != nullptr) {
    for (unsigned i = 0; i < 3; ++i) n[static_cast<int>(i)] = component(*a, vertex, i);
  } else if (const AttributeRecord* oct = find(Semantic::kNormalOct); oct != nullptr) {
    n = oct_to_normal(component(*oct, vertex, 0), component(*oct, vertex, 1));
  }
  const double length = glm::length(n);
  return length > 0 ? n / length : glm::dvec3(0, 0, 1);
}

glm::dvec2 VertexDecoder::uv(const std::byte* vertex, const ChunkRecord& chunk) const {
  const AttributeRecord* a = find(Semantic::kUv);
  glm::dvec2 uv(0.0);
  for (int i = 0; a != nullptr && i < 2; ++i) {
    uv[i] =
        static_cast<double>(chunk.uv_offset[i]) +
        static_cast<double>(chunk.uv_scale[i]) * component(*a, vertex, static_cast<unsigned>(i));
  }
  return uv;
}

glm::dvec4 VertexDecoder::colour(const std::byte* vertex) const {
  const AttributeRecord* a = find(Semantic::kColour);
  glm::dvec4 colour(1.0);
  for (int i = 0; a != nullptr && i < 4; ++i) {
    colour[i] = component(*a, vertex, static_cast<unsigned>(i));
  }
  return colour;
}

}  // namespace modar
