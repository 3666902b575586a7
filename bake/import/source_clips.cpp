#include "bake/import/source_clips.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

namespace modar {
namespace {

/// The shorter way round, at constant speed.
glm::dvec4 turned_between(const glm::dvec4& from, glm::dvec4 to, double share) {
  double dot = glm::dot(from, to);
  if (dot < 0) {
    to = -to;
    dot = -dot;
  }
  // Closer than this, the sine has no digits left, and both ways agree to 1e-16.
  if (dot > 1 - 1e-12) return glm::normalize(glm::mix(from, to, share));
  const double angle = std::acos(dot);
  return (std::sin((1 - share) * angle) * from + std::sin(share * angle) * to) / std::sin(angle);
}

}  // namespace

glm::dmat4 JointPlace::matrix() const {
  glm::dmat4 m = glm::mat4_cast(glm::dquat(rotation.w, rotation.x, rotation.y, rotation.z));
  for (int i = 0; i < 3; ++i) m[i] *= scale[i];
  m[3] = glm::dvec4(translation, 1.0);
  return m;
}

glm::dvec4 SourceTrack::at(double time) const {
  const bool cubic = interpolation == Interpolation::kCubic;
  const auto value = [&](std::size_t key) { return values[cubic ? 3 * key + 1 : key]; };
  const auto turned = [this](const glm::dvec4& v) {
    return path == TrackPath::kRotation ? glm::normalize(v) : v;
  };
  const auto above = std::upper_bound(times.begin(), times.end(), time);
  if (above == times.begin()) return turned(value(0));
  const auto key = static_cast<std::size_t>(above - times.begin()) - 1;
  if (above == times.end() || interpolation == Interpolation::kStep) return turned(value(key));
  const double span = times[key + 1] - times[key];
  const double s = (time - times[key]) / span;
  if (!cubic) {
    if (path == TrackPath::kRotation)
      return turned_between(turned(value(key)), turned(value(key + 1)), s);
    return glm::mix(value(key), value(key + 1), s);
  }
  // Hermite's polynomials, as the specification of glTF has them.
  const double s2 = s * s;
  const double s3 = s2 * s;
  const glm::dvec4 leaving = values[3 * key + 2];
  const glm::dvec4 arriving = values[3 * key + 3];
  return turned((2 * s3 - 3 * s2 + 1) * value(key) + span * (s3 - 2 * s2 + s) * leaving +
                (3 * s2 - 2 * s3) * value(key + 1) + span * (s3 - s2) * arriving);
}

std::array<std::uint8_t, 4> VertexBones::bytes() const {
  std::array<std::uint8_t, 4> result{};
  std::size_t most = 0;
  int rest = 255;
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = static_cast<std::uint8_t>(std::lround(weights[i] * 255.0f));
    rest -= result[i];
    if (weights[i] > weights[most]) most = i;
  }
  // Rounding leaves at most two, and the greatest of four that sum to 255 is above.
  result[most] = static_cast<std::uint8_t>(result[most] + rest);
  return result;
}

}  // namespace modar
