// Detector and descriptor of a parameter set, kept between frames. Internal to
// runtime/extensions/paper.
#pragma once

#include <opencv2/features2d.hpp>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"

namespace modar::paper {

/// The OpenCV object that detects and describes under `parameters`. May throw what OpenCV throws.
/// Errors: kUnsupported "features.detector".
Result<cv::Ptr<cv::Feature2D>> make_feature_engine(const ParameterSetRecord& parameters);

/// True where an image of that size is too small to hold a single keypoint of that set.
bool too_small_for_features(const ParameterSetRecord& parameters, int width, int height);

}  // namespace modar::paper
