// Decodes the numbers of vertex attributes: the one place that turns a ComponentType's bits into
// the value that OpenGL ES 2.0 hands to a shader (bundle.md, Decoding). quantise.hpp has the
// encoders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "formats/clip_tracks.hpp"
#include "formats/layout.hpp"

namespace modar {

/// Bytes of one component of `type`, a ComponentType; 0 for an unknown type.
constexpr std::uint32_t component_bytes(std::uint8_t type) {
  switch (static_cast<ComponentType>(type)) {
    case ComponentType::kHalf:
    case ComponentType::kI16:
    case ComponentType::kU16:
      return 2;
    case ComponentType::kI8:
    case ComponentType::kU8:
      return 1;
    case ComponentType::kF32:
      return 4;
  }
  return 0;
}

/// IEEE 754 binary16. By the builtin: libc++ 13 has no std::bit_cast.
constexpr float half_to_float(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16;
  const std::uint32_t exponent = (half >> 10) & 0x1Fu;
  const std::uint32_t mantissa = half & 0x03FFu;
  if (exponent == 31) return __builtin_bit_cast(float, sign | 0x7F800000u | (mantissa << 13));
  if (exponent != 0) {
    return __builtin_bit_cast(float, sign | ((exponent + 112u) << 23) | (mantissa << 13));
  }
  const float magnitude = static_cast<float>(mantissa) * 0x1p-24f;
  return sign != 0 ? -magnitude : magnitude;
}

/// A normalised integer of b bits (OpenGL ES 2.0, 2.1.2): unsigned c / (2^b - 1), in [0,1]; signed
/// (2c + 1) / (2^b - 1), in [-1,1], without a code for 0.
template <class Integer>
constexpr double decode_normalised(Integer code) {
  constexpr double kSteps = std::numeric_limits<std::make_unsigned_t<Integer>>::max();
  if constexpr (std::is_signed_v<Integer>) return (2.0 * code + 1.0) / kSteps;
  return code / kSteps;
}

/// `bytes` may be unaligned.
template <class T>
T load_number(const std::byte* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// The component whose first byte is `bytes` (unaligned is fine); 0 for an unknown type.
/// type: a ComponentType. normalised: as in AttributeRecord; ignored for kHalf and kF32.
inline double decode_component(const std::byte* bytes, std::uint8_t type, bool normalised) {
  const auto integer = [&](auto code) {
    return normalised ? decode_normalised(code) : static_cast<double>(code);
  };
  switch (static_cast<ComponentType>(type)) {
    case ComponentType::kHalf:
      return static_cast<double>(half_to_float(load_number<std::uint16_t>(bytes)));
    case ComponentType::kI16:
      return integer(load_number<std::int16_t>(bytes));
    case ComponentType::kU16:
      return integer(load_number<std::uint16_t>(bytes));
    case ComponentType::kI8:
      return integer(load_number<std::int8_t>(bytes));
    case ComponentType::kU8:
      return integer(load_number<std::uint8_t>(bytes));
    case ComponentType::kF32:
      return static_cast<double>(load_number<float>(bytes));
  }
  return 0.0;
}

/// Component `index` of an attribute of the vertex that starts at `vertex`.
inline double decode_component(const AttributeRecord& attribute, const std::byte* vertex,
                               std::uint32_t index) {
  return decode_component(vertex + attribute.offset + index * component_bytes(attribute.type),
                          attribute.type, attribute.normalised != 0);
}

/// The layout's attribute of that meaning, or nullptr.
inline const AttributeRecord* find_attribute(const LayoutRecord& layout, Semantic semantic) {
  for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
    if (layout.attributes[i].semantic == static_cast<std::uint8_t>(semantic)) {
      return &layout.attributes[i];
    }
  }
  return nullptr;
}

/// How far a morph target of the vertex's part moves it along an axis, as a part of the farthest
/// way.
inline double morph_part(const LayoutRecord& layout, const std::byte* vertex, int axis,
                         std::uint32_t target) {
  const int semantic = static_cast<int>(Semantic::kMorphX) + axis;
  const AttributeRecord* attribute = find_attribute(layout, static_cast<Semantic>(semantic));
  return load_number<std::int16_t>(vertex + attribute->offset + 2 * target) / double{kMorphUnits};
}

}  // namespace modar
