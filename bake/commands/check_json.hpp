// The documents of `modar check`. Their keys are a contract (json.md).
#pragma once

#include <string>

#include "bake/check/mutate.hpp"

namespace modar {

/// `modar check --mutate N --json`.
std::string mutation_json(const MutationReport& report);

}  // namespace modar
