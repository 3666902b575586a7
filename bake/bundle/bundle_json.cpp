// The bundle's meta text, written and read, and what `modar inspect` and `modar bake` print of a
// bundle.
#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/scene/scene_nodes.hpp"
#include "bake/bundle/scene/scene_placement.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>

#include "bake/options/options.hpp"
#include "formats/base/path.hpp"
#include "formats/meta_text.hpp"
#include "formats/pattern_shape.hpp"

namespace modar {
namespace {

/// The keys are a contract (json.md).
constexpr struct {
  const char* key;
  std::uint64_t MeshTopology::*value;
} kCounts[] = {
    {"vertices", &MeshTopology::vertices},
    {"edges", &MeshTopology::edges},
    {"triangles", &MeshTopology::triangles},
    {"components", &MeshTopology::components},
    {"boundary_loops", &MeshTopology::boundary_loops},
    {"boundary_edges", &MeshTopology::boundary_edges},
    {"non_manifold_edges", &MeshTopology::non_manifold_edges},
    {"non_manifold_vertices", &MeshTopology::non_manifold_vertices},
    {"flipped_edges", &MeshTopology::flipped_edges},
    {"duplicate_triangles", &MeshTopology::duplicate_triangles},
};

Json topology_json(const MeshTopology& topology) {
  Json json = Json::object();
  for (const auto& count : kCounts) json.set(count.key, topology.*count.value);
  json.set("euler", topology.euler());
  return json;
}

Json level_json(const LevelFigures& levels) {
  return {{"position_error_max", levels.position_error_max},
          {"uv_shift_max_texels", levels.uv_shift_max_texels}};
}

/// What the meta text has under a model's key.
Json stated(const BundleView& bundle, std::uint32_t model, const char* key) {
  return stated_list(bundle, "models")[model][key];
}

constexpr const char* kReasonNames[] = {"asked",  "standard", "header",    "georeferenced",
                                        "ground", "base",     "convention"};

Json upright_json(const Upright& upright) {
  return {{"axis", up_axis_name(upright.axis)},
          {"reason", kReasonNames[static_cast<std::size_t>(upright.reason)]}};
}

const char* layout_name(const LayoutRecord& layout) {
  for (std::uint16_t a = 0; a < layout.attribute_count; ++a) {
    const AttributeRecord& attribute = layout.attributes[a];
    if (attribute.semantic != static_cast<std::uint8_t>(Semantic::kPosition)) continue;
    if (attribute.type == static_cast<std::uint8_t>(ComponentType::kF32)) return "float";
    return attribute.type == static_cast<std::uint8_t>(ComponentType::kHalf) ? "half" : "int16";
  }
  return "none";
}

std::uint64_t model_bytes(const BundleView& bundle, std::uint32_t index) {
  // Levels may share vertices: ranges are counted once. Levels are written in ascending order.
  std::uint64_t bytes = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  const std::uint64_t stride = bundle.layouts()[bundle.models()[index].layout].stride;
  for (std::uint32_t g = 0; g < bundle.chunk_groups(); ++g) {
    const ChunkGroup group = bundle.chunk_group(g);
    for (std::uint32_t c = 0; group.model == index && c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        const LevelRecord& level = bundle.levels()[chunk.first_level + l];
        bytes += 2ull * level.index_count;
        ranges.emplace_back(level.vertex_offset, level.vertex_offset + stride * level.vertex_count);
      }
    }
  }
  std::sort(ranges.begin(), ranges.end());
  std::uint64_t end = 0;
  for (const auto& [first, last] : ranges) {
    if (last > end) bytes += last - std::max(first, end);
    end = std::max(end, last);
  }
  return bytes;
}

/// The whole model at each level, finest first: chunks that have no such level at their coarsest,
/// then its proxies.
Json level_list(const BundleView& bundle, std::uint32_t index) {
  const ModelRecord& model = bundle.models()[index];
  Json list = Json::array();
  const auto add = [&](const ChunkGroup& group, std::uint32_t depth) {
    std::uint64_t triangles = 0;
    float error = 0.0f;
    for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[c];
      const LevelRecord& level =
          bundle.levels()[chunk.first_level + std::min(depth, chunk.level_count - 1)];
      triangles += level.index_count / 3;
      error = std::max(error, level.error);
    }
    list.push_back({{"triangles", triangles},
                    {"chunks", group.chunk_count},
                    {"error", static_cast<double>(error) * model.scale}});
  };
  for (std::uint32_t l = 0; l < model.level_count; ++l) add(bundle.chunk_group(index), l);
  for (std::uint32_t g = bundle.models().size(); g < bundle.chunk_groups(); ++g) {
    if (bundle.chunk_group(g).model == index) add(bundle.chunk_group(g), 0);
  }
  return list;
}

Json clip_list(const BundleView& bundle, std::uint32_t model) {
  Json list = Json::array();
  for (std::uint32_t c = 0; c < bundle.clips().size(); ++c) {
    const ClipRecord& clip = bundle.clips()[c];
    if (clip.model != model) continue;
    list.push_back({{"name", bundle.name(clip.name)},
                    {"seconds", clip.seconds},
                    {"error", static_cast<double>(clip.error) * bundle.models()[model].scale},
                    {"bytes", bundle.section(SectionType::kClipTracks, c).size()}});
  }
  return list;
}

Json model_json(const BundleView& bundle, std::uint32_t index) {
  const ModelRecord& model = bundle.models()[index];
  const std::uint64_t bytes = model_bytes(bundle, index);
  std::uint64_t indices = 0;
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    indices += bundle.levels()[chunk.first_level].index_count;
  }
  const std::uint64_t level0 =
      model.vertex_count * bundle.layouts()[model.layout].stride + 2 * indices;
  Json materials = Json::array();
  for (std::uint32_t m = 0; m < model.material_count; ++m) {
    materials.push_back(bundle.name(bundle.materials()[model.first_material + m].name));
  }
  const std::optional<MeshTopology> topology = stated_topology(bundle, index);
  const std::optional<MeshDefects> repair = stated_repair(bundle, index);
  const std::optional<LevelFigures> levels = stated_levels(bundle, index);
  const std::optional<Upright> upright = stated_upright(bundle, index);
  Json level_figures = levels ? level_json(*levels) : Json();
  if (levels) level_figures.set("list", level_list(bundle, index));
  return {{"name", bundle.name(model.name)},
          {"vertices", model.vertex_count},
          {"triangles", model.triangle_count},
          {"source_vertices", model.source_vertex_count},
          {"source_faces", model.source_face_count},
          {"chunks", model.chunk_count},
          {"lods", model.level_count},
          {"materials", materials},
          {"bytes", bytes},
          {"bytes_per_triangle",
           static_cast<double>(level0) / static_cast<double>(model.triangle_count)},
          {"layout", layout_name(bundle.layouts()[model.layout])},
          {"center", Json::list(model.center)},
          {"scale", model.scale},
          {"diagonal", model.diagonal},
          {"unit_metres", model.unit_metres},
          {"position_error_max", model.position_error_max},
          {"position_error_rms", model.position_error_rms},
          {"normal_error_max_deg", model.normal_error_max_deg},
          {"normal_error_rms_deg", model.normal_error_rms_deg},
          {"uv_error_max_texels", model.uv_error_max_texels},
          {"uv_error_rms_texels", model.uv_error_rms_texels},
          {"up", upright ? upright_json(*upright) : Json()},
          {"clips", clip_list(bundle, index)},
          {"topology", topology ? topology_json(*topology) : Json()},
          {"repair", repair ? defects_json(*repair) : Json()},
          {"levels", std::move(level_figures)}};
}

const char* severity_name(DiagnosticSeverity severity) {
  return severity == DiagnosticSeverity::kInfo      ? "info"
         : severity == DiagnosticSeverity::kWarning ? "warning"
                                                    : "error";
}

Json texture_json(const BundleView& bundle, std::uint32_t index) {
  const TextureRecord& texture = bundle.textures()[index];
  return {{"name", bundle.name(texture.name)},
          {"width", texture.width},
          {"height", texture.height},
          {"source_width", texture.source_width},
          {"source_height", texture.source_height},
          {"levels", texture.level_count},
          {"bytes", bundle.texture_data(index).size()},
          {"psnr_db", texture.psnr_db},
          {"ssim", texture.ssim},
          {"alpha", (texture.flags & kTextureAlpha) != 0},
          {"repeat", (texture.flags & kTextureRepeat) != 0}};
}

}  // namespace

Json defects_json(const MeshDefects& defects) {
  Json json = Json::object();
  for (std::size_t d = 0; d < kDefects; ++d) {
    const DefectCount& count = defects.counts[d];
    json.set(kDefectNames[d], Json{{"count", count.count}, {"area", count.area}});
  }
  return json;
}

Json range_json(const ScoreRange& range, double width_mm) {
  return {{"nearest_widths", range.nearest},
          {"farthest_widths", range.farthest},
          {"tilt_deg", range.tilt_deg},
          {"around_deg", range.curved ? Json(2 * range.tilt_deg) : Json()},
          {"half_covered_right_pct", 100 * range.covered_share},
          {"sentence", range_sentence(range, width_mm)}};
}

Json stated_list(const BundleView& bundle, const char* key) {
  return Json::parse(bundle.meta())[key];
}

std::optional<ScoreRange> stated_range(const BundleView& bundle, std::uint32_t pattern) {
  return range_in(stated_list(bundle, "patterns"), pattern);
}

std::optional<ScoreRange> range_in(const Json& patterns, std::uint32_t pattern) {
  const Json values = patterns[pattern]["range"];
  if (values.size() != 5) return std::nullopt;
  std::array<double, 5> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::optional<double> number = values[i].number();
    if (!number || !(*number >= 0 && *number < 1e6)) return std::nullopt;
    numbers[i] = *number;
  }
  return ScoreRange{numbers[0], numbers[1], numbers[2], numbers[3], numbers[4] > 0};
}

namespace {

/// What the pattern is printed on; null: it is flat.
Json shape_json(const BundleView& bundle, std::uint32_t index) {
  const PatternRecord& pattern = bundle.patterns()[index];
  const auto bytes = bundle.section(SectionType::kPatternShape, index);
  PatternSurface surface;
  if (bytes.empty() || view_pattern_shape(bytes, pattern.width, pattern.height, surface)) return {};
  if (!surface.faces().empty()) return {{"kind", "faces"}, {"faces", surface.faces().size()}};
  // Pattern units: half of the longer side.
  const double mm =
      pattern.width_mm / (2.0 * pattern.width / std::max(pattern.width, pattern.height));
  const double grown = surface.slope() * pattern.height / std::max(pattern.width, pattern.height);
  return {{"kind", "round"},
          {"arc_deg", 360 / std::numbers::pi * surface.half_arc()},
          {"top_mm", 2 * mm * (surface.radius() + grown)},
          {"bottom_mm", 2 * mm * (surface.radius() - grown)}};
}

Json pattern_json(const BundleView& bundle, std::uint32_t index) {
  const PatternRecord& pattern = bundle.patterns()[index];
  Json keypoints = Json::object();
  for (const ParameterSetRecord& set : bundle.parameter_sets()) {
    if (bundle.section(SectionType::kMappedFeatures, index, set.id).empty()) continue;
    keypoints.set(bundle.name(set.name), bundle.features(index, set.id).keypoints.size());
  }
  const std::optional<ScoreRange> range = stated_range(bundle, index);
  return {{"name", bundle.name(pattern.name)},
          {"width", pattern.width},
          {"height", pattern.height},
          {"width_mm", pattern.width_mm},
          {"copies", std::max(1u, pattern.copies)},
          {"score", pattern.score < 0 ? Json() : Json(pattern.score)},
          {"grade", range ? Json(std::string(1, grade_of(*range))) : Json()},
          {"range", range ? range_json(*range, pattern.width_mm) : Json()},
          {"shape", shape_json(bundle, index)},
          {"keypoints", keypoints}};
}

}  // namespace

std::string bundle_meta(const BakeRequest& request, const Report& report, const BakeTrace& trace) {
  Json models = Json::array();
  for (const ModelRequest& asked : request.models) {
    Json model = {{"file", file_name(asked.path)}};
    if (asked.name != file_stem(asked.path)) model.set("name", asked.name);
    if (models.size() < report.uprights.size()) {
      model.set("up", upright_json(report.uprights[models.size()]));
    }
    if (models.size() < report.topologies.size()) {
      model.set("topology", topology_json(report.topologies[models.size()]));
    }
    if (models.size() < report.repairs.size()) {
      model.set("repair", defects_json(report.repairs[models.size()]));
    }
    if (models.size() < report.levels.size()) {
      model.set("levels", level_json(report.levels[models.size()]));
    }
    models.push_back(std::move(model));
  }
  Json patterns = Json::array();
  for (const PatternRequest& pattern : request.patterns) {
    Json stated = {{"file", file_name(pattern.path)}, {"width_mm", pattern.width_mm}};
    if (!pattern.shape.text.empty()) stated.set("shape", pattern.shape.text);
    if (pattern.copies > 1) stated.set("copies", pattern.copies);
    if (pattern.name != file_stem(pattern.path)) stated.set("name", pattern.name);
    if (patterns.size() < trace.ranges.size() && trace.ranges[patterns.size()]) {
      const ScoreRange& range = *trace.ranges[patterns.size()];
      stated.set("range",
                 Json::list(std::array<double, 5>{range.nearest, range.farthest, range.tilt_deg,
                                                  range.covered_share, range.curved ? 1.0 : 0.0}));
    }
    patterns.push_back(std::move(stated));
  }
  Json scenes = Json::array();
  for (const SceneRequest& scene : request.scenes) {
    Json stated = {{"pattern", scene.pattern},
                   {"model", scene.model},
                   {"scale", scene.size.value},
                   {"up", up_axis_name(scene.up.value_or(UpAxis::kZ))},
                   {"turn", Json::list(scene.turn)},
                   {"centred", scene.centred},
                   {"offset_sides", Json::list(scene.offset.value)}};
    if (!scene.light.empty()) stated.set("light", file_name(scene.light));
    if (!scene.clip.empty()) stated.set("clip", scene.clip);
    if (scene.once) stated.set("once", true);
    scenes.push_back(std::move(stated));
  }
  Json meta = {{"tool", "modar " + request.tool_version},
               {"models", models},
               {"patterns", patterns},
               {"scenes", scenes},
               {"options", state_options(request)}};
  if (Json nodes = node_texts(request); !nodes.is_null()) meta.set("nodes", std::move(nodes));
  return meta.dump();
}

std::optional<MeshTopology> stated_topology(const BundleView& bundle, std::uint32_t model) {
  const Json found = stated(bundle, model, "topology");
  MeshTopology topology;
  for (const auto& figure : kCounts) {
    const std::optional<std::uint64_t> count = found[figure.key].count();
    if (!count) return std::nullopt;
    topology.*figure.value = *count;
  }
  return topology;
}

std::optional<MeshDefects> stated_repair(const BundleView& bundle, std::uint32_t model) {
  const Json found = stated(bundle, model, "repair");
  if (found.is_null()) return std::nullopt;
  MeshDefects repair;
  for (std::size_t d = 0; d < kDefects; ++d) {
    const Json one = found[kDefectNames[d]];
    repair.counts[d] = {one["count"].count().value_or(0), one.number_at("area")};
  }
  return repair;
}

std::optional<LevelFigures> stated_levels(const BundleView& bundle, std::uint32_t model) {
  const Json found = stated(bundle, model, "levels");
  const auto error = found["position_error_max"].number();
  const auto shift = found["uv_shift_max_texels"].number();
  return error && shift ? std::optional(LevelFigures{*error, *shift}) : std::nullopt;
}

std::optional<Upright> stated_upright(const BundleView& bundle, std::uint32_t model) {
  return upright_in(stated_list(bundle, "models"), model);
}

std::optional<Upright> upright_in(const Json& models, std::uint32_t model) {
  const Json found = models[model]["up"];
  const auto axis = up_axis_of(found.text_at("axis"));
  const std::string reason = found.text_at("reason");
  const auto* known = std::find(std::begin(kReasonNames), std::end(kReasonNames), reason);
  if (!axis || known == std::end(kReasonNames)) return std::nullopt;
  return Upright{*axis, static_cast<UpReason>(known - std::begin(kReasonNames))};
}

std::string topology_words(const MeshTopology& t) {
  return std::to_string(t.components) + " components, " + std::to_string(t.boundary_loops) +
         " boundary loops, Euler number " + std::to_string(t.euler()) +
         ", non-manifold: " + std::to_string(t.non_manifold_edges) + " edges, " +
         std::to_string(t.non_manifold_vertices) + " vertices";
}

std::string repair_words(const MeshDefects& repair) {
  std::string words;
  for (std::size_t d = 0; d < kDefects; ++d) {
    const DefectCount& one = repair.counts[d];
    if (one.count == 0) continue;
    char text[96];
    std::snprintf(text, sizeof text, "%s%s (area %.3g)", words.empty() ? "repaired: " : ", ",
                  defect_words(static_cast<Defect>(d), one.count).c_str(), one.area);
    words += text;
  }
  return words.empty() ? "nothing to repair" : words;
}

std::string length_words(double source_units, const ModelRecord& model) {
  char text[96];
  const double share = model.diagonal > 0 ? 100 * source_units / model.diagonal : 0;
  if (model.unit_metres > 0) {
    std::snprintf(text, sizeof text, "%.3g mm (%.2g %% of its diagonal)",
                  source_units * model.unit_metres * 1000, share);
  } else {
    std::snprintf(text, sizeof text, "%.3g of the file's units (%.2g %% of its diagonal)",
                  source_units, share);
  }
  return text;
}

std::string level_words(const BundleView& bundle, std::uint32_t index) {
  const Json list = level_list(bundle, index);
  const auto figures = stated_levels(bundle, index);
  if (list.size() < 2 || !figures) return "";
  char text[128];
  std::snprintf(text, sizeof text, "%zu levels of detail, down to %.0f triangles", list.size(),
                list[list.size() - 1].number_at("triangles"));
  std::string words = text;
  if (figures->uv_shift_max_texels > 0) {
    std::snprintf(text, sizeof text, ", texture shifted by at most %.1f texels",
                  figures->uv_shift_max_texels);
    words += text;
  }
  return words;
}

/// The axis of the model that faces the visitor, who looks from the picture's lower edge: "+Z";
/// empty where none does.
std::string front_axis(const SceneRecord& scene) {
  const std::array<double, 4> q = {scene.rotation[0], scene.rotation[1], scene.rotation[2],
                                   scene.rotation[3]};
  const std::array<double, 3> front = {-2 * (q[0] * q[1] + q[3] * q[2]),
                                       2 * (q[0] * q[0] + q[2] * q[2]) - 1,
                                       -2 * (q[1] * q[2] - q[3] * q[0])};
  for (std::size_t i = 0; i < front.size(); ++i) {
    if (std::fabs(front[i]) > 0.99) {
      return {front[i] > 0 ? '+' : '-', static_cast<char>('X' + static_cast<char>(i))};
    }
  }
  return {};
}

std::string scene_words(const BundleView& bundle, std::uint32_t index) {
  const SceneRecord& scene = bundle.scenes()[index];
  const auto placement = stated_placement(bundle, index);
  const auto upright = stated_upright(bundle, scene.model);
  std::string words;
  if (placement) {
    std::string axis(up_axis_name(placement->up));
    for (char& c : axis) c = c == '-' ? c : static_cast<char>(c - 'a' + 'A');
    words = axis + " up";
    const bool guessed = upright && upright->axis == placement->up;
    if (guessed) words += " (" + std::string(up_reason_words(upright->reason)) + ")";
  }
  if (const std::string front = front_axis(scene); !front.empty()) {
    words += (words.empty() ? "" : ", ") + front + " in front";
  }
  char text[48];
  constexpr double kFlat = 0.05;  // mm: a flat sheet has no height
  if (const double height = scene_height_mm(bundle, index); height > kFlat) {
    const bool metres = height >= 10000;
    std::snprintf(text, sizeof text, metres ? "%.4g m high" : "%.4g mm high",
                  metres ? height / 1000 : height);
  } else {
    std::snprintf(text, sizeof text, "scale %.4g", static_cast<double>(scene.scale));
  }
  return words + (words.empty() ? "" : ", ") + text;
}

Json diagnostics_json(const std::vector<Diagnostic>& diagnostics) {
  return Json::list(diagnostics, [&](const Diagnostic& diagnostic) -> Json {
    return {{"id", diagnostic.id},           {"severity", severity_name(diagnostic.severity)},
            {"file", diagnostic.file},       {"line", diagnostic.line},
            {"message", diagnostic.message}, {"cure", diagnostic.cure}};
  });
}

std::optional<StatedPlacement> stated_placement(const BundleView& bundle, std::uint32_t scene) {
  const Json one = stated_list(bundle, "scenes")[scene];
  const auto up = up_axis_of(one.text_at("up"));
  const Json turn = one["turn"];
  if (!up || turn.size() != 3) return std::nullopt;
  StatedPlacement placement{*up, {}};
  for (std::size_t i = 0; i < 3; ++i) placement.turn[i] = turn[i].number().value_or(0);
  return placement;
}

namespace {

const char* node_kind(const NodeRecord& node) {
  constexpr const char* kKinds[] = {"model", "picture", "label", "video", "sound"};
  return node.kind - 1 < std::size(kKinds) ? kKinds[node.kind - 1] : "unknown";
}

Json node_json(const BundleView& bundle, std::uint32_t index) {
  const NodeRecord& node = bundle.nodes()[index];
  const bool picture = node.kind == static_cast<std::uint32_t>(NodeKind::kPicture);
  Json json = {{"name", bundle.name(node.name)},
               {"pattern", bundle.name(bundle.patterns()[node.pattern].name)},
               {"kind", node_kind(node)},
               {"hidden", (node.flags & kNodeHidden) != 0},
               {"group", node.group},
               {"place", Json::list(node.place)},
               {"rotation", Json::list(node.rotation)},
               {"half_size", Json::list(node.half_size)}};
  if (picture) json.set("texture", node.subject);
  if (plays_media(node)) json.set("media", node.subject);
  if (node.mark.length != 0) json.set("mark", bundle.name(node.mark));
  const std::string_view pattern = bundle.name(bundle.patterns()[node.pattern].name);
  Json words = Json::object();
  visit_node_texts(bundle.meta(), [&](const MetaText& each) {
    constexpr const char* kKeys[] = {"text", "alt", "title", "captions"};
    if (each.pattern != pattern || each.node != bundle.name(node.name)) return;
    const char* key = kKeys[static_cast<std::size_t>(each.kind)];
    Json by_language = words.find(key).value_or(Json::object());
    by_language.set(each.language, each.words);
    words.set(key, std::move(by_language));
  });
  json.set("words", std::move(words));
  return json;
}

/// "tap pot (lid): turn pot by 90 about x in 1.5s", as modar.toml has it.
std::string action_words(const BundleView& bundle, const ActionRecord& action) {
  constexpr const char* kCommands[] = {"",     "play", "pause", "show", "hide", "toggle", "text",
                                       "link", "next", "",      "turn", "play", "play",   "stop"};
  const auto number = [](float value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", static_cast<double>(value));
    return std::string(text);
  };
  const auto node = [&](std::uint32_t index) {
    return std::string(bundle.name(bundle.nodes()[index].name));
  };
  std::string words;
  switch (static_cast<ActionEvent>(action.event)) {
    case ActionEvent::kFound:
      words = "found";
      break;
    case ActionEvent::kLost:
      words = "lost";
      break;
    case ActionEvent::kTap:
      words = "tap " + node(action.source);
      if (action.part.length != 0) words += " (" + std::string(bundle.name(action.part)) + ")";
      break;
    case ActionEvent::kAfter:
      words = "after " + number(action.seconds) + "s";
  }
  if (action.command >= std::size(kCommands)) return words;
  words += std::string(": ") + kCommands[action.command] + " ";
  if (action.address.length != 0) words += std::string(bundle.name(action.address));
  if (plays_clip(action.command)) words += " on ";
  if (action.target < bundle.nodes().size()) words += node(action.target);
  if (action.command == static_cast<std::uint32_t>(ActionCommand::kClipOnce)) words += " once";
  if (action.command != static_cast<std::uint32_t>(ActionCommand::kTurn)) return words;
  words += " by " + number(action.degrees);
  for (int axis = 0; axis < 3; ++axis) {
    if (action.axis[axis] == 1.0f && axis != 2) words += std::string(" about ") + "xyz"[axis];
  }
  return action.duration > 0.0f ? words + " in " + number(action.duration) + "s" : words;
}

/// The pattern on which an action happens; kNone of an event that a newer version has.
std::uint32_t pattern_of(const BundleView& bundle, const ActionRecord& action) {
  const bool tap = action.event == static_cast<std::uint32_t>(ActionEvent::kTap);
  if (tap) return bundle.nodes()[action.source].pattern;
  return action.source < bundle.patterns().size() ? action.source : kNone;
}

Json action_json(const BundleView& bundle, std::uint32_t index) {
  const ActionRecord& action = bundle.actions()[index];
  const std::uint32_t pattern = pattern_of(bundle, action);
  return {
      {"pattern", pattern == kNone ? Json() : Json(bundle.name(bundle.patterns()[pattern].name))},
      {"words", action_words(bundle, action)}};
}

/// Labels and actions of a pattern.
std::pair<int, int> acting_counts(const BundleView& bundle, std::uint32_t pattern) {
  std::pair<int, int> counts;
  for (const NodeRecord& node : bundle.nodes()) {
    counts.first +=
        node.pattern == pattern && node.kind == static_cast<std::uint32_t>(NodeKind::kLabel);
  }
  for (const ActionRecord& each : bundle.actions()) {
    counts.second += pattern_of(bundle, each) == pattern;
  }
  return counts;
}

Json scene_json(const BundleView& bundle, std::uint32_t index) {
  const SceneRecord& scene = bundle.scenes()[index];
  const std::optional<StatedPlacement> placement = stated_placement(bundle, index);
  const double height = scene_height_mm(bundle, index);
  const auto [labels, actions] = acting_counts(bundle, scene.pattern);
  return {{"pattern", bundle.name(bundle.patterns()[scene.pattern].name)},
          {"model", bundle.name(bundle.models()[scene.model].name)},
          {"scale", scene.scale},
          {"offset", Json::list(scene.offset)},
          {"rotation", Json::list(scene.rotation)},
          {"up", placement ? Json(up_axis_name(placement->up)) : Json()},
          {"turn", placement ? Json::list(placement->turn) : Json()},
          {"height_mm", height > 0 ? Json(height) : Json()},
          {"labels", labels},
          {"actions", actions}};
}

Json media_json(const BundleView& bundle, std::uint32_t index) {
  const MediaRecord& record = bundle.media()[index];
  const bool video = record.kind == static_cast<std::uint32_t>(MediaKind::kVideo);
  return {{"name", bundle.name(record.name)},
          {"kind", video ? "video" : "sound"},
          {"width", record.width},
          {"height", record.height},
          {"seconds", record.seconds},
          {"sound", (record.flags & kMediaSound) != 0},
          {"flashes", (record.flags & kMediaFlashes) != 0},
          {"poster", video ? Json(record.poster) : Json()},
          {"bytes", bundle.media_data(index).size()}};
}

}  // namespace

Json bundle_json(const BundleView& bundle) {
  const auto list = [&](std::uint32_t count, Json (*one)(const BundleView&, std::uint32_t)) {
    Json all = Json::array();
    for (std::uint32_t i = 0; i < count; ++i) all.push_back(one(bundle, i));
    return all;
  };
  return {{"format", {{"major", bundle.header().major}, {"minor", bundle.header().minor}}},
          {"bytes", bundle.bytes().size()},
          {"models", list(bundle.models().size(), model_json)},
          {"textures", list(bundle.textures().size(), texture_json)},
          {"patterns", list(bundle.patterns().size(), pattern_json)},
          {"scenes", list(bundle.scenes().size(), scene_json)},
          {"nodes", list(bundle.nodes().size(), node_json)},
          {"actions", list(bundle.actions().size(), action_json)},
          {"media", list(bundle.media().size(), media_json)}};
}

}  // namespace modar
