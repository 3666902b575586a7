// Whether soak tests run at full length.
#pragma once

#include <cstdlib>
#include <string_view>

namespace modar::testing {

/// True under `scripts/test.sh --soak`, which sets MODAR_SOAK=full; without options
/// it is 1, with `--quick` 0.
inline bool soak() {
  const char* named = std::getenv("MODAR_SOAK");
  return named != nullptr && std::string_view(named) == "full";
}

}  // namespace modar::testing
