// Rooms with depth around a pattern, rendered with exact geometry: walls and boards that carry
// photos, and what moves in them.
#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/pattern/pattern.hpp"

namespace modar {

/// A picture, then halved again and again.
using Mipmap = std::vector<GrayPicture>;
Mipmap make_mipmap(GrayPicture picture);

/// A flat rectangle with a picture, in the pattern's world (units of half its longest side, the
/// pattern at z = 0, the viewer at z > 0).
struct Board {
  glm::dvec3 corner;  ///< top left of the picture
  glm::dvec3 right;   ///< to the top right corner, and
  glm::dvec3 down;    ///< to the bottom left one
  const Mipmap* picture = nullptr;
  int repeat = 1;  ///< times that the picture, alternately mirrored, fits each side
};

/// A room behind and around the pattern, which hangs on its wall, with upright boards.
/// pictures: one or more; they must outlive the boards.
std::vector<Board> make_room(std::span<const Mipmap> pictures, Random& random);

/// The pattern as a board of that pose in the world (rotation and translation of its points).
Board board_of(const Mipmap& pattern, const Pose& placed = {});

/// What a camera without distortion sees of the boards: four samples a pixel, grey elsewhere, with
/// noise of `noise` gray values.
GrayPicture render_room(std::span<const Board> boards, const Camera& camera, const Pose& pose,
                        double noise, Random& random);

}  // namespace modar
