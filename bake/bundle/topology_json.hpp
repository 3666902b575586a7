// Topology and levels of models, as the bundle's meta text states them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/json.hpp"
#include "bake/report.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// Keys and values of `models[].topology`.
std::vector<std::pair<std::string, std::int64_t>> topology_figures(const MeshTopology& topology);

/// What the bundle says of a model; nothing where it was baked with --no-topology or by others.
std::optional<MeshTopology> stated_topology(const BundleView& bundle, std::uint32_t model);

/// The object of `models[].topology`, and that of `models[].levels`.
Json topology_json(const MeshTopology& topology);
Json level_json(const LevelFigures& levels);

/// "3 components, 1 boundary loop, ...": for people.
std::string topology_words(const MeshTopology& topology);

/// What the bundle says of a model's levels; nothing where it has none or was baked by others.
std::optional<LevelFigures> stated_levels(const BundleView& bundle, std::uint32_t model);

/// "levels of detail: ...": for people.
std::string level_words(const LevelFigures& levels);

}  // namespace modar
