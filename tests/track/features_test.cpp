// Features under the article's parameter sets: their numbers, and their YML against OpenCV's
// reader.
#include "modar/features.hpp"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "synthetic.hpp"

namespace modar {
namespace {

TEST(Features, ParameterSetsAreTablesFourAndFive) {
  const auto sets = paper_parameter_sets();
  ASSERT_EQ(sets.size(), 4u);
  const std::vector<std::string> names = {"orb-2000", "orb-500", "brisk-3", "brisk-2"};
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(sets[i].id, i + 1);
    EXPECT_EQ(parameter_set_name(i + 1), names[i]);
    EXPECT_EQ(sets[i].min_matches, 8u);
    EXPECT_EQ(sets[i].min_inliers, 8u);
    EXPECT_EQ(sets[i].max_distance, i < 2 ? 85u : 170u);
  }
  EXPECT_EQ(sets[0].max_features, 2000u);
  EXPECT_EQ(sets[1].max_features, 500u);
  EXPECT_EQ(sets[0].edge_threshold, 31u);
  EXPECT_EQ(sets[0].fast_threshold, 20u);
  EXPECT_EQ(sets[2].octaves, 3u);
  EXPECT_EQ(sets[3].octaves, 2u);
  EXPECT_EQ(sets[2].agast_threshold, 30u);
  EXPECT_STREQ(parameter_set_name(99), "");
}

// Table 6 has 248 to 781 BRISK and 604 to 1595 ORB-2000 features on patterns of 0.07 to 0.25 MP.
TEST(Features, CountsAreOfTheArticlesOrder) {
  const cv::Mat picture = test::textured_picture(400, 347, 11);
  const auto sets = paper_parameter_sets();
  const auto count = [&](std::size_t set) {
    return describe_image(test::gray(picture), sets[set]).value().keypoints.size();
  };
  EXPECT_GT(count(0), 600u);
  EXPECT_LE(count(0), 2010u);
  EXPECT_GT(count(1), 350u);
  EXPECT_LE(count(1), 510u);
  EXPECT_GT(count(2), 150u);
  EXPECT_LT(count(2), 3000u);
  EXPECT_GE(count(2), count(3));
}

TEST(Features, DescriptorsHaveTheirSetsLengthAndRepeat) {
  const cv::Mat picture = test::textured_picture(320, 240, 3);
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    const auto first = describe_image(test::gray(picture), set);
    const auto second = describe_image(test::gray(picture), set);
    ASSERT_TRUE(first && second);
    EXPECT_EQ(first->descriptor_bytes, set.descriptor_bits / 8);
    EXPECT_EQ(first->descriptors.size(), first->keypoints.size() * first->descriptor_bytes);
    EXPECT_EQ(first->descriptors, second->descriptors);
  }
}

TEST(Features, OpenCvReadsTheYmlAndFindsTheSame) {
  const cv::Mat picture = test::textured_picture(300, 245, 5);
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    const auto features = describe_image(test::gray(picture), set);
    ASSERT_TRUE(features);
    const std::string yml = features_to_yml(*features);
    const cv::FileStorage storage(yml, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    storage["keypoints"] >> keypoints;
    storage["descriptors"] >> descriptors;
    ASSERT_EQ(keypoints.size(), features->keypoints.size());
    ASSERT_EQ(descriptors.total(), features->descriptors.size());
    EXPECT_EQ(std::memcmp(descriptors.data, features->descriptors.data(), descriptors.total()), 0);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const KeypointRecord& ours = features->keypoints[i];
      EXPECT_EQ(keypoints[i].pt, cv::Point2f(ours.x, ours.y));
      EXPECT_EQ(keypoints[i].size, ours.size);
      EXPECT_EQ(keypoints[i].angle, ours.angle);
      EXPECT_EQ(keypoints[i].response, ours.response);
      EXPECT_EQ(keypoints[i].octave, ours.octave);
      EXPECT_EQ(keypoints[i].class_id, ours.class_id);
    }
    const auto back = features_from_yml(yml);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->descriptors, features->descriptors);
    EXPECT_EQ(back->keypoints.size(), features->keypoints.size());
  }
}

TEST(Features, BadYmlIsAnErrorAndNothingElse) {
  const cv::Mat picture = test::textured_picture(160, 160, 5);
  const auto features = describe_image(test::gray(picture), paper_parameter_sets()[1]);
  const std::string good = features_to_yml(features.value());
  const std::vector<std::string> bad = {"",
                                        "hello",
                                        "%YAML:1.0\n---\n",
                                        "%YAML:1.0\n---\nkeypoints: 3\ndescriptors: 4\n",
                                        "{\"keypoints\": []}",
                                        good.substr(0, good.size() / 2),
                                        std::string(100, '\0')};
  for (const std::string& text : bad) {
    const auto answer = features_from_yml(text);
    ASSERT_FALSE(answer) << text.substr(0, 40);
    EXPECT_EQ(answer.error().code, "features.yml");
  }
}

TEST(Features, PicturesOfAnySizeAreTaken) {
  const std::vector<cv::Size> sizes = {{1, 1},   {3, 200}, {200, 3}, {17, 17},
                                       {62, 62}, {63, 63}, {64, 80}};
  for (const cv::Size& size : sizes) {
    const cv::Mat picture = test::textured_picture(size.width, size.height, 1);
    for (const ParameterSetRecord& set : paper_parameter_sets()) {
      const auto features = describe_image(test::gray(picture), set);
      EXPECT_TRUE(features) << size << " " << to_line(features.error());
    }
  }
}

TEST(Features, UnknownDetectorsAndWildParametersAreRefused) {
  const cv::Mat picture = test::textured_picture(100, 100, 1);
  ParameterSetRecord unknown = paper_parameter_sets()[0];
  unknown.detector = 77;
  ParameterSetRecord endless = paper_parameter_sets()[0];
  endless.level_count = 4000000000u;
  ParameterSetRecord shrinking = paper_parameter_sets()[0];
  shrinking.scale_factor = 0.5f;
  for (const ParameterSetRecord& set : {unknown, endless, shrinking}) {
    const auto features = describe_image(test::gray(picture), set);
    ASSERT_FALSE(features);
    EXPECT_EQ(features.error().code, "features.detector");
  }
}

}  // namespace
}  // namespace modar
