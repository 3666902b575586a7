// Scores, trials and simulations of patterns, and the figures that sum them up.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/confusion.hpp"
#include "bake/pattern/score.hpp"
#include "bake/pattern/simulate.hpp"
#include "bake/pattern/trial.hpp"
#include "bake/texture/etc1/etc1_kernel.hpp"
#include "modar/pattern_views.hpp"
#include "runtime/record/view_kernel.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

const cv::Mat& picture() {
  static const cv::Mat kPicture = test::textured_picture(220, 180, 31);
  return kPicture;
}

TrackerRecordOptions quick_bake() {
  TrackerRecordOptions options;
  options.features = 500;
  options.trial_views = 8;
  return options;
}

PatternScore score_of(const cv::Mat& image, unsigned jobs = 1) {
  const auto record = make_tracker_record(test::gray(image), quick_bake());
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

/// A view's pixel by floating point: the mean of samples over its footprint, bilinear, the
/// picture's border repeated.
double mean_of_footprint(const cv::Mat& image, const AffineView& view, int x, int y) {
  constexpr int kSide = 24;
  const cv::Matx22d linear(view.linear.data());
  const cv::Matx22d inverse = linear.inv();
  double sum = 0;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const cv::Vec2d place = inverse * cv::Vec2d(x + (u + 0.5) / kSide - 0.5 - view.offset[0],
                                                  y + (v + 0.5) / kSide - 0.5 - view.offset[1]);
      const double px = std::clamp(place[0], 0.0, image.cols - 1.0);
      const double py = std::clamp(place[1], 0.0, image.rows - 1.0);
      const int left = std::min(static_cast<int>(px), image.cols - 2);
      const int top = std::min(static_cast<int>(py), image.rows - 2);
      const auto at = [&](int dx, int dy) { return image.at<std::uint8_t>(top + dy, left + dx); };
      const double fx = px - left;
      const double upper = at(0, 0) + fx * (at(1, 0) - at(0, 0));
      const double lower = at(0, 1) + fx * (at(1, 1) - at(0, 1));
      sum += upper + (py - top) * (lower - upper);
    }
  }
  return sum / (kSide * kSide);
}

/// A view of picture(), tilted twofold along a diagonal, and a background for it.
AffineView tilted_view() {
  return make_view(picture().cols, picture().rows, 0.9, 2.0, turn_of(0.7), turn_of(2.1), 9);
}

TEST(Views, ShowTheMeanOfEachPixelsFootprint) {
  const auto levels = view_levels(test::gray(picture()));
  const AffineView view = tilted_view();
  const GrayPicture rendered = render_view(levels, view, nullptr);
  double sum = 0;
  int pixels = 0;
  for (int y = 0; y < view.height; y += 5) {
    for (int x = 0; x < view.width; x += 5, ++pixels) {
      const auto i = static_cast<std::size_t>(y * view.width + x);
      sum += std::abs(rendered.pixels[i] - mean_of_footprint(picture(), view, x, y));
    }
  }
  EXPECT_LT(sum / pixels, 0.2);  // of 255; other roundings and fewer samples
}

TEST(Views, ABackgroundShowsAroundThePictureAndNowhereElse) {
  const auto levels = view_levels(test::gray(picture()));
  const AffineView view = tilted_view();
  const GrayPicture plain = render_view(levels, view, nullptr);
  GrayPicture behind = plain;
  std::fill(behind.pixels.begin(), behind.pixels.end(), std::uint8_t{7});
  const GrayPicture over = render_view(levels, view, &behind);
  const cv::Matx22d inverse = cv::Matx22d(view.linear.data()).inv();
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const cv::Vec2d at = inverse * cv::Vec2d(x - view.offset[0], y - view.offset[1]);
      // Distance from the border in picture pixels, positive within; a footprint reaches 2 of them.
      const double depth = std::min(std::min(at[0] + 0.5, picture().cols - 0.5 - at[0]),
                                    std::min(at[1] + 0.5, picture().rows - 0.5 - at[1]));
      const auto i = static_cast<std::size_t>(y * view.width + x);
      if (std::abs(depth) < 4) continue;
      ASSERT_EQ(over.pixels[i], depth > 0 ? plain.pixels[i] : 7) << x << " " << y;
    }
  }
}

TEST(Views, AreTheSameAtEverySimdLevel) {
  const auto levels = view_levels(test::gray(picture()));
  const GrayPicture best = render_view(levels, tilted_view(), nullptr);
  const TrackerCode code{1, 2, 255};
  const std::array<TrackerCode, 3> codes{TrackerCode{}, TrackerCode{1, 2, 254},
                                         TrackerCode{1, 3, 255, 7}};
  for (const std::int64_t level : simd_levels()) {
    force_simd_level(level);
    EXPECT_EQ(render_view(levels, tilted_view(), nullptr).pixels, best.pixels)
        << simd_level_name(level);
    std::vector<int> bits(3);
    code_distances(code, codes.data(), nullptr, 3, bits.data());
    EXPECT_EQ(bits, (std::vector{10, 1, 4})) << simd_level_name(level);
    const std::uint32_t which[] = {2, 0};
    code_distances(code, codes.data(), which, 2, bits.data());
    EXPECT_EQ(bits, (std::vector{4, 10, 4})) << simd_level_name(level);
  }
  force_simd_level(0);
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
    if (std::string_view(ids[0]) == "repetition") {
      EXPECT_GE(value_of(bad, "texture"), 60) << "what repeats is detail";
    }
    for (const ScoreCause& cause : bad.causes) {
      // The best grade comes without advice.
      EXPECT_EQ(*cause.advice != 0, bad.grade != 'A' && cause.value < 60)
          << ids[0] << " " << cause.id;
    }
  }
}

TEST(Score, BlackOnWhiteHasContrast) {
  cv::Mat squares(160, 160, CV_8UC1, cv::Scalar(255));
  Random random(5);
  for (int i = 0; i < 25; ++i) {  // within the blocks of 16 pixels that are measured
    if (random.next() % 2 == 0) squares(cv::Rect(i % 5 * 32, i / 5 * 32, 32, 32)) = 0;
  }
  EXPECT_GT(value_of(score_of(squares), "contrast"), 90);
  cv::Mat few(120, 220, CV_8UC1, cv::Scalar(255));
  cv::putText(few, "three words", {20, 60}, cv::FONT_HERSHEY_SIMPLEX, 1, 0, 3);
  EXPECT_GT(value_of(score_of(few), "contrast"), 90);
}

TEST(Score, NamesPrintThatIsTooFine) {
  cv::Mat page(240, 320, CV_8UC1, cv::Scalar(255));
  for (int line = 0; line < 22; ++line) {
    cv::putText(page, "of the same length as words", {6, 14 + 10 * line}, cv::FONT_HERSHEY_PLAIN,
                0.55 + 0.005 * line, 0);
  }
  EXPECT_LT(value_of(score_of(page), "fine"), 60);
  EXPECT_EQ(value_of(good_score(), "fine"), 100);
}

TEST(Score, RisesWithTheGrade) {
  // One number, one grade, from the range alone.
  const std::pair<double, char> limits[] = {{14, 'A'}, {11, 'B'}, {8, 'C'}, {5, 'D'}};
  int last = 100;
  for (const auto& [far, grade] : limits) {
    const ScoreRange range{0.5, far, 70, 1.0};
    EXPECT_EQ(grade_of(range), grade);
    EXPECT_EQ(grade_of({0.5, far - 0.01, 70, 1.0}), grade + 1);
    EXPECT_LT(modar::score_of(range), last);
    last = modar::score_of(range);
  }
  EXPECT_EQ(last, 44);
  EXPECT_EQ(modar::score_of(ScoreRange{}), 0);
}

TEST(Score, SaysWhereAPatternWorksAndHowGoodThatIs) {
  const ScoreRange range{0.65, 6.5, 70.4, 0.9};
  EXPECT_EQ(range_sentence(range, 200),
            "recognised from 13 cm to 1.3 m, to 70 degrees, 90 % right when half covered");
  EXPECT_EQ(
      range_sentence(range, 0),
      "recognised from 0.65 to 6.5 times its width, to 70 degrees, 90 % right when half covered");
  EXPECT_EQ(range_sentence({}, 200), "not recognised at any distance");
  EXPECT_EQ(
      range_sentence({0.65, 6.5, 70.4, 0.9, true}, 66),
      "recognised from 4 cm to 43 cm, over 141 degrees around it, 90 % right when half covered");
  // A farther, steeper or better covered range is never graded worse.
  for (const double far : {1.0, 5.0, 9.0, 14.0, 20.0}) {
    EXPECT_LE(grade_of({0.5, far + 2, 70, 0.5}), grade_of({0.5, far, 70, 0.5}));
    EXPECT_LE(grade_of({0.5, far, 75, 0.5}), grade_of({0.5, far, 60, 0.5}));
    EXPECT_LE(grade_of({0.5, far, 70, 1.0}), grade_of({0.5, far, 70, 0.2}));
  }
  EXPECT_EQ(grade_of({}), 'E');
  const PatternScore& good = good_score();
  EXPECT_GT(good.range.farthest, 5 * good.range.nearest);
  EXPECT_GT(good.range.tilt_deg, 55);
  EXPECT_EQ(value_of(good, "mirror"), 100);
}

TEST(Score, TheBestGradeComesWithoutAdviceToAddDetail) {
  const char* root = std::getenv("MODAR_SOURCE_DIR");
  cv::Mat mural =
      cv::imread(std::string(root == nullptr ? "." : root) + "/assets/patterns/mural.png");
  const int drawn = mural.cols * 35 / 100;
  mural(cv::Rect(drawn, 0, mural.cols - drawn, mural.rows)) = cv::Scalar::all(128);
  const std::string file = testing::TempDir() + "/third.png";
  cv::imwrite(file, mural);
  const auto scored = score_file(file, 0, {}, 2);
  ASSERT_TRUE(scored) << scored.error().cause;
  const PatternScore& score = scored->score;
  ASSERT_EQ(score.grade, 'A');
  ASSERT_LT(value_of(score, "spread"), 60);
  for (const ScoreCause& cause : score.causes) {
    EXPECT_STREQ(cause.advice, "") << cause.id;
  }
}

TEST(Score, APatternBelowTheBestGradeIsAdvised) {
  cv::Mat symmetric = picture().clone();
  cv::Mat left = symmetric(cv::Rect(0, 0, 110, 180));
  cv::Mat right = symmetric(cv::Rect(110, 0, 110, 180));
  cv::flip(left, right, 1);
  const PatternScore score = score_of(symmetric);
  EXPECT_EQ(value_of(score, "mirror"), 0);
  for (const PatternScore& one : {score, good_score()}) {
    const bool advised = std::any_of(one.causes.begin(), one.causes.end(),
                                     [](const ScoreCause& cause) { return *cause.advice != 0; });
    EXPECT_TRUE(advised || one.grade == 'A') << one.grade;
  }
}

TEST(Score, APictureWithoutFeaturesHasNoRecordToScore) {
  const cv::Mat blank(120, 120, CV_8UC1, cv::Scalar(128));
  const auto record = make_tracker_record(test::gray(blank), quick_bake());
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
  simulation.range.tilt_deg = 0;
  EXPECT_EQ(range_sentence(simulation),
            "this camera recognises it from 0.75 to 8 times its width and only without tilt");
  simulation.width_mm = 100;
  simulation.curved = true;
  simulation.range = {1.5, 11.0, 40.0, 70.0};
  EXPECT_EQ(range_sentence(simulation),
            "printed 10 cm wide, this camera recognises it from 15 cm to 1.1 m and over 140 "
            "degrees around it");
  simulation.range = {};
  EXPECT_EQ(range_sentence(simulation), "this camera does not recognise it at any distance");
}

/// A band of values 0, 10, 20... with those shares of right frames, in percent.
SimulatedBand band_of(const char* name, const std::vector<int>& shares) {
  SimulatedBand band{name, "", {}};
  for (const int share : shares) {
    SimulatedValue& value = band.values.emplace_back();
    value.value = 10.0 * static_cast<double>(band.values.size() - 1);
    value.outcome.figures.frames = 100;
    value.outcome.figures.right = share;
  }
  return band;
}

TEST(Simulation, ItsRangeOutlivesADip) {
  const auto tilt = [](const std::vector<int>& shares) {
    return range_of({band_of("tilt", shares)}).tilt_deg;
  };
  EXPECT_EQ(tilt({100, 85, 100, 100, 100, 20, 0}), 40);
  EXPECT_EQ(tilt({85, 100, 100, 100, 100, 20, 0}), 40);
  EXPECT_EQ(tilt({100, 50, 100, 100, 100, 100, 0}), 50);  // 92 % of all
  EXPECT_EQ(tilt({100, 40, 100, 100, 40, 100, 0}), 0);    // too few of any larger range
  EXPECT_EQ(tilt({100, 100, 89, 0, 100}), 10);
  const auto far = range_of({band_of("distance", {0, 80, 100, 100, 85, 100, 95, 60, 100, 0})});
  EXPECT_EQ(far.nearest, 20);
  EXPECT_EQ(far.farthest, 80);  // 91 % of all
  EXPECT_EQ(range_of({band_of("distance", {0, 50, 0})}).farthest, 0);
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
  TrialSetup setup;
  setup.picture = pattern.view();
  setup.bundle = *bundle;
  setup.camera = default_camera(400, 300);
  setup.camera.distortion = {-0.25, 0.08, 0, 0, 0};
  setup.backgrounds = backgrounds;
  setup.views = 4;
  const std::vector<TrialSetting> settings = {at_side(150, 10), at_side(12, 10), at_side(150, 86)};
  const auto alone = try_views(setup, settings, {});
  setup.jobs = 3;
  const auto together = try_views(setup, settings, {});
  ASSERT_TRUE(alone && together);
  EXPECT_EQ((*alone)[0].figures.frames, 8);
  EXPECT_EQ((*alone)[0].figures.right, 8);
  EXPECT_LT((*alone)[0].figures.error_px, 0.5);
  EXPECT_TRUE((*alone)[0].sample_right);
  EXPECT_EQ((*alone)[1].figures.right, 0);
  EXPECT_EQ((*alone)[2].figures.right, 0);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    EXPECT_EQ((*alone)[i].figures.error_px, (*together)[i].figures.error_px);
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
  EXPECT_EQ(confusion->mirrored, (std::vector<int>{0, 0, 0}));
  // Of a pattern and its copy, the first is believed: both views of the copy are false.
  EXPECT_EQ(confusion->together, (std::vector<int>{2, 0, 0, 0, 2, 0, 2, 0, 0}));
  EXPECT_EQ(confusion->false_together(), 2);
  EXPECT_EQ(confusion->alike_pairs(), (std::vector<AlikePair>{{0, 2, false}}));
  Confusion pairs = *confusion;
  pairs.together = {2, 0, 0, 0, 1, 1, 0, 0, 2};  // another pair's mistake is not this one's
  EXPECT_EQ(pairs.alike_pairs(), (std::vector<AlikePair>{{0, 2, true}}));
}

}  // namespace
}  // namespace modar
