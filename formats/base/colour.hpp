// Light and its encodings.
#pragma once

#include <cmath>

namespace modar {

/// IEC 61966-2-1: the light of a value of sRGB, both 0 to 1.
inline double linear_of_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// Its inverse.
inline double srgb_of_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// CIE 1931: how bright linear red, green and blue look together, in units of white.
template <class Number>
constexpr Number luminance(Number red, Number green, Number blue) {
  return static_cast<Number>(0.2126) * red + static_cast<Number>(0.7152) * green +
         static_cast<Number>(0.0722) * blue;
}

}  // namespace modar
