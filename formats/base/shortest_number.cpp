// printf rounds correctly and strtod reads correctly in every C library that we build for:
// otherwise one digit more is tried until the number reads back.
#include "formats/base/shortest_number.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace modar {
namespace {

bool is_digit(char letter) {
  return letter >= '0' && letter <= '9';
}

float read_number(const char* text, float) {
  return std::strtof(text, nullptr);
}
double read_number(const char* text, double) {
  return std::strtod(text, nullptr);
}

/// A positive number as 0.DIGITS times 10 to the power of `point`.
struct Decimal {
  std::string digits;
  int point = 0;
};

Decimal rounded(double value, int digits) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*e", digits - 1, value);
  const std::string_view all(text.data());
  const std::size_t exponent = all.find('e');
  Decimal decimal;
  // Any other character is the locale's decimal point.
  for (const char letter : all.substr(0, exponent)) {
    if (is_digit(letter)) decimal.digits += letter;
  }
  decimal.point = std::atoi(text.data() + exponent + 1) + 1;
  return decimal;
}

template <class T>
bool reads_back(const Decimal& decimal, T value) {
  const auto count = static_cast<int>(decimal.digits.size());
  const std::string text = decimal.digits + "e" + std::to_string(decimal.point - count);
  return read_number(text.c_str(), value) == value;
}

template <class T>
Decimal fewest_digits(T value) {
  constexpr int kExact = 17;  // digits tell any double apart
  // Below a power of two numbers are twice as dense: the decimal above may be further off, and
  // read back all the same.
  int exponent = 0;
  const bool power_of_two = std::frexp(value, &exponent) == T(0.5);
  for (int digits = 1;; ++digits) {
    Decimal decimal = rounded(static_cast<double>(value), digits);
    if (digits == kExact || reads_back(decimal, value)) return decimal;
    if (!power_of_two || decimal.digits.back() == '9') continue;
    ++decimal.digits.back();
    if (reads_back(decimal, value)) return decimal;
  }
}

std::string scientific(const Decimal& decimal) {
  std::string text = decimal.digits.substr(0, 1);
  if (decimal.digits.size() > 1) text += "." + decimal.digits.substr(1);
  const int exponent = decimal.point - 1;
  std::array<char, 16> tail{};
  std::snprintf(tail.data(), tail.size(), "e%c%02d", exponent < 0 ? '-' : '+', std::abs(exponent));
  return text + tail.data();
}

std::string fixed(const Decimal& decimal, double value) {
  const auto count = static_cast<int>(decimal.digits.size());
  if (decimal.point <= 0) {
    return "0." + std::string(static_cast<std::size_t>(-decimal.point), '0') + decimal.digits;
  }
  if (decimal.point >= count) {
    std::array<char, 320> whole{};  // the largest double has 309 digits
    std::snprintf(whole.data(), whole.size(), "%.0f", value);
    return whole.data();
  }
  const auto point = static_cast<std::size_t>(decimal.point);
  return decimal.digits.substr(0, point) + "." + decimal.digits.substr(point);
}

template <class T>
std::string shortest(T value) {
  const std::string sign = std::signbit(value) ? "-" : "";
  if (value == 0) return sign + "0";
  const T size = std::abs(value);
  const Decimal decimal = fewest_digits(size);
  std::string with_exponent = scientific(decimal);
  std::string without = fixed(decimal, static_cast<double>(size));
  return sign + (without.size() <= with_exponent.size() ? without : with_exponent);
}

}  // namespace

std::string shortest_text(float value) {
  return shortest(value);
}

std::string shortest_text(double value) {
  return shortest(value);
}

}  // namespace modar
