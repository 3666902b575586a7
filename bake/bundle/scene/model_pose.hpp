// Where a model's vertices are at a time of one of its clips.
#pragma once

#include <cstdint>
#include <map>
#include <span>
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
  std::map<std::uint32_t, std::vector<glm::dmat4>> bones_;  // of each material that moves
};

/// The first clip of a model; kNone where it has none.
std::uint32_t first_clip(const BundleContent& content, std::uint32_t model);

/// As stored where clip is kNone.
ModelPose pose_at(const BundleContent& content, std::uint32_t clip, double share);
/// Where the first clip of a model begins.
ModelPose first_pose(const BundleContent& content, std::uint32_t model);
ModelPose first_pose(const BundleView& bundle, std::uint32_t model);

}  // namespace modar
