// The part of a bundle that a first visit downloads: its pieces in the order of need, one file.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"

namespace modar {

/// A packed bundle (formats/shipping.md) of forms that pages decode themselves. The same bundle
/// gives the same bytes.
std::vector<std::byte> pack_bundle(const BundleView& bundle);

/// Bytes from the start of a packed bundle up to LoadStage::kRefine: what shows something.
std::size_t shown_bytes(std::span<const std::byte> packed);

}  // namespace modar
