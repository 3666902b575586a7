// Our text of features is the one that OpenCV's FileStorage writes.
#include "formats/transport/feature_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "modar/features.hpp"

namespace modar {
namespace {

void expect_same_text(const Features& features) {
  FeatureView view;
  view.keypoints = features.keypoints;
  view.descriptors = features.descriptors;
  view.descriptor_bytes = features.descriptor_bytes;
  const auto expected = features_to_yml(features);
  ASSERT_TRUE(expected);
  EXPECT_EQ(feature_text(view), *expected);
}

TEST(FeatureText, IsOpenCvs) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> any(-2000, 2000);
  for (const std::size_t count : {1u, 2u, 37u, 400u}) {
    for (const std::uint32_t bytes : {1u, 32u, 64u}) {
      Features features;
      features.descriptor_bytes = bytes;
      for (std::size_t i = 0; i < count; ++i) {
        KeypointRecord point{any(random), any(random), 31, any(random), 0, 3, -1};
        if (i % 3 == 0) point.x = std::floor(point.x);
        if (i % 5 == 0) point.response = 1e-12f * any(random);
        if (i % 7 == 0) point.response = 3.5e9f;
        if (i % 11 == 0) point.angle = -0.0f;
        features.keypoints.push_back(point);
        for (std::uint32_t b = 0; b < bytes; ++b)
          features.descriptors.push_back(std::byte(random()));
      }
      expect_same_text(features);
    }
  }
}

}  // namespace
}  // namespace modar
