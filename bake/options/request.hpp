// The request for a bake: files, where models stand, and every option.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/texture/atlas/atlas.hpp"
#include "bake/texture/texture.hpp"
#include "bake/up_axis.hpp"
#include "formats/base/error.hpp"
#include "formats/scene_nodes.hpp"

namespace modar {

/// A model file and what scenes call it.
struct ModelRequest {
  ModelRequest() = default;
  ModelRequest(std::string file, std::string called = {})  // NOLINT: a path is a request
      : path(std::move(file)), name(std::move(called)) {}

  std::string path;
  std::string name;         ///< empty: as name_assets() says
  bool own_picture = true;  ///< a picture that is named as the file may be its texture
};

struct PatternRequest {
  std::string path;
  double width_mm = 0.0;     ///< 0: what the file or the shape states, or unknown
  ShapeRequest shape{};      ///< what it is printed on; flat where nothing is stated
  std::string name = {};     ///< empty: as name_assets() says
  std::uint32_t copies = 0;  ///< that are tracked at once, 1 to kMaxCopies; 0: nothing is stated
};

/// How far packed positions may be from the source's, as the user states it.
struct MaxError {
  enum class Unit : std::uint8_t { kAny, kSource, kPercent, kMetres };
  Unit unit = Unit::kAny;
  double value = 0.0;  ///< source units, percent of the model's diagonal, or metres
};

/// How large the model is on its pattern.
struct SceneSize {
  enum class Kind : std::uint8_t {
    kScale,   ///< the value is a factor on: largest side of the model = that of the pattern
    kHeight,  ///< millimetres above the pattern, from the lowest to the highest point
    kWidth    ///< millimetres along the pattern's x axis
  };
  Kind kind = Kind::kScale;
  double value = 1.0;
  bool usual = false;  ///< nobody states it: 1, as the model is while its clip begins
};

/// A shift along the pattern's axes, after everything else.
struct SceneOffset {
  enum class Unit : std::uint8_t {
    kUsual,  ///< millimetres where the pattern's width is known, else the pattern's side
    kSide,   ///< the pattern's largest side
    kMillimetres
  };
  Unit unit = Unit::kUsual;
  std::array<double, 3> value{};
};

/// A scene as the user asks for it.
/// SceneRequest::clip of a model that keeps still, unless it has a clip of that name.
inline constexpr const char* kNoClip = "none";

struct SceneRequest {
  std::string pattern;  ///< names, see name_assets()
  std::string model;
  SceneSize size{SceneSize::Kind::kScale, 1.0, true};
  std::optional<UpAxis> up;      ///< points out of the pattern; nothing: as find_up() says
  std::array<double, 3> turn{};  ///< degrees about the pattern's x, y and z, in this order
  bool centred = false;  ///< the model's centre is in the pattern's plane; else its bottom is on it
  SceneOffset offset;
  std::string light;    ///< picture of its room, see read_light(); empty: a neutral room
  std::string name;     ///< what actions call it; empty: as the model
  bool hidden = false;  ///< until an action shows it
  std::string group;    ///< of variants that `next` cycles through; empty: none
  std::string clip;     ///< that the model plays, or kNoClip; empty: its first
  bool once = false;    ///< the clip ends; else it loops
};

/// Words by language: {"en", "The rim"}.
using Words = std::map<std::string, std::string>;

/// A picture, a video or a label on a pattern, or a sound.
struct NodeRequest {
  NodeKind kind = NodeKind::kPicture;
  std::string file;    ///< of a picture, video or sound
  SceneRequest place;  ///< pattern, name, hidden, group, offset; but for labels size, turn, centred
  bool plays = true;   ///< a video or sound, from when its pattern is found
  bool loops = false;  ///< the same
  VideoAlpha alpha = VideoAlpha::kOpaque;
  std::array<float, 3> key{};  ///< of VideoAlpha::kKey
  float reach = 0;             ///< the same
  std::string mark;            ///< of a label: a number or a short word
  Words titles;
  Words texts;
  Words alts;
  Words captions;     ///< of a video or sound; in a project the files, for the bake their contents
  std::string where;  ///< for messages: "modar.toml:12:1"
};

/// The files that a project's node has.
inline void add_files(const NodeRequest& node, std::set<std::string>& files) {
  if (!node.file.empty()) files.insert(node.file);
  for (const auto& [language, file] : node.captions) files.insert(file);
}

/// Actions on a pattern when something happens. Names are those of nodes, or of models.
struct ActionRequest {
  std::string pattern;
  ActionEvent event = ActionEvent::kFound;
  std::string source;  ///< of a tap
  std::string part;    ///< of a tap on a model: a material; empty: any
  double seconds = 0;  ///< of kAfter
  ActionCommand command = ActionCommand::kShow;
  std::string target;   ///< of all but a link
  std::string address;  ///< of a link; the name of a clip
  int axis = 2;         ///< of a turn: 0 x, 1 y, 2 z of the pattern
  double degrees = 0;   ///< of a turn
  double duration = 0;  ///< of a turn: seconds
  std::string where;    ///< for messages: "modar.toml:12:1"
};

struct BakeRequest {
  std::vector<ModelRequest> models;
  std::vector<PatternRequest> patterns;
  std::vector<SceneRequest> scenes;
  std::vector<NodeRequest> nodes;
  std::vector<ActionRequest> actions;
  std::optional<UpAxis> up;  ///< of all models, for scenes that name none; nothing: see find_up()
  std::string light;         ///< of scenes that name none
  TextureOptions textures;
  std::uint64_t texture_budget = 0;  ///< GPU bytes that all textures may take; 0: any
  std::size_t most_triangles = 0;    ///< of each model, before its levels of detail; 0: any
  bool shadows = true;               ///< of each scene's model on its pattern's plane
  double unit_metres = 0.0;          ///< metres in a source unit of the models; 0: unknown
  MaxError max_error;
  std::optional<PositionKind> positions;  ///< nothing: as max_error needs it
  /// Of detail a chunk at most, the finest counted: halving ends before for all but huge chunks.
  std::uint32_t levels = kMaxLevels;
  std::uint32_t crease = 40;  ///< see WeldOptions
  bool smooth = false;        ///< as a crease of 180
  [[nodiscard]] double crease_degrees() const { return smooth ? 180.0 : crease; }
  bool repair = false;          ///< see repair_model()
  bool repair_support = false;  ///< the same, with the surface that a scan is on
  [[nodiscard]] bool repairs() const { return repair || repair_support; }
  bool occlusion = true;  ///< measure and store it
  AtlasMode atlas = AtlasMode::kWhereItPays;
  bool topology = false;           ///< measure and state each model's
  std::uint64_t memory_bytes = 0;  ///< see MemoryLimit; 0: any; the bytes do not depend on it
  std::string device;              ///< profile that it is planned for; empty: none
  std::string tier;                ///< that it is made for; empty: none
  unsigned jobs = 1;               ///< the bytes do not depend on it
  TrackerRecordOptions loop;       ///< of patterns; its jobs are those above
  /// The ModAR paper's parameter sets to describe patterns with, or "all" or "none"; empty: see
  /// stored_parameters().
  std::vector<std::string> parameters;
  std::string tool_version;
  std::string within;  ///< models read no files outside of this folder; empty: they may
};

/// Lowers texture sizes and their budget to what a device profile allows: half of its GPU memory,
/// so that as much is left for vertices, camera picture and framebuffers. Where its driver reads no
/// half floats, positions are 16-bit integers unless the request says otherwise. Errors: kUsage
/// "device.unknown" that lists the names.
Result<void> plan_for_device(const std::string& device, BakeRequest& request);

/// Lowers triangles, texture sizes and their budget to what a tier allows: "thumb", "phone" or
/// "desktop". Errors: kUsage "bake.tier" that lists the names.
Result<void> plan_for_tier(const std::string& tier, BakeRequest& request);
std::vector<std::string> tier_names();

/// The path of the picture of that file name among the request's patterns; empty: none exists.
std::string source_picture(const BakeRequest& request, const std::string& file);

}  // namespace modar
