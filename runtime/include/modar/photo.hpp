// Photos of flat things, as visitors take them: the corners, and the picture between them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <glm/vec2.hpp>

#include "modar/image.hpp"

namespace modar {

/// 8-bit R, G, B and an unused byte, top row first.
struct Photo {
  const std::uint8_t* rgba = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< bytes from row to row
};

/// Clockwise from the top left, pixels of a photo; the top left pixel's corner is (0, 0).
using PhotoCorners = std::array<glm::dvec2, 4>;

/// Longer side of what photo_flat() makes, at most: what trackers need.
inline constexpr int kFlatSide = 512;

/// The corners of one thing on a plain table. Nothing where there is no such thing, or it is of
/// another shape. They are right within some pixels: people correct them.
std::optional<PhotoCorners> photo_corners(const Photo& photo);

/// The picture between four corners, as from the front. Nothing where they are no convex
/// quadrangle.
std::optional<GrayPicture> photo_flat(const Photo& photo, const PhotoCorners& corners);

}  // namespace modar
