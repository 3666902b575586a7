// How parts of a model move: its joints, the bones that turn vertices, and the clips of its
// joints. clip_tracks.hpp defines the bytes of a clip's tracks.
#pragma once

#include <cstdint>

#include "formats/clip_tracks.hpp"
#include "formats/layout.hpp"

namespace modar {

inline constexpr std::uint32_t kMostClips = 256;  ///< of a bundle
inline constexpr float kLeastClipSeconds = 1.0f / 1024;
inline constexpr float kMostClipSeconds = 546.0f;  ///< kMaxClipSamples at kClipRate

/// A movement of a model's joints. Time 0 to seconds.
struct ClipRecord {
  NameRef name;          ///< not empty; no other clip of the model has it
  std::uint32_t model;   ///< index into kModels; those of one model follow each other
  std::uint32_t tracks;  ///< the clip that owns the kClipTracks section: this one, or an earlier
                         ///< one whose tracks are the same
  float seconds;
  float error;  ///< model space: no vertex is further from the source's place, at any sample
  std::uint32_t reserved[2];
};
static_assert(sizeof(ClipRecord) == 32);

/// A place that clips move. Its matrix to model space is that of its parent, times `before`, times
/// translation, rotation and scale (in that order of factors): those of the clip, where it has a
/// track, else these.
struct JointRecord {
  std::uint32_t model;   ///< those of one model follow each other
  std::uint32_t parent;  ///< of the same model and a lower index, or kNone
  float before[12];      ///< rows of a 3x4 matrix: to the parent's space, or the model's
  float translation[3];
  float rotation[4];  ///< unit quaternion x, y, z, w
  float scale[3];
};
static_assert(sizeof(JointRecord) == 96);

/// What moves vertices: model space at a time of a clip = matrix of the joint * inverse * stored
/// position.
struct BoneRecord {
  std::uint32_t joint;  ///< index into kJoints
  std::uint32_t reserved[3];
  float inverse[12];  ///< rows of a 3x4 matrix: from the stored place to the joint's space
};
static_assert(sizeof(BoneRecord) == 64);

/// A material whose chunks move. One bone and no target: all of it. Else each vertex has the
/// attributes kJoints and kWeights. A target's bone moves stored places before the others: its
/// matrix's shift along x is how far the farthest vertex is moved, kMorphX to Z the vertex's part.
struct PartRecord {
  std::uint32_t material;  ///< index into kMaterials; rising
  std::uint32_t first_bone;
  std::uint32_t bone_count;    ///< 1 to kMostPartBones
  std::uint32_t target_count;  ///< to kMostPartTargets: morph targets, whose bones follow
  float
      bounds_min[3];  ///< model space, conservative over all clips, the rest pose and stored places
  float bounds_max[3];

  [[nodiscard]] bool rigid() const { return bone_count == 1 && target_count == 0; }
};
static_assert(sizeof(PartRecord) == 40);

/// A clip that a scene's model plays from when its pattern is found; a scene has at most one.
struct SceneClipRecord {
  std::uint32_t scene;  ///< rising
  std::uint32_t clip;   ///< of the scene's model
  std::uint32_t flags;  ///< SceneClipFlags
  std::uint32_t reserved;
};
static_assert(sizeof(SceneClipRecord) == 16);

}  // namespace modar
