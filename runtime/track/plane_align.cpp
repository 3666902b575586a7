// Patch-wise Gauss-Newton alignment of a plane, and the photometric check of a detection.
#include "plane_align.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <glm/geometric.hpp>

namespace modar::loop {
namespace {

constexpr int kHalf = 4;  // a patch is 9x9 pixels
constexpr float kCount = (2 * kHalf + 1) * (2 * kHalf + 1);
constexpr float kFlat = 4.0f;       // variance below which nothing is to be seen
constexpr float kHeld = 0.7f;       // correlation of a patch that fits
constexpr double kSettled = 0.002;  // pixels of the level

/// Bilinear value; the caller keeps 0 <= x < width - 1, 0 <= y < height - 1.
inline float sample(const GrayImage& image, float x, float y) {
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const std::uint8_t* p = image.pixels + row * image.stride + column;
  const float a = p[0];
  const float b = p[1];
  const float c = p[image.stride];
  const float d = p[image.stride + 1];
  const float top = a + fx * (b - a);
  const float bottom = c + fx * (d - c);
  return top + fy * (bottom - top);
}

/// Sums over a patch: template t and its gradient (x, y), image i. The gradient is the template's,
/// which has no noise: an image's own noise in both the gradient and the difference would pull
/// towards the middle between pixels.
struct Sums {
  float t = 0, tt = 0, i = 0, ii = 0, ti = 0;
  float x = 0, y = 0, xx = 0, xy = 0, yy = 0, tx = 0, ty = 0, ix = 0, iy = 0;
};

/// Where a patch lies in a pyramid level: its centre, and the steps of a template pixel.
struct PatchPlace {
  float x = 0;
  float y = 0;
  glm::vec2 right{};
  glm::vec2 down{};
};

bool inside(const PatchPlace& place, const GrayImage& image) {
  const float reach_x = kHalf * (std::abs(place.right.x) + std::abs(place.down.x)) + 1.0f;
  const float reach_y = kHalf * (std::abs(place.right.y) + std::abs(place.down.y)) + 1.0f;
  return place.x - reach_x >= 0.0f && place.y - reach_y >= 0.0f &&
         place.x + reach_x < static_cast<float>(image.width - 1) &&
         place.y + reach_y < static_cast<float>(image.height - 1);
}

Sums sum_patch(const GrayImage& templates, int column, int row, const GrayImage& image,
               const PatchPlace& place) {
  Sums s;
  for (int v = -kHalf; v <= kHalf; ++v) {
    const std::uint8_t* t_row = templates.pixels + (row + v) * templates.stride + column;
    const float fv = static_cast<float>(v);
    const float left = place.x + fv * place.down.x;
    const float top = place.y + fv * place.down.y;
    for (int u = -kHalf; u <= kHalf; ++u) {
      const float fu = static_cast<float>(u);
      const float seen = sample(image, left + fu * place.right.x, top + fu * place.right.y);
      const float t = t_row[u];
      const float gx = 0.5f * static_cast<float>(t_row[u + 1] - t_row[u - 1]);
      const float gy =
          0.5f * static_cast<float>(t_row[u + templates.stride] - t_row[u - templates.stride]);
      s.t += t;
      s.tt += t * t;
      s.i += seen;
      s.ii += seen * seen;
      s.ti += t * seen;
      s.x += gx;
      s.y += gy;
      s.xx += gx * gx;
      s.xy += gx * gy;
      s.yy += gy * gy;
      s.tx += t * gx;
      s.ty += t * gy;
      s.ix += seen * gx;
      s.iy += seen * gy;
    }
  }
  return s;
}

/// What a patch says of its own displacement, in template pixels: g d = e, both by its weight.
struct Pull {
  float xx = 0, xy = 0, yy = 0;
  float ex = 0, ey = 0;
  float correlation = 0;
};

Pull pull_of(const Sums& s, float forgiving) {
  Pull pull;
  const float inverse = 1.0f / kCount;
  const float var_t = s.tt * inverse - s.t * inverse * s.t * inverse;
  const float var_i = s.ii * inverse - s.i * inverse * s.i * inverse;
  if (var_t < kFlat || var_i < kFlat * 0.25f) return pull;
  const float gain = std::sqrt(var_i / var_t);
  pull.correlation = (s.ti * inverse - s.t * inverse * s.i * inverse) / std::sqrt(var_t * var_i);
  const float miss = (1.0f - pull.correlation) / forgiving;
  if (miss >= 1.0f) return pull;
  // The template is brought to the image's contrast, its gradient too.
  const float weight = (1.0f - miss * miss) * (1.0f - miss * miss) / var_t;
  pull.xx = weight * (s.xx - s.x * s.x * inverse);
  pull.xy = weight * (s.xy - s.x * s.y * inverse);
  pull.yy = weight * (s.yy - s.y * s.y * inverse);
  pull.ex = weight * ((s.tx - s.t * s.x * inverse) - (s.ix - s.i * s.x * inverse) / gain);
  pull.ey = weight * ((s.ty - s.t * s.y * inverse) - (s.iy - s.i * s.y * inverse) / gain);
  return pull;
}

/// Image pixels of a patch to template pixels.
Eigen::Matrix2d to_template(const PatchPlace& place) {
  const glm::dvec2 right(place.right);
  const glm::dvec2 down(place.down);
  const double inverse = 1.0 / (right.x * down.y - right.y * down.x);
  Eigen::Matrix2d m;
  m << down.y * inverse, -down.x * inverse, -right.y * inverse, right.x * inverse;
  return m;
}

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Derivative of a world point's pixel by a small turn on the left and a shift.
Eigen::Matrix<double, 2, 6> pose_jacobian(const Camera& camera, const Pose& pose, glm::dvec2 world,
                                          double scale) {
  const glm::dvec3 turned = pose.rotation * glm::dvec3(world, 0.0);
  const glm::dvec3 p = turned + pose.translation;
  const double fx = scale * camera.fx / p.z;
  const double fy = scale * camera.fy / p.z;
  const double x = p.x / p.z;
  const double y = p.y / p.z;
  Eigen::Matrix<double, 2, 6> j;
  j << -fx * x * turned.y, fx * (turned.z + x * turned.x), -fx * turned.y, fx, 0, -fx * x,
      -fy * (turned.z + y * turned.y), fy * y * turned.x, fy * turned.x, 0, fy, -fy * y;
  return j;
}

void apply(const Vector6& change, Pose& pose) {
  pose.rotation = rotation_matrix({change(0), change(1), change(2)}) * pose.rotation;
  pose.translation += glm::dvec3(change(3), change(4), change(5));
}

/// One pass over the patches: normal equations and how well they fit.
struct Pass {
  Matrix6 jtj = Matrix6::Zero();
  Vector6 jtr = Vector6::Zero();
  Fit fit;
};

Pass pass_over(const LoopPattern& pattern, const Camera& camera, const GrayImage& image,
               const Resolution& at, float forgiving, const Pose& pose) {
  Pass pass;
  pass.fit.level = at.frame_level;
  const PlaneMap map = map_of_pose(pattern, camera, pose);
  const GrayImage& templates = pattern.levels[static_cast<std::size_t>(at.pattern_level)];
  const double shrink = 1.0 / static_cast<double>(1 << at.frame_level);
  const double grow = static_cast<double>(1 << at.pattern_level);
  for (const LoopPatchRecord& record :
       pattern.patches[static_cast<std::size_t>(at.pattern_level)]) {
    const glm::dvec2 centre{record.x / 64.0 - 0.5, record.y / 64.0 - 0.5};
    const int column = static_cast<int>(record.x / (64.0 * grow));
    const int row = static_cast<int>(record.y / (64.0 * grow));
    if (column <= kHalf || row <= kHalf || column >= templates.width - kHalf - 1 ||
        row >= templates.height - kHalf - 1) {
      continue;
    }
    bool ahead = false;
    const glm::dvec2 seen = map.at(centre, ahead);
    if (!ahead) continue;
    const glm::dmat2 d = map.derivative(centre) * (grow * shrink);
    const PatchPlace place{static_cast<float>((seen.x + 0.5) * shrink - 0.5),
                           static_cast<float>((seen.y + 0.5) * shrink - 0.5), glm::vec2(d[0]),
                           glm::vec2(d[1])};
    if (!inside(place, image)) continue;
    ++pass.fit.visible;
    const Pull pull = pull_of(sum_patch(templates, column, row, image, place), forgiving);
    if (pull.correlation >= kHeld) ++pass.fit.held;
    const Eigen::Matrix<double, 2, 6> j =
        to_template(place) * pose_jacobian(camera, pose, pattern.to_world(centre), shrink);
    Eigen::Matrix2d g;
    g << static_cast<double>(pull.xx), static_cast<double>(pull.xy), static_cast<double>(pull.xy),
        static_cast<double>(pull.yy);
    pass.jtj += j.transpose() * g * j;
    pass.jtr +=
        j.transpose() * Eigen::Vector2d(static_cast<double>(pull.ex), static_cast<double>(pull.ey));
  }
  return pass;
}

float correlation(std::span<const float> a, std::span<const float> b, float& contrast) {
  float sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i];
    sb += b[i];
    saa += a[i] * a[i];
    sbb += b[i] * b[i];
    sab += a[i] * b[i];
  }
  const float n = static_cast<float>(a.size());
  const float va = saa / n - sa / n * sa / n;
  const float vb = sbb / n - sb / n * sb / n;
  contrast = va;
  if (!(va > 0.0f) || !(vb > 0.25f)) return 0.0f;
  return (sab / n - sa / n * sb / n) / std::sqrt(va * vb);
}

}  // namespace

Resolution finest(const LoopPattern& pattern, const PlaneMap& map, int frame_levels) {
  const glm::dmat2 d = map.derivative({0.5 * pattern.width(), 0.5 * pattern.height()});
  // Frame pixels that a pattern's pixel takes up.
  const double scale = std::sqrt(std::abs(d[0].x * d[1].y - d[0].y * d[1].x));
  const int octaves = static_cast<int>(std::lround(std::log2(std::clamp(scale, 1e-3, 1e3))));
  Resolution out;
  out.frame_level = std::clamp(octaves, 0, frame_levels - 1);
  out.pattern_level = std::clamp(out.frame_level - octaves, 0, pattern.level_count - 1);
  return out;
}

Fit align(const LoopPattern& pattern, const Camera& camera, std::span<const GrayImage> pyramid,
          int frame_level, int steps, Pose& pose) {
  const Resolution best =
      finest(pattern, map_of_pose(pattern, camera, pose), static_cast<int>(pyramid.size()));
  const Resolution at{frame_level, best.pattern_level + frame_level - best.frame_level};
  Fit fit;
  fit.level = frame_level;
  if (at.pattern_level < 0 || at.pattern_level >= pattern.level_count) return fit;
  const GrayImage& image = pyramid[static_cast<std::size_t>(frame_level)];
  for (int step = 0; step <= steps; ++step) {
    // While the pose is still off, patches that hardly correlate pull in the right direction too.
    const float forgiving = step == 0 ? 1.0f : 0.7f;
    Pass pass = pass_over(pattern, camera, image, at, forgiving, pose);
    fit = pass.fit;
    if (step == steps || fit.visible < 4) break;
    const double trace = pass.jtj.trace();
    if (!(trace > 0.0)) break;
    pass.jtj.diagonal().array() += 1e-9 * trace;
    const Vector6 change = pass.jtj.ldlt().solve(pass.jtr);
    if (!change.allFinite() || change.head<3>().norm() > 0.5) break;
    apply(change, pose);
    if (!(pose.translation.z > 0.0)) break;
    const double moved = std::sqrt(change.dot(pass.jtj * change) / trace) * camera.fx;
    if (moved < kSettled && step > 0) steps = step + 1;
  }
  return fit;
}

Verdict verify(const LoopPattern& pattern, const PlaneMap& map,
               std::span<const GrayImage> pyramid) {
  constexpr int kCells = 8;
  constexpr int kSide = 6;
  constexpr float kTextured = 16.0f;
  constexpr float kRight = 0.5f;
  const glm::dmat2 d = map.derivative({0.5 * pattern.width(), 0.5 * pattern.height()});
  const double step =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(kCells * kSide);
  const double scale = std::sqrt(std::abs(d[0].x * d[1].y - d[0].y * d[1].x));
  const auto level_of = [](double pixels, int count) {
    return std::clamp(static_cast<int>(std::lround(std::log2(std::max(pixels, 1.0)))), 0,
                      count - 1);
  };
  const auto pattern_level = static_cast<std::size_t>(level_of(step, pattern.level_count));
  const auto frame_level =
      static_cast<std::size_t>(level_of(step * scale, static_cast<int>(pyramid.size())));
  const GrayImage& templates = pattern.levels[pattern_level];
  const GrayImage& image = pyramid[frame_level];
  const double template_shrink = 1.0 / static_cast<double>(1u << pattern_level);
  const double shrink = 1.0 / static_cast<double>(1u << frame_level);
  Verdict verdict;
  std::array<float, kSide * kSide> drawn{};
  std::array<float, kSide * kSide> seen{};
  for (int cell = 0; cell < kCells * kCells; ++cell) {
    bool complete = true;
    for (int k = 0; k < kSide * kSide && complete; ++k) {
      const double u =
          ((cell % kCells) * kSide + k % kSide + 0.5) / (kCells * kSide) * pattern.width();
      const double v =
          (static_cast<int>(cell / kCells) * kSide + static_cast<int>(k / kSide) + 0.5) /
          (kCells * kSide) * pattern.height();
      bool ahead = false;
      const glm::dvec2 p = map.at({u - 0.5, v - 0.5}, ahead);
      const double x = (p.x + 0.5) * shrink - 0.5;
      const double y = (p.y + 0.5) * shrink - 0.5;
      complete = ahead && x >= 0.0 && y >= 0.0 && x < image.width - 1 && y < image.height - 1;
      if (!complete) break;
      const auto at = static_cast<std::size_t>(k);
      seen[at] = sample(image, static_cast<float>(x), static_cast<float>(y));
      const double tx = std::clamp(u * template_shrink - 0.5, 0.0, templates.width - 1.001);
      const double ty = std::clamp(v * template_shrink - 0.5, 0.0, templates.height - 1.001);
      drawn[at] = sample(templates, static_cast<float>(tx), static_cast<float>(ty));
    }
    if (!complete) continue;
    float contrast = 0;
    const float fit = correlation(drawn, seen, contrast);
    if (contrast < kTextured) continue;
    ++verdict.cells;
    if (fit >= kRight) ++verdict.right;
  }
  return verdict;
}

}  // namespace modar::loop
