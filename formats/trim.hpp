// A bundle without what only the ModAR paper's method reads: what travels to pages and apps.
#pragma once

#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// A copy of all that players read: feature twins and feature texts (OpenCV YML), with the
/// parameter sets that they name, are left out where a pattern has a tracker record, and the
/// content summary is made anew. bundle: opened, so that its records are known to be in range.
BundleContent trim(const BundleView& bundle);

}  // namespace modar
