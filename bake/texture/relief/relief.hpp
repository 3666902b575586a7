// Normal maps of materials as relief in their base colours.
#pragma once

#include <cstdint>

#include <glm/gtc/quaternion.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// How relief is drawn.
struct ReliefOptions {
  glm::dquat stands{1, 0, 0, 0};  ///< from the model's axes to the neutral room's, whose z is up
  std::uint32_t max_side = 2048;  ///< of the pictures that are made
  unsigned jobs = 1;              ///< the pixels do not depend on it
};

/// Gives materials with a normal map a base colour that shows it: each texel is what it would be
/// multiplied with if the surface looked where the map says, relative to what the device multiplies
/// it with between vertices in the neutral room, upright; the mean where several places show one
/// texel, and 30 % more or less at most. What gets brighter than white makes the material's diffuse
/// greater. New pictures are in a temporary folder that the materials keep. The
/// device then needs nothing of the map. A map that cannot be read is a warning and left out.
/// Errors: kIo where a picture cannot be written.
Result<void> draw_relief(TriMesh& mesh, const ReliefOptions& options, Report& report);

}  // namespace modar
