// The commands of `modar`. Each adds itself to the command line: its options, and what it runs. It
// prints data to stdout and diagnostics to stderr, and answers the exit code.
#pragma once

#include "bake/commands/command_line.hpp"
#include "bake/pattern/pattern.hpp"

namespace modar {

void add_bake(CommandLine& program);
void add_pattern(CommandLine& program);
void add_check(CommandLine& program);
void add_inspect(CommandLine& program);
void add_ship(CommandLine& program);
void add_calibrate(CommandLine& program);
void add_init(CommandLine& program);
void add_cache(CommandLine& program);
void add_plan(CommandLine& program);
void add_report(CommandLine& program);
void add_adopt(CommandLine& program);
void add_studio(CommandLine& program);
void add_web(CommandLine& program);
void add_document(CommandLine& program);

/// The shape of a pattern's file: as told, else as the bake cuts it out of a photo, which is said.
Result<ShapeRequest> shape_of(const std::string& path, const std::string& told);

}  // namespace modar
