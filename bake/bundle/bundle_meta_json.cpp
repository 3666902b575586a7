// The text of a bundle's kMeta section.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/topology_json.hpp"

namespace modar {
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
  return json_text({{"tool", "modar " + request.tool_version},
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
