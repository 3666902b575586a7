// The overlay picture of a score, drawn with OpenCV.
#include <opencv2/imgproc.hpp>

#include "bake/pattern/score.hpp"

namespace modar {
namespace {

constexpr int kCells = 12;  // on the longer side

/// Shades cells without a feature.
void shade(cv::Mat& picture, const std::vector<ScorePlace>& places) {
  const int side = std::max(8, std::max(picture.cols, picture.rows) / kCells);
  for (int y = 0; y < picture.rows; y += side) {
    for (int x = 0; x < picture.cols; x += side) {
      const cv::Rect cell = cv::Rect(x, y, side, side) & cv::Rect(0, 0, picture.cols, picture.rows);
      const bool empty = std::none_of(places.begin(), places.end(), [&](const ScorePlace& place) {
        return cell.contains(cv::Point(cvRound(place.x), cvRound(place.y)));
      });
      if (!empty) continue;
      cv::Mat part = picture(cell);
      part = part * 0.45 + cv::Scalar(90, 10, 10, 140);
    }
  }
}

}  // namespace

RgbaImage score_overlay(const GrayImage& pattern, const PatternScore& score) {
  RgbaImage image;
  image.width = static_cast<std::uint32_t>(pattern.width);
  image.height = static_cast<std::uint32_t>(pattern.height);
  image.pixels.resize(std::size_t{image.width} * image.height * 4);
  const cv::Mat gray(pattern.height, pattern.width, CV_8UC1,
                     const_cast<std::uint8_t*>(pattern.pixels),
                     static_cast<std::size_t>(pattern.stride));
  cv::Mat picture(pattern.height, pattern.width, CV_8UC4, image.pixels.data());
  cv::cvtColor(gray, picture, cv::COLOR_GRAY2RGBA);
  shade(picture, score.places);
  for (const ScorePlace& place : score.places) {
    const bool good = place.held * 4 >= score.views;
    cv::circle(picture, {cvRound(place.x), cvRound(place.y)}, good ? 3 : 2,
               good ? cv::Scalar(60, 230, 60, 255) : cv::Scalar(240, 150, 50, 255), cv::FILLED,
               cv::LINE_AA);
  }
  return image;
}

}  // namespace modar
