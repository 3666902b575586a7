// The command line of `modar`.
#pragma once

namespace modar {

/// Parses and runs; answers the exit code. --help and --version go to stdout with 0, a wrong
/// command line to stderr with ExitCode::kUsage.
int run_modar(int argc, char** argv);

}  // namespace modar
