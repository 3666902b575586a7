// What of a bundle plays, points and acts, as a section of the page.
#pragma once

#include <string>

#include "formats/bundle_view.hpp"

namespace modar {

/// HTML: its nodes with their words, its videos and sounds with captions, its actions; empty if
/// none.
std::string acting_section(const BundleView& bundle);

}  // namespace modar
