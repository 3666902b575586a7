// Patterns of one bundle that are the same picture, or mirror images of each other.
#pragma once

#include <vector>

#include "bake/report.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// A warning for each pattern that looks like an earlier one, directly or mirrored: a tracker
/// cannot tell them apart. Compares small copies of the pictures; `modar pattern confusion` shows
/// whether editions of one print are distinguished. Of curved patterns and boxes, the pictures as
/// stored.
std::vector<Diagnostic> alike_patterns(const BundleContent& content);

}  // namespace modar
