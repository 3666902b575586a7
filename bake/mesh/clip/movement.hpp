// All clips of a model as bytes, with their error and the room that its parts take.
#pragma once

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/clip/clip_fit.hpp"
#include "bake/mesh/tri_mesh.hpp"

namespace modar {

struct FittedMovement {
  struct Clip {
    std::string name;  ///< no two have the same
    double seconds = 0;
    FittedClip fitted;
  };
  struct Box {
    glm::dvec3 low{0.0};
    glm::dvec3 high{0.0};
  };
  std::vector<Clip> clips;  ///< that move a vertex by more than the bound
  std::vector<Box> boxes;   ///< scene, of each part: as stored, at rest, and through all clips
};

/// bound: scene units, greatest distance of a vertex from its place in the source that keys may
/// cost at any sample; each clip states the distance that all vertices have, with stored weights.
/// Clips that are too long for the memory of a workstation are left out, with a diagnostic. The
/// result does not depend on `jobs`.
FittedMovement fit_movement(const SourceModel& model, double bound, unsigned jobs,
                            std::vector<Diagnostic>& diagnostics);

/// A mesh of that movement's model at a time of a clip of the source, seconds: positions and
/// normals.
TriMesh moved_mesh(const TriMesh& mesh, const SourceMovement& movement, const SourceClip& clip,
                   double time);

}  // namespace modar
