// How a model moves, as records of a bundle, and what scenes play of it.
#pragma once

#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/mesh/clip/movement.hpp"
#include "bake/mesh/tri_mesh.hpp"

namespace modar {

/// A model's movement until its materials have their places in the bundle.
struct ModelMovement {
  SourceMovement source;
  FittedMovement fitted;
};

/// Appends clips, joints, bones and parts of the content's last model. parts: of each of its
/// materials, as SourceMaterial has it.
void add_movement(const ModelMovement& movement, const std::vector<std::uint32_t>& parts,
                  const Placement& placement, BundleContent& content);

/// Appends a clip, whose tracks may be those of an earlier one: `tracks` of the record is set.
void add_clip(ClipRecord clip, std::vector<std::byte> tracks, BundleContent& content);

/// Says which clips a model has, and what plays where no scene names one.
Diagnostic clips_found(const std::string& model, const FittedMovement& fitted);

/// What each scene plays from when its pattern is found: as the request says it, or else the first
/// clip of its model, in a loop. Errors: kUsage "scene.clip" where a model has no clip of that
/// name.
Result<void> add_scene_clips(const std::vector<SceneRequest>& scenes, BundleContent& content);

}  // namespace modar
