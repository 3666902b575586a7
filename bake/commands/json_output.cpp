// The --json documents of the commands, and the bundle's meta text.
#include "bake/commands/json_output.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/topology_json.hpp"
#include "bake/json.hpp"

namespace modar {
namespace {

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
           json_number(static_cast<double>(level0) / static_cast<double>(model.triangle_count))},
          {"layout", layout_name(bundle.layouts()[model.layout])},
          {"center", {model.center[0], model.center[1], model.center[2]}},
          {"scale", json_number(model.scale)},
          {"diagonal", json_number(model.diagonal)},
          {"unit_metres", json_number(model.unit_metres)},
          {"position_error_max", json_number(model.position_error_max)},
          {"position_error_rms", json_number(model.position_error_rms)},
          {"normal_error_max_deg", json_number(model.normal_error_max_deg)},
          {"normal_error_rms_deg", json_number(model.normal_error_rms_deg)},
          {"uv_error_max_texels", json_number(model.uv_error_max_texels)},
          {"uv_error_rms_texels", json_number(model.uv_error_rms_texels)},
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
          {"psnr_db", json_number(texture.psnr_db)},
          {"ssim", json_number(texture.ssim)},
          {"alpha", (texture.flags & kTextureAlpha) != 0},
          {"repeat", (texture.flags & kTextureRepeat) != 0}};
}

Json pattern_json(const BundleView& bundle, std::uint32_t index) {
  const PatternRecord& pattern = bundle.patterns()[index];
  Json keypoints = Json::object();
  for (std::uint32_t s = 0; s < bundle.parameter_sets().size(); ++s) {
    const ParameterSetRecord& set = bundle.parameter_sets()[s];
    if (bundle.section(SectionType::kMappedFeatures, index, set.id).empty()) continue;
    keypoints[std::string(bundle.name(set.name))] = bundle.features(index, set.id).keypoints.size();
  }
  return {{"name", bundle.name(pattern.name)},
          {"width", pattern.width},
          {"height", pattern.height},
          {"width_mm", json_number(pattern.width_mm)},
          {"score", pattern.score < 0 ? Json(nullptr) : json_number(pattern.score)},
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
                      {"scale", json_number(scene.scale)},
                      {"offset", {scene.offset[0], scene.offset[1], scene.offset[2]}}});
  }
  return {{"format", {{"major", bundle.header().major}, {"minor", bundle.header().minor}}},
          {"bytes", bundle.bytes().size()},
          {"models", models},
          {"textures", textures},
          {"patterns", patterns},
          {"scenes", scenes}};
}

const char* severity_name(DiagnosticSeverity severity) {
  return severity == DiagnosticSeverity::kInfo      ? "info"
         : severity == DiagnosticSeverity::kWarning ? "warning"
                                                    : "error";
}

}  // namespace

std::string inspect_json(const BundleView& bundle) {
  return json_text(inspect_document(bundle));
}

std::string bake_json(const BundleView& bundle, const Report& report, const ProcessCost& cost) {
  Json stages = Json::array();
  for (const StageReport& stage : report.stages) {
    stages.push_back({{"name", stage.name},
                      {"ms", json_number(stage.ms)},
                      {"in", stage.in},
                      {"out", stage.out},
                      {"max_error", json_number(stage.max_error)}});
  }
  Json findings = Json::array();
  for (const Diagnostic& finding : report.findings) {
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
  return json_text({{"bundle", inspect_document(bundle)},
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
  return json_text({{"image", path}, {"width", width}, {"height", height}, {"width_mm", width_mm}});
}

std::string bench_json(const std::vector<BenchRow>& rows) {
  Json list = Json::array();
  for (const BenchRow& row : rows) {
    list.push_back({{"measure", row.measure},
                    {"ours", json_number(row.ours)},
                    {"reference", json_number(row.reference)},
                    {"ratio", json_number(row.ratio)}});
  }
  return json_text(list);
}

}  // namespace modar
