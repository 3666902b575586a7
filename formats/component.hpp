// One number of a vertex, decoded (bundle.md, Decoding). Internal to formats/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "formats/layout.hpp"
#include "formats/quantise.hpp"

namespace modar {

template <class T>
T load_number(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof(T));
  return value;
}

/// A component as OpenGL ES 2.0 hands it to a shader. type: a ComponentType.
inline double component(const std::byte* place, std::uint8_t type, bool normalised) {
  switch (static_cast<ComponentType>(type)) {
    case ComponentType::kHalf:
      return static_cast<double>(half_to_float(load_number<std::uint16_t>(place)));
    case ComponentType::kF32:
      return static_cast<double>(load_number<float>(place));
    case ComponentType::kI16: {
      const double c = load_number<std::int16_t>(place);
      return normalised ? (2.0 * c + 1.0) / 65535.0 : c;
    }
    case ComponentType::kU16: {
      const double c = load_number<std::uint16_t>(place);
      return normalised ? c / 65535.0 : c;
    }
    case ComponentType::kI8: {
      const double c = load_number<std::int8_t>(place);
      return normalised ? (2.0 * c + 1.0) / 255.0 : c;
    }
    case ComponentType::kU8: {
      const double c = load_number<std::uint8_t>(place);
      return normalised ? c / 255.0 : c;
    }
  }
  return 0.0;
}

}  // namespace modar
