// The commands of `modar-lab`.
#pragma once

#include "bake/commands/command_line.hpp"

namespace modar {

/// Each adds itself to the command line: its options, and what it runs.
void add_bench(CommandLine& program);
void add_mutate(CommandLine& program);

}  // namespace modar
