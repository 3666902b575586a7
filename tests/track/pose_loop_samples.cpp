#include "tests/track/pose_loop_samples.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "bake/pattern/pattern.hpp"

namespace modar::test {

const cv::Mat& picture() {
  static const cv::Mat kPicture = textured_picture(300, 240, 31);
  return kPicture;
}

std::vector<std::byte> record_of(const cv::Mat& picture) {
  TrackerRecordOptions options;
  options.features = 1200;
  options.trial_views = 40;
  auto baked = make_tracker_record(gray(picture), options);
  EXPECT_TRUE(baked) << to_line(baked.error());
  return *baked;
}

const std::vector<std::byte>& record() {
  static const std::vector<std::byte> kRecord = record_of(picture());
  return kRecord;
}

std::vector<std::byte> bundle_with(const std::vector<std::vector<std::byte>>& records,
                                   std::uint32_t copies) {
  BundleContent content;
  for (std::size_t i = 0; i < records.size(); ++i) {
    PatternRecord pattern{};
    pattern.name = content.intern("p" + std::to_string(i));
    pattern.width = 300;
    pattern.height = 240;
    pattern.half_width = 1.0f;
    pattern.half_height = 0.8f;
    pattern.score = -1;
    pattern.copies = copies;
    content.patterns.push_back(pattern);
    content.features.emplace_back();
    ExtraSection extra;
    extra.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
    extra.owner = static_cast<std::uint32_t>(i);
    extra.bytes = records[i];
    content.extra.push_back(std::move(extra));
  }
  return bundle_bytes(content);
}

double worst_corner(const Detection& detection, const SceneFrame& scene) {
  double worst = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    worst = std::max(worst, glm::length(detection.corners[i] - scene.corners[i]));
  }
  return worst;
}

Pose pose_of(const View& view) {
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    pose.translation[row] = view.translation[row];
    for (int column = 0; column < 3; ++column) {
      pose.rotation[column][row] = view.rotation(row, column);
    }
  }
  return pose;
}

GrayPicture plain(int width, int height, std::uint8_t gray) {
  return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height), gray)};
}

GrayPicture clutter(int width, int height, std::uint32_t seed) {
  const cv::Mat drawn = textured_picture(width, height, seed);
  return {width, height, {drawn.datastart, drawn.dataend}};
}

SceneFrame frame_of(const View& view, const GrayPicture& background, MotionBlur blur) {
  Random random(11);
  const SceneLight light;
  return render_scene(gray(picture()), default_camera(background.width, background.height),
                      pose_of(view), background, SceneBand{}, random, &light, blur);
}

}  // namespace modar::test
