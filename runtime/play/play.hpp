// The two things that the player does with a bundle.
#pragma once

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "options.hpp"

namespace modar {

/// Plays the bundle's scenes over the frames of --input or --golden; answers the exit code.
Result<int> play_video(const PlayOptions& options, const BundleView& bundle);

/// Draws options.turntable pictures of each model turning, and writes them to --out.
Result<void> play_turntable(const PlayOptions& options, const BundleView& bundle);

/// One line to standard output at once. Errors: kIo "out.write".
Result<void> print_line(const std::string& line);

}  // namespace modar
