#include "bake/bundle/scene/model_pose.hpp"

#include <glm/gtc/quaternion.hpp>

#include "formats/component.hpp"

namespace modar {
namespace {

glm::dmat4 matrix_of(const float (&rows)[12]) {
  glm::dmat4 m(1.0);
  for (int i = 0; i < 12; ++i) m[i % 4][i / 4] = static_cast<double>(rows[i]);
  return m;
}

/// What a joint has without tracks.
JointPlace place_of(const JointRecord& joint) {
  JointPlace place;
  for (int i = 0; i < 4; ++i) place.rotation[i] = static_cast<double>(joint.rotation[i]);
  for (int i = 0; i < 3; ++i) {
    place.translation[i] = static_cast<double>(joint.translation[i]);
    place.scale[i] = static_cast<double>(joint.scale[i]);
  }
  return place;
}

void apply(const ClipTracksView& view, float sample, std::vector<JointPlace>& places) {
  for (const TrackRecord& track : view.tracks) {
    std::uint32_t key = 0;
    const TrackValue found = view.at(track, sample, key);
    const glm::dvec4 value(static_cast<double>(found[0]), static_cast<double>(found[1]),
                           static_cast<double>(found[2]), static_cast<double>(found[3]));
    JointPlace& place = places[track.joint];
    switch (static_cast<TrackPath>(track.path)) {
      case TrackPath::kTranslation:
        place.translation = glm::dvec3(value);
        break;
      case TrackPath::kRotation:
        place.rotation = glm::normalize(value);
        break;
      case TrackPath::kScale:
        place.scale = glm::dvec3(value);
        break;
    }
  }
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
  std::vector<JointPlace> places;
  for (std::uint32_t j = first; j < joints.size() && joints[j].model == clip.model; ++j) {
    places.push_back(place_of(joints[j]));
  }
  ClipTracksView view;
  if (view_clip_tracks(tracks, static_cast<std::uint32_t>(places.size()), view) == nullptr) {
    apply(view, static_cast<float>(share * (view.header->sample_count - 1)), places);
  }
  std::vector<glm::dmat4> matrices;
  for (std::size_t j = 0; j < places.size(); ++j) {
    const JointRecord& joint = joints[first + j];
    const glm::dmat4 own = matrix_of(joint.before) * places[j].matrix();
    matrices.push_back(joint.parent == kNone ? own : matrices[joint.parent - first] * own);
  }
  for (const PartRecord& part : parts) {
    if (joints[bones[part.first_bone].joint].model != clip.model) continue;
    for (std::uint32_t b = part.first_bone; b < part.first_bone + part.bone_count; ++b) {
      bones_[part.material].push_back(matrices[bones[b].joint - first] *
                                      matrix_of(bones[b].inverse));
    }
  }
}

glm::dvec3 ModelPose::place(const LayoutRecord& layout, const VertexDecoder& decoder,
                            const ChunkRecord& chunk, const std::byte* vertex) const {
  const glm::dvec3 stored = decoder.position(vertex, chunk);
  const auto found = bones_.find(chunk.material);
  if (found == bones_.end()) return stored;
  const std::vector<glm::dmat4>& bones = found->second;
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

std::uint32_t first_clip(const BundleContent& content, std::uint32_t model) {
  for (std::uint32_t c = 0; c < content.clips.size(); ++c) {
    if (content.clips[c].model == model) return c;
  }
  return kNone;
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

ModelPose first_pose(const BundleContent& content, std::uint32_t model) {
  return pose_at(content, first_clip(content, model), 0);
}

ModelPose first_pose(const BundleView& bundle, std::uint32_t model) {
  for (const ClipRecord& clip : bundle.clips()) {
    if (clip.model != model) continue;
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
