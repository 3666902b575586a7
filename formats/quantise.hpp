// Numbers of the vertex layouts: half floats, normalised integers, octahedral normals.
#pragma once

#include <array>
#include <cstdint>

namespace modar {

/// IEEE 754 binary16, round to nearest even; overflow gives infinity, NaN stays NaN.
std::uint16_t float_to_half(float value);
float half_to_float(std::uint16_t half);

/// Signed normalised integers as OpenGL ES 2.0 decodes them (2.1.2): f = (2c + 1) / (2^b - 1).
/// (OpenGL ES 3 decodes max(c / (2^(b-1) - 1), -1); encode() picks the integer nearest under the
/// mean of both, so that neither driver is off by more than one step.)
std::int8_t float_to_snorm8(float value);
float snorm8_to_float(std::int8_t value);

/// Octahedral 8-bit code of a direction (Meyer et al., "On floating-point normal vectors", 2010),
/// of the four round it the one whose worse decoding, that of ES 2.0 or that of ES 3, is nearest in
/// angle (as the "precise" codes of Cigolle et al., "A survey of efficient representations for
/// independent unit vectors", 2014). normal: of unit length; what has no direction becomes +z.
std::array<std::int8_t, 2> normal_to_oct8(const std::array<double, 3>& normal);

/// Unsigned normalised integers: f = c / (2^b - 1).
std::uint16_t float_to_unorm16(float value);
float unorm16_to_float(std::uint16_t value);
std::uint8_t float_to_unorm8(float value);
float unorm8_to_float(std::uint8_t value);

}  // namespace modar
