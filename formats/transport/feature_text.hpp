// The YML text of a pattern's features, made from the mapped ones, so that it need not be
// downloaded.
#pragma once

#include <string>

#include "formats/bundle_view.hpp"

namespace modar {

/// OpenCV FileStorage YML with the nodes "keypoints" (a vector of KeyPoint) and "descriptors" (a
/// matrix, in OpenCV's base64 form). Keypoints have the fewest digits that read back bit for bit.
std::string feature_text(const FeatureView& features);

}  // namespace modar
