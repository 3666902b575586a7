// Corners found in photos that OpenCV renders: where they are is known exactly.
#include "bake/pattern/find_corners.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace modar {
namespace {

cv::Mat asset(const std::string& name) {
  const char* root = std::getenv("MODAR_SOURCE_DIR");
  return cv::imread(std::string(root == nullptr ? "." : root) + "/assets/patterns/" + name);
}

RgbaImage as_photo(const cv::Mat& bgr) {
  cv::Mat rgba;
  cv::cvtColor(bgr, rgba, cv::COLOR_BGR2RGBA);
  RgbaImage photo{static_cast<std::uint32_t>(rgba.cols), static_cast<std::uint32_t>(rgba.rows), {}};
  photo.pixels.assign(rgba.data, rgba.data + rgba.total() * 4);
  return photo;
}

using Corners = std::array<cv::Point2f, 4>;

/// The pattern at those corners before a background, twice as large and then shrunk, with noise.
cv::Mat photograph(const cv::Mat& pattern, const cv::Mat& background, const Corners& corners) {
  cv::Mat large;
  cv::resize(background, large, cv::Size(1920, 1440), 0, 0, cv::INTER_CUBIC);
  const auto right = static_cast<float>(pattern.cols) - 0.5f;
  const auto bottom = static_cast<float>(pattern.rows) - 0.5f;
  const Corners from = {{{-0.5f, -0.5f}, {right, -0.5f}, {right, bottom}, {-0.5f, bottom}}};
  Corners to = corners;
  for (cv::Point2f& corner : to)
    corner = 2 * (corner + cv::Point2f(0.5f, 0.5f)) - cv::Point2f(0.5f, 0.5f);
  cv::warpPerspective(pattern, large, cv::getPerspectiveTransform(from.data(), to.data()),
                      large.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  cv::Mat photo;
  cv::resize(large, photo, cv::Size(960, 720), 0, 0, cv::INTER_AREA);
  cv::Mat noise(photo.size(), CV_16SC3);
  cv::theRNG().state = 7;
  cv::randn(noise, 0, 3);
  cv::add(photo, noise, photo, cv::noArray(), CV_8UC3);
  return photo;
}

/// A table's colour that fades, or a blurred picture behind.
cv::Mat backdrop(const std::string& picture) {
  cv::Mat table(720, 960, CV_8UC3);
  for (int y = 0; y < table.rows; ++y) {
    for (int x = 0; x < table.cols; ++x) {
      table.at<cv::Vec3b>(y, x) = cv::Vec3b(static_cast<std::uint8_t>(96 + x / 16),
                                            static_cast<std::uint8_t>(120 + y / 24), 150);
    }
  }
  if (picture.empty()) return table;
  cv::resize(asset(picture), table, table.size());
  cv::GaussianBlur(table, table, cv::Size(), 9);
  return table;
}

TEST(FindCorners, WithinOnePercentOfTheWidth) {
  struct Case {
    const char* pattern;
    const char* background;
    Corners corners;
  };
  const std::vector<Case> cases = {
      {"mural.png", "", {{{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}}},
      {"game.png", "", {{{180.5f, 250.2f}, {560.6f, 90.7f}, {790.3f, 470.4f}, {380.8f, 640.2f}}}}};
  for (const Case& each : cases) {
    const cv::Mat photo = photograph(asset(each.pattern), backdrop(each.background), each.corners);
    const auto found = find_corners(as_photo(photo));
    ASSERT_TRUE(found) << each.pattern << ": " << found.error().cause;
    const double width = cv::norm(each.corners[1] - each.corners[0]);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(found->corners[i].x, static_cast<double>(each.corners[i].x), 0.01 * width)
          << each.pattern << " corner " << i;
      EXPECT_NEAR(found->corners[i].y, static_cast<double>(each.corners[i].y), 0.01 * width)
          << each.pattern << " corner " << i;
    }
  }
}

/// Darkens a table next to the objects, as a soft shadow does.
cv::Mat shaded(const cv::Mat& table, const Corners& corners) {
  cv::Mat light(table.size(), CV_32F, cv::Scalar(1));
  std::vector<cv::Point> outline;
  for (const cv::Point2f& corner : corners) outline.emplace_back(corner + cv::Point2f(8, 8));
  cv::fillConvexPoly(light, outline, cv::Scalar(0.5), cv::LINE_AA);
  cv::GaussianBlur(light, light, cv::Size(), 8);
  cv::Mat out;
  cv::cvtColor(light, light, cv::COLOR_GRAY2BGR);
  table.convertTo(out, CV_32FC3);
  cv::multiply(out, light, out);
  out.convertTo(out, CV_8UC3);
  return out;
}

TEST(FindCorners, AShadowIsNoPartOfTheThing) {
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  const auto found = find_corners(
      as_photo(photograph(asset("mural.png"), shaded(backdrop(""), corners), corners)));
  ASSERT_TRUE(found) << found.error().cause;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(found->corners[i].x, static_cast<double>(corners[i].x), 2) << i;
    EXPECT_NEAR(found->corners[i].y, static_cast<double>(corners[i].y), 2) << i;
  }
}

TEST(FindCorners, OfALargePhotoAreInItsPixels) {
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  constexpr double kTimes = 5;  // 17 megapixels: more than corners are measured at
  cv::Mat large;
  cv::resize(photograph(asset("mural.png"), backdrop(""), corners), large, cv::Size(), kTimes,
             kTimes, cv::INTER_CUBIC);
  const auto found = find_corners(as_photo(large));
  ASSERT_TRUE(found) << found.error().cause;
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(found->corners[i].x, kTimes * (static_cast<double>(corners[i].x) + 0.5) - 0.5,
                2 * kTimes)
        << i;
    EXPECT_NEAR(found->corners[i].y, kTimes * (static_cast<double>(corners[i].y) + 0.5) - 0.5,
                2 * kTimes)
        << i;
  }
}

TEST(FindCorners, APhotoThatIsThePictureAlreadyIsDoubted) {
  cv::Mat scan = asset("mural.png");
  cv::resize(scan, scan, cv::Size(900, 700));
  cv::copyMakeBorder(scan, scan, 20, 20, 20, 20, cv::BORDER_CONSTANT, cv::Scalar(235, 238, 240));
  const auto found = find_corners(as_photo(scan));
  ASSERT_TRUE(found) << found.error().cause;
  EXPECT_TRUE(found->fills);
}

TEST(FindCorners, APartOfALongerThingIsDoubted) {
  cv::Mat mural = asset("mural.png");
  const cv::Mat board(mural.size(), CV_8UC3, cv::Scalar(20, 22, 24));
  cv::hconcat(mural, board, mural);
  const auto found = find_corners(as_photo(photograph(  // the board leaves the photo
      mural, backdrop(""), {{{150, 150}, {1250, 120}, {1260, 560}, {140, 530}}})));
  ASSERT_TRUE(found) << found.error().cause;
  EXPECT_NEAR(found->corners[0].x, 150, 5);
  EXPECT_LT(found->corners[1].x, 800);
  EXPECT_TRUE(found->framed);
}

/// Boards of wood: streaks along them, and gaps between.
cv::Mat wood() {
  cv::Mat streaks(720, 960, CV_32F);
  cv::theRNG().state = 11;
  cv::randn(streaks, 0, 1);
  cv::GaussianBlur(streaks, streaks, cv::Size(), 60, 1.5);
  cv::normalize(streaks, streaks, 0.6, 1.3, cv::NORM_MINMAX);
  cv::Mat table;
  cv::cvtColor(streaks, table, cv::COLOR_GRAY2BGR);
  cv::multiply(table, cv::Scalar(60, 95, 140), table);
  table.convertTo(table, CV_8UC3);
  for (int y = 90; y < table.rows; y += 210) {
    cv::line(table, cv::Point(0, y), cv::Point(table.cols, y), cv::Scalar(25, 40, 60), 2);
  }
  return table;
}

/// As printed: 0 to its edges, 1 with a white margin, 2 with a frame near its edges.
cv::Mat printed(cv::Mat pattern, int how) {
  if (how == 1) {
    cv::copyMakeBorder(pattern, pattern, 40, 40, 40, 40, cv::BORDER_CONSTANT,
                       cv::Scalar(240, 244, 246));
  }
  const cv::Rect frame(22, 22, pattern.cols - 44, pattern.rows - 44);
  if (how == 2) cv::rectangle(pattern, frame, cv::Scalar(30, 160, 60), 5);
  return pattern;
}

double apart(const std::array<PixelPoint, 4>& found, const Corners& corners) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    most = std::max(most, std::hypot(found[i].x - static_cast<double>(corners[i].x),
                                     found[i].y - static_cast<double>(corners[i].y)));
  }
  return most;
}

TEST(FindPicture, WrongCornersAreWarnedOfAndRightOnesAreNot) {
  const std::vector<Corners> views = {
      {{{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}},
      {{{330.5f, 200.2f}, {640.6f, 230.7f}, {600.3f, 610.4f}, {280.8f, 560.2f}}}};
  int photos = 0;
  int seen = 0;
  int right = 0;
  int alarms = 0;
  for (const char* pattern : {"mural.png", "game.png", "cover.png", "painting.png"}) {
    for (const int how : {0, 1, 2}) {
      for (const int ground : {0, 1, 2}) {
        const Corners& corners = views[static_cast<std::size_t>(photos) % views.size()];
        cv::Mat table = ground == 0 ? backdrop("") : ground == 1 ? wood() : backdrop("survey.png");
        if (photos % 2 == 0) table = shaded(table, corners);
        ++photos;
        seen += ground < 2 ? 1 : 0;  // a busy background hides edges, and is warned of
        const cv::Mat bgr = photograph(printed(asset(pattern), how), table, corners);
        const Photo photo{as_photo(bgr)};
        const FoundPicture found = find_picture(photo, find_corners(photo.image));
        const bool good = found.corners && apart(*found.corners, corners) < 5;
        const bool warned = *found.doubt != 0;
        right += good ? 1 : 0;
        alarms += good && warned ? 1 : 0;
        EXPECT_TRUE(good || warned) << pattern << " printed " << how << " on " << ground;
      }
    }
  }
  EXPECT_GE(right, seen * 2 / 3);
  EXPECT_LE(alarms, photos / 10);
}

struct Verdict {
  bool good = false;     ///< of find_picture()
  bool doubted = false;  ///< the same
  bool silent = false;   ///< wrong without a doubt, here or in find_corners()
};

Verdict verdict(const cv::Mat& bgr, const Corners& corners) {
  const Photo photo{as_photo(bgr)};
  const auto found = find_corners(photo.image);
  const FoundPicture picture = find_picture(photo, found);
  Verdict out;
  out.good = picture.corners && apart(*picture.corners, corners) < 5;
  out.doubted = *picture.doubt != 0;
  const bool wrong = found && apart(found->corners, corners) >= 5;
  out.silent = (!out.good && !out.doubted) || (wrong && *found->doubt() == 0);
  return out;
}

TEST(FindPicture, ATableIsNotTakenForThePrintOnIt) {
  const Corners edges = {{{180, 90}, {800, 130}, {850, 640}, {90, 600}}};
  const Corners corners = {
      {{300.3f, 210.6f}, {520.2f, 200.4f}, {540.8f, 430.1f}, {280.7f, 440.9f}}};
  const cv::Mat room(720, 960, CV_8UC3, cv::Scalar(120, 150, 140));
  int doubted = 0;
  for (const char* pattern : {"mural.png", "game.png"}) {
    for (const int how : {0, 1}) {
      for (const double bright : {0.3, 1.6}) {
        const cv::Mat table =
            photograph(wood()(cv::Rect(100, 100, 640, 180)) * bright, room, edges);
        const Verdict one = verdict(
            photograph(printed(asset(pattern), how), shaded(table, corners), corners), corners);
        EXPECT_FALSE(one.silent) << pattern << " printed " << how << " on " << bright;
        doubted += one.doubted ? 1 : 0;
      }
    }
  }
  EXPECT_GE(doubted, 4) << "the table has the better edges";
}

/// A picture at one side, and text in a frame at the other.
cv::Mat postcard() {
  cv::Mat sheet(600, 900, CV_8UC3, cv::Scalar(225, 238, 242));
  cv::Mat mural = asset("mural.png");
  cv::resize(mural, mural, cv::Size(370, 460));
  mural.copyTo(sheet(cv::Rect(50, 70, 370, 460)));
  cv::rectangle(sheet, {475, 70, 380, 460}, cv::Scalar(40, 30, 160), 6);
  for (int line = 0; line < 7; ++line) {
    cv::putText(sheet, "Dear Jo, it rained", {500, 200 + 46 * line}, cv::FONT_HERSHEY_SIMPLEX, 1,
                cv::Scalar(90, 40, 30), 2);
  }
  return sheet;
}

TEST(FindPicture, PicturesPrintedOnASheetAreNoObjectsOnIt) {
  const std::vector<Corners> views = {
      {{{200.3f, 170.6f}, {730.2f, 110.4f}, {790.8f, 560.1f}, {170.7f, 520.9f}}},
      {{{380.5f, 90.2f}, {790.6f, 330.7f}, {560.3f, 640.4f}, {140.8f, 350.2f}}}};
  for (const Corners& corners : views) {
    const double light = &corners == views.data() ? 1 : 0.6;
    const cv::Mat table = shaded(wood(), corners);
    const Verdict one = verdict(photograph(postcard(), table, corners) * light, corners);
    EXPECT_TRUE(one.good) << light;
    EXPECT_FALSE(one.doubted) << light;
  }
  // The same as an object on a mat whose edges are in the photo, and along them.
  const Corners mat = {{{130, 90}, {830, 80}, {860, 650}, {90, 640}}};
  cv::Mat card = postcard();
  cv::copyMakeBorder(card, card, 260, 420, 330, 430, cv::BORDER_CONSTANT,
                     cv::Scalar(120, 160, 130));
  const Photo photo{as_photo(photograph(card, wood(), mat))};
  EXPECT_STREQ(find_picture(photo, find_corners(photo.image)).doubt, "rivalled");
}

TEST(FindPicture, TheInsideOfABlackBorderIsDoubted) {
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  int alarms = 0;
  for (const char* name : {"painting.png", "cover.png"}) {
    for (const double width : {0.06, 0.15}) {
      for (const int ground : {40, 140}) {
        cv::Mat pattern = asset(name);
        const int border = cvRound(width * std::min(pattern.cols, pattern.rows));
        cv::copyMakeBorder(pattern, pattern, border, border, border, border, cv::BORDER_CONSTANT,
                           cv::Scalar(14, 14, 14));
        const cv::Mat table(720, 960, CV_8UC3, cv::Scalar(ground - 4, ground, ground + 6));
        const Verdict one = verdict(photograph(pattern, table, corners), corners);
        EXPECT_FALSE(one.silent) << name << " " << width << " on " << ground;
        alarms += one.good && one.doubted ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(alarms, 0);
}

TEST(FindPicture, ABlackBorderThatIsSeenAtOneSideOnlyIsDoubted) {
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  cv::Mat table(720, 960, CV_8UC3, cv::Scalar(12, 12, 13));
  table.rowRange(430, 720) = cv::Scalar(20, 30, 60);
  for (const char* name : {"painting.png", "cover.png"}) {
    cv::Mat pattern = asset(name);
    const int border = cvRound(0.06 * std::min(pattern.cols, pattern.rows));
    cv::copyMakeBorder(pattern, pattern, border, border, border, border, cv::BORDER_CONSTANT,
                       cv::Scalar(14, 14, 14));
    EXPECT_FALSE(verdict(photograph(pattern, table, corners), corners).silent) << name;
  }
}

TEST(FindPicture, LinesOfATableThatContinueAPrintAreNoSheet) {
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  // With three sides of the print, the edge of a board next to it makes a figure around the print.
  cv::Mat table = backdrop("survey.png") * 0.4;
  cv::line(table, {850, 60}, {905, 640}, cv::Scalar(200, 210, 220), 9, cv::LINE_AA);
  for (const char* pattern : {"mural.png", "game.png"}) {
    for (const int how : {0, 1}) {
      const Verdict one =
          verdict(photograph(printed(asset(pattern), how), table, corners), corners);
      EXPECT_TRUE(one.good) << pattern << " printed " << how;
      EXPECT_FALSE(one.doubted) << pattern << " printed " << how;
    }
  }
}

TEST(FindPicture, ABorderWhoseEdgeAShadowHidesIsDoubted) {
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  for (const int ground : {50, 64}) {
    cv::Mat pattern = asset("painting.png");
    const int border = pattern.cols / 6;
    cv::copyMakeBorder(pattern, pattern, border, border, border, border, cv::BORDER_CONSTANT,
                       cv::Scalar(34, 34, 34));
    const cv::Mat table(720, 960, CV_8UC3, cv::Scalar(ground, ground, ground + 2));
    EXPECT_FALSE(verdict(photograph(pattern, shaded(table, corners), corners), corners).silent)
        << ground;
  }
}

TEST(FindPicture, AFileThatIsThePictureStaysWhole) {
  for (const char* name :
       {"cover.png", "game.png", "mural.png", "painting.png", "poems.png", "survey.png"}) {
    const Photo photo{as_photo(asset(name))};
    const FoundPicture found = find_picture(photo, find_corners(photo.image));
    EXPECT_FALSE(found.corners) << name;
    EXPECT_STREQ(found.doubt, "") << name;
  }
}

TEST(FindPicture, ASmallFigureIsAPartOfThePicture) {
  Photo photo;
  photo.image = {1000, 1000, {}};
  for (const double side : {282.0, 284.0}) {  // 7.95 and 8.07 % of the photo
    FoundCorners found;
    found.corners = {{{300, 300}, {300 + side, 300}, {300 + side, 300 + side}, {300, 300 + side}}};
    found.sharpness = found.divided = 1;
    EXPECT_EQ(find_picture(photo, found).corners.has_value(), side > 283) << side;
  }
}

TEST(FindPicture, AFigureThatIsTooUnsureToCutOutIsWarnedOf) {
  Photo photo;
  photo.image = {1000, 1000, {}};
  FoundCorners found;
  found.sharpness = 0.85;
  found.corners = {{{300, 300}, {700, 300}, {700, 700}, {300, 700}}};
  EXPECT_STREQ(find_picture(photo, found).doubt, "") << "parallel to the photo's: a layout";
  for (const double tilt : {6.0, 40.0}) {
    found.corners = {{{300 + tilt, 300}, {700, 300 + tilt}, {700 - tilt, 700}, {300, 700 - tilt}}};
    const FoundPicture picture = find_picture(photo, found);
    EXPECT_FALSE(picture.corners) << tilt;
    EXPECT_STREQ(picture.doubt, "part") << tilt;
  }
  found.corners = {{{306, 300}, {580, 306}, {574, 580}, {300, 574}}};
  EXPECT_STREQ(find_picture(photo, found).doubt, "") << "7.5 % of the photo";
}

TEST(FindPicture, ABorderOfBackgroundIsNotThePicture) {
  Photo photo;
  photo.image = {1200, 900, {}};  // a camera's shape
  FoundCorners found;
  found.fills = true;
  found.corners = {{{6, 20}, {1195, 5}, {1194, 892}, {4, 890}}};
  found.sharpness = kDoubtfulSharpness;
  EXPECT_STREQ(find_picture(photo, found).doubt, "");
  found.sharpness = kDoubtfulSharpness - 0.001;
  EXPECT_STREQ(find_picture(photo, found).doubt, "not-found");
  EXPECT_FALSE(find_picture(photo, found).corners);
}

TEST(FindPicture, ACornerThatIsCutOffIsWarnedOf) {
  FoundCorners found;
  found.sharpness = found.quarter = found.divided = 1;
  found.ends = kLeastEnds - 0.001;
  EXPECT_STREQ(found.doubt(), "blurred");
  found.ends = kLeastEnds;
  EXPECT_STREQ(found.doubt(), "");
  // The outline of a box has six corners where its side is seen.
  const Corners front = {{{201.2f, 249.8f}, {698.5f, 147.5f}, {693.9f, 423.4f}, {300.9f, 512.3f}}};
  for (const float depth : {1.f, 1.3f}) {
    cv::Mat table(720, 960, CV_8UC3, cv::Scalar(120, 130, 120));
    const std::vector<cv::Point> side = {front[0], front[0] + depth * cv::Point2f(14, -28),
                                         front[1] + depth * cv::Point2f(-18, -20), front[1]};
    cv::fillConvexPoly(table, side, cv::Scalar(30, 40, 150), cv::LINE_AA);
    const Verdict one = verdict(photograph(asset("game.png"), table, front), front);
    EXPECT_FALSE(one.silent) << depth;
  }
}

TEST(FindPicture, WhitePaperOnAWhiteWallIsNoPartOfIt) {
  cv::Mat sheet = asset("mural.png");
  cv::copyMakeBorder(sheet, sheet, 60, 60, 60, 60, cv::BORDER_CONSTANT, cv::Scalar(252, 252, 252));
  const Corners corners = {
      {{250.3f, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  for (const int wall : {240, 247, 248}) {
    const cv::Mat plain(720, 960, CV_8UC3, cv::Scalar::all(wall));
    EXPECT_FALSE(verdict(photograph(sheet, plain, corners), corners).silent) << wall;
  }
}

/// A picture on a label that a program laid out, with lines of text below it or without.
Photo label(bool text, double turned) {
  cv::Mat sheet(800, 1200, CV_8UC3, cv::Scalar(245, 245, 240));
  cv::Mat mural = asset("mural.png");
  cv::resize(mural, mural, cv::Size(400, 270));
  mural.copyTo(sheet(cv::Rect(60, 80, 400, 270)));
  for (int line = 0; text && line < 9; ++line) {
    cv::putText(sheet, "Oil on canvas, 1888, given by a friend", {60, 440 + 38 * line},
                cv::FONT_HERSHEY_SIMPLEX, 0.9, cv::Scalar(30, 30, 30), 2);
  }
  const cv::Mat turn = cv::getRotationMatrix2D({600, 400}, turned, 1);
  cv::warpAffine(sheet, sheet, turn, sheet.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return {as_photo(sheet)};
}

TEST(FindPicture, AFigureInALayoutIsAPartOfIt) {
  for (const auto& [text, turned] : {std::pair(true, 0.0), {false, 0.0}, {true, 1.0}}) {
    const Photo photo = label(text, turned);
    const FoundPicture found = find_picture(photo, find_corners(photo.image));
    EXPECT_EQ(found.corners.has_value(), !text || turned != 0) << text << " " << turned;
  }
}

TEST(FindPicture, TwoThingsAreWarnedOf) {
  const Corners left = {{{100.3f, 150.6f}, {420.2f, 120.4f}, {430.8f, 460.1f}, {90.7f, 420.9f}}};
  const Corners right = {{{520.3f, 200.6f}, {830.2f, 220.4f}, {800.8f, 560.1f}, {500.7f, 520.9f}}};
  const Photo photo{as_photo(
      photograph(asset("mural.png"), photograph(asset("game.png"), backdrop(""), left), right))};
  EXPECT_STREQ(find_picture(photo, find_corners(photo.image)).doubt, "rivalled");
}

TEST(FindPicture, APhotoInWhichNothingIsFoundIsWarnedOf) {
  Photo photo{as_photo(backdrop(""))};  // 4:3, as cameras make them
  EXPECT_STREQ(find_picture(photo, find_corners(photo.image)).doubt, "not-found");
  photo.image = as_photo(backdrop("")(cv::Rect(0, 0, 700, 700)));
  EXPECT_STREQ(find_picture(photo, find_corners(photo.image)).doubt, "");
  photo.focal_px = 800;  // a camera's, by its EXIF
  EXPECT_STREQ(find_picture(photo, find_corners(photo.image)).doubt, "not-found");
}

/// A photo of 1.3 to 1, which is no camera's shape: a cropped one.
FoundPicture seen_in(const cv::Mat& photo) {
  const Photo cropped{as_photo(photo(cv::Rect(0, 0, 936, 720)))};
  return find_picture(cropped, find_corners(cropped.image));
}

TEST(FindPicture, AnObjectWithoutFourEdgesInThePhotoIsWarnedOf) {
  const cv::Mat mural = asset("mural.png");
  cv::Mat sticker = photograph(mural, backdrop(""), {});
  EXPECT_STREQ(seen_in(sticker).doubt, "");
  cv::circle(sticker, {430, 350}, 200, cv::Scalar(40, 30, 200), -1, cv::LINE_AA);
  EXPECT_STREQ(seen_in(sticker).doubt, "object");
  const Corners left = {{{-90, 150.6f}, {520.2f, 120.4f}, {560.8f, 560.1f}, {-70, 520.9f}}};
  EXPECT_STREQ(seen_in(photograph(mural, backdrop(""), left)).doubt, "object");
  const Corners both = {{{250.3f, -90}, {600.2f, -80}, {640.8f, 790}, {220.7f, 780}}};
  EXPECT_STREQ(seen_in(photograph(mural, backdrop(""), both)).doubt, "object");
  const Corners corner = {{{-14, 150.6f}, {720.2f, 120.4f}, {760.8f, 560.1f}, {220.7f, 520.9f}}};
  const FoundPicture cut = seen_in(photograph(mural, backdrop(""), corner));
  EXPECT_FALSE(cut.corners);
  EXPECT_STREQ(cut.doubt, "object");
  // A disc that a program drew on an even ground is a picture.
  cv::Mat drawn(720, 960, CV_8UC3, cv::Scalar(200, 220, 240));
  cv::circle(drawn, {430, 350}, 200, cv::Scalar(40, 30, 200), -1, cv::LINE_AA);
  EXPECT_STREQ(seen_in(drawn).doubt, "");
}

TEST(FindCorners, NothingThatStandsOutIsAnError) {
  const auto empty = find_corners(as_photo(backdrop("")));
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, "rectify.not-found");
  EXPECT_NE(empty.error().cure.find("--corners"), std::string::npos);
}

TEST(FindCorners, ThePictureShowsThem) {
  const RgbaImage photo = as_photo(backdrop(""));
  const auto picture = corners_picture(photo, {{{100, 100}, {800, 100}, {800, 600}, {100, 600}}});
  ASSERT_TRUE(picture);
  ASSERT_EQ(picture->width, 960U);
  const std::uint8_t* edge = &picture->pixels[4 * (100 * std::size_t{960} + 400)];
  EXPECT_GT(edge[0], 200);
  EXPECT_LT(edge[1], 100);
}

}  // namespace
}  // namespace modar
