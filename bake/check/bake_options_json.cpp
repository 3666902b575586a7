// Reads the options of a bake back from the meta text that bundle_meta() wrote.
#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "bake/bundle/request_text.hpp"
#include "bake/check/source_check.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"

namespace modar {
namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kLeastTextureSide = 4;  // as the command line has it

/// Takes a key over where it is there and of that type: the text may be anyone's.
template <class T>
void take(const Json& options, const char* key, T& value) {
  const auto found = options.find(key);
  if (found == options.end()) return;
  if constexpr (std::is_same_v<T, bool>) {
    if (found->is_boolean()) value = found->get<bool>();
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (found->is_string()) value = found->get<std::string>();
  } else if constexpr (std::is_integral_v<T>) {
    // Numbers beyond the type would be cast to anything.
    if (found->is_number_integer() && *found >= 0 && *found <= std::numeric_limits<T>::max()) {
      value = found->get<T>();
    }
  } else {
    if (found->is_number()) value = found->get<T>();
  }
}

/// A name of a scene or a pattern that is among the sources: others cannot be baked.
template <class Range>
bool is_given(const Range& sources, const std::string& name) {
  return std::any_of(sources.begin(), sources.end(),
                     [&](const auto& source) { return source.name == name; });
}

void take_three(const Json& stated, const char* key, std::array<double, 3>& values) {
  const auto found = stated.find(key);
  if (found == stated.end() || !found->is_array() || found->size() != values.size()) return;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if ((*found)[i].is_number()) values[i] = (*found)[i].get<double>();
  }
}

/// What the bundle calls the sources, where it is not the stem of their file's name: the user's own
/// names come first, and two files of one name are told apart by the user alone.
template <class Asset>
void read_names(const Json& document, const char* kind, std::vector<Asset>& assets) {
  const auto entries = document.find(kind);
  if (entries == document.end() || !entries->is_array()) return;
  for (const Json& stated : *entries) {
    std::string file;
    std::string name;
    if (!stated.is_object()) continue;
    take(stated, "file", file);
    take(stated, "name", name);
    const auto same = [&](const Asset& asset) {
      return asset.name.empty() && std::filesystem::path(asset.path).filename().string() == file;
    };
    if (name.empty() || std::count_if(assets.begin(), assets.end(), same) != 1) continue;
    std::find_if(assets.begin(), assets.end(), same)->name = name;
  }
}

/// A picture among the sources that lights a scene and is no pattern of the bundle.
std::string take_light(const Json& document, const std::string& file, BakeRequest& request) {
  const auto named = [&file](const PatternRequest& pattern) {
    return std::filesystem::path(pattern.path).filename().string() == file;
  };
  const auto patterns = document.find("patterns");
  if (patterns != document.end() && patterns->is_array()) {
    for (const Json& stated : *patterns) {
      std::string other;
      if (stated.is_object()) take(stated, "file", other);
      if (other == file) return "";
    }
  }
  const auto found = std::find_if(request.patterns.begin(), request.patterns.end(), named);
  if (file.empty() || found == request.patterns.end()) return "";
  return found->path;
}

void read_scenes(const Json& document, BakeRequest& request) {
  const auto scenes = document.find("scenes");
  if (scenes == document.end() || !scenes->is_array()) return;
  for (const Json& stated : *scenes) {
    if (!stated.is_object()) continue;
    SceneRequest scene;
    take(stated, "pattern", scene.pattern);
    take(stated, "model", scene.model);
    take(stated, "scale", scene.size.value);
    std::string up;
    take(stated, "up", up);
    scene.up = up_axis_of(up);
    take(stated, "centred", scene.centred);
    take_three(stated, "turn", scene.turn);
    scene.offset.unit = SceneOffset::Unit::kSide;
    take_three(stated, "offset_sides", scene.offset.value);
    std::string light;
    take(stated, "light", light);
    scene.light = take_light(document, light, request);
    if (is_given(request.models, scene.model) && is_given(request.patterns, scene.pattern)) {
      request.scenes.push_back(scene);
    }
  }
  std::erase_if(request.patterns, [&request](const PatternRequest& pattern) {
    return std::any_of(request.scenes.begin(), request.scenes.end(),
                       [&](const SceneRequest& scene) { return scene.light == pattern.path; });
  });
}

/// The widths and shapes that patterns were baked with, where the user gives none.
void read_widths(const Json& document, BakeRequest& request) {
  const auto patterns = document.find("patterns");
  if (patterns == document.end() || !patterns->is_array()) return;
  for (const Json& stated : *patterns) {
    if (!stated.is_object()) continue;
    std::string file;
    std::string shape;
    double width = 0;
    take(stated, "file", file);
    take(stated, "width_mm", width);
    take(stated, "shape", shape);
    for (PatternRequest& pattern : request.patterns) {
      const bool same = std::filesystem::path(pattern.path).filename().string() == file;
      if (same && pattern.width_mm == 0 && width > 0) pattern.width_mm = width;
      const auto known = parse_shape(shape);
      if (same && pattern.shape.flat() && known) pattern.shape = *known;
    }
  }
}

}  // namespace

void read_bake_options(std::string_view meta, BakeRequest& request) {
  const Json document = Json::parse(meta, nullptr, false);
  if (!document.is_object()) return;
  read_names(document, "models", request.models);
  read_names(document, "patterns", request.patterns);
  if (!name_assets(request)) return;
  read_scenes(document, request);
  read_widths(document, request);
  if (!document.contains("options")) return;
  const Json& options = document["options"];
  if (!options.is_object()) return;
  take(options, "device", request.device);
  if (!request.device.empty() && !plan_for_device(request.device, request)) request.device.clear();
  std::string tier;
  take(options, "tier", tier);
  static_cast<void>(plan_for_tier(tier, request));
  int effort = static_cast<int>(request.textures.effort);
  take(options, "effort", effort);
  if (effort >= 0 && effort <= static_cast<int>(TextureEffort::kBest)) {
    request.textures.effort = static_cast<TextureEffort>(effort);
  }
  take(options, "perceptual", request.textures.perceptual);
  std::uint32_t side = request.textures.max_side;
  take(options, "max_texture", side);
  if (side >= kLeastTextureSide && side <= kMaxTextureSide) request.textures.max_side = side;
  std::uint32_t levels = request.levels;
  take(options, "lods", levels);
  if (levels >= 1 && levels <= kMaxLevels) request.levels = levels;
  take(options, "mipmaps", request.textures.mipmaps);
  TrackerRecordOptions loop = request.loop;
  take(options, "loop_views", loop.trial_views);
  take(options, "score", loop.score);
  if (loop.validate()) request.loop = loop;
  // Of bundles that were baked before there was any.
  request.occlusion = request.shadows = false;
  request.atlas = AtlasMode::kNever;
  take(options, "occlusion", request.occlusion);
  take(options, "shadows", request.shadows);
  take(options, "topology", request.topology);
  take(options, "unit_metres", request.unit_metres);
  take(options, "max_error", request.max_error.value);
  const std::map<std::string, MaxError::Unit> units = {{"any", MaxError::Unit::kAny},
                                                       {"source", MaxError::Unit::kSource},
                                                       {"percent", MaxError::Unit::kPercent},
                                                       {"metres", MaxError::Unit::kMetres}};
  std::string word;
  take(options, "max_error_unit", word);
  if (const auto unit = units.find(word); unit != units.end())
    request.max_error.unit = unit->second;
  word.clear();
  take(options, "positions", word);
  if (word == "half") request.positions = PositionKind::kHalf;
  if (word == "int16") request.positions = PositionKind::kInt16;
  word.clear();
  take(options, "up", word);
  request.up = up_axis_of(word);
  word.clear();
  take(options, "atlas", word);
  if (word == "always") request.atlas = AtlasMode::kAlways;
  if (word == "where it pays") request.atlas = AtlasMode::kWhereItPays;
}

}  // namespace modar
