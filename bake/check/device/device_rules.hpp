// Rules on what a device can hold, fetch and sample.
#pragma once

#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "modar/device_profile.hpp"

namespace modar {

/// Holds a bundle that check_bundle() found good against a device: texture size, attribute count,
/// uniform vectors, extensions, GPU memory, RAM, storage. (Indices are 16-bit in every bundle.)
/// Each breach names the asset. Answers true if no finding was an error.
bool check_device(const BundleView& bundle, const DeviceProfile& device, const IssueSink& sink);

}  // namespace modar
