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

/// A member of that type; what it is without it. The text may be anyone's.
std::string text_in(const Json& stated, const char* key) {
  return stated.find(key).value_or(Json()).text().value_or("");
}
double number_in(const Json& stated, const char* key, double otherwise) {
  return stated.find(key).value_or(Json()).number().value_or(otherwise);
}

/// The objects of an array of the document.
std::vector<Json> entries_of(const Json& document, const char* kind) {
  const Json list = document.find(kind).value_or(Json());
  std::vector<Json> entries;
  for (std::size_t i = 0; list.is_array() && i < list.size(); ++i) entries.push_back(*list.at(i));
  return entries;
}

/// A name of a scene or a pattern that is among the sources: others cannot be baked.
template <class Range>
bool is_given(const Range& sources, const std::string& name) {
  return ranges::any_of(sources, [&](const auto& source) { return source.name == name; });
}

void take_three(const Json& stated, const char* key, std::array<double, 3>& values) {
  const Json list = stated.find(key).value_or(Json());
  if (!list.is_array() || list.size() != values.size()) return;
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = list.at(i)->number().value_or(values[i]);
  }
}

/// What the bundle calls the sources, where it is not the stem of their file's name: the user's own
/// names come first, and only the user distinguishes two files of one name.
template <class Asset>
void read_names(const Json& document, const char* kind, std::vector<Asset>& assets) {
  for (const Json& stated : entries_of(document, kind)) {
    const std::string file = text_in(stated, "file");
    const std::string name = text_in(stated, "name");
    const auto same = [&](const Asset& asset) {
      return asset.name.empty() && file_name(asset.path) == file;
    };
    if (name.empty() || std::count_if(assets.begin(), assets.end(), same) != 1) continue;
    std::find_if(assets.begin(), assets.end(), same)->name = name;
  }
}

void read_scenes(const Json& document, BakeRequest& request) {
  for (const Json& stated : entries_of(document, "scenes")) {
    SceneRequest scene;
    scene.pattern = text_in(stated, "pattern");
    scene.model = text_in(stated, "model");
    scene.size.value = number_in(stated, "scale", scene.size.value);
    scene.up = up_axis_of(text_in(stated, "up"));
    scene.centred = stated.find("centred").value_or(Json()).truth().value_or(false);
    take_three(stated, "turn", scene.turn);
    scene.offset.unit = SceneOffset::Unit::kSide;
    take_three(stated, "offset_sides", scene.offset.value);
    scene.light = source_picture(request, text_in(stated, "light"));
    scene.clip = text_in(stated, "clip");
    scene.once = stated.find("once").value_or(Json()).truth().value_or(false);
    if (is_given(request.models, scene.model) && is_given(request.patterns, scene.pattern)) {
      request.scenes.push_back(scene);
    }
  }
}

/// The widths and shapes that patterns were baked with, where the user gives none.
void read_widths(const Json& document, BakeRequest& request) {
  for (const Json& stated : entries_of(document, "patterns")) {
    const std::string file = text_in(stated, "file");
    const double width = number_in(stated, "width_mm", 0);
    const auto shape = parse_shape(text_in(stated, "shape"));
    for (PatternRequest& pattern : request.patterns) {
      if (file_name(pattern.path) != file) continue;
      if (pattern.width_mm == 0 && width > 0) pattern.width_mm = width;
      if (pattern.shape.text.empty() && shape) pattern.shape = *shape;
    }
  }
}

/// Pictures among the sources that give light and are no patterns of the bundle.
void leave_out_lights(const Json& document, BakeRequest& request) {
  const std::vector<Json> patterns = entries_of(document, "patterns");
  std::erase_if(request.patterns, [&](const PatternRequest& pattern) {
    const bool lights =
        pattern.path == request.light ||
        std::any_of(request.scenes.begin(), request.scenes.end(),
                    [&](const SceneRequest& scene) { return scene.light == pattern.path; });
    return lights && std::none_of(patterns.begin(), patterns.end(), [&](const Json& stated) {
             return text_in(stated, "file") == file_name(pattern.path);
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
  if (const Json options = document.find("options").value_or(Json()); !options.keys().empty()) {
    // Of bundles that were baked before there was any.
    request.occlusion = request.shadows = false;
    request.atlas = AtlasMode::kNever;
    restore_options(options, request);
  }
  leave_out_lights(document, request);
}

}  // namespace modar
