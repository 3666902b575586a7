// The slow path of the number parser: long mantissas, exponents, nan and inf.
#include "bake/import/obj/number_parser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <fast_float/fast_float.h>

namespace modar::detail {
namespace {

/// Is `word` (lower case) at p, whatever the case there? Returns its length or 0.
std::size_t match_word(const char* p, const char* end, const char* word) {
  std::size_t i = 0;
  for (; word[i] != '\0'; ++i) {
    if (p + i >= end || (p[i] | 0x20) != word[i]) return 0;
  }
  return i;
}

}  // namespace

const char* parse_real_slow(const char* p, const char* end, double& value, NumberKind& kind) {
  const char* const start = p;
  const bool negative = p < end && *p == '-';
  if (p < end && (*p == '-' || *p == '+')) ++p;
  const auto starts_number = [&](const char* q) {
    return q < end && ((*q >= '0' && *q <= '9') || *q == '.');
  };
  if (starts_number(p)) {
    double magnitude = 0;
    auto result = fast_float::from_chars(p, end, magnitude);
    if (result.ptr + 1 < end && *result.ptr == ',' && is_digit(result.ptr[1])) {
      std::string pointed(p,
                          std::min<std::size_t>(static_cast<std::size_t>(end - p), kTextPadding));
      pointed[static_cast<std::size_t>(result.ptr - p)] = '.';
      const auto again =
          fast_float::from_chars(pointed.data(), pointed.data() + pointed.size(), magnitude);
      result.ptr = p + (again.ptr - pointed.data());
      result.ec = again.ec;
    }
    if (result.ec == std::errc() || result.ec == std::errc::result_out_of_range) {
      value = negative ? -magnitude : magnitude;
      kind = std::isfinite(value) ? NumberKind::kFinite : NumberKind::kNotFinite;
      return result.ptr;
    }
  }
  for (const char* word : {"nan", "infinity", "inf"}) {
    if (const std::size_t n = match_word(p, end, word); n != 0) {
      value = std::numeric_limits<double>::quiet_NaN();
      kind = NumberKind::kNotFinite;
      return p + n;
    }
  }
  kind = NumberKind::kNone;
  return start;
}

}  // namespace modar::detail
