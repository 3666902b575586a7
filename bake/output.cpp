#include "bake/output.hpp"

#include <filesystem>
#include <system_error>

namespace modar {

Result<void> make_output_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return fail(ExitCode::kIo, "io.folder", folder, error.message(),
                "name a folder that can be made");
  }
  return {};
}

}  // namespace modar
