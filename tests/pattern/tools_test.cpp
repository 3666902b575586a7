// Scores, trials and simulations of patterns, and the figures that sum them up.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/confusion.hpp"
#include "bake/pattern/loop_bake.hpp"
#include "bake/pattern/pose_subject.hpp"
#include "bake/pattern/score.hpp"
#include "bake/pattern/score_bench.hpp"
#include "bake/pattern/simulate.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

const cv::Mat& picture() {
  static const cv::Mat kPicture = test::textured_picture(220, 180, 31);
  return kPicture;
}

LoopBakeOptions quick_bake() {
  LoopBakeOptions options;
  options.features = 500;
  options.trial_views = 8;
  return options;
}

PatternScore score_of(const cv::Mat& image, unsigned jobs = 1) {
  const auto record = bake_loop_record(test::gray(image), quick_bake());
  EXPECT_TRUE(record) << to_line(record.error());
  if (!record) return {};
  const auto score = score_pattern(test::gray(image), *record, jobs);
  EXPECT_TRUE(score) << to_line(score.error());
  return score.value_or(PatternScore{});
}

/// That of picture() on one thread, made once.
const PatternScore& good_score() {
  static const PatternScore kScore = score_of(picture());
  return kScore;
}

int value_of(const PatternScore& score, const std::string& id) {
  for (const ScoreCause& cause : score.causes) {
    if (cause.id == id) return cause.value;
  }
  ADD_FAILURE() << id;
  return -1;
}

// Baked bytes hang on these, so they are our own; the library's are right to an ulp somewhere.
TEST(Views, TurnAndScaleAsTheLibraryDoes) {
  for (int i = -2000; i <= 2000; ++i) {
    const double angle = 0.0157 * i;
    EXPECT_NEAR(turn_of(angle).cosine, std::cos(angle), 4e-15) << angle;
    EXPECT_NEAR(turn_of(angle).sine, std::sin(angle), 4e-15) << angle;
    const double power = 0.002 * i;
    EXPECT_NEAR(exp_of(power) / std::exp(power), 1, 4e-15) << power;
  }
  const Turn quarter = turn_of(1.57079632679489661923);
  EXPECT_EQ(quarter.sine, 1.0);
  EXPECT_EQ(quarter.cosine, 0.0);
}

TEST(Score, IsTheSameOnAnyNumberOfThreads) {
  const PatternScore& one = good_score();
  const PatternScore three = score_of(picture(), 3);
  EXPECT_EQ(one.score, three.score);
  ASSERT_EQ(one.places.size(), three.places.size());
  EXPECT_GT(one.score, 50);
  for (std::size_t i = 0; i < one.causes.size(); ++i) {
    EXPECT_EQ(one.causes[i].value, three.causes[i].value) << one.causes[i].id;
  }
}

TEST(Score, NamesWhatIsWrongWithAPicture) {
  const PatternScore& good = good_score();
  cv::Mat blurred;
  cv::GaussianBlur(picture(), blurred, cv::Size(0, 0), 3);
  cv::Mat faint;
  picture().convertTo(faint, CV_8U, 0.12, 110);
  cv::Mat corner(180, 220, CV_8UC1, cv::Scalar(200));
  picture()(cv::Rect(0, 0, 70, 60)).copyTo(corner(cv::Rect(10, 10, 70, 60)));
  cv::Mat tiles;
  cv::repeat(picture()(cv::Rect(40, 40, 44, 45)), 4, 5, tiles);
  const cv::Mat strip = picture()(cv::Rect(0, 0, 220, 48)).clone();
  const std::tuple<std::vector<const char*>, cv::Mat> cases[] = {{{"blur"}, blurred},
                                                                 {{"contrast"}, faint},
                                                                 {{"spread", "texture"}, corner},
                                                                 {{"repetition"}, tiles},
                                                                 {{"aspect", "size"}, strip}};
  for (const auto& [ids, image] : cases) {
    const PatternScore bad = score_of(image);
    for (const char* id : ids) {
      EXPECT_LT(bad.score, good.score) << id;
      EXPECT_LT(value_of(bad, id), 60) << id;
      EXPECT_LT(value_of(bad, id), value_of(good, id)) << id;
    }
    for (const ScoreCause& cause : bad.causes) {
      EXPECT_EQ(*cause.advice != 0, cause.value < 60) << ids[0] << " " << cause.id;
    }
  }
}

TEST(Score, APictureWithoutFeaturesHasNoRecordToScore) {
  const cv::Mat blank(120, 120, CV_8UC1, cv::Scalar(128));
  const auto record = bake_loop_record(test::gray(blank), quick_bake());
  ASSERT_FALSE(record);
  EXPECT_EQ(record.error().code, "pattern.no-features");
  EXPECT_FALSE(score_pattern(test::gray(blank), {}, 1));
}

TEST(Score, TheOverlayHasThePicturesSizeAndMarks) {
  const PatternScore& score = good_score();
  const RgbaImage overlay = score_overlay(test::gray(picture()), score);
  ASSERT_EQ(overlay.width, 220u);
  ASSERT_EQ(overlay.height, 180u);
  int coloured = 0;
  for (std::size_t i = 0; i < overlay.pixels.size(); i += 4) {
    coloured += overlay.pixels[i] != overlay.pixels[i + 1] ? 1 : 0;
  }
  EXPECT_GT(coloured, 500);
}

// The example of the encyclopaedia's article on Spearman's coefficient, and shared ranks.
TEST(ScoreBench, RankCorrelation) {
  EXPECT_NEAR(rank_correlation({106, 100, 86, 101, 99, 103, 97, 113, 112, 110},
                               {7, 27, 2, 50, 28, 29, 20, 12, 6, 17}),
              -29.0 / 165.0, 1e-12);
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 2, 3}, {10, 20, 20, 30}), 1.0);
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 3}, {5, 5, 5}), 0.0);
}

TEST(Simulation, TellsItsRangeInAPersonsWords) {
  Simulation simulation;
  simulation.width_mm = 200;
  simulation.range = {0.75, 8.0, 62.0};
  EXPECT_EQ(
      range_sentence(simulation),
      "printed 20 cm wide, this camera recognises it from 15 cm to 1.6 m and up to 62 degrees");
  simulation.width_mm = 0;
  EXPECT_EQ(range_sentence(simulation),
            "this camera recognises it from 0.75 to 8 times its width and up to 62 degrees");
  simulation.range = {};
  EXPECT_EQ(range_sentence(simulation), "this camera does not recognise it at any distance");
}

/// Settings at one distance, in pixels of the pattern's side in the frame.
TrialSetting at_side(double side, double tilt) {
  TrialSetting setting;
  setting.band.area_low = setting.band.area_high = side * side / (220.0 * 180.0);
  setting.band.tilt_low = setting.band.tilt_high = tilt;
  return setting;
}

TEST(Trials, ShowNearViewsRightAndFarOnesMissedThroughABentLens) {
  GrayPicture pattern{220, 180, {picture().datastart, picture().dataend}};
  const auto bundle = bundle_of_pattern(pattern.view(), quick_bake());
  ASSERT_TRUE(bundle) << to_line(bundle.error());
  Random random(3);
  const std::vector<GrayPicture> backgrounds = {made_background(400, 300, random)};
  TrialBed bed;
  bed.picture = pattern.view();
  bed.bundle = *bundle;
  bed.camera = default_camera(400, 300);
  bed.camera.distortion = {-0.25, 0.08, 0, 0, 0};
  bed.backgrounds = backgrounds;
  bed.views = 4;
  const std::vector<TrialSetting> settings = {at_side(150, 10), at_side(12, 10), at_side(150, 86)};
  const auto alone = try_views(bed, settings, {});
  bed.jobs = 3;
  const auto together = try_views(bed, settings, {});
  ASSERT_TRUE(alone && together);
  EXPECT_EQ((*alone)[0].row.frames, 8);
  EXPECT_EQ((*alone)[0].row.right, 8);
  EXPECT_LT((*alone)[0].row.error_px, 0.5);
  EXPECT_TRUE((*alone)[0].sample_right);
  EXPECT_EQ((*alone)[1].row.right, 0);
  EXPECT_EQ((*alone)[2].row.right, 0);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    EXPECT_EQ((*alone)[i].row.error_px, (*together)[i].row.error_px);
    EXPECT_EQ((*alone)[i].sample.pixels, (*together)[i].sample.pixels);
  }
}

TEST(Confusion, CountsWhoIsTakenForWhom) {
  std::vector<NamedPattern> patterns;
  for (const auto& [name, seed] : {std::pair{"a", 31}, {"b", 77}, {"a again", 31}}) {
    const cv::Mat image = test::textured_picture(220, 180, static_cast<std::uint32_t>(seed));
    NamedPattern pattern{name, {220, 180, {image.datastart, image.dataend}}, {}};
    auto bundle = bundle_of_pattern(pattern.picture.view(), quick_bake());
    ASSERT_TRUE(bundle);
    pattern.bundle = std::move(*bundle);
    patterns.push_back(std::move(pattern));
  }
  ConfusionOptions options;
  options.views = 2;
  options.width = 480;
  options.height = 360;
  const auto confusion = measure_confusion(patterns, options, {});
  ASSERT_TRUE(confusion);
  // A pattern and its copy are taken for each other, and for no third.
  EXPECT_EQ(confusion->recognised, (std::vector<int>{2, 0, 2, 0, 2, 0, 2, 0, 2}));
  EXPECT_EQ(confusion->false_recognitions(), 4);
  // Of a pattern and its copy, the first is believed: both views of the copy are false.
  EXPECT_EQ(confusion->together, 2);
}

}  // namespace
}  // namespace modar
