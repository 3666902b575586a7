// The bake as a whole: files in, the content of one bundle out.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/bundle/scene_placement.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/report.hpp"
#include "bake/texture/atlas.hpp"
#include "bake/texture/texture.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// A model file and what scenes call it.
struct ModelRequest {
  ModelRequest() = default;
  ModelRequest(std::string file, std::string called = {})  // NOLINT: a path is a request
      : path(std::move(file)), name(std::move(called)) {}

  std::string path;
  std::string name;  ///< empty: as name_assets() says
};

struct PatternRequest {
  std::string path;
  double width_mm = 0.0;  ///< 0: what the file or the shape states, or unknown
  ShapeRequest shape{};   ///< what it is printed on; flat where nothing is told
  std::string name = {};  ///< empty: as name_assets() says
};

/// How far packed positions may lie from the source's, as the user says it.
struct MaxError {
  enum class Unit : std::uint8_t { kAny, kSource, kPercent, kMetres };
  Unit unit = Unit::kAny;
  double value = 0.0;  ///< source units, percent of the model's diagonal, or metres
};

struct BakeRequest {
  std::vector<ModelRequest> models;
  std::vector<PatternRequest> patterns;
  std::vector<SceneRequest> scenes;
  std::optional<UpAxis> up;  ///< of all models, for scenes that name none; nothing: see find_up()
  std::string light;         ///< of the scene that one model and one pattern make by themselves
  TextureOptions textures;
  std::uint64_t texture_budget = 0;  ///< GPU bytes that all textures may take; 0: any
  std::size_t most_triangles = 0;    ///< of each model, before its levels of detail; 0: any
  bool shadows = true;               ///< of each scene's model on its pattern's plane
  double unit_metres = 0.0;          ///< metres in a source unit of the models; 0: unknown
  MaxError max_error;
  std::optional<PositionKind> positions;  ///< nothing: as max_error needs it
  /// Of detail a chunk at most, the finest counted: halving ends before for all but huge chunks.
  std::uint32_t levels = kMaxLevels;
  bool occlusion = true;  ///< measure and store it; not beside int16 positions
  AtlasMode atlas = AtlasMode::kWhereItPays;
  bool topology = false;           ///< measure and state each model's
  std::uint64_t memory_bytes = 0;  ///< see MemoryLimit; 0: any; the bytes do not depend on it
  std::string device;              ///< profile that it is planned for; empty: none
  std::string tier;                ///< that it is made for; empty: none
  unsigned jobs = 1;               ///< the bytes do not depend on it
  TrackerRecordOptions loop;       ///< of patterns; its jobs are those above
  /// The article's parameter sets to describe patterns with; empty: all; "none": our loop's record
  /// alone.
  std::vector<std::string> parameters;
  std::string tool_version;
};

/// Lowers texture sizes and their budget to what a device profile allows: half of its GPU memory,
/// so that as much is left for vertices, camera picture and framebuffers. Errors: kUsage
/// "device.unknown" that lists the names.
Result<void> plan_for_device(const std::string& device, BakeRequest& request);

/// Lowers triangles, texture sizes and their budget to what a tier allows: "thumb", "phone" or
/// "desktop". Errors: kUsage "bake.tier" that lists the names.
Result<void> plan_for_tier(const std::string& tier, BakeRequest& request);

/// Refuses models that stand on no pattern, and patterns that carry no model, where there are both;
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

/// Reads what is cheap to read of each input, so that a wrong one costs no bake: models can be
/// opened and have a format that is read, pictures and lights can be decoded, scenes name what
/// there is and give lengths only where their pattern's width is known. Names must be set.
/// Errors: those of the readers; kUsage "bake.scene-unknown", "scene.no-width".
Result<void> check_inputs(const BakeRequest& request);

/// Runs all stages, after name_assets() and check_inputs(). One model and one pattern without a
/// scene make one by themselves. trace: filled where given.
/// Errors: those of the stages; kUsage "bake.nothing", "bake.max-error-unit".
Result<BundleContent> build_bundle(const BakeRequest& request, Report& report,
                                   BakeTrace* trace = nullptr);

/// Bakes what each scene of the content needs to be lit: the light of its picture, where the
/// request names one, and its shadow. scenes: as content.scenes. Errors: those of read_light().
Result<void> light_scenes(const std::vector<SceneRequest>& scenes, const BakeRequest& request,
                          BundleContent& content, Report& report);

/// Gives each model and pattern that has no name one: the file's stem, or, where several files have
/// the same (as scene.gltf), the name of its folder. Errors: kUsage "bake.same-name", where two
/// still have one name.
Result<void> name_assets(BakeRequest& request);

/// "dir/spider.obj" -> "spider".
std::string file_stem(const std::string& path);

}  // namespace modar
