// The bundle's meta text, written and read, and what `modar inspect` and `modar bake` print of a
// bundle. Keys are a contract (bake/commands/json.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/json.hpp"
#include "bake/report.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// JSON of the kMeta section: tool, options and source file names, without folders or times.
/// What the report says of the models stands beside each.
std::string bundle_meta(const BakeRequest& request, const Report& report);

/// What the bundle states of a model's topology and of its levels of detail. Nothing where it was
/// baked without them, or by others.
std::optional<MeshTopology> stated_topology(const BundleView& bundle, std::uint32_t model);
std::optional<LevelFigures> stated_levels(const BundleView& bundle, std::uint32_t model);

/// "3 components, 1 boundary loop, ...", "levels of detail: off by at most ...": for people.
std::string topology_words(const MeshTopology& topology);
std::string level_words(const LevelFigures& levels);

/// "findings" of the documents.
Json diagnostics_json(const std::vector<Diagnostic>& diagnostics);

/// All that a bundle holds: the document of `modar inspect --json`.
Json bundle_json(const BundleView& bundle);

}  // namespace modar
