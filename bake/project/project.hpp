// The door of this room: a collection that is described by a file, modar.toml, and baked as far as
// something changed.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/files/sorted_files.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

inline constexpr const char* kProjectFile = "modar.toml";
inline constexpr const char* kCacheFolder = ".modar/cache";  ///< where the project names none

/// Options of the bake by their names in modar.toml, as text: {"effort", "best"}.
using Settings = std::map<std::string, std::string>;

/// One model or one pattern of a project.
struct ProjectAsset {
  std::string name;          ///< what scenes and bundles call it
  std::string file;          ///< relative to the project's folder
  bool pattern = false;      ///< else a model
  double width_mm = 0.0;     ///< of a pattern; 0: what the file or its shape states, or unknown
  ShapeRequest shape;        ///< of a pattern
  std::uint32_t copies = 0;  ///< of a pattern, as PatternRequest has them
  Settings settings;         ///< of its own, above those of [bake] and of the tier
  std::size_t table = 0;     ///< which [[model]] or [[pattern]] of the file names it
  std::vector<std::string> globs;  ///< of that table
  std::string where;               ///< of that table: "modar.toml:12:1"
};

struct ProjectScene {
  SceneRequest request;  ///< its light: relative to the project's folder; no model: nodes alone
  Words texts;
  Words alts;                          ///< what a screen reader says is seen
  std::vector<NodeRequest> nodes;      ///< files: relative to the project's folder
  std::vector<ActionRequest> actions;  ///< on any node of the pattern
  std::optional<std::size_t> table;    ///< which [[scene]] of the file; nothing: it has none
  std::string where;                   ///< of that table: "modar.toml:12:1"
};

/// Which assets go into one file: see assets_of(). Models of the patterns' scenes come along.
struct ProjectBundle {
  std::string name;
  std::vector<std::string> models;    ///< names, * and ? match
  std::vector<std::string> patterns;  ///< the same
};

/// The same bundles once more, for another kind of device.
struct ProjectTier {
  std::string name;  ///< empty: the only one; else part of the files' names
  Settings settings;
};

/// What a bundle has to reach to be written.
struct ProjectGates {
  double min_psnr_db = 0;       ///< of each texture
  double min_ssim = 0;          ///< the same
  double min_score = 0;         ///< of each pattern, 0 to 100
  char min_grade = 0;           ///< of each pattern, 'A' to 'E'; 0: any
  std::uint64_t max_bytes = 0;  ///< of the file; 0: any
};

/// A parsed project file, globs expanded.
struct Project {
  std::string file;               ///< path of the project file
  bool outside = false;           ///< may use files outside its folder
  std::string folder;             ///< its folder, with a slash at its end; empty: the current one
  std::string out = "out";        ///< folder of the bundles, relative to the project's
  std::string cache;              ///< folder of the cache, relative; empty: kCacheFolder
  std::string light;              ///< of scenes that name none, relative; empty: none
  std::set<std::string> folders;  ///< that its globs look into, as the current folder sees them
  std::vector<ProjectAsset> models;
  std::vector<ProjectAsset> patterns;
  std::vector<ProjectScene> scenes;
  std::vector<ProjectBundle> bundles;  ///< at least one
  std::vector<ProjectTier> tiers;      ///< at least one
  Settings settings;                   ///< of [bake]
  ProjectGates gates;

  /// A path of the project as the current folder sees it.
  /// A node whose files are named from where we are.
  [[nodiscard]] NodeRequest located(NodeRequest node) const;
  [[nodiscard]] std::string path(const std::string& relative) const {
    return relative.starts_with('/') ? relative : folder + relative;
  }
  /// Whether the project may use a file, given as the current folder sees it: one in its folder.
  [[nodiscard]] bool may_use(const std::string& name) const;
};

/// Errors: kIo "project.open"; kInvalidInput with file, line and column: "project.toml" (no TOML),
/// "project.key" (unknown; names the nearest one there is), "project.value", "project.no-match" (a
/// glob that matches nothing), "project.same-name", "project.scene-unknown", "project.outside" (a
/// path that leads outside the project's folder, by links too, unless `outside` allows it: whoever
/// bakes a stranger's project gives it the files of its folder alone).
Result<Project> read_project(const std::string& path, bool outside = false);
/// The same of a text that is to become the file `path`.
Result<Project> read_project_text(const std::string& text, const std::string& path);

/// A project that is being written: the readable part, and the faults of the rest.
struct ProjectDraft {
  Project project;              ///< tables with errors are left out, or lack the wrong keys
  std::vector<Error> problems;  ///< those of read_project(), one a table at most for each kind
};
ProjectDraft read_draft(const std::string& text, const std::string& path);

/// Files below a folder, relative to it, in byte order; hidden ones and `out` left out.
struct FoundAssets {
  std::vector<std::string> models;
  std::vector<std::string> pictures;  ///< without those that a material of any model names
  std::vector<LeftOut> left_out;      ///< unread keys
};
/// Errors: kIo "io.folder".
Result<FoundAssets> find_assets(const std::string& folder);

/// Assets that no scene of a bundle names.
struct NeverShown {
  enum class Kind : std::uint8_t {
    kLeftOut,  ///< models
    kKept,     ///< models that the bundle names
    kBare      ///< patterns
  } kind;
  std::string names;  ///< "a, b and 3 more"
};
inline constexpr const char* kNeverShown = "project.never-shown";
/// The finding of a bundle's file.
Diagnostic finding_of(const NeverShown& what, const std::string& file);

/// What goes into a bundle of a project, in the project's order.
struct BundleAssets {
  std::vector<const ProjectAsset*> models;
  std::vector<const ProjectAsset*> patterns;
  std::vector<const ProjectScene*> scenes;
  std::vector<NeverShown> never_shown;
};

/// A bundle that names neither models nor patterns gets all patterns, the models that scenes show,
/// and all models where there is no pattern. `project` outlives the answer.
BundleAssets assets_of(const Project& project, const ProjectBundle& bundle);

/// The glob that matches this file alone.
std::string as_glob(const std::string& file);

struct InitialProject {
  std::string text;
  std::vector<Diagnostic>
      said;  ///< corners that were found, pairs that are guesses, files left out
};

/// The text of a project file, with comments, for the models and pictures in a folder and below it
/// (hidden ones and `out` left out). A picture that a model uses as a texture is no pattern. Files
/// that cannot be read are left out, so that the project bakes without an edit.
/// Errors: kIo "io.folder"; kInvalidInput "project.nothing" if none.
Result<InitialProject> initial_project(const std::string& folder);

/// The JSON schema of project files: modar.schema.json.
std::string project_schema();

struct ProjectOptions {
  std::string cache;            ///< folder; empty: the project's
  std::string cache_key;        ///< file of the key that signs the cache's entries; empty: none
  std::string only;             ///< bake this asset into the cache and link nothing; empty: all
  unsigned jobs = 1;            ///< threads, shared out over assets
  bool memory_limited = false;  ///< a MemoryLimit holds: assets are baked one after the other
  bool dry_run = false;         ///< plan only
  std::string tool_version;
};

/// What happens to an asset in a tier.
struct AssetOutcome {
  std::string name;
  std::string tier;
  enum class State : std::uint8_t { kFresh, kCached, kBaked, kFailed, kStale } state;
  std::string reason;  ///< why it is baked: "cover.png changed"; empty for kFresh and kCached
};

struct BundleOutcome {
  std::string path;
  std::uint64_t bytes = 0;
  bool written = false;
  bool fresh = false;  ///< it was there and is as it would be written
};

struct ProjectOutcome {
  std::vector<AssetOutcome> assets;  ///< kStale: of a dry run, it would be baked
  std::vector<BundleOutcome> bundles;
  std::vector<Diagnostic> diagnostics;  ///< of assets that went into a bundle that was written
  std::vector<std::string> inputs;      ///< paths of all files that were read, for a depfile
  std::vector<Error> errors;            ///< of assets and bundles that failed; the others stand
};

/// Bakes what changed and links the bundles that it belongs to. Finished parts stay in the cache,
/// whatever happens then. Errors: those of the folders that it writes to; what concerns one asset
/// or one bundle is in the outcome.
Result<ProjectOutcome> bake_project(const Project& project, const ProjectOptions& options,
                                    const ProgressCallback& progress);

/// What a cache holds. Errors of all three: kIo "cache.folder".
struct CacheSummary {
  std::uint64_t entries = 0;
  std::uint64_t bytes = 0;
  std::vector<std::string> damaged;  ///< of verify_cache(): files that were removed
};
Result<CacheSummary> summarise_cache(const std::string& folder);
/// Removes those that were used longest ago until at most `bytes` are left, and what interrupted
/// processes left more than a day ago. Returns the removed entries. dry_run: what would be.
Result<CacheSummary> prune_cache(const std::string& folder, std::uint64_t bytes,
                                 bool dry_run = false);
/// Reads every entry and removes those that are damaged, not what their name says, or not signed
/// with the key of the file `cache_key` (empty: none is requested): it is baked again when needed.
Result<CacheSummary> verify_cache(const std::string& folder, const std::string& cache_key);

}  // namespace modar
