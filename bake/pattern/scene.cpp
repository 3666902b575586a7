// Draws poses and renders frames with OpenCV, independently of the bake's renderer.
#include "bake/pattern/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/gray_mat.hpp"
#include "bake/pattern/surface_scene.hpp"

namespace modar {
namespace {

using std::numbers::pi;

std::array<glm::dvec2, 4> corners_of(const GrayImage& pattern, const Camera& camera,
                                     const Pose& pose) {
  auto corners = pattern_corners(pattern.width, pattern.height);
  for (glm::dvec2& corner : corners) {
    const glm::dvec3 p = pose.rotation * glm::dvec3(corner, 0.0) + pose.translation;
    corner = project(camera, p);
  }
  return corners;
}

/// The rotation that takes the camera's axis to a line of sight.
glm::dmat3 towards(const glm::dvec3& sight) {
  const glm::dvec3 axis(-sight.y, sight.x, 0);
  const double across = std::hypot(axis.x, axis.y);
  if (across <= 0) return glm::dmat3(1.0);
  return rotation_matrix(axis * (std::atan2(across, sight.z) / across));
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

/// Samples along a side of a frame's pixel. An enlarged picture is smooth and needs fewer; with 4,
/// rendering would take 16/9 of the time, which is most of a bench's.
int oversampling_of(double linear) {
  return linear < 1.0 ? 3 : 2;
}

/// The part of a frame that shows the pattern.
struct Shown {
  cv::Rect place;
  cv::Mat picture;
  cv::Mat mask;  ///< 255 where the pattern hides the background
};

/// Pixels of the frame around the pattern's outline, which a distorting lens bends.
cv::Rect place_of(const GrayImage& pattern, const Camera& camera, const Pose& pose) {
  constexpr int kPoints = 8;  // on each side of the outline
  const auto world = pattern_corners(pattern.width, pattern.height);
  double low_x = camera.width;
  double low_y = camera.height;
  double high_x = 0;
  double high_y = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (int k = 0; k < kPoints; ++k) {
      const glm::dvec2 p = glm::mix(world[i], world[(i + 1) % 4], 1.0 * k / kPoints);
      const glm::dvec2 at = project(camera, pose.rotation * glm::dvec3(p, 0.0) + pose.translation);
      low_x = std::min(low_x, at.x);
      low_y = std::min(low_y, at.y);
      high_x = std::max(high_x, at.x);
      high_y = std::max(high_y, at.y);
    }
  }
  constexpr int kRoom = 3;  // pixels for the outline between those points
  const int x0 = std::max(0, static_cast<int>(std::floor(low_x)) - kRoom);
  const int y0 = std::max(0, static_cast<int>(std::floor(low_y)) - kRoom);
  const int x1 = std::min(camera.width, static_cast<int>(std::ceil(high_x)) + kRoom + 1);
  const int y1 = std::min(camera.height, static_cast<int>(std::ceil(high_y)) + kRoom + 1);
  return x1 > x0 && y1 > y0 ? cv::Rect(x0, y0, x1 - x0, y1 - y0) : cv::Rect();
}

/// The position in the pattern's picture of each fine pixel of the place, through the camera's
/// lens. map: picture pixels to fine ideal pixels of the place. Distortion is evaluated at every
/// fourth pixel; linear interpolation between is right to a thousandth of a pixel.
cv::Mat lens_map(const Camera& camera, const cv::Rect& place, const cv::Mat& map,
                 int oversampling) {
  constexpr int kStep = 4;
  const int columns = place.width / kStep + 2;
  cv::Mat knots(place.height / kStep + 2, columns, CV_64FC2);
  for (int y = 0; y < knots.rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const glm::dvec2 p =
          undistort(camera, {1.0 * place.x + kStep * x - 0.5, 1.0 * place.y + kStep * y - 0.5});
      knots.at<cv::Vec2d>(y, x) = {(p.x + 0.5 - place.x) * oversampling - 0.5,
                                   (p.y + 0.5 - place.y) * oversampling - 0.5};
    }
  }
  const cv::Matx33d back = cv::Matx33d(map).inv();
  cv::Mat out(place.height * oversampling, place.width * oversampling, CV_32FC2);
  const double fine = 1.0 / (kStep * oversampling);
  for (int y = 0; y < out.rows; ++y) {
    const double v = (y + 0.5) * fine;
    const auto* top = knots.ptr<cv::Vec2d>(static_cast<int>(v));
    const double fy = v - std::floor(v);
    for (int x = 0; x < out.cols; ++x) {
      const double u = (x + 0.5) * fine;
      const auto* p = top + static_cast<int>(u);
      const double fx = u - std::floor(u);
      const cv::Vec2d at = (p[0] * (1 - fx) + p[1] * fx) * (1 - fy) +
                           (p[columns] * (1 - fx) + p[columns + 1] * fx) * fy;
      const cv::Vec3d from = back * cv::Vec3d(at[0], at[1], 1);
      out.at<cv::Vec2f>(y, x) = {static_cast<float>(from[0] / from[2]),
                                 static_cast<float>(from[1] / from[2])};
    }
  }
  return out;
}

/// A mask of the picture that hides the share `covered` from one side.
cv::Mat uncovered(cv::Size size, double covered, int side) {
  cv::Mat shown(size, CV_8UC1, cv::Scalar(255));
  const int cut_x = static_cast<int>(std::lround(size.width * covered));
  const int cut_y = static_cast<int>(std::lround(size.height * covered));
  const std::array<cv::Rect, 4> hidden = {cv::Rect(0, 0, cut_x, size.height),
                                          {size.width - cut_x, 0, cut_x, size.height},
                                          {0, 0, size.width, cut_y},
                                          {0, size.height - cut_y, size.width, cut_y}};
  if (covered > 0) shown(hidden[static_cast<std::size_t>(side)]).setTo(0);
  return shown;
}

/// Pattern and coverage, supersampled and averaged, where the frame shows them.
Shown show(const GrayImage& pattern, const Camera& camera, const Pose& pose, double covered,
           int side) {
  Shown shown;
  shown.place = place_of(pattern, camera, pose);
  if (shown.place.empty()) return shown;
  Camera ideal = camera;
  ideal.distortion = {};
  const auto corners = corners_of(pattern, ideal, pose);
  // Where the pattern shrinks, its own pixels are averaged first.
  cv::Mat source = as_mat(pattern);
  double linear =
      std::sqrt(std::abs(area_of(corners)) / (static_cast<double>(pattern.width) * pattern.height));
  const int oversampling = oversampling_of(linear);
  while (linear * oversampling < 0.7 && std::min(source.cols, source.rows) >= 4) {
    cv::resize(source, source, cv::Size(source.cols / 2, source.rows / 2), 0, 0, cv::INTER_AREA);
    linear *= 2;
  }
  const float w = static_cast<float>(source.cols);
  const float h = static_cast<float>(source.rows);
  const std::array<cv::Point2f, 4> from = {
      cv::Point2f{-0.5f, -0.5f}, {w - 0.5f, -0.5f}, {w - 0.5f, h - 0.5f}, {-0.5f, h - 0.5f}};
  std::array<cv::Point2f, 4> to;
  for (std::size_t i = 0; i < 4; ++i) {
    to[i] = {static_cast<float>((corners[i].x - shown.place.x + 0.5) * oversampling - 0.5),
             static_cast<float>((corners[i].y - shown.place.y + 0.5) * oversampling - 0.5)};
  }
  const cv::Mat map = cv::getPerspectiveTransform(from.data(), to.data());
  const cv::Size large = shown.place.size() * oversampling;
  const bool distorting = camera.distortion != ideal.distortion;
  const cv::Mat positions =
      distorting ? lens_map(camera, shown.place, map, oversampling) : cv::Mat();
  const auto warp = [&](const cv::Mat& what, int sampling, int border, cv::Mat& out) {
    cv::Mat fine;
    if (distorting) {
      cv::remap(what, fine, positions, cv::noArray(), sampling, border, cv::Scalar(0));
    } else {
      cv::warpPerspective(what, fine, map, large, sampling, border, cv::Scalar(0));
    }
    cv::resize(fine, out, shown.place.size(), 0, 0, cv::INTER_AREA);
  };
  warp(source, cv::INTER_LINEAR, cv::BORDER_REPLICATE, shown.picture);
  warp(uncovered(source.size(), covered, side), cv::INTER_NEAREST, cv::BORDER_CONSTANT, shown.mask);
  return shown;
}

void lay_over(const Shown& shown, cv::Mat& frame) {
  for (int y = 0; y < shown.place.height; ++y) {
    const std::uint8_t* mask = shown.mask.ptr(y);
    const std::uint8_t* picture = shown.picture.ptr(y);
    std::uint8_t* row = frame.ptr(shown.place.y + y) + shown.place.x;
    for (int x = 0; x < shown.place.width; ++x) {
      const int m = mask[x];
      row[x] = static_cast<std::uint8_t>((m * picture[x] + (255 - m) * row[x] + 127) / 255);
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

namespace {

/// A pose of a curved object that keeps its picture's nearest place in the frame.
Pose draw_surface_pose(const SceneBand& band, const GrayImage& pattern, const Camera& camera,
                       Random& random) {
  const double area = std::exp(random.uniform(std::log(band.area_low), std::log(band.area_high)));
  const auto either_side = [&random](double low, double high) {
    const double angle = random.uniform(low, high);
    return random.next() % 2 == 0 ? angle : -angle;
  };
  const double above = either_side(band.tilt_low, band.tilt_high);
  const double around = either_side(band.around_low, band.around_high);
  const double roll = random.uniform(band.roll_low, band.roll_high);
  const double side = std::sqrt(area * pattern.width * pattern.height);
  const double room_x = std::max(0.05 * camera.width, 0.5 * (camera.width - 1.3 * side));
  const double room_y = std::max(0.05 * camera.height, 0.5 * (camera.height - 1.3 * side));
  const glm::dvec2 sight{random.uniform(-room_x, room_x) / camera.fx,
                         random.uniform(-room_y, room_y) / camera.fy};
  return surface_pose(pattern, *band.surface, camera, around, above, roll, std::sqrt(area), sight);
}

}  // namespace

Pose draw_pose(const SceneBand& band, const GrayImage& pattern, const Camera& camera,
               Random& random) {
  if (band.surface != nullptr) return draw_surface_pose(band, pattern, camera, random);
  const double area = std::exp(random.uniform(std::log(band.area_low), std::log(band.area_high)));
  const double tilt = random.uniform(band.tilt_low, band.tilt_high) * pi / 180.0;
  const double axis = random.uniform(0.0, 2 * pi);
  const double roll = random.uniform(band.roll_low, band.roll_high) * pi / 180.0;
  glm::dmat3 frontal(1.0);
  frontal[1][1] = frontal[2][2] = -1.0;
  const glm::dmat3 turned = rotation_matrix({0, 0, roll}) *
                            rotation_matrix({tilt * std::cos(axis), tilt * std::sin(axis), 0}) *
                            frontal;
  // The centre is drawn where a pattern of that size stays in the frame, else near the middle.
  const double side = std::sqrt(area * pattern.width * pattern.height);
  const double room_x = std::max(0.05 * camera.width, 0.5 * (camera.width - 1.3 * side));
  const double room_y = std::max(0.05 * camera.height, 0.5 * (camera.height - 1.3 * side));
  const double u = random.uniform(-room_x, room_x) / camera.fx;
  const double v = random.uniform(-room_y, room_y) / camera.fy;
  Pose pose;
  pose.rotation = towards({u, v, 1}) * turned;
  // The nearest corner stays before the camera.
  const double nearest = 1.2 * std::hypot(pose.rotation[0].z, pose.rotation[1].z) + 0.2;
  double depth = 2 * camera.fx / side;
  for (int i = 0; i < 12; ++i) {
    pose.translation = {u * depth, v * depth, depth};
    const double now =
        area_of(corners_of(pattern, camera, pose)) / (1.0 * pattern.width * pattern.height);
    depth = now > 0 ? depth * std::sqrt(now / area) : depth * 1.5;
    depth = std::max(depth, nearest);
  }
  pose.translation = {u * depth, v * depth, depth};
  return pose;
}

// Ranges of a room's light and of a focused lens, those of the protocol that all of the tracker's
// figures were measured under.
SceneLight draw_light(Random& random) {
  SceneLight light;
  light.gain = random.uniform(0.6, 1.25);
  light.bias = random.uniform(-20.0, 20.0);
  light.slope_x = random.uniform(-0.2, 0.2);
  light.slope_y = random.uniform(-0.2, 0.2);
  light.focus = random.uniform(0.4, 0.9);
  return light;
}

SceneFrame render_still(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        double focus, MotionBlur blur) {
  SceneFrame scene;
  scene.pose = pose;
  scene.picture = background;
  cv::Mat frame(background.height, background.width, CV_8UC1, scene.picture.pixels.data());
  if (band.pattern && band.surface != nullptr) {
    scene.corners = surface_corners(pattern, *band.surface, camera, pose);
    draw_surface(pattern, *band.surface, camera, pose,
                 random.uniform(band.covered_low, band.covered_high), scene.picture);
  } else if (band.pattern) {
    scene.corners = corners_of(pattern, camera, pose);
    const double covered = random.uniform(band.covered_low, band.covered_high);
    const int side = static_cast<int>(random.uniform(0, 4));
    lay_over(show(pattern, camera, pose, covered, side), frame);
  }
  cv::GaussianBlur(frame, frame, cv::Size(5, 5), focus);
  if (blur.length > 1.0) blur_motion(blur, scene.picture);
  return scene;
}

void blur_motion(MotionBlur blur, GrayPicture& picture) {
  cv::Mat frame(picture.height, picture.width, CV_8UC1, picture.pixels.data());
  cv::filter2D(frame, frame, -1, motion_kernel(blur.length, blur.angle));
}

void expose(const GrayPicture& still, const SceneLight& light, Random& random,
            GrayPicture& picture) {
  picture.width = still.width;
  picture.height = still.height;
  picture.pixels.resize(still.pixels.size());
  const double step = light.slope_x / still.width;
  std::size_t i = 0;
  for (int y = 0; y < still.height; ++y) {
    double gain = light.gain - 0.5 * light.slope_x +
                  light.slope_y * (static_cast<double>(y) / still.height - 0.5);
    for (int x = 0; x < still.width; ++x, ++i, gain += step) {
      const double seen = gain * still.pixels[i] + light.bias + light.noise * random.normal();
      picture.pixels[i] = static_cast<std::uint8_t>(std::clamp(seen + 0.5, 0.0, 255.0));
    }
  }
}

SceneFrame render_scene(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        const SceneLight* light, MotionBlur blur) {
  const SceneLight used = light != nullptr ? *light : draw_light(random);
  SceneFrame scene =
      render_still(pattern, camera, pose, background, band, random, used.focus, blur);
  expose(scene.picture, used, random, scene.picture);
  return scene;
}

GrayPicture another_view(const GrayPicture& photo, Random& random) {
  const cv::Point2f centre(static_cast<float>(random.uniform(0.3, 0.7) * photo.width),
                           static_cast<float>(random.uniform(0.3, 0.7) * photo.height));
  const double angle = random.uniform(0, 360);
  const double scale = std::exp(random.uniform(std::log(0.7), std::log(2.0)));
  const cv::Mat map = cv::getRotationMatrix2D(centre, angle, scale);
  GrayPicture view{photo.width, photo.height, std::vector<std::uint8_t>(photo.pixels.size())};
  cv::Mat out(view.height, view.width, CV_8UC1, view.pixels.data());
  cv::warpAffine(as_mat(photo.view()), out, map, out.size(), cv::INTER_LINEAR,
                 cv::BORDER_REFLECT_101);
  return view;
}

GrayPicture made_background(int width, int height, Random& random) {
  GrayPicture picture{width, height, {}};
  std::vector<double> sum(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 128);
  for (int cell = 256; cell >= 4; cell /= 2) {
    const int columns = width / cell + 2;
    const int rows = height / cell + 2;
    std::vector<double> knots(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    for (double& knot : knots) knot = random.uniform(-1, 1) * std::sqrt(cell) * 4;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double u = 1.0 * (x % cell) / cell;
        const double v = 1.0 * (y % cell) / cell;
        const auto knot = [&](int i, int j) {
          return knots[static_cast<std::size_t>((y / cell + j) * columns + x / cell + i)];
        };
        sum[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)] += (knot(0, 0) * (1 - u) + knot(1, 0) * u) * (1 - v) +
                                            (knot(0, 1) * (1 - u) + knot(1, 1) * u) * v;
      }
    }
  }
  for (const double value : sum) {
    picture.pixels.push_back(static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)));
  }
  return picture;
}

Result<GrayPicture> load_background(const std::string& path, int width, int height) {
  MODAR_ASSIGN(const GrayPicture picture, load_gray(path));
  const cv::Mat photo = as_mat(picture.view());
  // Scaled to fill the frame.
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

Result<std::vector<GrayPicture>> load_backgrounds(const std::vector<std::string>& paths, int width,
                                                  int height) {
  std::vector<GrayPicture> backgrounds;
  for (const std::string& path : paths) {
    MODAR_ASSIGN(auto background, load_background(path, width, height));
    backgrounds.push_back(std::move(background));
  }
  return backgrounds;
}

}  // namespace modar
