// Topology to JSON and back, and what is stated of levels.
#include "bake/bundle/topology_json.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

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

/// What the meta text has under a model's key; null where it has no such object.
nlohmann::json stated(const BundleView& bundle, std::uint32_t model, const char* key) {
  const auto document = nlohmann::json::parse(bundle.meta(), nullptr, false);
  if (!document.is_object() || !document.contains("models")) return nullptr;
  const auto& models = document["models"];
  if (!models.is_array() || model >= models.size() || !models[model].is_object()) return nullptr;
  const auto found = models[model].find(key);
  if (found == models[model].end() || !found->is_object()) return nullptr;
  return *found;
}

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> topology_figures(const MeshTopology& topology) {
  std::vector<std::pair<std::string, std::int64_t>> figures;
  for (const auto& count : kCounts) {
    figures.emplace_back(count.key, static_cast<std::int64_t>(topology.*count.value));
  }
  figures.emplace_back("euler", topology.euler());
  return figures;
}

std::optional<MeshTopology> stated_topology(const BundleView& bundle, std::uint32_t model) {
  const nlohmann::json found = stated(bundle, model, "topology");
  if (found.is_null()) return std::nullopt;
  MeshTopology topology;
  for (const auto& count : kCounts) {
    const auto value = found.find(count.key);
    if (value == found.end() || !value->is_number_unsigned()) return std::nullopt;
    topology.*count.value = value->get<std::uint64_t>();
  }
  return topology;
}

std::string topology_words(const MeshTopology& t) {
  return std::to_string(t.components) + " components, " + std::to_string(t.boundary_loops) +
         " boundary loops, Euler number " + std::to_string(t.euler()) +
         ", non-manifold: " + std::to_string(t.non_manifold_edges) + " edges, " +
         std::to_string(t.non_manifold_vertices) + " vertices";
}

std::optional<LevelFigures> stated_levels(const BundleView& bundle, std::uint32_t model) {
  const nlohmann::json found = stated(bundle, model, "levels");
  if (found.is_null()) return std::nullopt;
  const auto error = found.find("position_error_max");
  const auto shift = found.find("uv_shift_max_texels");
  if (error == found.end() || !error->is_number() || shift == found.end() || !shift->is_number()) {
    return std::nullopt;
  }
  return LevelFigures{error->get<double>(), shift->get<double>()};
}

std::string level_words(const LevelFigures& levels) {
  char text[128];
  std::snprintf(text, sizeof text,
                "levels of detail: off by at most %.3g, texture shifted by at most %.1f texels",
                levels.position_error_max, levels.uv_shift_max_texels);
  return text;
}

Json topology_json(const MeshTopology& topology) {
  Json json = Json::object();
  for (const auto& [key, value] : topology_figures(topology)) json[key] = value;
  return json;
}

Json level_json(const LevelFigures& levels) {
  return {{"position_error_max", json_number(levels.position_error_max)},
          {"uv_shift_max_texels", json_number(levels.uv_shift_max_texels)}};
}

}  // namespace modar
