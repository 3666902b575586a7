// The bake as a whole: files in, the content of one bundle out.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/report.hpp"
#include "bake/texture/atlas.hpp"
#include "bake/texture/texture.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/error.hpp"

namespace modar {

/// Which axis of the model points out of the pattern, towards the camera.
enum class UpAxis : std::uint8_t { kX, kY, kZ, kMinusX, kMinusY, kMinusZ };

/// A scene as the user asks for it. Names are those of files without folder and extension.
struct SceneRequest {
  std::string pattern;
  std::string model;
  double scale = 1.0;  ///< factor on: largest side of the model = largest side of the pattern
  UpAxis up = UpAxis::kZ;
  bool centred = false;  ///< the model's centre lies in the pattern's plane; else it stands on it
  std::array<double, 3> offset{};  ///< pattern units (half of its largest side), added at last
  std::string light;               ///< picture of its room, see read_light(); empty: a neutral room
};

struct PatternRequest {
  std::string path;
  double width_mm = 0.0;  ///< 0: what the file or the shape states, or unknown
  ShapeRequest shape{};   ///< what it is printed on; flat where nothing is told
};

/// How far packed positions may lie from the source's, as the user says it.
struct MaxError {
  enum class Unit : std::uint8_t { kAny, kSource, kPercent, kMetres };
  Unit unit = Unit::kAny;
  double value = 0.0;  ///< source units, percent of the model's diagonal, or metres
};

struct BakeRequest {
  std::vector<std::string> models;
  std::vector<PatternRequest> patterns;
  std::vector<SceneRequest> scenes;
  std::string light;  ///< of the scene that one model and one pattern make by themselves
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
  std::vector<std::array<double, 3>> model_sides;  ///< of each model's box, source units
};

/// Runs all stages. One model and one pattern without a scene make one by themselves. trace:
/// filled where given.
/// Errors: those of the stages; kUsage "bake.nothing", "bake.same-name", "bake.scene-unknown",
/// "bake.max-error-unit".
Result<BundleContent> build_bundle(const BakeRequest& request, Report& report,
                                   BakeTrace* trace = nullptr);

/// Bakes what each scene of the content needs to be lit: the light of its picture, where the
/// request names one, and its shadow. scenes: as content.scenes. Errors: those of read_light().
Result<void> light_scenes(const std::vector<SceneRequest>& scenes, const BakeRequest& request,
                          BundleContent& content, Report& report);

/// The scene's record for a model whose source box has these side lengths (source units).
SceneRecord place_scene(const SceneRequest& request, std::uint32_t pattern, std::uint32_t model,
                        const std::array<double, 3>& model_sides);

/// "dir/spider.obj" -> "spider".
std::string file_stem(const std::string& path);

}  // namespace modar
