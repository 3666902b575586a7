// What main.cpp and turntable.cpp share.
#pragma once

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"
#include "options.hpp"

namespace modar {

/// Draws options.turntable pictures of each model turning, or of the other content of patterns in a
/// bundle without models, and writes them to --out. Errors: "play.no-models"; "io.changed" if the
/// bundle's file was changed meanwhile.
Result<void> play_turntable(const PlayOptions& options, const BundleView& bundle,
                            const MappedFile& file);

/// One line to standard output at once. Errors: kIo "out.write".
Result<void> print_line(const std::string& line);

}  // namespace modar
