// What the comments of a text model say of its vertical axis.
#pragma once

#include <optional>
#include <string_view>

#include "bake/up_axis.hpp"

namespace modar {

/// The axis that the comments in the first lines of an OBJ ("# ...") or PLY ("comment ...") file
/// name as vertical: "Z up", "Y-up", "up axis: z", "up = +Y". Nothing where none does, or where
/// they contradict each other. head: the file's first bytes, at most 4 KB of them are read.
std::optional<UpAxis> up_in_comments(std::string_view head);

}  // namespace modar
