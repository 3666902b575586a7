// The contact sheet of a simulation, drawn with OpenCV.
#include <cmath>
#include <cstdio>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/simulate.hpp"

namespace modar {
namespace {

constexpr int kWide = 160;  // of a view on the sheet
constexpr int kText = 16;   // height of a line of text
constexpr int kName = 100;  // width of the bands' names
constexpr int kGap = 4;
const cv::Scalar kWhite(255, 255, 255, 255);
const cv::Scalar kGreen(80, 220, 80, 255);
const cv::Scalar kRed(240, 80, 80, 255);
const cv::Scalar kPaper(24, 24, 28, 255);

void write(cv::Mat& sheet, const std::string& text, int x, int y, const cv::Scalar& colour) {
  cv::putText(sheet, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, 0.36, colour, 1, cv::LINE_AA);
}

void outline(cv::Mat& view, const std::array<glm::dvec2, 4>& corners, double scale,
             const cv::Scalar& colour) {
  std::vector<cv::Point> points;
  for (const glm::dvec2& corner : corners) {
    // Corners near the camera lie far outside: lines are cut at the view's border anyway.
    points.emplace_back(static_cast<int>(std::clamp(corner.x * scale, -1e4, 1e4)),
                        static_cast<int>(std::clamp(corner.y * scale, -1e4, 1e4)));
  }
  cv::polylines(view, points, true, colour, 1, cv::LINE_AA);
}

void draw_value(cv::Mat& sheet, const SimulatedValue& value, int x, int y, int height) {
  const TrialOutcome& outcome = value.outcome;
  const GrayPicture& sample = outcome.sample;
  const cv::Mat gray(sample.height, sample.width, CV_8UC1,
                     const_cast<std::uint8_t*>(sample.pixels.data()));
  cv::Mat view;
  cv::cvtColor(gray, view, cv::COLOR_GRAY2RGBA);
  cv::resize(view, view, cv::Size(kWide, height), 0, 0, cv::INTER_AREA);
  const double scale = static_cast<double>(kWide) / sample.width;
  outline(view, outcome.truth, scale, kWhite);
  if (outcome.sample_right) outline(view, outcome.seen, scale, kGreen);
  view.copyTo(sheet(cv::Rect(x, y, kWide, height)));
  char text[48];
  std::snprintf(text, sizeof text, "%.3g: %.0f %%", value.value, 100 * outcome.right_share());
  write(sheet, text, x + 2, y + height + kText - 4, outcome.right_share() >= 0.9 ? kGreen : kRed);
}

}  // namespace

RgbaImage simulation_picture(const Simulation& simulation) {
  std::size_t columns = 1;
  for (const SimulatedBand& band : simulation.bands) {
    columns = std::max(columns, band.values.size());
  }
  const GrayPicture& first = simulation.bands.front().values.front().outcome.sample;
  const int height = std::max(1, kWide * first.height / first.width);
  const int row = height + kText + kGap;
  RgbaImage image;
  image.width = static_cast<std::uint32_t>(kName + static_cast<int>(columns) * (kWide + kGap));
  image.height =
      static_cast<std::uint32_t>(2 * kText + static_cast<int>(simulation.bands.size()) * row);
  image.pixels.resize(std::size_t{image.width} * image.height * 4);
  cv::Mat sheet(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4,
                image.pixels.data());
  sheet.setTo(kPaper);
  write(sheet, simulation.name + ": " + range_sentence(simulation), 6, kText + 2, kWhite);
  int y = 2 * kText;
  for (const SimulatedBand& band : simulation.bands) {
    write(sheet, band.name, 6, y + kText, kWhite);
    write(sheet, band.unit, 6, y + 2 * kText, kWhite);
    int x = kName;
    for (const SimulatedValue& value : band.values) {
      draw_value(sheet, value, x, y, height);
      x += kWide + kGap;
    }
    y += row;
  }
  return image;
}

}  // namespace modar
