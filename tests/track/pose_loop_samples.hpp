// What the tests of the pose loop share: pictures, records, bundles and frames.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "bake/pattern/pattern.hpp"
#include "modar/tracker.hpp"
#include "tests/track/synthetic.hpp"

namespace modar::test {

/// Frames of the tests, pixels.
constexpr int kWidth = 640;
constexpr int kHeight = 480;

/// The pattern of most tests, 300x240.
const cv::Mat& picture();
/// A small record of a picture: fewer codes and trials than a bake makes by default.
std::vector<std::byte> record_of(const cv::Mat& picture);
/// That of picture(), made once.
const std::vector<std::byte>& record();
/// A bundle with a pattern of 300x240 for each loop record.
std::vector<std::byte> bundle_with(const std::vector<std::vector<std::byte>>& records,
                                   std::uint32_t copies = 0);

/// Greatest distance of a corner from its true place, pixels.
double worst_corner(const Detection& detection, const SceneFrame& scene);
Pose pose_of(const View& view);

GrayPicture plain(int width, int height, std::uint8_t gray);
GrayPicture clutter(int width, int height, std::uint32_t seed);
/// picture() as a camera of the clutter's size sees it at that view, before the clutter.
SceneFrame frame_of(const View& view, const GrayPicture& background, MotionBlur blur = {});

}  // namespace modar::test
