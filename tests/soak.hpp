// Whether soak tests run at full length.
#pragma once

#include <cstdlib>
#include <string_view>

namespace modar::testing {

/// True under `scripts/test.sh --soak`, which sets MODAR_SOAK=full; `--all` sets it to 1, the plain
/// run to 0.
inline bool soak() {
  const char* named = std::getenv("MODAR_SOAK");
  return named != nullptr && std::string_view(named) == "full";
}

}  // namespace modar::testing
