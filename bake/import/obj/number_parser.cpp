// The slow path of the number parser: long mantissas, exponents, nan and inf.
#include "bake/import/obj/number_parser.hpp"

#include <cmath>
#include <limits>

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

const char* take_real_slow(const char* p, const char* end, double& value, NumberKind& kind) {
  const char* const start = p;
  const bool negative = p < end && *p == '-';
  if (p < end && (*p == '-' || *p == '+')) ++p;
  const auto starts_number = [&](const char* q) {
    return q < end && ((*q >= '0' && *q <= '9') || *q == '.');
  };
  if (starts_number(p)) {
    double magnitude = 0;
    const auto result = fast_float::from_chars(p, end, magnitude);
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
