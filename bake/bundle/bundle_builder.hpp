// The bake as a whole: files in, the content of one bundle out.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bake/options/request.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// Refuses models without a pattern, and patterns without a model, where there are both;
/// scenes of unknown names are left to build_bundle(). Errors: kUsage "bake.never-shown", whose
/// cure is what to add to the command line.
Result<void> require_shown(const BakeRequest& request);

/// What a bake learns of its inputs and no bundle states.
struct BakeTrace {
  /// Files that models and image targets name, as paths; those that are missing too. Their own and
  /// pictures that are patterns are not among them.
  std::vector<std::string> files;
  std::vector<std::optional<ScoreRange>> ranges;   ///< one a pattern
  std::vector<std::array<double, 3>> model_sides;  ///< of each model's box, source units
};

/// Reads the cheap parts of each input, so that a wrong one costs no bake: models can be
/// opened and have a format that is read, pictures and lights can be decoded, scenes name what
/// there is and give lengths only where their pattern's width is known. Names must be set.
/// Errors: those of the readers; kUsage "bake.scene-unknown", "scene.no-width".
Result<void> check_inputs(const BakeRequest& request);

/// Holds the names of nodes against each other: each has one of its own on its pattern, nodes named
/// by actions exist and can do it, pictures can be read. check_inputs() does it, too. Errors:
/// kUsage "node.same-name", "node.too-many", "action.unknown", "action.command", "action.part";
/// those of read_image().
Result<void> check_nodes(const BakeRequest& request);

/// Is a material of a bundle seen through, and drawn after the others?
bool blended(const MaterialRecord& material, const BundleContent& content);

/// Runs all stages, after name_assets() and check_inputs(). One model and one pattern without a
/// scene make one by themselves. trace: filled where given.
/// Errors: those of the stages; kUsage "bake.nothing", "bake.max-error-unit".
Result<BundleContent> build_bundle(const BakeRequest& request, Report& report,
                                   BakeTrace* trace = nullptr);

/// Bakes what each scene of the content needs to be lit: the light of its picture, where the
/// request names one, and its shadow. scenes: as content.scenes. Errors: those of read_light().
Result<void> light_scenes(const std::vector<SceneRequest>& scenes, const BakeRequest& request,
                          BundleContent& content, Report& report);

/// Last: floats of records that are next to zero become 0, as the checker takes them for damage,
/// and the summary is stated.
void finish_content(BundleContent& content);

/// Gives each model and pattern that has no name one: the file's stem, or, where several files have
/// the same (as scene.gltf), the name of its folder. Errors: kUsage "bake.same-name", where two
/// still have one name.
Result<void> name_assets(BakeRequest& request);

}  // namespace modar
