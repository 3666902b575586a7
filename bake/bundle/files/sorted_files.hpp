// What a list of files becomes in a bake: the same for `modar bake FILES`, `modar init`, the studio
// and programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/import/source_model.hpp"
#include "bake/options/request.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// A model or picture that is not read, and why.
struct LeftOut {
  std::string file;
  Error error;
};

/// Files by what a bake makes of them, in the order in which they were given.
struct SortedFiles {
  std::vector<std::string> models;
  std::vector<std::string> pictures;  ///< that become patterns
  std::vector<std::string> textures;  ///< pictures that a model uses, so no patterns
  std::vector<std::string> others;    ///< neither models nor pictures
  std::vector<LeftOut> left_out;
};

/// Sorts by endings and first bytes; materials and small models are read to tell textures apart.
/// folder: before each name, for reading, and what they name must be in it; empty: the current one,
/// and any.
SortedFiles sort_files(const std::vector<std::string>& files, const std::string& folder = {});

/// A file that belongs to a model: a material, a buffer.
bool is_material_file(const std::string& file);

/// The model of a file of at most 100 MB, to see what it contains; nothing: it is larger.
/// within: the folder that all it names must be in; empty: any.
std::optional<Result<SourceModel>> small_model(const std::string& path, const std::string& within);

/// Finds the picture of a pattern in its file, unless the request states a shape: a photo of a flat
/// thing gets the thing's corners. Reports the files found in `said`: a note, or a warning where it
/// may be wrong. Errors: those of read_photo().
Result<void> find_picture(PatternRequest& pattern, std::vector<Diagnostic>& said);

/// The pairs of names that need no scene: equal names, and a single model on a single pattern.
/// Otherwise the first model on the first pattern, and so on; `guessed` is true then.
struct ScenePairs {
  std::vector<SceneRequest> scenes;
  bool guessed = false;
};
ScenePairs pair_by_names(const std::vector<std::string>& patterns,
                         const std::vector<std::string>& models);

}  // namespace modar
