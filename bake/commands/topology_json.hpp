// Topology of models, as the bundle's meta text states it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/model/topology.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// Keys and values of `models[].topology`.
std::vector<std::pair<std::string, std::int64_t>> topology_figures(const MeshTopology& topology);

/// What the bundle says of a model; nothing where it was baked with --no-topology or by others.
std::optional<MeshTopology> stated_topology(const BundleView& bundle, std::uint32_t model);

/// "3 components, 1 boundary loop, ...": for people.
std::string topology_words(const MeshTopology& topology);

}  // namespace modar
