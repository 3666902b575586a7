// Whether long tests run in full.
#pragma once

#include <cstdlib>
#include <string_view>

namespace modar::testing {

/// True under `scripts/test.sh --all`, which sets MODAR_SOAK=1; the plain run sets it to 0.
inline bool soak() {
  const char* named = std::getenv("MODAR_SOAK");
  return named != nullptr && std::string_view(named) == "1";
}

}  // namespace modar::testing
