// Lines with soft edges, and the display's text.
#include "overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

void blend(std::uint8_t& channel, std::uint8_t colour, double share) {
  const double mixed = channel + (colour - channel) * share;
  channel = static_cast<std::uint8_t>(std::lround(mixed));
}

/// The part of from-to inside the canvas grown by `margin` (Liang-Barsky); false where none is.
bool clip(const Canvas& canvas, double margin, glm::dvec2& from, glm::dvec2& to) {
  const glm::dvec2 low(-margin);
  const glm::dvec2 high(canvas.width - 1 + margin, canvas.height - 1 + margin);
  const glm::dvec2 step = to - from;
  double enter = 0;
  double leave = 1;
  for (int axis = 0; axis < 2; ++axis) {
    if (step[axis] == 0) {
      if (from[axis] < low[axis] || from[axis] > high[axis]) return false;
      continue;
    }
    const double a = (low[axis] - from[axis]) / step[axis];
    const double b = (high[axis] - from[axis]) / step[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (!(enter <= leave)) return false;
  const glm::dvec2 start = from;
  from = start + enter * step;
  to = start + leave * step;
  return true;
}

/// Pixels of one row that can be within `reach` of the segment.
std::array<int, 2> row_span(const Canvas& canvas, int y, glm::dvec2 from, glm::dvec2 to,
                            double reach) {
  double left = std::min(from.x, to.x);
  double right = std::max(from.x, to.x);
  const double rise = to.y - from.y;
  if (std::abs(rise) > 2 * reach) {
    const double slope = (to.x - from.x) / rise;
    const double at_top = from.x + (y - reach - from.y) * slope;
    const double at_bottom = from.x + (y + reach - from.y) * slope;
    left = std::max(left, std::min(at_top, at_bottom));
    right = std::min(right, std::max(at_top, at_bottom));
  }
  return {std::max(0, static_cast<int>(std::floor(left - reach))),
          std::min(canvas.width - 1, static_cast<int>(std::ceil(right + reach)))};
}

}  // namespace

void draw_line(const Canvas& canvas, glm::dvec2 from, glm::dvec2 to, double line_width,
               Colour colour) {
  const double reach = line_width / 2 + 0.5;
  const bool finite = std::isfinite(from.x + from.y + to.x + to.y);
  if (!finite || !clip(canvas, reach, from, to)) return;
  const glm::dvec2 step = to - from;
  const double length2 = glm::dot(step, step);
  const int top = std::max(0, static_cast<int>(std::floor(std::min(from.y, to.y) - reach)));
  const int bottom =
      std::min(canvas.height - 1, static_cast<int>(std::ceil(std::max(from.y, to.y) + reach)));
  for (int y = top; y <= bottom; ++y) {
    const auto [left, right] = row_span(canvas, y, from, to, reach);
    for (int x = left; x <= right; ++x) {
      const glm::dvec2 offset = glm::dvec2(x, y) - from;
      const double along =
          length2 > 0 ? std::clamp(glm::dot(offset, step) / length2, 0.0, 1.0) : 0.0;
      const double share =
          std::clamp(reach - glm::length(offset - along * step), 0.0, std::min(1.0, line_width));
      if (share <= 0) continue;
      std::uint8_t* pixel =
          &canvas.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(canvas.width) +
                        static_cast<std::size_t>(x)) *
                       4];
      blend(pixel[0], colour.r, share);
      blend(pixel[1], colour.g, share);
      blend(pixel[2], colour.b, share);
    }
  }
}

void draw_outline(const Canvas& canvas, const std::array<glm::dvec2, 4>& corners, Colour colour) {
  constexpr Colour kRim{16, 16, 16};
  for (const auto& [width, ink] : {std::pair{3.5, kRim}, std::pair{1.5, colour}}) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      draw_line(canvas, corners[i], corners[(i + 1) % corners.size()], width, ink);
    }
  }
}

namespace {

/// A place of the picture in the frame; false where it is turned away or behind the camera.
bool shows(const PatternSurface& surface, const Camera& camera, const Pose& pose, glm::dvec2 pixel,
           glm::dvec2& at) {
  const auto vector_of = [](const std::array<double, 3>& v) {
    return glm::dvec3(v[0], v[1], v[2]);
  };
  const SurfacePoint point = surface.at(pixel.x, pixel.y);
  const glm::dvec3 seen = pose.rotation * vector_of(point.at) + pose.translation;
  const glm::dvec3 normal =
      pose.rotation * glm::cross(vector_of(point.down), vector_of(point.right));
  if (!(seen.z > 0) || !(glm::dot(normal, seen) < 0)) return false;
  at = project(camera, seen);
  return true;
}

}  // namespace

void draw_outline(const Canvas& canvas, const PatternSurface& surface, const Camera& camera,
                  const Pose& pose, Colour colour) {
  constexpr Colour kRim{16, 16, 16};
  constexpr int kSteps = 24;  // of a side: a chord leaves a half turn by a hundredth of its radius
  const auto draw_rectangle = [&](glm::dvec2 low, glm::dvec2 size, double width, Colour ink) {
    const std::array<glm::dvec2, 4> corners = {low, low + glm::dvec2(size.x, 0), low + size,
                                               low + glm::dvec2(0, size.y)};
    glm::dvec2 last{};
    bool visible = false;
    for (int i = 0; i <= 4 * kSteps; ++i) {
      const auto side = static_cast<std::size_t>(i / kSteps % 4);
      const double share = 1.0 * (i % kSteps) / kSteps;
      const glm::dvec2 pixel = glm::mix(corners[side], corners[(side + 1) % 4], share);
      glm::dvec2 now{};
      const bool here = shows(surface, camera, pose, pixel, now);
      if (here && visible) draw_line(canvas, last, now, width, ink);
      visible = here;
      last = now;
    }
  };
  for (const auto& [width, ink] : {std::pair{3.5, kRim}, std::pair{1.5, colour}}) {
    if (surface.faces().empty()) {
      draw_rectangle(glm::dvec2(-0.5), {surface.width(), surface.height()}, width, ink);
    }
    for (const ShapeFaceRecord& face : surface.faces()) {
      // Just inside of the face, or a neighbour of it in the picture takes the place.
      draw_rectangle({face.place[0] - 0.49, face.place[1] - 0.49},
                     {face.place[2] - 0.02, face.place[3] - 0.02}, width, ink);
    }
  }
}

void RateMeter::add(std::int64_t now_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  if (start_ns_ == 0) {
    start_ns_ = now_ns;
    return;
  }
  ++count_;
  const std::int64_t passed = now_ns - start_ns_;
  if (passed < kSecond) return;
  rate_ = static_cast<double>(count_) * kSecond / static_cast<double>(passed);
  start_ns_ = now_ns;
  count_ = 0;
}

std::string display_text(const FrameReport& report, std::span<const std::string> pattern_names,
                         double fps) {
  std::string text = std::to_string(report.frame) + "  ";
  if (fps > 0) {
    char rate[32];
    // Whole tenths by integers: printf would ask the locale for the point.
    const auto tenths = static_cast<long>(fps * 10 + 0.5);
    std::snprintf(rate, sizeof rate, "%ld.%ld fps  ", tenths / 10, tenths % 10);
    text += rate;
  }
  text += to_string(report.state);
  if (report.visible.empty()) {
    text += std::string(": ") + to_string(report.reason);
  } else if (report.state == Shown::kHidden) {
    text += ": seen once";
  }
  for (const Detection& seen : report.visible) {
    text += "  ";
    if (seen.pattern < pattern_names.size()) text += pattern_names[seen.pattern] + " ";
    text += std::to_string(seen.inliers) + " inliers";
  }
  return text;
}

}  // namespace modar
