// Vertices as the integers that a mesh codec predicts well, and back, bit for bit. Pure integer
// arithmetic: publisher and installer agree on every processor.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "formats/component.hpp"
#include "formats/layout.hpp"

namespace modar {

/// A half in [-1,1], split into a step on a grid of 2^-11, which a codec predicts well, and the
/// remainder, which it does not: x = (coarse * 2^13 + fine) * 2^-24.
struct HalfParts {
  std::int32_t coarse = 0;  ///< -2048 to 2048
  std::uint32_t fine = 0;   ///< below 2^13; its lowest 13 - fine_bits(coarse) bits are zero
};

/// Nothing for -0, values outside [-1,1] and NaN.
std::optional<HalfParts> split_half(std::uint16_t half);
std::uint16_t join_half(HalfParts parts);
/// Bits of `fine` that are not known from `coarse`: 0 for |x| >= 1/2, one more for each halving.
int fine_bits(std::int32_t coarse);

/// A direction of any length above 0, as the bytes that float_to_snorm8 gives for it.
std::array<std::int8_t, 3> snorm8_of_direction(const std::array<std::int32_t, 3>& direction);
/// The same of a point of the octahedral map of 2^bits - 1 values a side. s, t: 0 to 2^bits - 2.
std::array<std::int8_t, 3> snorm8_of_octahedral(std::int32_t s, std::int32_t t, int bits);

/// The direction at a point of the map; its absolute values add up to 2^(bits-1) - 1.
std::array<std::int32_t, 3> octahedral_direction(std::int32_t s, std::int32_t t, int bits);

/// The direction of the map that decodes to exactly these bytes or, if none is near the normal, to
/// the nearest ones. bits: 2 to 16.
std::array<std::int32_t, 3> octahedral_of_snorm8(std::array<std::int8_t, 3> bytes, int bits);

/// Semantic of the byte that OcclusionRecord names, where it travels; a layout has no such
/// attribute.
inline constexpr std::uint8_t kTravellingOcclusion = 255;

/// How one attribute of a layout travels.
struct VertexStream {
  enum class Kind : std::uint8_t {
    kHalfPosition,  ///< HalfParts: coarse steps in the codec, fine bits next to it
    kPosition,      ///< integers in the codec
    kNormal,        ///< octahedral in the codec, corrections of the three bytes next to it
    kUv,            ///< integers in the codec
    kOther,         ///< integers in the codec
  };
  Kind kind = Kind::kOther;
  AttributeRecord attribute{};
  /// Component `c` of the vertex at `vertex` as the integer that its bits are.
  [[nodiscard]] std::int32_t load(const std::byte* vertex, std::uint32_t c) const;
  /// Errors: false if the value does not fit.
  [[nodiscard]] bool store(std::byte* vertex, std::uint32_t c, std::int32_t value) const;
};

/// One stream an attribute, the position first; nothing if the layout has no position of half
/// floats or 16-bit integers, or holds 32-bit floats.
std::optional<std::vector<VertexStream>> plan_streams(std::uint32_t stride,
                                                      std::span<const AttributeRecord> attributes);

}  // namespace modar
