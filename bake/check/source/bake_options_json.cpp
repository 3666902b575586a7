// Reads the options of a bake back from the meta text that bundle_meta() wrote.
#include <algorithm>
#include <array>

#include "bake/check/source/source_check.hpp"
#include "bake/json.hpp"
#include "bake/options/options.hpp"
#include "bake/options/request_text.hpp"
#include "formats/base/path.hpp"
#include "formats/base/ranges.hpp"

namespace modar {
namespace {

/// A name of a scene or a pattern that is among the sources: others cannot be baked.
template <class Range>
bool is_given(const Range& sources, const std::string& name) {
  return ranges::any_of(sources, [&](const auto& source) { return source.name == name; });
}

void take_three(const Json& stated, const char* key, std::array<double, 3>& values) {
  const Json list = stated[key];
  if (!list.is_array() || list.size() != values.size()) return;
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = list[i].number().value_or(values[i]);
  }
}

/// What the bundle calls the sources, where it is not the stem of their file's name: the user's own
/// names come first, and only the user distinguishes two files of one name.
template <class Asset>
void read_names(const Json& document, const char* kind, std::vector<Asset>& assets) {
  for (const Json& stated : document[kind].elements()) {
    const std::string file = stated.text_at("file");
    const std::string name = stated.text_at("name");
    const auto same = [&](const Asset& asset) {
      return asset.name.empty() && file_name(asset.path) == file;
    };
    if (name.empty() || std::count_if(assets.begin(), assets.end(), same) != 1) continue;
    std::find_if(assets.begin(), assets.end(), same)->name = name;
  }
}

void read_scenes(const Json& document, BakeRequest& request) {
  for (const Json& stated : document["scenes"].elements()) {
    SceneRequest scene;
    scene.pattern = stated.text_at("pattern");
    scene.model = stated.text_at("model");
    scene.size.value = stated["scale"].number().value_or(scene.size.value);
    scene.up = up_axis_of(stated.text_at("up"));
    scene.centred = stated["centred"].truth().value_or(false);
    take_three(stated, "turn", scene.turn);
    scene.offset.unit = SceneOffset::Unit::kSide;
    take_three(stated, "offset_sides", scene.offset.value);
    scene.light = source_picture(request, stated.text_at("light"));
    scene.clip = stated.text_at("clip");
    scene.once = stated["once"].truth().value_or(false);
    if (is_given(request.models, scene.model) && is_given(request.patterns, scene.pattern)) {
      request.scenes.push_back(scene);
    }
  }
}

/// The widths, shapes and copies that patterns were baked with, where the user gives none.
void read_widths(const Json& document, BakeRequest& request) {
  for (const Json& stated : document["patterns"].elements()) {
    const std::string file = stated.text_at("file");
    const double width = stated.number_at("width_mm");
    const auto shape = parse_shape(stated.text_at("shape"));
    for (PatternRequest& pattern : request.patterns) {
      if (file_name(pattern.path) != file) continue;
      if (pattern.width_mm == 0 && width > 0) pattern.width_mm = width;
      if (pattern.shape.text.empty() && shape) pattern.shape = *shape;
      if (pattern.copies == 0)
        pattern.copies = static_cast<std::uint32_t>(stated.number_at("copies"));
    }
  }
}

/// Pictures among the sources that give light and are no patterns of the bundle.
void leave_out_lights(const Json& document, BakeRequest& request) {
  const std::vector<Json> patterns = document["patterns"].elements();
  std::erase_if(request.patterns, [&](const PatternRequest& pattern) {
    const bool lights =
        pattern.path == request.light ||
        std::any_of(request.scenes.begin(), request.scenes.end(),
                    [&](const SceneRequest& scene) { return scene.light == pattern.path; });
    return lights && std::none_of(patterns.begin(), patterns.end(), [&](const Json& stated) {
             return stated.text_at("file") == file_name(pattern.path);
           });
  });
}

}  // namespace

void read_bake_options(std::string_view meta, BakeRequest& request) {
  const Json document = Json::parse(meta);
  read_names(document, "models", request.models);
  read_names(document, "patterns", request.patterns);
  if (!name_assets(request)) return;
  read_scenes(document, request);
  read_widths(document, request);
  if (const Json options = document["options"]; !options.keys().empty()) {
    // Of bundles that were baked before there was any.
    request.occlusion = request.shadows = false;
    request.atlas = AtlasMode::kNever;
    restore_options(options, request);
  }
  leave_out_lights(document, request);
}

}  // namespace modar
