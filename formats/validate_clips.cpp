// Validates clips, joints, bones and parts: see validate.hpp.
#include "formats/validate.hpp"

#include <set>
#include <tuple>

#include "formats/component.hpp"

namespace modar {
namespace {

std::uint32_t joints_of(const BundleParts& parts, std::uint32_t model) {
  std::uint32_t count = 0;
  for (const JointRecord& joint : parts.joints) count += joint.model == model ? 1 : 0;
  return count;
}

void check_joint(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const JointRecord& joint = parts.joints[index];
  check.numbers(joint.before, "before");
  check.numbers(joint.translation, "translation");
  check.numbers(joint.rotation, "rotation");
  check.numbers(joint.scale, "scale");
  if (joint.model >= parts.models.size() ||
      (index > 0 && parts.joints[index - 1].model > joint.model)) {
    check.fault(Rule::kClip, &joint.model,
                "model " + std::to_string(joint.model) + " is not there or out of order");
  }
  if (joint.parent != kNone &&
      (joint.parent >= index || parts.joints[joint.parent].model != joint.model)) {
    check.fault(Rule::kClip, &joint.parent,
                "its parent " + std::to_string(joint.parent) + " is no earlier joint of its model");
  }
  if (!unit_length(joint.rotation)) {
    check.fault(Rule::kClip, joint.rotation, "its rotation is not a unit quaternion");
  }
}

void check_tracks(const RecordCheck& check, const BundleParts& parts, const ClipRecord& clip,
                  std::uint32_t index) {
  const bool owned = clip.tracks == index;
  const SectionEntry* own = find_section(parts.sections, SectionType::kClipTracks, index, 0);
  if (clip.tracks > index || parts.clips[clip.tracks].tracks != clip.tracks ||
      owned != (own != nullptr)) {
    return check.fault(Rule::kClip, &clip.tracks,
                       "clip " + std::to_string(clip.tracks) + " does not own its tracks");
  }
  const SectionEntry* entry =
      find_section(parts.sections, SectionType::kClipTracks, clip.tracks, 0);
  if (entry == nullptr) return;  // told where that clip is
  ClipTracksView view;
  const char* fault =
      view_clip_tracks(section_bytes(parts, *entry), joints_of(parts, clip.model), view);
  if (fault != nullptr) {
    check.fault(Rule::kClip, &clip.tracks, std::string("its tracks: ") + fault);
  }
}

void check_clip(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const ClipRecord& clip = parts.clips[index];
  check.name(clip.name);
  check.number(clip.seconds, "seconds", static_cast<double>(kLeastClipSeconds),
               static_cast<double>(kMostClipSeconds));
  check.number(clip.error, "error", 0.0);
  check.reserved(clip.reserved, sizeof(clip.reserved));
  if (clip.name.length == 0) check.fault(Rule::kClip, &clip.name, "it has no name");
  if (clip.model >= parts.models.size() ||
      (index > 0 && parts.clips[index - 1].model > clip.model)) {
    return check.fault(Rule::kClip, &clip.model,
                       "model " + std::to_string(clip.model) + " is not there or out of order");
  }
  check_tracks(check, parts, clip, index);
}

/// What parts of several bones need of their model's vertices.
bool has_bone_attributes(const BundleParts& parts, const ModelRecord& model) {
  if (model.layout >= parts.layouts.size()) return false;
  const LayoutRecord& layout = parts.layouts[model.layout];
  const AttributeRecord* joints = find_attribute(layout, Semantic::kJoints);
  const AttributeRecord* weights = find_attribute(layout, Semantic::kWeights);
  const auto bytes = static_cast<std::uint8_t>(ComponentType::kU8);
  return joints != nullptr && weights != nullptr && joints->type == bytes &&
         weights->type == bytes && joints->normalised == 0 && weights->normalised == 1;
}

void check_part(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const PartRecord& part = parts.parts[index];
  check.numbers(part.bounds_min, "bounds_min");
  check.numbers(part.bounds_max, "bounds_max");
  check.reserved(&part.reserved, sizeof(part.reserved));
  for (int axis = 0; axis < 3; ++axis) {
    if (part.bounds_min[axis] > part.bounds_max[axis]) {
      check.fault(Rule::kClip, &part.bounds_min[axis], "its box is inside out");
    }
  }
  if (part.material >= parts.materials.size() ||
      (index > 0 && parts.parts[index - 1].material >= part.material)) {
    return check.fault(Rule::kClip, &part.material,
                       "material " + std::to_string(part.material) + " is not there or out of order");
  }
  if (part.bone_count == 0 || part.bone_count > kMostPartBones ||
      std::uint64_t{part.first_bone} + part.bone_count > parts.bones.size()) {
    return check.fault(Rule::kClip, &part.first_bone,
                       std::to_string(part.bone_count) + " bones from " +
                           std::to_string(part.first_bone) + " on are not there, or too many");
  }
  std::uint32_t model = 0;
  while (model < parts.models.size() &&
         (part.material < parts.models[model].first_material ||
          part.material - parts.models[model].first_material >= parts.models[model].material_count))
    ++model;
  bool good = model < parts.models.size();
  for (std::uint32_t b = part.first_bone; good && b < part.first_bone + part.bone_count; ++b) {
    const std::uint32_t joint = parts.bones[b].joint;
    good = joint < parts.joints.size() && parts.joints[joint].model == model;
  }
  if (!good) {
    return check.fault(Rule::kClip, &part.first_bone, "its bones are not of its material's model");
  }
  if (part.bone_count > 1 && !has_bone_attributes(parts, parts.models[model])) {
    check.fault(Rule::kClip, &part.bone_count, "the vertices of its model name no bones");
  }
}

void check_scene_clip(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const SceneClipRecord& plays = parts.scene_clips[index];
  check.flags(plays.flags, known_flags("SceneClipRecord"));
  check.reserved(&plays.reserved, sizeof(plays.reserved));
  if (plays.scene >= parts.scenes.size() || plays.clip >= parts.clips.size() ||
      (index > 0 && parts.scene_clips[index - 1].scene >= plays.scene) ||
      parts.scenes[plays.scene].model != parts.clips[plays.clip].model) {
    check.fault(Rule::kClip, &plays.scene,
                "scene " + std::to_string(plays.scene) + " is out of order, or clip " +
                    std::to_string(plays.clip) + " not one of its model's");
  }
}

/// Each clip of a model has a name of its own.
void check_clip_names(FaultLog& log, const BundleParts& parts) {
  std::set<std::tuple<std::uint32_t, std::string_view>> names;
  for (std::uint32_t i = 0; i < parts.clips.size() && !log.stop(); ++i) {
    const ClipRecord& clip = parts.clips[i];
    const std::string_view name(
        reinterpret_cast<const char*>(parts.names.data()) + clip.name.offset, clip.name.length);
    if (names.insert({clip.model, name}).second) continue;
    RecordCheck(log, parts, "clip", i)
        .fault(Rule::kClip, &clip.name, "another clip of its model has its name");
  }
}

}  // namespace

void validate_clips(FaultLog& log, const BundleParts& parts) {
  if (parts.joints.size() > kMaxJoints || parts.clips.size() > kMostClips) {
    return log.add(Rule::kClip, 0, "clips",
                   std::to_string(parts.joints.size()) + " joints or " +
                       std::to_string(parts.clips.size()) + " clips are more than a bundle has");
  }
  const std::uint64_t faults = log.errors();
  for (std::uint32_t i = 0; i < parts.joints.size() && !log.stop(); ++i) {
    check_joint(RecordCheck(log, parts, "joint", i), parts, i);
  }
  for (std::uint32_t i = 0; i < parts.bones.size() && !log.stop(); ++i) {
    const RecordCheck check(log, parts, "bone", i);
    check.numbers(parts.bones[i].inverse, "inverse");
    check.reserved(parts.bones[i].reserved, sizeof(parts.bones[i].reserved));
  }
  if (log.errors() != faults) return;
  for (std::uint32_t i = 0; i < parts.clips.size() && !log.stop(); ++i) {
    check_clip(RecordCheck(log, parts, "clip", i), parts, i);
  }
  for (std::uint32_t i = 0; i < parts.parts.size() && !log.stop(); ++i) {
    check_part(RecordCheck(log, parts, "part", i), parts, i);
  }
  for (std::uint32_t i = 0; i < parts.scene_clips.size() && !log.stop(); ++i) {
    check_scene_clip(RecordCheck(log, parts, "scene clip", i), parts, i);
  }
  // Names may be out of bounds before.
  if (log.errors() == faults) check_clip_names(log, parts);
}

}  // namespace modar
