// The --json documents of the commands, and the bundle's meta text.
#include "bake/commands/json_output.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "bake/bundle_builder.hpp"
#include "bake/commands/topology_json.hpp"

namespace modar {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no infinities: they become null.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

/// Foreign bytes that are no UTF-8 are replaced, never thrown at.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

const char* layout_name(const LayoutRecord& layout) {
  for (std::uint16_t a = 0; a < layout.attribute_count; ++a) {
    const AttributeRecord& attribute = layout.attributes[a];
    if (attribute.semantic != static_cast<std::uint8_t>(Semantic::kPosition)) continue;
    return attribute.type == static_cast<std::uint8_t>(ComponentType::kHalf) ? "half" : "int16";
  }
  return "none";
}

std::uint64_t model_bytes(const BundleView& bundle, const ModelRecord& model) {
  // Levels may share vertices: ranges are counted once. Levels are written in ascending order.
  std::uint64_t bytes = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  const std::uint64_t stride = bundle.layouts()[model.layout].stride;
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
      const LevelRecord& level = bundle.levels()[chunk.first_level + l];
      bytes += 2ull * level.index_count;
      ranges.emplace_back(level.vertex_offset, level.vertex_offset + stride * level.vertex_count);
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

Json topology_json(const MeshTopology& topology) {
  Json json = Json::object();
  for (const auto& [key, value] : topology_figures(topology)) json[key] = value;
  return json;
}

Json level_json(const LevelFigures& levels) {
  return {{"position_error_max", number(levels.position_error_max)},
          {"uv_shift_max_texels", number(levels.uv_shift_max_texels)}};
}

Json model_json(const BundleView& bundle, std::uint32_t index) {
  const ModelRecord& model = bundle.models()[index];
  const std::uint64_t bytes = model_bytes(bundle, model);
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
  const std::optional<LevelFigures> levels = stated_levels(bundle, index);
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
           number(static_cast<double>(level0) / static_cast<double>(model.triangle_count))},
          {"layout", layout_name(bundle.layouts()[model.layout])},
          {"center", {model.center[0], model.center[1], model.center[2]}},
          {"scale", number(model.scale)},
          {"diagonal", number(model.diagonal)},
          {"unit_metres", number(model.unit_metres)},
          {"position_error_max", number(model.position_error_max)},
          {"position_error_rms", number(model.position_error_rms)},
          {"normal_error_max_deg", number(model.normal_error_max_deg)},
          {"normal_error_rms_deg", number(model.normal_error_rms_deg)},
          {"uv_error_max_texels", number(model.uv_error_max_texels)},
          {"uv_error_rms_texels", number(model.uv_error_rms_texels)},
          {"topology", topology ? topology_json(*topology) : Json(nullptr)},
          {"levels", levels ? level_json(*levels) : Json(nullptr)}};
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
          {"psnr_db", number(texture.psnr_db)},
          {"ssim", number(texture.ssim)},
          {"alpha", (texture.flags & kTextureAlpha) != 0},
          {"repeat", (texture.flags & kTextureRepeat) != 0}};
}

Json pattern_json(const BundleView& bundle, std::uint32_t index) {
  const PatternRecord& pattern = bundle.patterns()[index];
  Json keypoints = Json::object();
  for (std::uint32_t s = 0; s < bundle.parameter_sets().size(); ++s) {
    const ParameterSetRecord& set = bundle.parameter_sets()[s];
    if (bundle.section(SectionType::kFeatureTwin, index, set.id).empty()) continue;
    keypoints[std::string(bundle.name(set.name))] = bundle.features(index, set.id).keypoints.size();
  }
  return {{"name", bundle.name(pattern.name)},
          {"width", pattern.width},
          {"height", pattern.height},
          {"width_mm", number(pattern.width_mm)},
          {"score", pattern.score < 0 ? Json(nullptr) : number(pattern.score)},
          {"keypoints", keypoints}};
}

Json inspect_document(const BundleView& bundle) {
  Json models = Json::array();
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    models.push_back(model_json(bundle, m));
  }
  Json textures = Json::array();
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    textures.push_back(texture_json(bundle, t));
  }
  Json patterns = Json::array();
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    patterns.push_back(pattern_json(bundle, p));
  }
  Json scenes = Json::array();
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    const SceneRecord& scene = bundle.scenes()[s];
    scenes.push_back({{"pattern", bundle.name(bundle.patterns()[scene.pattern].name)},
                      {"model", bundle.name(bundle.models()[scene.model].name)},
                      {"scale", number(scene.scale)},
                      {"offset", {scene.offset[0], scene.offset[1], scene.offset[2]}}});
  }
  return {{"format", {{"major", bundle.header().major}, {"minor", bundle.header().minor}}},
          {"bytes", bundle.bytes().size()},
          {"models", models},
          {"textures", textures},
          {"patterns", patterns},
          {"scenes", scenes}};
}

const char* severity_name(FindingSeverity severity) {
  return severity == FindingSeverity::kInfo      ? "info"
         : severity == FindingSeverity::kWarning ? "warning"
                                                 : "error";
}

}  // namespace

std::string inspect_json(const BundleView& bundle) {
  return dump(inspect_document(bundle));
}

std::string bake_json(const BundleView& bundle, const Report& report, const ProcessCost& cost) {
  Json stages = Json::array();
  for (const StageReport& stage : report.stages) {
    stages.push_back({{"name", stage.name},
                      {"ms", number(stage.ms)},
                      {"in", stage.in},
                      {"out", stage.out},
                      {"max_error", number(stage.max_error)}});
  }
  Json findings = Json::array();
  for (const Finding& finding : report.findings) {
    findings.push_back({{"id", finding.id},
                        {"severity", severity_name(finding.severity)},
                        {"file", finding.file},
                        {"line", finding.line},
                        {"message", finding.message},
                        {"cure", finding.cure}});
  }
  Json half_edges = Json::array();
  for (const MeshTopology& topology : report.topologies) {
    if (!topology.half_edges) continue;
    half_edges.push_back({{"model", topology.model},
                          {"boundary_loops", topology.half_edges->boundary_loops},
                          {"copied_faces", topology.half_edges->copied_faces},
                          {"copied_vertices", topology.half_edges->copied_vertices}});
  }
  return dump({{"bundle", inspect_document(bundle)},
               {"half_edges", half_edges},
               {"stages", stages},
               {"findings", findings},
               {"cpu_seconds", cost.cpu_seconds},
               {"peak_rss_bytes", cost.peak_rss_bytes}});
}

double bytes_per_triangle_of(const std::string& report) {
  const auto document = nlohmann::json::parse(report, nullptr, false);
  const auto value = nlohmann::json::json_pointer("/bundle/models/0/bytes_per_triangle");
  if (!document.is_object() || !document.contains(value) || !document[value].is_number()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return document[value].get<double>();
}

std::string rectify_json(const std::string& path, std::uint32_t width, std::uint32_t height,
                         double width_mm) {
  return dump({{"image", path}, {"width", width}, {"height", height}, {"width_mm", width_mm}});
}

std::string bench_json(const std::vector<BenchRow>& rows) {
  Json list = Json::array();
  for (const BenchRow& row : rows) {
    list.push_back({{"measure", row.measure},
                    {"ours", number(row.ours)},
                    {"reference", number(row.reference)},
                    {"ratio", number(row.ratio)}});
  }
  return dump(list);
}

namespace {

const char* max_error_unit(const MaxError& error) {
  switch (error.unit) {
    case MaxError::Unit::kAny:
      return "any";
    case MaxError::Unit::kSource:
      return "source";
    case MaxError::Unit::kPercent:
      return "percent";
    case MaxError::Unit::kMetres:
      break;
  }
  return "metres";
}

const char* positions_name(const BakeRequest& request) {
  if (!request.positions) return "auto";
  return *request.positions == PositionKind::kHalf ? "half" : "int16";
}

}  // namespace

std::string bundle_meta(const BakeRequest& request, const Report& report) {
  const auto name = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  Json models = Json::array();
  for (const std::string& path : request.models) {
    Json model = {{"file", name(path)}};
    if (models.size() < report.topologies.size()) {
      model["topology"] = topology_json(report.topologies[models.size()]);
    }
    if (models.size() < report.levels.size()) {
      model["levels"] = level_json(report.levels[models.size()]);
    }
    models.push_back(std::move(model));
  }
  Json patterns = Json::array();
  for (const PatternRequest& pattern : request.patterns) {
    patterns.push_back({{"file", name(pattern.path)}, {"width_mm", pattern.width_mm}});
  }
  return dump({{"tool", "modar " + request.tool_version},
               {"models", models},
               {"patterns", patterns},
               {"options",
                {{"device", request.device},
                 {"lods", request.levels},
                 {"max_error", request.max_error.value},
                 {"max_error_unit", max_error_unit(request.max_error)},
                 {"positions", positions_name(request)},
                 {"topology", request.topology},
                 {"effort", static_cast<int>(request.textures.effort)},
                 {"perceptual", request.textures.perceptual},
                 {"max_texture", request.textures.max_side},
                 {"mipmaps", request.textures.mipmaps},
                 {"unit_metres", request.unit_metres}}}});
}

}  // namespace modar
