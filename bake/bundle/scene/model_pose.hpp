// Where a model's vertices are at a time of one of its clips.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>

#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

class ModelPose {
 public:
  /// As the vertices are stored.
  ModelPose() = default;
  /// tracks: of the clip. share: of its time, 0 to 1. joints, bones, parts: of the bundle.
  ModelPose(std::span<const JointRecord> joints, std::span<const BoneRecord> bones,
            std::span<const PartRecord> parts, const ClipRecord& clip,
            std::span<const std::byte> tracks, double share);

  /// Model space; vertex: of a chunk of the clip's model.
  [[nodiscard]] glm::dvec3 place(const LayoutRecord& layout, const VertexDecoder& decoder,
                                 const ChunkRecord& chunk, const std::byte* vertex) const;

 private:
  /// Of each material that moves: its bones, and how far its morph targets move a vertex.
  struct Part {
    std::vector<glm::dmat4> bones;
    std::vector<double> targets;
  };
  std::map<std::uint32_t, Part> parts_;
};

/// The clip of a model that a scene plays: that of the name, or else the first, but none where the
/// name is kNoClip. kNone: none.
std::uint32_t clip_named(const BundleContent& content, std::uint32_t model,
                         const std::string& name);

/// As stored where clip is kNone.
ModelPose pose_at(const BundleContent& content, std::uint32_t clip, double share);
/// Where the clip of a scene begins; as stored where it plays none.
ModelPose scene_pose(const BundleView& bundle, std::uint32_t scene);

}  // namespace modar
