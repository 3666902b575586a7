// Paints on a finished picture: the outline of a pattern.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <glm/vec2.hpp>

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

/// A smooth line of that width in pixels, clipped to the canvas. Pixel centres lie on whole
/// numbers.
void draw_line(const Canvas& canvas, glm::dvec2 from, glm::dvec2 to, double line_width,
               Colour colour);

/// The closed outline of four corners: a coloured line on a dark rim, seen on any ground.
void draw_outline(const Canvas& canvas, const std::array<glm::dvec2, 4>& corners, Colour colour);

}  // namespace modar
