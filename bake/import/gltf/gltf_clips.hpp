// The animations of a glTF file: nodes that move as joints, channels as tracks.
#pragma once

#include <vector>

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
};

/// Tracks of nodes in the scene that `roots` span. What cannot be read (targets that do not exist,
/// times that do not rise, weights of morph targets) is left out, with a diagnostic for each clip.
GltfClips gltf_clips(const tinygltf::Model& gltf, const std::vector<int>& roots,
                     const std::string& label, std::vector<Diagnostic>& diagnostics);

}  // namespace modar
