// A clip as the bytes of its tracks: the fewest keys with which no point moves further than
// allowed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"

namespace modar {

/// Points that move with a joint: in its own space, as its rest place has them.
struct JointPoints {
  std::uint32_t joint = 0;
  std::vector<glm::dvec3> points;
};

struct FittedClip {
  std::vector<std::byte> bytes;  ///< of clip_tracks.hpp; empty where nothing moves by `bound`
  double error = 0;  ///< greatest distance of a point from the source's, over all samples
  std::size_t keys = 0;
};

/// Joints' places in the scene at a time of the clip.
std::vector<glm::dmat4> clip_pose(std::span<const SourceJoint> joints, const SourceClip& clip,
                                  double time);
/// The same of the tracks' bytes, at a sample. keys: of each track, for the next call.
std::vector<glm::dmat4> tracks_pose(std::span<const SourceJoint> joints, const ClipTracksView& view,
                                    double sample, std::vector<std::uint32_t>& keys);

/// At least two, no more than 1/kClipRate seconds apart, over the whole duration; on the keys of
/// the clip where these are equally far apart.
std::uint32_t clip_samples(const SourceClip& clip);

/// bound: scene units, greatest distance at any sample. Deterministic.
FittedClip fit_clip(std::span<const SourceJoint> joints, const SourceClip& clip,
                    std::span<const JointPoints> points, double bound);

}  // namespace modar
