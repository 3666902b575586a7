// The animations of a glTF file: nodes that move as joints, channels as tracks.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>

#include "bake/import/source_clips.hpp"
#include "bake/report.hpp"

namespace tinygltf {
class Model;
}  // namespace tinygltf

namespace modar {

struct GltfClips {
  std::vector<SourceJoint> joints;
  std::vector<SourceClip> clips;           ///< each has a track
  std::vector<std::uint32_t> node_joints;  ///< of each node: that it moves with, or kNoJoint
  std::vector<glm::dmat4> node_places;     ///< of each node: to the space of that, or the scene's
  /// Where each joint is in the scene while its vertices are stored: where the first clip begins,
  /// as rest poses may be elsewhere. Scales of 0, which flatten what they hide, are 1.
  std::vector<glm::dmat4> stored;
};

/// Tracks of nodes in the scene that `roots` span. What cannot be read (targets that do not exist,
/// times that do not rise, weights of morph targets) is left out, with a diagnostic for each clip.
GltfClips gltf_clips(const tinygltf::Model& gltf, const std::vector<int>& roots,
                     const std::string& label, std::vector<Diagnostic>& diagnostics);

}  // namespace modar
