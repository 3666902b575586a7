// The animations of a glTF file: nodes that move as joints, channels as tracks.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <glm/mat4x4.hpp>

#include "bake/import/source_clips.hpp"
#include "bake/report.hpp"

namespace tinygltf {
class Model;
class Node;
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
  /// Of a node and a morph target of its mesh: the joint that weighs it, the last ones.
  std::map<std::pair<int, std::size_t>, std::uint32_t> weights;
};

/// Of a node's mesh.
std::size_t gltf_targets(const tinygltf::Model& gltf, const tinygltf::Node& node);
/// The weight of a morph target of the node's mesh where no clip plays.
double gltf_weight(const tinygltf::Model& gltf, const tinygltf::Node& node, std::size_t target);

/// Tracks of nodes in the scene that `roots` span. What cannot be read (targets that do not exist,
/// times that do not rise) is left out, with a diagnostic for each clip.
GltfClips gltf_clips(const tinygltf::Model& gltf, const std::vector<int>& roots,
                     const std::string& label, std::vector<Diagnostic>& diagnostics);

}  // namespace modar
