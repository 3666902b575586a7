// Painted on a finished picture: outlines of patterns, and the small on-screen display.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include <glm/vec2.hpp>

#include "formats/base/error.hpp"
#include "formats/pattern_shape.hpp"
#include "frame_report.hpp"
#include "modar/camera.hpp"
#include "modar/pose.hpp"

namespace modar {

struct Colour {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
};

/// The caller's R, G, B, A pixels without gaps, top row first.
struct Canvas {
  std::span<std::uint8_t> rgba;
  int width = 0;
  int height = 0;
};

/// A smooth line of that width in pixels, clipped to the canvas. Pixel centres are at whole
/// numbers.
void draw_line(const Canvas& canvas, glm::dvec2 from, glm::dvec2 to, double line_width,
               Colour colour);

/// The closed outline of four corners: a coloured line on a dark rim, seen on any ground.
void draw_outline(const Canvas& canvas, const std::array<glm::dvec2, 4>& corners, Colour colour);

/// The same of a pattern that is not flat: the border of its picture, or of its faces, where that
/// is turned to the camera.
void draw_outline(const Canvas& canvas, const PatternSurface& surface, const Camera& camera,
                  const Pose& pose, Colour colour);

/// Pictures a second over the last second or so.
class RateMeter {
 public:
  void add(std::int64_t now_ns);
  [[nodiscard]] double rate() const { return rate_; }

 private:
  std::int64_t start_ns_ = 0;
  int count_ = 0;
  double rate_ = 0;
};

/// One line: the frame, its state with the reason when lost, and of each pattern seen its name and
/// inliers. fps: 0 leaves it out (pictures of a file are the same in each run).
std::string display_text(const FrameReport& report, std::span<const std::string> pattern_names,
                         double fps);

/// Paints the line on a dark bar along the top. Characters outside ASCII become question marks.
/// Errors: kUnsupported "display.unsupported" in a build without OpenCV's letters.
Result<void> draw_text_bar(const Canvas& canvas, const std::string& text);

}  // namespace modar
