#include "bake/bundle/scene/model_pose.hpp"

#include <algorithm>

#include "bake/mesh/clip/movement.hpp"
#include "bake/options/request.hpp"
#include "formats/component.hpp"

namespace modar {
namespace {

glm::dmat4 matrix_of(const float (&rows)[12]) {
  glm::dmat4 m(1.0);
  for (int i = 0; i < 12; ++i) m[i % 4][i / 4] = static_cast<double>(rows[i]);
  return m;
}

/// The joints of a model, as the source had them, but that roots lead to model space.
std::vector<SourceJoint> joints_of(std::span<const JointRecord> records, std::uint32_t first,
                                   std::uint32_t model) {
  std::vector<SourceJoint> joints;
  for (std::uint32_t j = first; j < records.size() && records[j].model == model; ++j) {
    const JointRecord& record = records[j];
    SourceJoint joint{
        record.parent == kNone ? kNoJoint : record.parent - first, matrix_of(record.before), {}};
    for (int i = 0; i < 4; ++i) joint.rest.rotation[i] = static_cast<double>(record.rotation[i]);
    for (int i = 0; i < 3; ++i) {
      joint.rest.translation[i] = static_cast<double>(record.translation[i]);
      joint.rest.scale[i] = static_cast<double>(record.scale[i]);
    }
    joints.push_back(joint);
  }
  return joints;
}

template <class T>
std::vector<T> copied(const Table<T>& table) {
  std::vector<T> records;
  for (const T& each : table) records.push_back(each);
  return records;
}

}  // namespace

ModelPose::ModelPose(std::span<const JointRecord> joints, std::span<const BoneRecord> bones,
                     std::span<const PartRecord> parts, const ClipRecord& clip,
                     std::span<const std::byte> tracks, double share) {
  std::uint32_t first = 0;
  while (joints[first].model != clip.model) ++first;
  const std::vector<SourceJoint> rest = joints_of(joints, first, clip.model);
  ClipTracksView view;
  std::vector<std::uint32_t> keys;
  double sample = 0;
  if (view_clip_tracks(tracks, static_cast<std::uint32_t>(rest.size()), view) == nullptr) {
    sample = share * (view.header->sample_count - 1);
  } else {
    view = {};
  }
  const std::vector<glm::dmat4> matrices = tracks_pose(rest, view, sample, keys);
  for (const PartRecord& part : parts) {
    if (joints[bones[part.first_bone].joint].model != clip.model) continue;
    Part& own = parts_[part.material];
    const std::uint32_t targets = part.first_bone + part.bone_count;
    for (std::uint32_t b = part.first_bone; b < targets + part.target_count; ++b) {
      const glm::dmat4 m = matrices[bones[b].joint - first] * matrix_of(bones[b].inverse);
      if (b < targets) own.bones.push_back(m);
      if (b >= targets) own.targets.push_back(m[3].x);
    }
  }
}

glm::dvec3 ModelPose::place(const LayoutRecord& layout, const VertexDecoder& decoder,
                            const ChunkRecord& chunk, const std::byte* vertex) const {
  glm::dvec3 stored = decoder.position(vertex, chunk);
  const auto found = parts_.find(chunk.material);
  if (found == parts_.end()) return stored;
  const auto& [bones, targets] = found->second;
  for (std::uint32_t t = 0; t < targets.size(); ++t) {
    for (int axis = 0; axis < 3; ++axis)
      stored[axis] += targets[t] * morph_part(layout, vertex, axis, t);
  }
  if (bones.size() == 1) return glm::dvec3(bones[0] * glm::dvec4(stored, 1.0));
  const std::byte* joints = vertex + find_attribute(layout, Semantic::kJoints)->offset;
  const std::byte* weights = vertex + find_attribute(layout, Semantic::kWeights)->offset;
  glm::dvec3 at(0.0);
  for (int k = 0; k < 4; ++k) {
    const auto weight = std::to_integer<std::uint32_t>(weights[k]);
    const auto bone = std::to_integer<std::size_t>(joints[k]);
    if (weight == 0 || bone >= bones.size()) continue;
    at += weight / 255.0 * glm::dvec3(bones[bone] * glm::dvec4(stored, 1.0));
  }
  return at;
}

std::uint32_t clip_named(const BundleContent& content, std::uint32_t model,
                         const std::string& name) {
  std::uint32_t first = kNone;
  for (std::uint32_t c = 0; c < content.clips.size(); ++c) {
    if (content.clips[c].model != model) continue;
    const NameRef& own = content.clips[c].name;
    if (content.names.compare(own.offset, own.length, name) == 0) return c;
    first = std::min(first, c);
  }
  return name == kNoClip ? kNone : first;
}

ModelPose pose_at(const BundleContent& content, std::uint32_t clip, double share) {
  if (clip == kNone) return {};
  return {content.joints,
          content.bones,
          content.parts,
          content.clips[clip],
          content.clip_tracks[content.clips[clip].tracks],
          share};
}

ModelPose scene_pose(const BundleView& bundle, std::uint32_t scene) {
  for (const SceneClipRecord& plays : bundle.scene_clips()) {
    if (plays.scene != scene) continue;
    const ClipRecord& clip = bundle.clips()[plays.clip];
    return {copied(bundle.joints()),
            copied(bundle.bones()),
            copied(bundle.moving_parts()),
            clip,
            bundle.section(SectionType::kClipTracks, clip.tracks),
            0};
  }
  return {};
}

}  // namespace modar
