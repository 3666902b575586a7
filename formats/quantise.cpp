// Encoders of half floats and normalised integers.
#include "formats/quantise.hpp"

#include <cmath>

namespace modar {
namespace {

/// From one signed 8-bit code to the next, in the mean of both decodings.
constexpr double kSnorm8Step = (2.0 / 255.0 + 1.0 / 127.0) / 2.0;

/// What signed codes decode to under ES 2.0 and under ES 3, and the middle of the two, by code +
/// 128.
struct SnormTables {
  std::array<double, 256> es2{};
  std::array<double, 256> es3{};
  std::array<double, 257> mean{};  ///< the last one is no code: nothing is near it
};

constexpr SnormTables make_snorm_tables() {
  SnormTables tables;
  for (int c = -128; c < 128; ++c) {
    const auto at = static_cast<std::size_t>(c + 128);
    tables.es2[at] = decode_normalised(static_cast<std::int8_t>(c));
    tables.es3[at] = c < -127 ? -1.0 : c / 127.0;
    tables.mean[at] = (tables.es2[at] + tables.es3[at]) / 2.0;
  }
  tables.mean[256] = 4.0;
  return tables;
}
constexpr SnormTables kSnorm = make_snorm_tables();

/// Square of the cosine between a unit vector and what octahedral coordinates decode to.
double oct_cosine_square(double x, double y, const std::array<double, 3>& n) {
  const double z = 1.0 - std::fabs(x) - std::fabs(y);
  // Both cases in one: the fold moves x and y towards the middle by what z is below 0.
  const double fold = z < 0 ? -z : 0.0;
  const double fx = x + (x < 0 ? fold : -fold);
  const double fy = y + (y < 0 ? fold : -fold);
  const double dot = fx * n[0] + fy * n[1] + z * n[2];
  return dot * std::fabs(dot) / (fx * fx + fy * fy + z * z);
}

/// NaN becomes 0: there is no better integer for it.
double clamped(float value, double low, double high) {
  const double wide = static_cast<double>(value);
  if (std::isnan(wide)) return 0.0;
  return wide < low ? low : (wide > high ? high : wide);
}

}  // namespace

std::uint16_t float_to_half(float value) {
  const std::uint32_t bits = __builtin_bit_cast(std::uint32_t, value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000u);
  const std::uint32_t magnitude = bits & 0x7FFFFFFFu;
  std::uint32_t half = 0;
  if (magnitude > 0x7F800000u) {
    // The quiet bit keeps a NaN whose payload is in the lost bits from turning into infinity.
    half = 0x7C00u | 0x0200u | ((magnitude >> 13) & 0x03FFu);
  } else if (magnitude >= 0x47800000u) {  // 2^16 and up, infinity
    half = 0x7C00u;
  } else if (magnitude >= 0x38800000u) {  // normal halves, from 2^-14
    const std::uint32_t rebased = magnitude - (112u << 23);
    // Adding half a unit, less one where the kept part is even, rounds ties to even; a carry runs
    // into the exponent and, at the top, into infinity, as it must.
    half = (rebased + 0x0FFFu + ((rebased >> 13) & 1u)) >> 13;
  } else if (magnitude >= 0x33000000u) {  // subnormal halves, from 2^-25
    const std::uint32_t shift = 126u - (magnitude >> 23);
    const std::uint32_t mantissa = (magnitude & 0x007FFFFFu) | 0x00800000u;
    const std::uint32_t kept = mantissa >> shift;
    const std::uint32_t lost = mantissa & ((1u << shift) - 1u);
    const std::uint32_t tie = 1u << (shift - 1u);
    half = kept + ((lost > tie || (lost == tie && (kept & 1u) != 0)) ? 1u : 0u);
  }
  return static_cast<std::uint16_t>(sign | half);
}

std::int8_t float_to_snorm8(float value) {
  const double wanted = clamped(value, -1.0, 1.0);
  // Without branches, which normals in no order would mispredict.
  const double steps = (wanted - 0.5 / 255.0) / kSnorm8Step;
  auto below = static_cast<int>(steps);
  below -= static_cast<int>(steps < below);
  below = below < -128 ? -128 : (below > 127 ? 127 : below);
  // The mean of both decodings bends at -127, so the neighbour above decides by distance.
  const auto at = static_cast<std::size_t>(below + 128);
  const bool above = std::fabs(kSnorm.mean[at + 1] - wanted) < std::fabs(kSnorm.mean[at] - wanted);
  return static_cast<std::int8_t>(below + static_cast<int>(above));
}

std::array<std::int8_t, 2> normal_to_oct8(const std::array<double, 3>& normal) {
  const double sum = std::fabs(normal[0]) + std::fabs(normal[1]) + std::fabs(normal[2]);
  if (!(sum > 0) || !std::isfinite(sum)) return {0, 0};
  double x = normal[0] / sum;
  double y = normal[1] / sum;
  if (normal[2] < 0) {
    const double unfolded = x;
    x = (1.0 - std::fabs(y)) * (x < 0 ? -1.0 : 1.0);
    y = (1.0 - std::fabs(unfolded)) * (y < 0 ? -1.0 : 1.0);
  }
  const auto below = [](double wanted) {
    const int c = static_cast<int>(std::floor((wanted - 0.5 / 255.0) / kSnorm8Step));
    return c < -128 ? -128 : (c > 126 ? 126 : c);
  };
  const int x0 = below(x);
  const int y0 = below(y);
  int best_x = x0;
  int best_y = y0;
  double best = -2.0;
  for (int k = 0; k < 4; ++k) {
    const int cx = x0 + (k & 1);
    const int cy = y0 + (k >> 1);
    const auto ix = static_cast<std::size_t>(cx + 128);
    const auto iy = static_cast<std::size_t>(cy + 128);
    const double es2 = oct_cosine_square(kSnorm.es2[ix], kSnorm.es2[iy], normal);
    if (es2 <= best) continue;
    const double es3 = oct_cosine_square(kSnorm.es3[ix], kSnorm.es3[iy], normal);
    const double worse = es2 < es3 ? es2 : es3;
    if (worse > best) {
      best = worse;
      best_x = cx;
      best_y = cy;
    }
  }
  return {static_cast<std::int8_t>(best_x), static_cast<std::int8_t>(best_y)};
}

std::uint16_t float_to_unorm16(float value) {
  return static_cast<std::uint16_t>(std::floor(clamped(value, 0.0, 1.0) * 65535.0 + 0.5));
}

std::uint8_t float_to_unorm8(float value) {
  return static_cast<std::uint8_t>(std::floor(clamped(value, 0.0, 1.0) * 255.0 + 0.5));
}

}  // namespace modar
