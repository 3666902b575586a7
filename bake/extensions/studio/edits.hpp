// The page's edits of modar.toml: POST api/edit.
#pragma once

#include <string>

#include "bake/json.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// The text after all edits of a list. file: path of modar.toml, for names and messages. Errors:
/// kUsage "studio.edit" (no such table or name), "project.edit"; those of read_project_text() where
/// the text was right before.
Result<std::string> edited_text(const std::string& text, const std::string& file,
                                const Json& edits);

/// The text with tables for files of the folder that it does not list yet, and without those that
/// are there no more.
struct NewAsset {
  std::string file;  ///< relative to the project's folder
  bool pattern = false;
};
/// A text that has nothing begins with a [project]. Errors: as edited_text().
Result<std::string> text_with_assets(const std::string& text, const std::string& file,
                                     const std::vector<NewAsset>& assets);

}  // namespace modar
