// Names that a page or an archive gives to files, and the files of a folder that they may mean.
#pragma once

#include <string>
#include <string_view>

#include "formats/base/error.hpp"

namespace modar {

/// "photos/vase.jpg": parts of readable characters that do not begin with a dot, none too long for
/// a file system, no backslash. Errors: kUsage "studio.name".
Result<void> check_name(std::string_view name);

/// The path of a regular file that the name means; links that lead out of the folder are refused.
/// Errors: kUsage "studio.name", "studio.unknown".
Result<std::string> file_inside(const std::string& folder, std::string_view name);

/// The path under which a file of that name may be made; folders on the way are made. Errors:
/// kUsage "studio.name" (also where a link on the way leads out of the folder), kIo "io.folder".
Result<std::string> place_inside(const std::string& folder, std::string_view name);

}  // namespace modar
