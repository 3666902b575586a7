// Draws poses and renders frames with OpenCV, apart from the bake's own renderer.
#include "bake/pattern/pose_scene.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/pattern_image.hpp"
#include "bake/pattern/pattern_picture.hpp"

namespace modar {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kOversampling = 3;
constexpr double kNoise = 3.0;

/// Ideal pixels of the pattern's corners; the bench's cameras have no distortion.
std::array<glm::dvec2, 4> corners_of(const GrayImage& pattern, const Camera& camera,
                                     const Pose& pose) {
  auto corners = pattern_corners(pattern.width, pattern.height);
  for (glm::dvec2& corner : corners) {
    const glm::dvec3 p = pose.rotation * glm::dvec3(corner, 0.0) + pose.translation;
    corner = project(camera, p);
  }
  return corners;
}

double area_of(const std::array<glm::dvec2, 4>& c) {
  double area = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = c[i];
    const glm::dvec2 b = c[(i + 1) % 4];
    area += 0.5 * (a.x * b.y - b.x * a.y);
  }
  return area;
}

cv::Mat as_mat(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

/// Pattern and coverage, supersampled and averaged, in frame pixels.
void warp(const GrayImage& pattern, const std::array<glm::dvec2, 4>& corners, double covered,
          int side, cv::Size size, cv::Mat& picture, cv::Mat& mask) {
  std::array<cv::Point2f, 4> from;
  std::array<cv::Point2f, 4> to;
  // Where the pattern shrinks, its own pixels are averaged first.
  cv::Mat source = as_mat(pattern);
  double linear =
      std::sqrt(area_of(corners) / (static_cast<double>(pattern.width) * pattern.height));
  while (linear * kOversampling < 0.7) {
    cv::resize(source, source, cv::Size(source.cols / 2, source.rows / 2), 0, 0, cv::INTER_AREA);
    linear *= 2;
  }
  const float w = static_cast<float>(source.cols);
  const float h = static_cast<float>(source.rows);
  from = {cv::Point2f{-0.5f, -0.5f}, {w - 0.5f, -0.5f}, {w - 0.5f, h - 0.5f}, {-0.5f, h - 0.5f}};
  for (std::size_t i = 0; i < 4; ++i) {
    to[i] = {static_cast<float>((corners[i].x + 0.5) * kOversampling - 0.5),
             static_cast<float>((corners[i].y + 0.5) * kOversampling - 0.5)};
  }
  cv::Mat shown(source.size(), CV_8UC1, cv::Scalar(255));
  const int cut_x = static_cast<int>(std::lround(source.cols * covered));
  const int cut_y = static_cast<int>(std::lround(source.rows * covered));
  const std::array<cv::Rect, 4> hidden = {cv::Rect(0, 0, cut_x, source.rows),
                                          {source.cols - cut_x, 0, cut_x, source.rows},
                                          {0, 0, source.cols, cut_y},
                                          {0, source.rows - cut_y, source.cols, cut_y}};
  if (covered > 0) shown(hidden[static_cast<std::size_t>(side)]).setTo(0);
  const cv::Mat map = cv::getPerspectiveTransform(from.data(), to.data());
  const cv::Size large(size.width * kOversampling, size.height * kOversampling);
  cv::Mat fine;
  cv::warpPerspective(source, fine, map, large, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::resize(fine, picture, size, 0, 0, cv::INTER_AREA);
  cv::warpPerspective(shown, fine, map, large, cv::INTER_NEAREST, cv::BORDER_CONSTANT,
                      cv::Scalar(0));
  cv::resize(fine, mask, size, 0, 0, cv::INTER_AREA);
}

void light_and_noise(cv::Mat& frame, const SceneLight& with, Random& random) {
  for (int y = 0; y < frame.rows; ++y) {
    std::uint8_t* row = frame.ptr(y);
    for (int x = 0; x < frame.cols; ++x) {
      const double light = with.gain + with.slope_x * (static_cast<double>(x) / frame.cols - 0.5) +
                           with.slope_y * (static_cast<double>(y) / frame.rows - 0.5);
      const double seen = light * row[x] + with.bias + kNoise * random.normal();
      row[x] = static_cast<std::uint8_t>(std::clamp(seen + 0.5, 0.0, 255.0));
    }
  }
}

cv::Mat motion_kernel(double length, double angle) {
  const int side = 2 * static_cast<int>(std::ceil(length / 2)) + 1;
  cv::Mat kernel(side, side, CV_32F, cv::Scalar(0));
  const int steps = 8 * side;
  for (int i = 0; i < steps; ++i) {
    const double t = ((i + 0.5) / steps - 0.5) * length;
    const int x = static_cast<int>(std::lround(side / 2 + t * std::cos(angle)));
    const int y = static_cast<int>(std::lround(side / 2 + t * std::sin(angle)));
    kernel.at<float>(std::clamp(y, 0, side - 1), std::clamp(x, 0, side - 1)) +=
        1.0f / static_cast<float>(steps);
  }
  return kernel;
}

}  // namespace

std::vector<SceneBand> pose_bands() {
  return {{"area 0.1-0.25", 0.1, 0.25, 0, 45, 0, 0, true},
          {"area 0.25-0.4", 0.25, 0.4, 0, 45, 0, 0, true},
          {"area 0.4-0.9", 0.4, 0.9, 0, 45, 0, 0, true},
          {"area 0.9-4", 0.9, 4.0, 0, 45, 0, 0, true},
          {"area 4-5", 4.0, 5.0, 0, 45, 0, 0, true},
          {"tilt 45-60", 0.5, 3.0, 45, 60, 0, 0, true},
          {"tilt 60-70", 0.5, 3.0, 60, 70, 0, 0, true},
          {"half covered", 0.5, 3.0, 0, 45, 0.5, 0.5, true},
          {"mixed", 0.25, 5.0, 0, 65, 0, 0.5, true},
          {"none", 0.4, 4.0, 0, 45, 0, 0, false}};
}

Pose draw_pose(const SceneBand& band, const GrayImage& pattern, const Camera& camera,
               Random& random) {
  const double area = std::exp(random.uniform(std::log(band.area_low), std::log(band.area_high)));
  const double tilt = random.uniform(band.tilt_low, band.tilt_high) * kPi / 180.0;
  const double axis = random.uniform(0.0, 2 * kPi);
  const double roll = random.uniform(0.0, 2 * kPi);
  glm::dmat3 frontal(1.0);
  frontal[1][1] = frontal[2][2] = -1.0;
  Pose pose;
  pose.rotation = rotation_matrix({0, 0, roll}) *
                  rotation_matrix({tilt * std::cos(axis), tilt * std::sin(axis), 0}) * frontal;
  // The centre lies where a pattern of that size stays in the frame, or in its middle.
  const double side = std::sqrt(area * pattern.width * pattern.height);
  const double room_x = std::max(0.05 * camera.width, 0.5 * (camera.width - 1.3 * side));
  const double room_y = std::max(0.05 * camera.height, 0.5 * (camera.height - 1.3 * side));
  const double u = random.uniform(-room_x, room_x) / camera.fx;
  const double v = random.uniform(-room_y, room_y) / camera.fy;
  double depth = 2 * camera.fx / side;
  for (int i = 0; i < 12; ++i) {
    pose.translation = {u * depth, v * depth, depth};
    const double now =
        area_of(corners_of(pattern, camera, pose)) / (1.0 * pattern.width * pattern.height);
    depth = now > 0 ? depth * std::sqrt(now / area) : depth * 1.5;
    depth = std::max(depth, 1.2 * std::sin(tilt) + 0.2);
  }
  pose.translation = {u * depth, v * depth, depth};
  return pose;
}

SceneLight draw_light(Random& random) {
  SceneLight light;
  light.gain = random.uniform(0.6, 1.25);
  light.bias = random.uniform(-20.0, 20.0);
  light.slope_x = random.uniform(-0.2, 0.2);
  light.slope_y = random.uniform(-0.2, 0.2);
  light.focus = random.uniform(0.4, 0.9);
  return light;
}

SceneFrame render_scene(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        const SceneLight* light, MotionBlur blur) {
  const SceneLight shining = light != nullptr ? *light : draw_light(random);
  SceneFrame scene;
  scene.pose = pose;
  scene.picture = background;
  cv::Mat frame(background.height, background.width, CV_8UC1, scene.picture.pixels.data());
  if (band.pattern) {
    scene.corners = corners_of(pattern, camera, pose);
    const double covered = random.uniform(band.covered_low, band.covered_high);
    const int side = static_cast<int>(random.uniform(0, 4));
    cv::Mat picture;
    cv::Mat mask;
    warp(pattern, scene.corners, covered, side, frame.size(), picture, mask);
    for (int y = 0; y < frame.rows; ++y) {
      for (int x = 0; x < frame.cols; ++x) {
        const int m = mask.at<std::uint8_t>(y, x);
        std::uint8_t& grey = frame.at<std::uint8_t>(y, x);
        grey = static_cast<std::uint8_t>(
            (m * picture.at<std::uint8_t>(y, x) + (255 - m) * grey + 127) / 255);
      }
    }
  }
  cv::GaussianBlur(frame, frame, cv::Size(5, 5), shining.focus);
  if (blur.length > 1.0) cv::filter2D(frame, frame, -1, motion_kernel(blur.length, blur.angle));
  light_and_noise(frame, shining, random);
  return scene;
}

Result<GrayPicture> load_background(const std::string& path, int width, int height) {
  auto picture = load_grey(path);
  if (!picture) return tl::unexpected(picture.error());
  const cv::Mat photo = as_mat(picture->view());
  // The frame's middle of the photo, scaled to fill it.
  const double scale =
      std::max(static_cast<double>(width) / photo.cols, static_cast<double>(height) / photo.rows);
  cv::Mat scaled;
  cv::resize(photo, scaled,
             cv::Size(std::max(width, static_cast<int>(std::ceil(photo.cols * scale))),
                      std::max(height, static_cast<int>(std::ceil(photo.rows * scale)))),
             0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  const cv::Mat cut =
      scaled(cv::Rect((scaled.cols - width) / 2, (scaled.rows - height) / 2, width, height));
  GrayPicture out;
  out.width = width;
  out.height = height;
  for (int y = 0; y < height; ++y)
    out.pixels.insert(out.pixels.end(), cut.ptr(y), cut.ptr(y) + width);
  return out;
}

}  // namespace modar
