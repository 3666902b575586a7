// Folders that commands write pictures and files to.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include "formats/error.hpp"

namespace modar {

/// Makes the folder and those above it where they are missing. Errors: kIo "io.folder".
inline Result<void> make_output_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return fail(ExitCode::kIo, "io.folder", folder, error.message(),
                "name a folder that can be made");
  }
  return {};
}

}  // namespace modar
