// Rays against round objects and faces, some for each pixel of the frame.
#include "bake/pattern/surface_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "modar/pattern_views.hpp"

namespace modar {
namespace {

using std::numbers::pi;

constexpr double kBody = 1.15;  // of a bottle's body to its label, in height
constexpr double kBare = 96;    // grey of unprinted parts

/// Where a ray meets the print.
struct SurfaceHit {
  double distance = 0;
  double facing = 0;  ///< cosine between the normal and the ray
  bool printed = false;
  glm::dvec2 pixel{};  ///< of the picture
};

glm::dvec3 vector_of(const float (&v)[3]) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

class CurvedPrint {
 public:
  CurvedPrint(const GrayImage& pattern, const PatternSurface& surface)
      : surface_(surface),
        width_(pattern.width),
        height_(pattern.height),
        longest_(std::max(pattern.width, pattern.height)),
        rise_(std::sqrt(1 - surface.slope() * surface.slope())) {}

  /// A place of the picture, by the formulas of formats/bundle.md.
  [[nodiscard]] glm::dvec3 at(glm::dvec2 pixel) const {
    if (!surface_.faces().empty()) {
      const ShapeFaceRecord& face = surface_.faces()[0];
      return vector_of(face.corner) +
             (pixel.x + 0.5 - face.place[0]) / face.place[2] * vector_of(face.right) +
             (pixel.y + 0.5 - face.place[1]) / face.place[3] * vector_of(face.down);
    }
    const double x = (2 * pixel.x + 1 - width_) / longest_;
    const double y = (height_ - 2 * pixel.y - 1) / longest_;
    const double r = surface_.radius() + surface_.slope() * y;
    const double a = x / surface_.radius();
    return {r * std::sin(a), rise_ * y, r * std::cos(a) - surface_.radius()};
  }
  [[nodiscard]] std::array<glm::dvec2, 4> corners() const {
    glm::dvec2 low(-0.5);
    glm::dvec2 size(width_, height_);
    if (!surface_.faces().empty()) {
      const auto& place = surface_.faces()[0].place;
      low += glm::dvec2(place[0], place[1]);
      size = {place[2], place[3]};
    }
    return {low, low + glm::dvec2(size.x, 0), low + size, low + glm::dvec2(0, size.y)};
  }
  /// Its middle, about which it is turned, and the distance of its nearest part before that.
  [[nodiscard]] glm::dvec3 middle() const {
    if (surface_.faces().empty()) return {0, 0, -surface_.radius()};
    glm::dvec3 sum(0);
    for (const ShapeFaceRecord& face : surface_.faces()) {
      sum += vector_of(face.corner) + 0.5 * (vector_of(face.right) + vector_of(face.down));
    }
    return sum / static_cast<double>(surface_.faces().size());
  }
  [[nodiscard]] double depth() const {
    if (surface_.faces().empty()) return surface_.radius();
    return glm::length(at(0.5 * (corners()[0] + corners()[2])) - middle());
  }
  /// A ball that holds it, about middle().
  [[nodiscard]] double reach() const {
    if (surface_.faces().empty()) {
      const double half = kBody * height_ / longest_;
      return std::hypot(surface_.radius() + std::fabs(surface_.slope()) * half, half);
    }
    double most = 0;
    for (const ShapeFaceRecord& face : surface_.faces()) {
      for (int k = 0; k < 4; ++k) {
        most = std::max(most, glm::length(vector_of(face.corner) +
                                          static_cast<double>(k % 2) * vector_of(face.right) +
                                          std::floor(0.5 * k) * vector_of(face.down) - middle()));
      }
    }
    return most;
  }
  [[nodiscard]] std::optional<SurfaceHit> meet(const glm::dvec3& eye, const glm::dvec3& ray) const {
    return surface_.faces().empty() ? meet_round(eye, ray) : meet_faces(eye, ray);
  }

 private:
  [[nodiscard]] std::optional<SurfaceHit> meet_round(const glm::dvec3& eye,
                                                     const glm::dvec3& ray) const {
    const double m = surface_.slope() / rise_;
    const double radius = surface_.radius();
    const double oz = eye.z + radius;
    const double width = radius + m * eye.y;
    const double a = ray.x * ray.x + ray.z * ray.z - m * m * ray.y * ray.y;
    const double b = eye.x * ray.x + oz * ray.z - m * ray.y * width;
    const double c = eye.x * eye.x + oz * oz - width * width;
    const double root = b * b - a * c;
    if (!(root >= 0) || a == 0) return std::nullopt;
    std::optional<SurfaceHit> nearest;
    for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
      const glm::dvec3 p = eye + t * ray;
      const double r = radius + m * p.y;
      const double up = p.y / rise_;
      if (!(t > 0) || !(r > 0) || std::fabs(up) > kBody * height_ / longest_) continue;
      if (nearest && nearest->distance < t) continue;
      const double angle = std::atan2(p.x, p.z + radius);
      const glm::dvec3 normal = glm::normalize(glm::dvec3(std::sin(angle), -m, std::cos(angle)));
      SurfaceHit hit;
      hit.distance = t;
      hit.facing = -glm::dot(normal, ray) / glm::length(ray);
      if (hit.facing <= 0)
        hit.facing = -hit.facing;  // the inner side of an open object
      else
        hit.printed =
            std::fabs(angle) <= surface_.half_arc() && std::fabs(up) <= height_ / longest_;
      hit.pixel = {0.5 * (angle * radius * longest_ + width_ - 1),
                   0.5 * (height_ - 1 - up * longest_)};
      nearest = hit;
    }
    return nearest;
  }
  [[nodiscard]] std::optional<SurfaceHit> meet_faces(const glm::dvec3& eye,
                                                     const glm::dvec3& ray) const {
    std::optional<SurfaceHit> nearest;
    for (const ShapeFaceRecord& face : surface_.faces()) {
      const glm::dvec3 right = vector_of(face.right);
      const glm::dvec3 down = vector_of(face.down);
      const glm::dvec3 normal = glm::normalize(glm::cross(down, right));
      const double towards = glm::dot(normal, ray);
      if (!(towards < 0)) continue;
      const double t = glm::dot(normal, vector_of(face.corner) - eye) / towards;
      const glm::dvec3 p = eye + t * ray - vector_of(face.corner);
      const double u = glm::dot(p, right) / glm::dot(right, right);
      const double v = glm::dot(p, down) / glm::dot(down, down);
      if (!(t > 0) || u < 0 || u > 1 || v < 0 || v > 1 || (nearest && nearest->distance < t))
        continue;
      nearest = SurfaceHit{
          t,
          -towards / glm::length(ray),
          true,
          {face.place[0] + u * face.place[2] - 0.5, face.place[1] + v * face.place[3] - 0.5}};
    }
    return nearest;
  }

  const PatternSurface& surface_;
  double width_;
  double height_;
  double longest_;
  double rise_;
};

double picture_at(const GrayPicture& picture, glm::dvec2 at) {
  const double x = std::clamp(at.x, 0.0, picture.width - 1.001);
  const double y = std::clamp(at.y, 0.0, picture.height - 1.001);
  const std::uint8_t* p = picture.pixels.data() + static_cast<std::ptrdiff_t>(y) * picture.width +
                          static_cast<std::ptrdiff_t>(x);
  const double fx = x - std::floor(x);
  const double fy = y - std::floor(y);
  return (p[0] * (1 - fx) + p[1] * fx) * (1 - fy) +
         (p[picture.width] * (1 - fx) + p[picture.width + 1] * fx) * fy;
}

}  // namespace

std::array<glm::dvec2, 4> surface_corners(const GrayImage& pattern, const PatternSurface& surface,
                                          const Camera& camera, const Pose& pose) {
  const CurvedPrint print(pattern, surface);
  auto corners = print.corners();
  for (glm::dvec2& corner : corners) {
    corner = project(camera, pose.rotation * print.at(corner) + pose.translation);
  }
  return corners;
}

Pose surface_pose(const GrayImage& pattern, const PatternSurface& surface, const Camera& camera,
                  double around, double above, double roll, double scale, glm::dvec2 sight) {
  const CurvedPrint print(pattern, surface);
  constexpr double kDegree = pi / 180;
  glm::dmat3 frontal(1.0);
  frontal[1][1] = frontal[2][2] = -1.0;
  const glm::dvec3 ray = glm::normalize(glm::dvec3(sight, 1.0));
  const glm::dvec3 across = glm::cross(glm::dvec3(0, 0, 1), ray);
  const double sine = glm::length(across);
  const glm::dmat3 towards =
      sine > 0 ? rotation_matrix(across * (std::asin(sine) / sine)) : glm::dmat3(1.0);
  Pose pose;
  pose.rotation = towards * rotation_matrix({0, 0, roll * kDegree}) *
                  rotation_matrix({above * kDegree, 0, 0}) * frontal *
                  rotation_matrix({0, -around * kDegree, 0});
  const double step = 2.0 / std::max(pattern.width, pattern.height);
  const double distance = camera.fx * step / scale + print.depth();
  pose.translation = distance * ray - pose.rotation * print.middle();
  return pose;
}

void draw_surface(const GrayImage& pattern, const PatternSurface& surface, const Camera& camera,
                  const Pose& pose, double covered, GrayPicture& frame) {
  const CurvedPrint print(pattern, surface);
  const auto levels = halved(pattern);
  const glm::dmat3 back = glm::transpose(pose.rotation);
  const glm::dvec3 eye = -(back * pose.translation);
  const glm::dvec3 middle = pose.rotation * print.middle() + pose.translation;
  // Frame pixels of the ball around it; a distorting lens moves its edge by less than a quarter.
  const double nearest = std::max(middle.z - print.reach(), 1e-3);
  const double radius = 1.25 * camera.fx * print.reach() / nearest + 4;
  const glm::dvec2 centre = project(camera, middle);
  const auto bound = [](double value, int most) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
  };
  const double step = 2.0 / std::max(pattern.width, pattern.height);
  // Across and down a frame's pixel; an enlarged picture is smooth and needs fewer.
  const int rays = camera.fx * step < nearest ? 3 : 2;
  const double all = rays * rays;
  for (int y = bound(centre.y - radius, frame.height); y < bound(centre.y + radius, frame.height);
       ++y) {
    for (int x = bound(centre.x - radius, frame.width); x < bound(centre.x + radius, frame.width);
         ++x) {
      double sum = 0;
      int hits = 0;
      for (int k = 0; k < rays * rays; ++k) {
        const glm::dvec2 at{x + (k % rays + 0.5) / rays - 0.5,
                            y + (static_cast<int>(k / rays) + 0.5) / rays - 0.5};
        const glm::dvec2 ideal = undistort(camera, at);
        const glm::dvec3 ray = back * glm::dvec3((ideal.x - camera.cx) / camera.fx,
                                                 (ideal.y - camera.cy) / camera.fy, 1.0);
        const auto hit = print.meet(eye, ray);
        if (!hit) continue;
        ++hits;
        double gray = kBare;
        if (hit->printed && hit->pixel.x >= covered * pattern.width - 0.5) {
          // The ray's last coordinate is 1 before the camera: its distance is a depth.
          const double spacing = hit->distance / (camera.fx * step * rays);
          std::size_t level = 0;
          double pixels = 1;
          while (level + 1 < levels.size() && spacing > 1.5 * pixels) {
            ++level;
            pixels *= 2;
          }
          gray = picture_at(levels[level], (hit->pixel + 0.5) / pixels - 0.5);
        }
        sum += gray * (0.7 + 0.3 * hit->facing);
      }
      if (hits == 0) continue;
      std::uint8_t& out =
          frame.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                       static_cast<std::size_t>(x)];
      out = static_cast<std::uint8_t>((sum + (all - hits) * out) / all + 0.5);
    }
  }
}

}  // namespace modar
