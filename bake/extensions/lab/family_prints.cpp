#include "bake/extensions/lab/family_prints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace modar {
namespace {

cv::Mat copy_of(const GrayImage& image) {
  return cv::Mat(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
                 static_cast<std::size_t>(image.stride))
      .clone();
}

GrayPicture filled_from(const cv::Mat& mat) {
  GrayPicture picture{mat.cols, mat.rows, {}};
  for (int y = 0; y < mat.rows; ++y) {
    picture.pixels.insert(picture.pixels.end(), mat.ptr(y), mat.ptr(y) + mat.cols);
  }
  return picture;
}

/// Consonants and vowels in turn.
std::string word(int letters, bool capitals, Random& random) {
  static constexpr const char* kKinds[] = {"bcdfghklmnprstvz", "aeiou"};
  static constexpr std::array<std::uint64_t, 2> kCounts = {16, 5};
  std::string out;
  const std::uint64_t first = random.next() % 2;
  for (int i = 0; i < letters; ++i) {
    const auto kind = static_cast<std::size_t>((first + static_cast<std::uint64_t>(i)) % 2);
    char letter = kKinds[kind][random.next() % kCounts[kind]];
    if (capitals || i == 0) letter = static_cast<char>(letter - 'a' + 'A');
    out += letter;
  }
  return out;
}

/// How a line of a layout is set.
struct Line {
  cv::Rect place;
  int font = cv::FONT_HERSHEY_SIMPLEX;
  int ink = 0;
};

/// As large as the place allows, its middle there.
void set_line(const std::string& text, const Line& line, cv::Mat& print) {
  int base = 0;
  const cv::Size one = cv::getTextSize(text, line.font, 1.0, 2, &base);
  const double size =
      std::min(0.95 * line.place.width / one.width, 0.95 * line.place.height / (one.height + base));
  const int thickness = std::max(1, static_cast<int>(std::lround(2.5 * size)));
  const cv::Size real = cv::getTextSize(text, line.font, size, thickness, &base);
  cv::putText(print, text,
              {line.place.x + (line.place.width - real.width) / 2,
               line.place.y + (line.place.height + real.height - base) / 2},
              line.font, size, cv::Scalar(line.ink), thickness, cv::LINE_AA);
}

int drawn_font(Random& random) {
  static constexpr std::array<int, 4> kFonts = {cv::FONT_HERSHEY_SIMPLEX, cv::FONT_HERSHEY_DUPLEX,
                                                cv::FONT_HERSHEY_TRIPLEX, cv::FONT_HERSHEY_COMPLEX};
  return kFonts[random.next() % kFonts.size()];
}

cv::Rect share_of(const cv::Mat& print, double x, double y, double width, double height) {
  return cv::Rect(static_cast<int>(x * print.cols), static_cast<int>(y * print.rows),
                  static_cast<int>(width * print.cols), static_cast<int>(height * print.rows)) &
         cv::Rect(0, 0, print.cols, print.rows);
}

}  // namespace

FamilyPrints titled_prints(const GrayImage& picture, Random& random) {
  std::array<cv::Mat, 2> prints = {copy_of(picture), copy_of(picture)};
  const double top = random.uniform(0.04, 0.1);
  const double height = random.uniform(0.1, 0.16);
  const bool dark = random.next() % 2 == 0;
  const bool on_band = random.next() % 2 == 0;
  const int font = drawn_font(random);
  const int first = 5 + static_cast<int>(random.next() % 5);
  const int second = 8 + static_cast<int>(random.next() % 8);
  for (cv::Mat& print : prints) {
    const int ink = dark ? 25 : 235;
    const cv::Rect title = share_of(print, 0.06, top, 0.88, height);
    const cv::Rect below = share_of(print, 0.15, top + height, 0.7, 0.45 * height);
    if (on_band) print(title | below).setTo(dark ? 230 : 30);
    set_line(word(first, true, random), {title, font, ink}, print);
    set_line(word(second / 2, false, random) + " " + word(second / 2, false, random),
             {below, font, ink}, print);
  }
  return {filled_from(prints[0]), filled_from(prints[1])};
}

FamilyPrints fruit_prints(const GrayImage& picture, const GrayImage& first, const GrayImage& second,
                          Random& random) {
  std::array<cv::Mat, 2> prints = {copy_of(picture), copy_of(picture)};
  const std::array<cv::Mat, 2> fruits = {copy_of(first), copy_of(second)};
  const cv::Size whole = prints[0].size();
  const double size = random.uniform(0.3, 0.42) * std::min(whole.width, whole.height);
  const cv::Point2d middle{random.uniform(0.35, 0.65) * whole.width,
                           random.uniform(0.35, 0.6) * whole.height};
  const int font = drawn_font(random);
  for (std::size_t k = 0; k < 2; ++k) {
    const double tall = size * random.uniform(0.75, 1.0);
    const cv::Rect place =
        cv::Rect(cv::Point2d(middle.x - size / 2, middle.y - tall / 2), cv::Size2d(size, tall)) &
        cv::Rect({}, whole);
    const cv::Mat& fruit = fruits[k];
    cv::Mat cut;
    cv::resize(fruit(cv::Rect(fruit.cols / 4, fruit.rows / 4, fruit.cols / 2, fruit.rows / 2)), cut,
               place.size(), 0, 0, cv::INTER_AREA);
    cv::Mat mask(place.size(), CV_8UC1, cv::Scalar(0));
    cv::ellipse(mask, {place.width / 2, place.height / 2}, {place.width / 2, place.height / 2}, 0,
                0, 360, cv::Scalar(255), cv::FILLED);
    cut.copyTo(prints[k](place), mask);
    const cv::Rect name = cv::Rect(cv::Point2d(middle.x - 0.6 * size, middle.y + 0.55 * size),
                                   cv::Size2d(1.2 * size, 0.22 * size)) &
                          cv::Rect({}, whole);
    prints[k](name).setTo(225);
    set_line(word(5 + static_cast<int>(k), true, random), {name, font, 30}, prints[k]);
  }
  return {filled_from(prints[0]), filled_from(prints[1])};
}

GrayPicture held_print(const GrayImage& print, Random& random) {
  cv::Mat held = copy_of(print);
  const double side = std::min(held.cols, held.rows);
  for (const bool left : {true, false}) {
    const double length = random.uniform(0.12, 0.2) * side;
    const double width = random.uniform(0.08, 0.12) * side;
    const cv::Point2d tip{left ? length : held.cols - length,
                          random.uniform(0.4, 0.85) * held.rows};
    const double tone = random.uniform(110, 190);
    for (int y = 0; y < held.rows; ++y) {
      for (int x = 0; x < held.cols; ++x) {
        const double across = (y - tip.y) / (0.5 * width);
        const double beyond =
            std::max(0.0, left ? x - tip.x + 0.5 * width : tip.x + 0.5 * width - x) / (0.5 * width);
        const double out = across * across + beyond * beyond;
        if (out > 1) continue;
        held.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(tone * (1 - 0.35 * out));
      }
    }
  }
  return filled_from(held);
}

}  // namespace modar
