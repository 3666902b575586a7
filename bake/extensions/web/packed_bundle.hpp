// The part of a bundle that a first visit downloads: its pieces in the order of need, one file.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"

namespace modar {

/// Bytes of a bundle up to which a page loads all of it; of a larger one it loads, by ranges, the
/// levels that the view needs. MOST_BYTES of modar-view.js.
inline constexpr std::size_t kMostWhole = std::size_t{64} << 20;

/// A packed bundle (formats/shipping.md) of forms that pages decode themselves. The same bundle
/// gives the same bytes. jobs: threads at once.
std::vector<std::byte> pack_bundle(const BundleView& bundle, unsigned jobs);

/// Bytes from the start of a packed bundle up to LoadStage::kRefine: what shows something.
std::size_t shown_bytes(std::span<const std::byte> packed);

}  // namespace modar
