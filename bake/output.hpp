// What commands do before they write files for people.
#pragma once

#include <string>

#include "formats/error.hpp"

namespace modar {

/// Makes the folder and those above it where they are missing. Errors: kIo "io.folder".
Result<void> make_output_folder(const std::string& folder);

}  // namespace modar
