// Patterns of one bundle that are the same picture, or mirror images of each other.
#pragma once

#include <vector>

#include "bake/report.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// A warning for each pattern that looks like an earlier one, as it is or mirrored: a tracker
/// cannot tell them apart. Compares small copies of the pictures; whether editions of one print are
/// told apart is what `modar pattern confusion` finds out. Of curved patterns and boxes, the
/// pictures as they are stored.
std::vector<Diagnostic> alike_patterns(const BundleContent& content);

}  // namespace modar
