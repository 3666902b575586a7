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

/// Unsigned normalised integers: f = c / (2^b - 1).
std::uint16_t float_to_unorm16(float value);
float unorm16_to_float(std::uint16_t value);
std::uint8_t float_to_unorm8(float value);
float unorm8_to_float(std::uint8_t value);

}  // namespace modar
