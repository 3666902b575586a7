// Decimal numbers of command lines and headers, without the locale and without the tables of the
// standard library's conversions, which weigh more than this player should.
#pragma once

#include <cstdint>
#include <string_view>

namespace modar {

/// "30", "29.97", "0.5": digits with at most one point, at most 15 digits in all, so that the
/// quotient of two exact numbers is the nearest double. False for anything else.
inline bool parse_decimal(std::string_view text, double& value) {
  constexpr int kMostDigits = 15;
  std::int64_t digits = 0;
  double divisor = 1;
  int count = 0;
  bool point = false;
  for (const char letter : text) {
    if (letter == '.' && !point) {
      point = true;
      continue;
    }
    if (letter < '0' || letter > '9' || ++count > kMostDigits) return false;
    digits = digits * 10 + (letter - '0');
    if (point) divisor *= 10;
  }
  if (count == 0) return false;
  value = static_cast<double>(digits) / divisor;
  return true;
}

}  // namespace modar
