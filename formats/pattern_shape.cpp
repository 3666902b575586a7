// Points of curved and boxed patterns by sums, products and square roots alone, and the rules of
// their section.
#include "formats/pattern_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/base/turn.hpp"

namespace modar {
namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

double dot(const float (&a)[3], const float (&b)[3]) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return sum;
}

const char* check_face(const ShapeFaceRecord& face, std::uint32_t width, std::uint32_t height) {
  const auto near = [](const float(&v)[3]) {  // NaN is not
    return std::all_of(std::begin(v), std::end(v), [](float part) {
      return std::fabs(static_cast<double>(part)) <= kMostShapeNumber;
    });
  };
  if (face.place[2] == 0 || face.place[3] == 0 ||
      std::uint32_t{face.place[0]} + face.place[2] > width ||
      std::uint32_t{face.place[1]} + face.place[3] > height) {
    return "a face is outside the picture";
  }
  if (!near(face.corner) || !near(face.right) || !near(face.down)) {
    return "a face's place is not within 1000 units";
  }
  const double right = dot(face.right, face.right);
  const double down = dot(face.down, face.down);
  const double both = dot(face.right, face.down);
  if (!(right > 0) || !(down > 0) || !(both * both <= 1e-6 * right * down)) {
    return "a face's edges are not at right angles";
  }
  return nullptr;
}

}  // namespace

PatternSurface PatternSurface::round(int width, int height, double half_arc, double slope) {
  PatternSurface out;
  out.kind_ = static_cast<std::uint32_t>(ShapeKind::kRound);
  out.width_ = width;
  out.height_ = height;
  out.half_arc_ = half_arc;
  out.slope_ = slope;
  out.radius_ = out.width_ / std::max(out.width_, out.height_) / half_arc;
  out.rise_ = std::sqrt(1 - slope * slope);
  return out;
}

PatternSurface PatternSurface::of_faces(int width, int height,
                                        std::span<const ShapeFaceRecord> faces) {
  PatternSurface out;
  out.kind_ = static_cast<std::uint32_t>(ShapeKind::kFaces);
  out.width_ = width;
  out.height_ = height;
  out.faces_ = faces;
  return out;
}

/// Of the face whose rectangle is nearest.
SurfacePoint PatternSurface::on_face(double x, double y) const {
  const ShapeFaceRecord* nearest = faces_.data();
  double least = 1e300;
  for (const ShapeFaceRecord& face : faces_) {
    const double u = x + 0.5 - face.place[0];
    const double v = y + 0.5 - face.place[1];
    const double away =
        std::max({-u, u - face.place[2], 0.0}) + std::max({-v, v - face.place[3], 0.0});
    if (away >= least) continue;
    least = away;
    nearest = &face;
  }
  SurfacePoint point;
  const double u = x + 0.5 - nearest->place[0];
  const double v = y + 0.5 - nearest->place[1];
  for (std::size_t i = 0; i < 3; ++i) {
    point.right[i] = static_cast<double>(nearest->right[i]) / nearest->place[2];
    point.down[i] = static_cast<double>(nearest->down[i]) / nearest->place[3];
    point.at[i] = static_cast<double>(nearest->corner[i]) + u * point.right[i] + v * point.down[i];
  }
  return point;
}

SurfacePoint PatternSurface::at(double x, double y) const {
  const double step = 2 / std::max(width_, height_);  // of a pixel, pattern units
  const double along = (x + 0.5 - 0.5 * width_) * step;
  const double up = (0.5 * height_ - y - 0.5) * step;
  if (kind_ == 0) return {{along, up, 0}, {step, 0, 0}, {0, -step, 0}, {}};
  if (!faces_.empty()) return on_face(x, y);
  const auto [cosine, sine] = turn_of(along / radius_);
  const double radius = radius_ + slope_ * up;
  const double stretch = step * radius / radius_;
  return {{radius * sine, rise_ * up, radius * cosine - radius_},
          {stretch * cosine, 0, -stretch * sine},
          {-step * slope_ * sine, -step * rise_, -step * slope_ * cosine},
          {-stretch * step / radius_ * sine, 0, -stretch * step / radius_ * cosine}};
}

const char* view_pattern_shape(std::span<const std::byte> bytes, std::uint32_t width,
                               std::uint32_t height, PatternSurface& surface) {
  PatternShapeHeader header{};
  if (bytes.size() < sizeof header) return "it is cut short";
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.face_count > kMaxShapeFaces ||
      bytes.size() != sizeof header + header.face_count * sizeof(ShapeFaceRecord)) {
    return "its faces do not fill the section";
  }
  if (header.kind == static_cast<std::uint32_t>(ShapeKind::kRound)) {
    const double longest = std::max(width, height);
    if (header.face_count != 0) return "a round shape has faces";
    if (!(header.half_arc > 0) || !(header.half_arc <= kHalfTurn)) {
      return "its arc is not above 0 and at most a turn";
    }
    const double radius = width / longest / header.half_arc;
    if (!(std::fabs(header.slope) < 1) || !(std::fabs(header.slope) * height / longest < radius)) {
      return "its slope leaves no radius above 0";
    }
    surface = PatternSurface::round(static_cast<int>(width), static_cast<int>(height),
                                    header.half_arc, header.slope);
    return nullptr;
  }
  if (header.kind != static_cast<std::uint32_t>(ShapeKind::kFaces)) return "its kind is unknown";
  if (header.face_count == 0) return "it has no faces";
  if (header.half_arc != 0 || header.slope != 0) return "faces have an arc or a slope";
  const std::span<const ShapeFaceRecord> faces{
      reinterpret_cast<const ShapeFaceRecord*>(bytes.data() + sizeof header), header.face_count};
  for (const ShapeFaceRecord& face : faces) {
    if (const char* fault = check_face(face, width, height)) return fault;
  }
  surface = PatternSurface::of_faces(static_cast<int>(width), static_cast<int>(height), faces);
  return nullptr;
}

}  // namespace modar
