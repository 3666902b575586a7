// The YML text of a pattern's features, generated from the mapped ones: byte for byte what OpenCV's
// FileStorage writes for them, so that the text need not be downloaded.
#pragma once

#include <string>

#include "formats/bundle_view.hpp"

namespace modar {

/// OpenCV FileStorage YML with the nodes "keypoints" and "descriptors". Whether a stored text
/// equals it is for the caller to see: other versions of OpenCV may break lines elsewhere.
std::string feature_text(const FeatureView& features);

}  // namespace modar
