// Normals for the corners that a file gives none. Internal to this room.
#pragma once

#include <cstdint>

#include "bake/import/source_model.hpp"

namespace modar {

/// What make_normals() did.
struct MadeNormals {
  std::uint64_t bad = 0;      ///< corners whose own normal has no direction
  std::uint64_t made = 0;     ///< normals
  bool noise = false;         ///< its creases were taken for noise and smoothed
  Array<std::uint32_t> from;  ///< position that each position appended to the model is a copy of
};

/// Whether a source normal has a direction.
bool has_direction(const glm::vec3& normal);

/// Whether all corners of triangles use their position's number for their uv, where they have any,
/// and share the normal at their position, if not stated then within one smoothing group.
bool has_identity_indices(const SourceModel& source);

/// Gives each corner without a normal one, weighted by area and angle: its face's in smoothing
/// group 0, else that of the faces of its group around the position. Where no group is stated,
/// edges whose faces differ by more than `crease` degrees stay sharp, unless most creases end in
/// nothing, as the noise of scans does. Triangles that occur in both windings are kept apart.
/// Models with identity indices keep them: corners of sharp edges get copies of their positions.
MadeNormals make_normals(SourceModel& source, double crease);

}  // namespace modar
