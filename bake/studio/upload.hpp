// Files that the page brings into the project's folder: PUT api/files/NAME.
#pragma once

#include <string>
#include <vector>

#include "bake/studio/session.hpp"

namespace modar {

/// Takes the file at call.upload, or what an archive has, and lists in modar.toml what is a model
/// or a picture. Files that are there already are never changed.
Answer take_upload(Session& session, const Call& call);

/// Textures, MTL files and buffers that a model names and that are not there, relative to the
/// project's folder. file: the same.
std::vector<std::string> missing_of(const Session& session, const std::string& file);

}  // namespace modar
