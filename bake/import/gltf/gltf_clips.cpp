#include "bake/import/gltf/gltf_clips.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>

#include "bake/import/gltf/gltf_accessor.hpp"
#include "bake/import/gltf/gltf_pose.hpp"
#include "bake/import/gltf/tinygltf_library.hpp"

namespace modar {
namespace {

/// Why a channel is left out, for people; empty: it was read.
using Reason = std::string;

std::optional<TrackPath> path_of(const std::string& word) {
  if (word == "translation") return TrackPath::kTranslation;
  if (word == "rotation") return TrackPath::kRotation;
  if (word == "scale") return TrackPath::kScale;
  if (word == "weights") return TrackPath::kTranslation;  // of joints that weigh
  return std::nullopt;
}

bool read_times(const tinygltf::Model& gltf, int index, std::vector<double>& times) {
  GltfAccessor accessor;
  if (!accessor.open(gltf, index) || accessor.components() != 1 || accessor.size() == 0)
    return false;
  for (std::size_t i = 0; i < accessor.size(); ++i) {
    const double time = accessor.at(i, 0);
    // NaN is in no order. Two keys at one time are a jump.
    if (!(time >= 0 && time < 1e6) || (i > 0 && !(time >= times.back()))) return false;
    times.push_back(time);
  }
  return true;
}

/// which: of `every` tracks whose values take turns.
bool read_values(const tinygltf::Model& gltf, int index, std::size_t components, std::size_t which,
                 std::size_t every, SourceTrack& track) {
  GltfAccessor accessor;
  const bool cubic = track.interpolation == Interpolation::kCubic;
  const bool turns = track.path == TrackPath::kRotation;
  const std::size_t count = track.times.size() * (cubic ? 3 : 1);
  if (!accessor.open(gltf, index) || accessor.components() != components ||
      accessor.size() < count * every) {
    return false;
  }
  for (std::size_t i = 0; i < count; ++i) {
    glm::dvec4 value(0.0);
    for (std::size_t c = 0; c < components; ++c) {
      value[static_cast<int>(c)] = accessor.at(i * every + which, c);
      if (!std::isfinite(value[static_cast<int>(c)])) return false;
    }
    const bool tangent = cubic && i % 3 != 1;
    if (turns && !tangent && !(glm::length(value) > 1e-6)) return false;
    track.values.push_back(value);
  }
  return true;
}

/// One track, or one for each morph target.
Reason read_channel(const tinygltf::Model& gltf, const tinygltf::Animation& animation,
                    const tinygltf::AnimationChannel& channel, std::vector<SourceTrack>& tracks) {
  const auto path = path_of(channel.target_path);
  if (!path)
    return channel.target_path == "pointer" ? "values that KHR_animation_pointer names"
                                            : "an unknown target";
  SourceTrack track;
  track.path = *path;
  const bool known =
      channel.target_node >= 0 && static_cast<std::size_t>(channel.target_node) < gltf.nodes.size();
  if (!known) return "a target that does not exist";
  const tinygltf::Node& node = gltf.nodes[static_cast<std::size_t>(channel.target_node)];
  const bool weighs = channel.target_path == "weights";
  if (!weighs && node.matrix.size() == 16) return "a node that has a matrix";
  const std::size_t count = weighs ? gltf_targets(gltf, node) : 1;
  if (count == 0) return "weights of a mesh without morph targets";
  if (channel.sampler < 0 ||
      static_cast<std::size_t>(channel.sampler) >= animation.samplers.size()) {
    return "a sampler that does not exist";
  }
  const auto& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
  if (sampler.interpolation == "STEP") track.interpolation = Interpolation::kStep;
  if (sampler.interpolation == "CUBICSPLINE") track.interpolation = Interpolation::kCubic;
  if (!read_times(gltf, sampler.input, track.times)) return "keys whose times fall";
  const std::size_t components = weighs ? 1 : track.path == TrackPath::kRotation ? 4 : 3;
  for (std::size_t t = 0; t < count; ++t) {
    tracks.push_back(track);
    if (!read_values(gltf, sampler.output, components, t, count, tracks.back()))
      return "values that are missing or no numbers";
  }
  return {};
}

JointPlace rest_of(const tinygltf::Node& node) {
  JointPlace place;
  for (int i = 0; i < 4; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (node.rotation.size() == 4) place.rotation[i] = node.rotation[k];
    if (i < 3 && node.translation.size() == 3) place.translation[i] = node.translation[k];
    if (i < 3 && node.scale.size() == 3) place.scale[i] = node.scale[k];
  }
  place.rotation = glm::normalize(place.rotation);
  return place;
}

/// Whether a track leaves its joint in its place: exporters write one for each bone.
bool is_still(const SourceTrack& track, const JointPlace& place) {
  glm::dvec4 rest = place.rotation;
  if (track.path == TrackPath::kTranslation) rest = glm::dvec4(place.translation, 0.0);
  if (track.path == TrackPath::kScale) rest = glm::dvec4(place.scale, 0.0);
  const double most = 1e-6 * glm::length(rest);
  const bool cubic = track.interpolation == Interpolation::kCubic;
  for (std::size_t i = 0; i < track.values.size(); ++i) {
    const bool tangent = cubic && i % 3 != 1;
    const glm::dvec4& value = track.values[i];
    const bool turns = track.path == TrackPath::kRotation && !tangent;
    const glm::dvec4 at = turns ? glm::normalize(value) : value;
    const glm::dvec4 wanted = tangent ? glm::dvec4(0.0) : rest;
    if (!(glm::distance(at, wanted) <= most) && !(turns && glm::distance(-at, wanted) <= most)) {
      return false;
    }
  }
  return true;
}

/// Numbers the moved nodes below `roots`, parents first.
class JointFinder {
 public:
  JointFinder(const tinygltf::Model& gltf, const std::vector<bool>& moved, GltfClips& clips)
      : gltf_(gltf), moved_(moved), clips_(clips), joint_of_(gltf.nodes.size(), kNoJoint) {
    clips_.node_joints.assign(gltf.nodes.size(), kNoJoint);
    clips_.node_places.assign(gltf.nodes.size(), glm::dmat4(1.0));
  }

  /// The reader of the scene refuses nodes that are reached twice, and depths beyond its limit.
  void walk(const std::vector<int>& roots) {
    struct Step {
      int node;
      std::uint32_t joint;
      glm::dmat4 before;
    };
    std::vector<Step> waiting;
    std::vector<bool> seen(gltf_.nodes.size(), false);
    for (const int root : roots) waiting.push_back({root, kNoJoint, glm::dmat4(1.0)});
    while (!waiting.empty()) {
      Step step = waiting.back();
      waiting.pop_back();
      const auto n = static_cast<std::size_t>(step.node);
      if (step.node < 0 || n >= seen.size() || seen[n]) continue;
      seen[n] = true;
      const tinygltf::Node& node = gltf_.nodes[n];
      if (moved_[n]) {
        joint_of_[n] = static_cast<std::uint32_t>(clips_.joints.size());
        clips_.joints.push_back({step.joint, step.before, rest_of(node), false});
        step = {step.node, joint_of_[n], glm::dmat4(1.0)};
      } else {
        step.before = step.before * node_transform(node);
      }
      clips_.node_joints[n] = step.joint;
      clips_.node_places[n] = step.before;
      for (const int child : node.children) waiting.push_back({child, step.joint, step.before});
    }
  }

  [[nodiscard]] std::uint32_t joint(int node) const {
    return joint_of_[static_cast<std::size_t>(node)];
  }

 private:
  const tinygltf::Model& gltf_;
  const std::vector<bool>& moved_;
  GltfClips& clips_;
  std::vector<std::uint32_t> joint_of_;
};

JointPlace weight_place(const tinygltf::Model& gltf, const tinygltf::Node& node,
                        std::size_t target) {
  JointPlace place;
  place.translation.x = gltf_weight(gltf, node, target);
  return place;
}

void add_weight_joints(const tinygltf::Model& gltf, GltfClips& clips) {
  for (auto& [of, joint] : clips.weights) {
    const tinygltf::Node& node = gltf.nodes[static_cast<std::size_t>(of.first)];
    joint = static_cast<std::uint32_t>(clips.joints.size());
    clips.joints.push_back({kNoJoint, glm::dmat4(1.0), weight_place(gltf, node, of.second), true});
  }
}

/// See GltfClips::stored.
std::vector<glm::dmat4> stored_places(const GltfClips& clips) {
  std::vector<JointPlace> places;
  for (const SourceJoint& joint : clips.joints) places.push_back(joint.rest);
  for (const SourceTrack& track :
       clips.clips.empty() ? std::vector<SourceTrack>() : clips.clips.front().tracks) {
    const glm::dvec4 value = track.at(0);
    JointPlace& place = places[track.joint];
    if (track.path == TrackPath::kTranslation) place.translation = glm::dvec3(value);
    if (track.path == TrackPath::kRotation) place.rotation = value;
    if (track.path == TrackPath::kScale) place.scale = glm::dvec3(value);
  }
  std::vector<glm::dmat4> result;
  for (std::size_t j = 0; j < places.size(); ++j) {
    for (int i = 0; i < 3; ++i) {
      places[j].scale[i] = places[j].scale[i] == 0 ? 1 : places[j].scale[i];
    }
    const glm::dmat4 own = clips.joints[j].before * places[j].matrix();
    const std::uint32_t parent = clips.joints[j].parent;
    result.push_back(parent == kNoJoint ? own : result[parent] * own);
  }
  return result;
}

struct ReadChannel {
  int node;
  std::optional<std::size_t> target;  ///< that it weighs
  SourceTrack track;
};

struct ReadAnimation {
  std::vector<ReadChannel> channels;  ///< that move their node
  double duration = 0;
  std::size_t read = 0;  ///< channels, the still ones too
  Reason left_out;
};

ReadAnimation read_channels(const tinygltf::Model& gltf, const tinygltf::Animation& animation) {
  ReadAnimation result;
  for (const tinygltf::AnimationChannel& channel : animation.channels) {
    std::vector<SourceTrack> tracks;
    const Reason reason = read_channel(gltf, animation, channel, tracks);
    if (!reason.empty()) {
      if (result.left_out.find(reason) == Reason::npos)
        result.left_out += (result.left_out.empty() ? "" : ", ") + reason;
      continue;
    }
    ++result.read;
    result.duration = std::max(result.duration, tracks[0].times.back());
    const tinygltf::Node& node = gltf.nodes[static_cast<std::size_t>(channel.target_node)];
    for (std::size_t t = 0; t < tracks.size(); ++t) {
      std::optional<std::size_t> target;
      if (channel.target_path == "weights") target = t;
      if (is_still(tracks[t], target ? weight_place(gltf, node, t) : rest_of(node))) continue;
      result.channels.push_back({channel.target_node, target, std::move(tracks[t])});
    }
  }
  return result;
}

std::string name_of(const tinygltf::Animation& animation, std::size_t number) {
  return animation.name.empty() ? "clip " + std::to_string(number + 1) : animation.name;
}

}  // namespace

std::size_t gltf_targets(const tinygltf::Model& gltf, const tinygltf::Node& node) {
  const auto mesh = static_cast<std::size_t>(node.mesh);
  if (node.mesh < 0 || mesh >= gltf.meshes.size() || gltf.meshes[mesh].primitives.empty()) return 0;
  return gltf.meshes[mesh].primitives[0].targets.size();
}

double gltf_weight(const tinygltf::Model& gltf, const tinygltf::Node& node, std::size_t target) {
  const std::vector<double>& weights =
      node.weights.empty() ? gltf.meshes[static_cast<std::size_t>(node.mesh)].weights
                           : node.weights;
  return target < weights.size() ? weights[target] : 0.0;
}

GltfClips gltf_clips(const tinygltf::Model& gltf, const std::vector<int>& roots,
                     const std::string& label, std::vector<Diagnostic>& diagnostics) {
  GltfClips result;
  std::vector<ReadAnimation> animations;
  std::vector<bool> moved(gltf.nodes.size(), false);
  const auto warn = [&](const std::string& message, const char* cure) {
    diagnostics.push_back({"gltf.clip", DiagnosticSeverity::kWarning, label, 0, message, cure});
  };
  for (std::size_t i = 0; i < gltf.animations.size(); ++i) {
    animations.push_back(read_channels(gltf, gltf.animations[i]));
    const ReadAnimation& read = animations.back();
    for (const ReadChannel& each : read.channels) {
      if (each.target) result.weights[{each.node, *each.target}] = kNoJoint;
      if (!each.target) moved[static_cast<std::size_t>(each.node)] = true;
    }
    if (read.left_out.empty()) continue;
    const std::string name = "animation '" + name_of(gltf.animations[i], i) + "' ";
    if (read.read == 0) {
      warn(name + "is left out, and the pose of the file kept: it has " + read.left_out,
           "animate nodes or bones, check the file with the glTF validator and export it again");
    } else {
      warn(name + "is kept without " + read.left_out + ", whose values in the file stay",
           "check the file with the glTF validator and export it again");
    }
  }
  const auto joints = result.weights.size() +
                      static_cast<std::size_t>(std::count(moved.begin(), moved.end(), true));
  // One more may represent what nothing moves.
  if (joints >= kMaxJoints) {
    warn("its animations move " + std::to_string(joints) + " nodes, more than " +
             std::to_string(kMaxJoints - 1) + ", and are left out: the pose of the file is kept",
         "move fewer nodes");
    moved.assign(moved.size(), false);
    animations.clear();
    result.weights.clear();
  }
  JointFinder finder(gltf, moved, result);
  finder.walk(roots);
  add_weight_joints(gltf, result);
  for (std::size_t i = 0; i < animations.size(); ++i) {
    SourceClip clip{name_of(gltf.animations[i], i), animations[i].duration, {}};
    for (ReadChannel& each : animations[i].channels) {
      each.track.joint =
          each.target ? result.weights[{each.node, *each.target}] : finder.joint(each.node);
      if (each.track.joint == kNoJoint) continue;  // in no scene, and nothing of it shows
      clip.tracks.push_back(std::move(each.track));
    }
    std::stable_sort(clip.tracks.begin(), clip.tracks.end(), [](const auto& a, const auto& b) {
      return std::pair(a.joint, a.path) < std::pair(b.joint, b.path);
    });
    // Of two channels with one target the first counts.
    const auto same = [](const auto& a, const auto& b) {
      return a.joint == b.joint && a.path == b.path;
    };
    clip.tracks.erase(std::unique(clip.tracks.begin(), clip.tracks.end(), same), clip.tracks.end());
    if (!clip.tracks.empty()) result.clips.push_back(std::move(clip));
  }
  result.stored = stored_places(result);
  return result;
}

}  // namespace modar
