// Encodes the numbers of vertex attributes: half floats, normalised integers, octahedral normals.
// component.hpp has the decoders.
#pragma once

#include <array>
#include <cstdint>

#include "formats/component.hpp"

namespace modar {

/// IEEE 754 binary16, round to nearest even; overflow gives infinity, NaN stays NaN.
std::uint16_t float_to_half(float value);

/// The signed normalised integer nearest to `value` under the mean of both decodings in use, so
/// that neither is off by more than one step: OpenGL ES 2.0 has (2c + 1) / 255, ES 3 has
/// max(c / 127, -1). NaN becomes 0.
std::int8_t float_to_snorm8(float value);
/// As a shader under OpenGL ES 2.0 reads it.
inline float snorm8_to_float(std::int8_t value) {
  return static_cast<float>(decode_normalised(value));
}

/// Octahedral 8-bit code of a direction (Meyer et al., "On floating-point normal vectors", 2010):
/// of the four codes around it the one whose worse decoding, under ES 2.0 or ES 3, is nearest in
/// angle (the "precise" codes of Cigolle et al., "A survey of efficient representations for
/// independent unit vectors", 2014). normal: of unit length; without a direction it becomes +z.
std::array<std::int8_t, 2> normal_to_oct8(const std::array<double, 3>& normal);

/// Unsigned normalised integers, clamped to [0,1] and rounded to nearest. NaN becomes 0.
std::uint16_t float_to_unorm16(float value);
std::uint8_t float_to_unorm8(float value);
inline float unorm16_to_float(std::uint16_t value) {
  return static_cast<float>(decode_normalised(value));
}

}  // namespace modar
