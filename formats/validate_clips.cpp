// Validates clips, joints, bones and parts: see validate.hpp. Its texts are few: a page has them.
#include "formats/component.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

constexpr const char* kNoSuch = "it refers to what does not exist, or is out of order";

void check_joint(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const JointRecord& joint = parts.joints[index];
  check.numbers(joint.before, "before");
  check.numbers(joint.translation, "translation");
  check.numbers(joint.rotation, "rotation");
  check.numbers(joint.scale, "scale");
  const bool child = joint.parent != kNone;
  if (joint.model >= parts.models.size() ||
      (index > 0 && parts.joints[index - 1].model > joint.model) ||
      (child && (joint.parent >= index || parts.joints[joint.parent].model != joint.model))) {
    check.fault(Rule::kClip, &joint.model, kNoSuch);
  }
  if (!unit_length(joint.rotation)) {
    check.fault(Rule::kClip, joint.rotation, "its rotation is not a unit quaternion");
  }
}

/// Its own, or those of an earlier clip that owns them; its model has the joints.
const char* fault_of_tracks(const BundleParts& parts, std::uint32_t index) {
  const ClipRecord& clip = parts.clips[index];
  const auto tracks_of = [&parts](std::uint32_t owner) {
    return find_section(parts.sections, SectionType::kClipTracks, owner, 0);
  };
  if (clip.tracks > index || parts.clips[clip.tracks].tracks != clip.tracks ||
      (clip.tracks == index) != (tracks_of(index) != nullptr)) {
    return kNoSuch;
  }
  const SectionEntry* entry = tracks_of(clip.tracks);
  if (entry == nullptr) return nullptr;  // a fault of that clip
  std::uint32_t joints = 0;
  for (const JointRecord& joint : parts.joints) joints += joint.model == clip.model ? 1 : 0;
  ClipTracksView view;
  return view_clip_tracks(section_bytes(parts, *entry), joints, view);
}

void check_clip(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const ClipRecord& clip = parts.clips[index];
  check.name(clip.name);
  check.number(clip.seconds, "seconds", static_cast<double>(kLeastClipSeconds),
               static_cast<double>(kMostClipSeconds));
  check.number(clip.error, "error", 0.0);
  check.reserved(clip.reserved, sizeof(clip.reserved));
  bool good = clip.name.length > 0 && clip.model < parts.models.size() &&
              (index == 0 || parts.clips[index - 1].model <= clip.model);
  for (std::uint32_t i = 0; i < index && good; ++i) {
    const NameRef& name = parts.clips[i].name;
    // Names may be out of bounds; writers store equal ones once.
    good = parts.clips[i].model != clip.model || name.offset != clip.name.offset ||
           name.length != clip.name.length;
  }
  const char* fault = good ? fault_of_tracks(parts, index) : kNoSuch;
  if (fault != nullptr) check.fault(Rule::kClip, &clip.model, fault);
}

/// What a part that is not rigid needs of its model's vertices.
bool has_bone_attributes(const BundleParts& parts, const ModelRecord& model,
                         std::uint32_t targets) {
  if (model.layout >= parts.layouts.size()) return false;
  const LayoutRecord& layout = parts.layouts[model.layout];
  const AttributeRecord* joints = find_attribute(layout, Semantic::kJoints);
  const AttributeRecord* weights = find_attribute(layout, Semantic::kWeights);
  const auto bytes = static_cast<std::uint8_t>(ComponentType::kU8);
  for (const Semantic semantic : {Semantic::kMorphX, Semantic::kMorphY, Semantic::kMorphZ}) {
    const AttributeRecord* morph = find_attribute(layout, semantic);
    if (targets > 0 && (morph == nullptr || morph->components < targets)) return false;
    const bool words =
        morph == nullptr ||
        (morph->normalised == 0 && morph->type == static_cast<std::uint8_t>(ComponentType::kI16));
    if (!words || (morph != nullptr && find_attribute(layout, Semantic::kColour) != nullptr))
      return false;
  }
  return joints != nullptr && weights != nullptr && joints->type == bytes &&
         weights->type == bytes && joints->normalised == 0 && weights->normalised == 1;
}

/// The part's material is of one model, and its bones are of joints of that.
bool bones_fit(const BundleParts& parts, const PartRecord& part) {
  std::uint32_t model = kNone;
  for (std::uint32_t m = 0; m < parts.models.size(); ++m) {
    const ModelRecord& each = parts.models[m];
    if (part.material < each.first_material ||
        part.material - each.first_material >= each.material_count)
      continue;
    if (model != kNone) return false;
    model = m;
  }
  if (model == kNone) return false;
  for (std::uint32_t b = 0; b < part.bone_count + part.target_count; ++b) {
    const std::uint32_t joint = parts.bones[part.first_bone + b].joint;
    if (joint >= parts.joints.size() || parts.joints[joint].model != model) return false;
  }
  return part.rigid() || has_bone_attributes(parts, parts.models[model], part.target_count);
}

void check_part(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const PartRecord& part = parts.parts[index];
  check.numbers(part.bounds_min, "bounds_min");
  check.numbers(part.bounds_max, "bounds_max");
  bool good = part.material < parts.materials.size() && part.bone_count > 0 &&
              part.bone_count <= kMostPartBones && part.target_count <= kMostPartTargets &&
              part.first_bone <= parts.bones.size() &&
              part.bone_count + part.target_count <= parts.bones.size() - part.first_bone &&
              (index == 0 || parts.parts[index - 1].material < part.material);
  for (int axis = 0; axis < 3; ++axis) {
    good = good && part.bounds_min[axis] <= part.bounds_max[axis];
  }
  if (!good || !bones_fit(parts, part)) check.fault(Rule::kClip, &part.material, kNoSuch);
}

void check_scene_clip(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const SceneClipRecord& plays = parts.scene_clips[index];
  check.flags(plays.flags, known_flags("SceneClipRecord"));
  check.reserved(&plays.reserved, sizeof(plays.reserved));
  if (plays.scene >= parts.scenes.size() || plays.clip >= parts.clips.size() ||
      (index > 0 && parts.scene_clips[index - 1].scene >= plays.scene) ||
      parts.scenes[plays.scene].model != parts.clips[plays.clip].model) {
    check.fault(Rule::kClip, &plays.scene, kNoSuch);
  }
}

}  // namespace

void validate_clips(FaultLog& log, const BundleParts& parts) {
  if (parts.joints.size() > kMaxJoints || parts.clips.size() > kMostClips) {
    return log.add(Rule::kClip, 0, "clips", "there are more than a bundle may have");
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
}

}  // namespace modar
