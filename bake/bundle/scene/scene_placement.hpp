// The place of a scene's model on its pattern: from what the user said to the scene's record.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "bake/options/request.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// Model axes to pattern axes: `up` to +z, then degrees about the pattern's x, y and z.
glm::dquat rotation_of(UpAxis up, const std::array<double, 3>& turn);

/// True where a length in millimetres is requested, which needs the pattern's width.
bool needs_width(const SceneRequest& request);

/// The error of such a scene where the width is unknown. kUsage "scene.no-width".
tl::unexpected<Error> no_width(const SceneRequest& request);

/// Whether a model has an extent along the axis whose size is requested. mesh: welded; up: for
/// requests that name none. Errors: kUsage "scene.flat".
Result<void> check_extent(const SceneRequest& request, const TriMesh& mesh, UpAxis up);

/// The model that a scene places, in content.models.
struct PlacedModel {
  std::uint32_t index = 0;
  std::array<double, 3> sides{};  ///< of its box, source units
  UpAxis up = UpAxis::kY;         ///< for scenes that name none
};

/// The request with `up` set, its size as a factor and its offset in sides: as modar states it in
/// the bundle's meta text. content: has the model and the pattern.
/// Errors: kUsage "scene.no-width", where millimetres are requested and the width is unknown;
/// "scene.flat", as check_extent(); "scene.size", where the model would be beyond kMostScale.
Result<SceneRequest> resolve_scene(const SceneRequest& request, const BundleContent& content,
                                   std::uint32_t pattern, const PlacedModel& model);

/// The record of a resolved scene.
SceneRecord place_scene(const SceneRequest& resolved, const BundleContent& content,
                        std::uint32_t pattern, const PlacedModel& model);

/// Whether nothing of a scene's model is drawn for those who look at it from the front: it shows
/// them the backs of one-sided materials, or is transparent. False for one that moves.
bool draws_nothing(const BundleContent& content, const SceneRecord& scene);
bool draws_nothing(const BundleView& bundle, const SceneRecord& scene);

/// Warnings of scenes whose model nobody will see, and of those that repeat another.
std::vector<Diagnostic> doubtful_scenes(const BundleContent& content);

/// Millimetres from the lowest to the highest point of a scene's model, as its clip begins; 0 where
/// the pattern's width is unknown. Of the vertices of its finest level.
double scene_height_mm(const BundleView& bundle, std::uint32_t index);

}  // namespace modar
