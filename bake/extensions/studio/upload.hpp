// Files that the page uploads into the project's folder: PUT api/files/NAME.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/studio/session.hpp"

namespace modar {

/// Takes the file at call.upload, or the files of an archive, and lists models and pictures in
/// modar.toml. Files that are there already are never changed.
Result<Answer> take_upload(Session& session, const Call& call);

/// Textures, MTL files and buffers that a model names and that are not there, relative to the
/// project's folder. file: the same.
std::vector<std::string> missing_of(const Session& session, const std::string& file);

}  // namespace modar
