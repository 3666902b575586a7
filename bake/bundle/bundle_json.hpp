// The bundle's meta text, written and read, and what `modar inspect` and `modar bake` print of a
// bundle. Keys are a contract (bake/commands/json.md).
#pragma once

#include <array>
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
/// The report of the models and the trace of the patterns are next to each.
std::string bundle_meta(const BakeRequest& request, const Report& report, const BakeTrace& trace);

/// What the bundle states of a model's topology, its repair and its levels of detail. Nothing where
/// it was baked without them, or by others.
std::optional<MeshTopology> stated_topology(const BundleView& bundle, std::uint32_t model);
std::optional<MeshDefects> stated_repair(const BundleView& bundle, std::uint32_t model);
std::optional<LevelFigures> stated_levels(const BundleView& bundle, std::uint32_t model);

/// Which axis of the model is up, and how that is known. Nothing of bundles that do not state it.
std::optional<Upright> stated_upright(const BundleView& bundle, std::uint32_t model);

/// Where a pattern is recognised, as the bake measured it. Nothing: it was not scored.
std::optional<ScoreRange> stated_range(const BundleView& bundle, std::uint32_t pattern);

/// What a bundle states of its "models" or "patterns", and the same two of it: whoever asks of many
/// parses the text once, which grows with them.
Json stated_list(const BundleView& bundle, const char* key);
std::optional<Upright> upright_in(const Json& models, std::uint32_t model);
std::optional<ScoreRange> range_in(const Json& patterns, std::uint32_t pattern);
/// "range" of the documents.
Json range_json(const ScoreRange& range, double width_mm);

/// How a scene's model was turned.
struct StatedPlacement {
  UpAxis up = UpAxis::kY;
  std::array<double, 3> turn{};  ///< SceneRequest::turn
};
std::optional<StatedPlacement> stated_placement(const BundleView& bundle, std::uint32_t scene);

/// "3 components, 1 boundary loop, ...": for people.
std::string topology_words(const MeshTopology& topology);
/// "repaired: 3 small islands (area 0.02), ...": in square units of the file.
std::string repair_words(const MeshDefects& repair);
/// "6 levels of detail, down to 1328 triangles"; empty where a model has one, or states none.
std::string level_words(const BundleView& bundle, std::uint32_t model);
/// "0.42 mm (0.01 % of its diagonal)".
std::string length_words(double source_units, const ModelRecord& model);
/// "Y up (the glTF standard), 120 mm high".
std::string scene_words(const BundleView& bundle, std::uint32_t scene);

/// "findings" of the documents.
Json diagnostics_json(const std::vector<Diagnostic>& diagnostics);

/// Counts by the names of kDefectNames, and areas where they are known: of repairs.
Json defects_json(const MeshDefects& defects);

/// All that a bundle holds: the document of `modar inspect --json`.
Json bundle_json(const BundleView& bundle);

}  // namespace modar
