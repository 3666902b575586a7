#include "bake/bundle/clip_records.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include "formats/base/nearest.hpp"

namespace modar {
namespace {

/// Rows of a 3x4 matrix.
void put_rows(const glm::dmat4& m, float (&rows)[12]) {
  for (int i = 0; i < 12; ++i) rows[i] = static_cast<float>(m[i % 4][i / 4]);
}

/// From the scene of the source to model space, and back.
glm::dmat4 into_model(const Placement& placement) {
  glm::dmat4 m(1.0 / placement.scale);
  m[3] = glm::dvec4(-placement.center / placement.scale, 1.0);
  return m;
}

glm::dmat4 out_of_model(const Placement& placement) {
  glm::dmat4 m(placement.scale);
  m[3] = glm::dvec4(placement.center, 1.0);
  return m;
}

JointRecord joint_record(const SourceJoint& joint, std::uint32_t model, std::uint32_t first,
                         const glm::dmat4& to_model) {
  JointRecord record{};
  record.model = model;
  const bool root = joint.parent == kNoJoint;
  record.parent = root ? kNone : first + joint.parent;
  glm::dmat4 before = root ? to_model * joint.before : joint.before;
  if (joint.weighs) before = to_model[0][0] * joint.before;
  put_rows(before, record.before);
  const glm::dvec4 rotation = glm::normalize(joint.rest.rotation);
  for (int i = 0; i < 4; ++i) record.rotation[i] = static_cast<float>(rotation[i]);
  for (int i = 0; i < 3; ++i) {
    record.translation[i] = static_cast<float>(joint.rest.translation[i]);
    record.scale[i] = static_cast<float>(joint.rest.scale[i]);
  }
  return record;
}

/// Bones are written once a part; the atlas may have given a part several materials.
void add_parts(const ModelMovement& movement, const std::vector<std::uint32_t>& parts,
               std::uint32_t first_joint, const Placement& placement, BundleContent& content) {
  const glm::dmat4 from_model = out_of_model(placement);
  std::vector<std::uint32_t> first_bone(movement.source.parts.size(), kNone);
  for (std::uint32_t m = 0; m < parts.size(); ++m) {
    if (parts[m] >= first_bone.size()) continue;
    const auto& [bones, targets] = movement.source.parts[parts[m]];
    std::uint32_t& first = first_bone[parts[m]];
    if (first == kNone) {
      first = static_cast<std::uint32_t>(content.bones.size());
      for (const SourceBone& bone : bones) {
        BoneRecord record{};
        record.joint = first_joint + bone.joint;
        put_rows(bone.inverse * from_model, record.inverse);
        content.bones.push_back(record);
      }
      for (const std::uint32_t target : targets) {
        BoneRecord record{};
        record.joint = first_joint + target;
        put_rows(glm::dmat4(1.0), record.inverse);
        content.bones.push_back(record);
      }
    }
    PartRecord record{};
    record.material = content.models.back().first_material + m;
    record.first_bone = first;
    record.bone_count = static_cast<std::uint32_t>(bones.size());
    record.target_count = static_cast<std::uint32_t>(targets.size());
    const FittedMovement::Box& box = movement.fitted.boxes[parts[m]];
    for (int i = 0; i < 3; ++i) {
      record.bounds_min[i] =
          static_cast<float>((box.low[i] - placement.center[i]) / placement.scale);
      record.bounds_max[i] =
          static_cast<float>((box.high[i] - placement.center[i]) / placement.scale);
    }
    content.parts.push_back(record);
  }
}

/// Keys at time 0 alone: nothing moves while it plays.
bool is_pose(double seconds) {
  return seconds <= 1.0 / kClipRate + 1e-6;
}

std::string clip_name(const BundleContent& content, std::uint32_t clip) {
  const NameRef& name = content.clips[clip].name;
  return content.names.substr(name.offset, name.length);
}

std::string quoted(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
  return text;
}

}  // namespace

void add_clip(ClipRecord clip, std::vector<std::byte> tracks, BundleContent& content) {
  const auto same = std::find(content.clip_tracks.begin(), content.clip_tracks.end(), tracks);
  clip.tracks = static_cast<std::uint32_t>(same - content.clip_tracks.begin());
  if (same != content.clip_tracks.end()) tracks.clear();
  content.clip_tracks.push_back(std::move(tracks));
  content.clips.push_back(clip);
}

void add_movement(const ModelMovement& movement, const std::vector<std::uint32_t>& parts,
                  const Placement& placement, BundleContent& content) {
  if (movement.fitted.clips.empty()) return;
  const auto model = static_cast<std::uint32_t>(content.models.size() - 1);
  const auto first_joint = static_cast<std::uint32_t>(content.joints.size());
  for (const SourceJoint& joint : movement.source.joints) {
    content.joints.push_back(joint_record(joint, model, first_joint, into_model(placement)));
  }
  add_parts(movement, parts, first_joint, placement, content);
  for (const FittedMovement::Clip& clip : movement.fitted.clips) {
    ClipRecord record{};
    record.name = content.intern(clip.name);
    record.model = model;
    record.seconds = static_cast<float>(clip.seconds);
    // Never below the truth.
    record.error = std::nextafter(static_cast<float>(clip.fitted.error / placement.scale), 4.0f);
    add_clip(record, clip.fitted.bytes, content);
  }
}

Diagnostic clips_found(const std::string& model, const FittedMovement& fitted) {
  std::vector<std::string> names;
  for (const FittedMovement::Clip& clip : fitted.clips) names.push_back(clip.name);
  const bool several = names.size() > 1;
  const bool pose = is_pose(fitted.clips[0].seconds);
  return {"model.clips",
          DiagnosticSeverity::kInfo,
          model,
          0,
          (several ? "it has the clips " + quoted(names) + ": scenes play the first"
                   : "scenes play its clip " + quoted(names)) +
              (pose ? ", a pose" : " in a loop"),
          several ? "--scene PATTERN=" + model + ",clip=" + names[1] +
                        " plays another, clip=none keeps it still"
                  : "--scene PATTERN=" + model + ",clip=none keeps it still"};
}

Result<void> add_scene_clips(const std::vector<SceneRequest>& scenes, BundleContent& content) {
  for (std::uint32_t s = 0; s < scenes.size(); ++s) {
    const SceneRequest& scene = scenes[s];
    std::vector<std::string> names;
    std::uint32_t first = kNone;
    for (std::uint32_t c = 0; c < content.clips.size(); ++c) {
      if (content.clips[c].model != content.scenes[s].model) continue;
      if (names.empty()) first = c;
      names.push_back(clip_name(content, c));
    }
    const auto found = std::find(names.begin(), names.end(), scene.clip);
    if (found == names.end() && !scene.clip.empty() && scene.clip != kNoClip) {
      return fail(ExitCode::kUsage, "scene.clip", scene.clip,
                  "the model '" + scene.model + "' has no " +
                      (names.empty() ? "animation" : "clip of that name"),
                  names.empty() ? "leave clip= out" : cure_of_name(scene.clip, names));
    }
    // A clip of that name comes before the word.
    if (names.empty() || (found == names.end() && scene.clip == kNoClip)) continue;
    const auto index = found == names.end() ? 0 : found - names.begin();
    const std::uint32_t chosen = first + static_cast<std::uint32_t>(index);
    content.scene_clips.push_back(
        {s, chosen,
         scene.once || is_pose(content.clips[chosen].seconds) ? 0u : std::uint32_t{kSceneClipLoops},
         0});
  }
  return {};
}

}  // namespace modar
