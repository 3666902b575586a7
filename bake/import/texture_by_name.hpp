// The texture of a model whose file names none. Internal to this room.
#pragma once

#include <string>

#include "bake/import/read_model.hpp"

namespace modar {

/// Gives all materials of a model that has texture coordinates and names no material file the
/// picture next to it that is_texture_name() of, else, with own_picture, the one that
/// is_own_picture() of and whose sides are powers of two; a note says which, or how to name one.
/// What has colours at its vertices needs none. folder: the model's. label: the file's name in
/// diagnostics.
void assign_texture_by_name(const ModelFolder& folder, const std::string& label, bool own_picture,
                            SourceModel& model);

}  // namespace modar
