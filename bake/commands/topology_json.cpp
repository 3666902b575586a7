// Topology to JSON and back.
#include "bake/commands/topology_json.hpp"

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
  const auto document = nlohmann::json::parse(bundle.meta(), nullptr, false);
  if (!document.is_object() || !document.contains("models")) return std::nullopt;
  const auto& models = document["models"];
  if (!models.is_array() || model >= models.size() || !models[model].is_object()) {
    return std::nullopt;
  }
  const auto found = models[model].find("topology");
  if (found == models[model].end() || !found->is_object()) return std::nullopt;
  MeshTopology topology;
  for (const auto& count : kCounts) {
    const auto value = found->find(count.key);
    if (value == found->end() || !value->is_number_unsigned()) return std::nullopt;
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

}  // namespace modar
