// Whole numbers from JavaScript, which has doubles only.
#pragma once

#include <cstdint>
#include <optional>

namespace modar {

/// JavaScript's Number.MAX_SAFE_INTEGER: above it, doubles skip whole numbers.
inline constexpr double kMostWholeNumber = 9007199254740991.0;

/// The number without its fraction; nothing for NaN, below 0 and above `most`.
inline std::optional<std::uint64_t> whole_number(double number, double most = kMostWholeNumber) {
  if (!(number >= 0 && number <= most)) return std::nullopt;
  return static_cast<std::uint64_t>(number);
}

}  // namespace modar
