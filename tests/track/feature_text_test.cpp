// Our text of features is one that OpenCV's FileStorage reads back bit for bit.
#include "formats/transport/feature_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <random>

#include "modar/features.hpp"

namespace modar {
namespace {

/// The text, after OpenCV itself has read it.
std::string read_text(const Features& features) {
  const std::string text = features_to_yml(features);
  const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  storage["keypoints"] >> keypoints;
  storage["descriptors"] >> descriptors;
  EXPECT_EQ(keypoints.size(), features.keypoints.size());
  EXPECT_EQ(descriptors.size(), cv::Size(static_cast<int>(features.descriptor_bytes),
                                         static_cast<int>(features.keypoints.size())));
  if (keypoints.size() != features.keypoints.size()) return text;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::KeyPoint& point = keypoints[i];
    const KeypointRecord read{point.pt.x,     point.pt.y,   point.size,    point.angle,
                              point.response, point.octave, point.class_id};
    EXPECT_EQ(std::memcmp(&read, &features.keypoints[i], sizeof read), 0) << i << "\n" << text;
  }
  EXPECT_TRUE(std::equal(features.descriptors.begin(), features.descriptors.end(),
                         reinterpret_cast<const std::byte*>(descriptors.data)));
  return text;
}

/// "descriptors" as OpenCV writes it in base64.
std::string matrix_text(const Features& features) {
  cv::Mat descriptors(static_cast<int>(features.keypoints.size()),
                      static_cast<int>(features.descriptor_bytes), CV_8UC1);
  std::memcpy(descriptors.data, features.descriptors.data(), features.descriptors.size());
  cv::FileStorage storage(".yml", cv::FileStorage::WRITE_BASE64 | cv::FileStorage::MEMORY);
  storage << "descriptors" << descriptors;
  const std::string text = storage.releaseAndGetString();
  return text.substr(text.find("descriptors"));
}

TEST(FeatureText, OpenCvReadsItBack) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> any(-2000, 2000);
  for (const std::size_t count : {1u, 2u, 37u, 400u}) {
    for (const std::uint32_t bytes : {1u, 2u, 24u, 32u, 64u}) {
      Features features;
      features.descriptor_bytes = bytes;
      for (std::size_t i = 0; i < count; ++i) {
        KeypointRecord point{any(random), any(random), 31, any(random), 0, 3, -1};
        if (i % 3 == 0) point.x = std::floor(point.x);
        if (i % 5 == 0) point.response = 1e-12f * any(random);
        if (i % 7 == 0) point.response = 3.5e9f;
        if (i % 11 == 0) point.angle = -0.0f;
        // The shortest decimal that is this number is next to the middle between two others: as a
        // double it is that middle.
        if (i % 13 == 1) point.response = 7.038531e-26f;
        features.keypoints.push_back(point);
        for (std::uint32_t b = 0; b < bytes; ++b)
          features.descriptors.push_back(std::byte(random()));
      }
      const std::string text = read_text(features);
      EXPECT_EQ(text.substr(text.find("descriptors")), matrix_text(features));
    }
  }
}

TEST(FeatureText, NothingFoundIsATextToo) {
  Features features;
  features.descriptor_bytes = 32;
  const auto read = features_from_yml(features_to_yml(features));
  ASSERT_TRUE(read) << to_line(read.error());
  EXPECT_TRUE(read->keypoints.empty());
}

/// 2,000 keypoints of 32 bytes: 690 KB as FileStorage writes them by default.
TEST(FeatureText, TakesAThirdOfFileStoragesUsualText) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(0, 700);
  Features features;
  features.descriptor_bytes = 32;
  features.descriptors.resize(2000 * 32, std::byte{123});
  for (int i = 0; i < 2000; ++i) {
    features.keypoints.push_back(
        {any(random), any(random), 31, any(random), 1e-4f * any(random), 3, -1});
  }
  EXPECT_LT(features_to_yml(features).size(), 240'000u);
}

}  // namespace
}  // namespace modar
