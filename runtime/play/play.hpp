// What main.cpp and turntable.cpp share.
#pragma once

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "options.hpp"

namespace modar {

/// Draws options.turntable pictures of each model turning, and writes them to --out.
Result<void> play_turntable(const PlayOptions& options, const BundleView& bundle);

/// One line to standard output at once. Errors: kIo "out.write".
Result<void> print_line(const std::string& line);

}  // namespace modar
