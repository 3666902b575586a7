// Renders disturbed frames with OpenCV on top of bake/pattern's scenes.
#include "bake/extensions/lab/field_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace modar {
namespace {

using std::numbers::pi;

cv::Mat mat_of(GrayPicture& picture) {
  return {picture.height, picture.width, CV_8UC1, picture.pixels.data()};
}

cv::Mat mat_of(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

GrayPicture picture_of(const cv::Mat& mat) {
  GrayPicture picture{mat.cols, mat.rows, {}};
  for (int y = 0; y < mat.rows; ++y) {
    picture.pixels.insert(picture.pixels.end(), mat.ptr(y), mat.ptr(y) + mat.cols);
  }
  return picture;
}

/// Paper bent about its vertical axis, the convex side to the camera.
class BentPaper {
 public:
  BentPaper(const GrayImage& pattern, const Camera& camera, const Pose& pose, double radius)
      : picture_(mat_of(pattern)),
        camera_(camera),
        pose_(pose),
        back_(glm::transpose(pose.rotation)),
        origin_(-(back_ * pose.translation)),
        radius_(2 * radius * pattern_corners(pattern.width, pattern.height)[1].x),
        half_(pattern_corners(pattern.width, pattern.height)[1]) {}

  /// Frame pixel of a point of the paper, in the flat pattern's coordinates.
  [[nodiscard]] glm::dvec2 project_paper(glm::dvec2 p) const {
    const double angle = p.x / radius_;
    const glm::dvec3 world(radius_ * std::sin(angle), p.y, radius_ * (std::cos(angle) - 1));
    return project(camera_, pose_.rotation * world + pose_.translation);
  }

  void draw(cv::Mat& frame) const {
    const cv::Rect place = outline() & cv::Rect(0, 0, frame.cols, frame.rows);
    for (int y = place.y; y < place.y + place.height; ++y) {
      for (int x = place.x; x < place.x + place.width; ++x) {
        std::uint8_t& pixel = frame.at<std::uint8_t>(y, x);
        int sum = 0;
        constexpr double kSamples[] = {-0.25, 0.25};
        for (const double v : kSamples) {
          for (const double u : kSamples) sum += sample({x + u, y + v}, pixel);
        }
        pixel = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
  }

 private:
  [[nodiscard]] cv::Rect outline() const {
    std::vector<cv::Point2f> points;
    for (int i = 0; i <= 20; ++i) {
      for (const double y : {-half_.y, half_.y}) {
        const glm::dvec2 p = project_paper({(0.1 * i - 1) * half_.x, y});
        points.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
      }
    }
    cv::Rect box = cv::boundingRect(points);
    return {box.x - 2, box.y - 2, box.width + 4, box.height + 4};
  }

  /// Gray of the paper along the pixel's ray; `behind` where the ray misses it.
  [[nodiscard]] int sample(glm::dvec2 pixel, std::uint8_t behind) const {
    const glm::dvec3 ray = back_ * glm::dvec3((pixel.x - camera_.cx) / camera_.fx,
                                              (pixel.y - camera_.cy) / camera_.fy, 1);
    // The cylinder x^2 + (z + r)^2 = r^2, its nearer side.
    const double z = origin_.z + radius_;
    const double a = ray.x * ray.x + ray.z * ray.z;
    const double b = origin_.x * ray.x + z * ray.z;
    const double root = b * b - a * (origin_.x * origin_.x + z * z - radius_ * radius_);
    if (!(root > 0)) return behind;
    const glm::dvec3 hit = origin_ + (-b - std::sqrt(root)) / a * ray;
    const double across = radius_ * std::atan2(hit.x, hit.z + radius_);
    const double u = 0.5 * (across / half_.x + 1) * picture_.cols - 0.5;
    const double v = 0.5 * (1 - hit.y / half_.y) * picture_.rows - 0.5;
    if (u < -0.5 || v < -0.5 || u > picture_.cols - 0.5 || v > picture_.rows - 0.5) return behind;
    const int x = std::clamp(static_cast<int>(u), 0, picture_.cols - 2);
    const int y = std::clamp(static_cast<int>(v), 0, picture_.rows - 2);
    const double fx = std::clamp(u - x, 0.0, 1.0);
    const double fy = std::clamp(v - y, 0.0, 1.0);
    const auto at = [&](int i, int j) { return picture_.at<std::uint8_t>(y + j, x + i); };
    return static_cast<int>((at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) +
                            (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy + 0.5);
  }

  cv::Mat picture_;
  Camera camera_;
  Pose pose_;
  glm::dmat3 back_;
  glm::dvec3 origin_;
  double radius_;    ///< in the unit of poses, half of the longer side
  glm::dvec2 half_;  ///< half width and height, the same unit
};

/// Signed distance of pixels to a line through the pattern's centre.
struct Edge {
  glm::dvec2 centre;
  glm::dvec2 normal;
  [[nodiscard]] double at(int x, int y) const {
    return glm::dot(glm::dvec2(x, y) - centre, normal);
  }
};

void add_light(const FieldCondition& condition, const FrameTruth& truth, Random& random,
               cv::Mat& frame) {
  const double angle = random.uniform(0, 2 * pi);
  const glm::dvec2 centre =
      0.25 * (truth.corners[0] + truth.corners[1] + truth.corners[2] + truth.corners[3]);
  const Edge edge{centre, {std::cos(angle), std::sin(angle)}};
  for (int y = 0; y < frame.rows; ++y) {
    for (int x = 0; x < frame.cols; ++x) {
      double gray = frame.at<std::uint8_t>(y, x);
      const double distance = edge.at(x, y);
      if (condition.shadow) gray *= 0.45 + 0.55 * std::clamp(0.5 + distance / 6, 0.0, 1.0);
      if (condition.glare) gray += 255 * std::clamp(0.5 + distance / 40, 0.0, 1.0);
      gray = 128 + condition.contrast * (std::min(gray, 255.0) - 128);
      if (condition.gamma != 1) gray = 255 * std::pow(std::max(gray, 0.0) / 255, condition.gamma);
      frame.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(gray);
    }
  }
}

/// Rows are read one after the other while the camera moves sideways.
void roll_shutter(double shift, cv::Mat& frame, FrameTruth& truth) {
  cv::Mat from(frame.size(), CV_32FC2);
  for (int y = 0; y < frame.rows; ++y) {
    const auto by = static_cast<float>(shift * (1.0 * y / frame.rows - 0.5));
    for (int x = 0; x < frame.cols; ++x) {
      from.at<cv::Vec2f>(y, x) = {static_cast<float>(x) - by, static_cast<float>(y)};
    }
  }
  cv::Mat rolled;
  cv::remap(frame, rolled, from, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  rolled.copyTo(frame);
  for (glm::dvec2& corner : truth.corners) corner.x += shift * (corner.y / frame.rows - 0.5);
}

/// What compression loses: DCT coefficients quantised by the luminance table of ITU-T T.81, Annex
/// K, scaled as libjpeg does. Whole blocks only.
void compress(int quality, cv::Mat& frame) {
  constexpr std::uint8_t kTable[64] = {
      16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
      14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
      18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
      49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
  const int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  cv::Mat block;
  for (int y = 0; y + 8 <= frame.rows; y += 8) {
    for (int x = 0; x + 8 <= frame.cols; x += 8) {
      cv::Mat place = frame(cv::Rect(x, y, 8, 8));
      place.convertTo(block, CV_32F, 1, -128);
      cv::dct(block, block);
      for (int i = 0; i < 64; ++i) {
        const float step = static_cast<float>(std::clamp((kTable[i] * scale + 50) / 100, 1, 255));
        float& value = block.at<float>(i / 8, i % 8);
        value = step * std::round(value / step);
      }
      cv::dct(block, block, cv::DCT_INVERSE);
      block.convertTo(place, CV_8U, 1, 128);
    }
  }
}

}  // namespace

std::vector<FieldCondition> field_conditions() {
  // The bench's own choice: strengths from mild to where trackers break, as a phone indoors shows.
  return {{.name = "plain"},
          {.name = "motion 6 px", .motion_px = 6},
          {.name = "motion 12 px", .motion_px = 12},
          {.name = "defocus 2 px", .defocus_px = 2},
          {.name = "defocus 4 px", .defocus_px = 4},
          {.name = "low light raw", .gain = 0.25, .noise = 8},
          {.name = "low light denoised", .gain = 0.25, .noise = 8, .denoised = true},
          {.name = "gain 0.12", .gain = 0.12},
          {.name = "contrast 0.2", .contrast = 0.2},
          {.name = "contrast 0.1", .contrast = 0.1},
          {.name = "gamma 2.2", .gamma = 2.2},
          {.name = "gamma 0.45", .gamma = 0.45},
          {.name = "jpeg 20", .jpeg_quality = 20},
          {.name = "glare over half", .glare = true},
          {.name = "shadow edge", .shadow = true},
          {.name = "rolling shutter 20 px", .shutter_px = 20},
          {.name = "lens not corrected", .distorting = true},
          {.name = "focal length 0.8", .focal = 0.8},
          {.name = "focal length 1.25", .focal = 1.25},
          {.name = "bend radius 3", .bend_radius = 3},
          {.name = "bend radius 1.5", .bend_radius = 1.5},
          {.name = "bend radius 0.8", .bend_radius = 0.8},
          {.name = "mirrored", .mirrored = true},
          {.name = "other edition", .other_edition = true}};
}

FieldFrame render_field(const GrayImage& pattern, const GrayImage& other, const Camera& camera,
                        const GrayPicture& background, const FieldCondition& condition,
                        Random& random) {
  GrayPicture print = picture_of(mat_of(pattern));
  if (condition.mirrored) cv::flip(mat_of(print), mat_of(print), 1);
  if (condition.other_edition) print = edition_of(pattern, other);
  Camera lens = camera;
  lens.fx *= condition.focal;
  lens.fy *= condition.focal;
  if (condition.distorting) lens.distortion = {-0.25, 0.08, 0, 0, 0};  // a phone's wide lens
  SceneBand band;
  band.area_low = 0.5;
  band.area_high = 2.0;
  const Pose pose = draw_pose(band, print.view(), lens, random);
  const double focus = std::hypot(random.uniform(0.4, 0.9), condition.defocus_px);
  const MotionBlur blur{condition.motion_px, random.uniform(0, pi)};
  FieldFrame out;
  band.pattern = condition.bend_radius <= 0;
  SceneFrame scene =
      render_still(print.view(), lens, pose, background, band, random, 0.65, MotionBlur{});
  cv::Mat frame = mat_of(scene.picture);
  out.truth = {!condition.mirrored && !condition.other_edition, scene.corners};
  if (condition.bend_radius > 0) {
    const BentPaper paper(print.view(), lens, pose, condition.bend_radius);
    paper.draw(frame);
    const auto flat = pattern_corners(print.width, print.height);
    for (std::size_t i = 0; i < 4; ++i) out.truth.corners[i] = paper.project_paper(flat[i]);
  }
  if (condition.defocus_px > 0) cv::GaussianBlur(frame, frame, cv::Size(), focus);
  if (condition.motion_px > 0) blur_motion(blur, scene.picture);
  add_light(condition, out.truth, random, frame);
  if (condition.shutter_px != 0) roll_shutter(condition.shutter_px, frame, out.truth);
  SceneLight light;
  light.gain = condition.gain;
  light.noise = condition.noise;
  expose(scene.picture, light, random, out.picture);
  cv::Mat taken = mat_of(out.picture);
  if (condition.denoised) {
    const cv::Mat noisy = taken.clone();
    cv::bilateralFilter(noisy, taken, 5, 3 * condition.noise, 2);
  }
  if (condition.jpeg_quality > 0) compress(condition.jpeg_quality, taken);
  return out;
}

FieldFrame render_homography(const GrayImage& pattern, const std::array<double, 9>& homography,
                             const GrayPicture& background) {
  FieldFrame out{background, {true, {}}};
  const cv::Matx33d map(homography.data());
  const double right = pattern.width - 0.5;
  const double bottom = pattern.height - 0.5;
  const cv::Vec3d outline[] = {
      {-0.5, -0.5, 1}, {right, -0.5, 1}, {right, bottom, 1}, {-0.5, bottom, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const cv::Vec3d p = map * outline[i];
    out.truth.corners[i] = {p[0] / p[2], p[1] / p[2]};
  }
  // Three samples on a side of a pixel, then their mean.
  constexpr int kFine = 3;
  const cv::Matx33d fine = cv::Matx33d(kFine, 0, 1, 0, kFine, 1, 0, 0, 1) * map;
  cv::Mat frame = mat_of(out.picture);
  cv::Mat shown;
  cv::Mat mask;
  const cv::Mat whole(pattern.height, pattern.width, CV_8UC1, cv::Scalar(255));
  cv::warpPerspective(mat_of(pattern), shown, fine, frame.size() * kFine, cv::INTER_LINEAR,
                      cv::BORDER_REPLICATE);
  cv::warpPerspective(whole, mask, fine, frame.size() * kFine, cv::INTER_NEAREST);
  cv::resize(shown, shown, frame.size(), 0, 0, cv::INTER_AREA);
  cv::resize(mask, mask, frame.size(), 0, 0, cv::INTER_AREA);
  for (int y = 0; y < frame.rows; ++y) {
    for (int x = 0; x < frame.cols; ++x) {
      const int m = mask.at<std::uint8_t>(y, x);
      std::uint8_t& pixel = frame.at<std::uint8_t>(y, x);
      pixel = static_cast<std::uint8_t>(
          (m * shown.at<std::uint8_t>(y, x) + (255 - m) * pixel + 127) / 255);
    }
  }
  return out;
}

GrayPicture edition_of(const GrayImage& pattern, const GrayImage& other) {
  cv::Mat print = mat_of(pattern).clone();
  const cv::Rect middle(print.cols * 3 / 20, print.rows * 3 / 20, print.cols * 7 / 10,
                        print.rows * 7 / 10);
  cv::resize(mat_of(other), print(middle), middle.size(), 0, 0, cv::INTER_AREA);
  return picture_of(print);
}

GrayPicture language_of(const GrayImage& pattern) {
  cv::Mat print = mat_of(pattern).clone();
  const int width = print.cols / 6;
  const int height = std::max(1, print.rows / 20);
  for (int y = print.rows * 3 / 5; y + height <= print.rows; y += height) {
    for (int x = 0; x + width <= print.cols; x += width) {
      cv::Mat words = print(cv::Rect(x, y, width, height));
      const cv::Mat before = words.clone();
      cv::flip(before, words, -1);
    }
  }
  return picture_of(print);
}

HandPath::HandPath(const Pose& middle, Random& random) : middle_(middle) {
  middle_.translation.x = middle_.translation.y = 0.0;
  for (double& value : phase_) value = random.uniform(0.0, 6.28);
}

Pose HandPath::at(double time_s, double speed, double tremor) const {
  const auto sway = [&](std::size_t k, double hertz) {
    return std::sin(2 * pi * hertz * speed * time_s + phase_[k]) +
           0.3 * std::sin(2 * pi * 2.7 * hertz * speed * time_s + phase_[k + 6]);
  };
  Pose pose = middle_;
  pose.rotation =
      rotation_matrix({0.20 * sway(0, 0.31), 0.20 * sway(1, 0.23), 0.25 * sway(2, 0.17)}) *
      middle_.rotation;
  const double depth = middle_.translation.z;
  pose.translation +=
      glm::dvec3(0.10 * sway(3, 0.29), 0.07 * sway(4, 0.37), 0.15 * sway(5, 0.13)) * depth;
  const auto shake = [&](std::size_t k, double hertz) {
    return tremor * std::sin(2 * pi * hertz * time_s + phase_[k]);
  };
  pose.translation += glm::dvec3(0.012 * shake(6, 7.3) + 0.006 * shake(7, 11.9),
                                 0.012 * shake(8, 6.1) + 0.006 * shake(9, 12.7), 0.0) *
                      depth;
  return pose;
}

}  // namespace modar
