// What has to hold whatever the input: libFuzzer reports where it does not.
#pragma once

#include <cstdlib>

#include "formats/base/error.hpp"

namespace modar::test {

inline void need(bool condition) {
  if (!condition) std::abort();
}

/// An error says what kind it is and what to do.
inline void need_told(const Error& error) {
  need(!error.code.empty() && !error.cause.empty() && !error.cure.empty());
}

}  // namespace modar::test
