// What a first visit brings of a bundle: its pieces in the order of need, one file.
#pragma once

#include <cstddef>
#include <vector>

#include "formats/bundle_view.hpp"

namespace modar {

/// A packed bundle (formats/shipping.md) of forms that pages decode themselves. The same bundle
/// gives the same bytes.
std::vector<std::byte> pack_bundle(const BundleView& bundle);

}  // namespace modar
