// Patches against the frame.
#include "patch_equations.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace modar::tracker {
namespace {

constexpr float kCount = (2 * kPatchHalf + 1) * (2 * kPatchHalf + 1);
constexpr float kFlat = 4.0f;    // variance below which nothing is to be seen
constexpr float kPlain = 30.0f;  // variance below which noise tells a patch's worth

bool inside(const PatchPlace& place, const GrayImage& image) {
  const float reach_x = kPatchHalf * (std::abs(place.right_x) + std::abs(place.down_x)) + 1.0f;
  const float reach_y = kPatchHalf * (std::abs(place.right_y) + std::abs(place.down_y)) + 1.0f;
  return place.x - reach_x >= 0.0f && place.y - reach_y >= 0.0f &&
         place.x + reach_x < static_cast<float>(image.width - 1) &&
         place.y + reach_y < static_cast<float>(image.height - 1);
}

Pull pull_of(const Patch& p, const PatchSums& s, float forgiving) {
  Pull pull;
  const float inverse = 1.0f / kCount;
  const float var_t = p.tt * inverse - p.t * inverse * p.t * inverse;
  const float var_i = s.ii * inverse - s.i * inverse * s.i * inverse;
  if (var_t < kFlat || var_i < kFlat * 0.25f) return pull;
  const float gain = std::sqrt(var_i / var_t);
  pull.correlation = (s.ti * inverse - p.t * inverse * s.i * inverse) / std::sqrt(var_t * var_i);
  const float miss = (1.0f - pull.correlation) / forgiving;
  if (miss >= 1.0f) return pull;
  // The template is brought to the image's contrast, its gradient too.
  const float weight = (1.0f - miss * miss) * (1.0f - miss * miss) / (var_t + kPlain);
  pull.xx = weight * (p.xx - p.x * p.x * inverse);
  pull.xy = weight * (p.xy - p.x * p.y * inverse);
  pull.yy = weight * (p.yy - p.y * p.y * inverse);
  pull.ex = weight * ((p.tx - p.t * p.x * inverse) - (s.ix - s.i * p.x * inverse) / gain);
  pull.ey = weight * ((p.ty - p.t * p.y * inverse) - (s.iy - s.i * p.y * inverse) / gain);
  return pull;
}

}  // namespace

/// The view of a level for a map; no patches where the pattern has no image for it.
glm::vec2 way_of(const Pull& pull) {
  const float stiff = 0.1f * (pull.xx + pull.yy);
  const float xx = pull.xx + stiff;
  const float yy = pull.yy + stiff;
  const float determinant = xx * yy - pull.xy * pull.xy;
  if (!(determinant > 0.0f)) return {0.0f, 0.0f};
  return glm::vec2{yy * pull.ex - pull.xy * pull.ey, xx * pull.ey - pull.xy * pull.ex} /
         determinant;
}

View view_of(const TrackedPattern& pattern, const Scene& scene, int frame_level,
             const PlaneMap& map, std::size_t few) {
  const Resolution best = finest(pattern, map, static_cast<int>(scene.pyramid.size()));
  View view{&scene.pyramid[static_cast<std::size_t>(frame_level)],
            &scene.kernels,
            {frame_level, best.pattern_level + frame_level - best.frame_level},
            {}};
  if (view.at.pattern_level < 0 || view.at.pattern_level >= pattern.level_count) return view;
  view.patches = scene.patches.of(pattern, view.at.pattern_level);
  view.stride = std::max<std::size_t>(1, view.patches.size() / few);
  return view;
}

bool glance(const View& view, const PlaneMap& map, const Patch& patch, float forgiving,
            Glance& out) {
  const double shrink = 1.0 / static_cast<double>(1 << view.at.frame_level);
  const double grow = static_cast<double>(1 << view.at.pattern_level);
  bool ahead = false;
  out.seen = map.at(patch.centre, ahead);
  if (!ahead) return false;
  const glm::dmat2 d = map.derivative(patch.centre) * (grow * shrink);
  out.slope = d;
  const PatchPlace place{static_cast<float>((out.seen.x + 0.5) * shrink - 0.5),
                         static_cast<float>((out.seen.y + 0.5) * shrink - 0.5),
                         static_cast<float>(d[0].x),
                         static_cast<float>(d[0].y),
                         static_cast<float>(d[1].x),
                         static_cast<float>(d[1].y)};
  if (!inside(place, *view.image)) return false;
  const PatchSums sums =
      view.kernels->patch_sums(patch.pixels, place, view.image->pixels, view.image->stride);
  out.pull = pull_of(patch, sums, forgiving);
  return true;
}

PoseSlope pose_slope(const Camera& camera, const Pose& pose, glm::dvec2 world, double scale) {
  const glm::dvec3 turned = pose.rotation * glm::dvec3(world, 0.0);
  const glm::dvec3 p = turned + pose.translation;
  const double fx = scale * camera.fx / p.z;
  const double fy = scale * camera.fy / p.z;
  const double x = p.x / p.z;
  const double y = p.y / p.z;
  return {{-fx * x * turned.y, fx * (turned.z + x * turned.x), -fx * turned.y, fx, 0, -fx * x},
          {-fy * (turned.z + y * turned.y), fy * y * turned.x, fy * turned.x, 0, fy, -fy * y}};
}

double move(const TrackedPattern& pattern, const Camera& camera, double scale,
            const std::array<double, 6>& change, Pose& pose) {
  const glm::dvec3 translation = pose.translation + glm::dvec3(change[3], change[4], change[5]);
  if (!(translation.z > 0.0)) return -1.0;
  const double right = pattern.width();
  const double bottom = pattern.height();
  double most = 0.0;
  for (const glm::dvec2 corner : {glm::dvec2{0, 0}, {right, 0}, {0, bottom}, {right, bottom}}) {
    const PoseSlope slope = pose_slope(camera, pose, pattern.to_world(corner), scale);
    most = std::max(
        most, std::hypot(std::inner_product(slope.x.begin(), slope.x.end(), change.begin(), 0.0),
                         std::inner_product(slope.y.begin(), slope.y.end(), change.begin(), 0.0)));
  }
  pose.rotation = rotation_matrix({change[0], change[1], change[2]}) * pose.rotation;
  pose.translation = translation;
  return most;
}

}  // namespace modar::tracker
