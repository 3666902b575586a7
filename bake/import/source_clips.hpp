// The joints of a model file and the clips that move them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "formats/clip_tracks.hpp"

namespace modar {

/// Translation, rotation (x, y, z, w) and scale: the joint's place in its parent is their product,
/// translation first.
struct JointPlace {
  glm::dvec3 translation{0.0};
  glm::dvec4 rotation{0.0, 0.0, 0.0, 1.0};
  glm::dvec3 scale{1.0};

  [[nodiscard]] glm::dmat4 matrix() const;
};

inline constexpr std::uint32_t kNoJoint = 0xFFFFFFFFu;

/// A node that a clip moves. parent: of a lower index, or kNoJoint. before: from the parent's space
/// (the scene's) to that of the joint's place, through the nodes between, which nothing moves.
/// weighs: no node, but a morph target: its translation along x is the weight, which `before` turns
/// into the way of the farthest vertex from where it is stored.
struct SourceJoint {
  std::uint32_t parent = kNoJoint;
  glm::dmat4 before{1.0};
  JointPlace rest;
  bool weighs = false;
};

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubic };

/// Times never fall, in seconds; the values before the first and behind the last hold. Of kCubic
/// each time has three values: tangent before, value, tangent behind.
struct SourceTrack {
  std::uint32_t joint = 0;
  TrackPath path = TrackPath::kTranslation;
  Interpolation interpolation = Interpolation::kLinear;
  std::vector<double> times;
  std::vector<glm::dvec4> values;

  /// A rotation has unit length.
  [[nodiscard]] glm::dvec4 at(double time) const;
};

struct SourceClip {
  std::string name;
  double duration = 0;  ///< seconds: the last time of its tracks
  std::vector<SourceTrack> tracks;
};

/// What turns vertices: from the place where they are stored, in the scene, to the joint's space.
struct SourceBone {
  std::uint32_t joint = 0;
  glm::dmat4 inverse{1.0};
};

/// Faces of one material that move with at most kMostPartBones bones and kMostPartTargets targets.
struct SourcePart {
  std::vector<SourceBone> bones;
  std::vector<std::uint32_t> targets;  ///< joints that weigh

  [[nodiscard]] bool rigid() const { return bones.size() == 1 && targets.empty(); }
};

/// Of a vertex: bones of its part, and the share of each; the sum is 1.
struct VertexBones {
  std::array<std::uint8_t, 4> bones{};
  std::array<float, 4> weights{1.0f, 0.0f, 0.0f, 0.0f};
  /// Its way along x of each target of its part, then y and z: in kMorphUnits of the farthest.
  std::array<std::array<std::int16_t, kMostPartTargets>, 3> morphs{};

  /// In 255ths, whose sum is 255.
  [[nodiscard]] std::array<std::uint8_t, 4> bytes() const;
};

/// How a model moves.
struct SourceMovement {
  std::vector<SourceJoint> joints;  ///< parents first
  std::vector<SourceClip> clips;
  std::vector<SourcePart> parts;  ///< SourceMaterial::part counts them
};

}  // namespace modar
