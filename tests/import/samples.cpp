// Finds sample files on the machine.
#include "tests/import/samples.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace modar::testing {

namespace fs = std::filesystem;

std::vector<std::string> obj_files_below(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error); it != fs::recursive_directory_iterator();
       it.increment(error)) {
    if (error) break;
    if (it->path().extension() == ".obj") files.push_back(it->path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::string> assimp_obj_files() {
  return obj_files_below("/usr/share/assimp/models/OBJ");
}

std::string shared_data() {
  std::string folder;
  if (const char* named = std::getenv("MODAR_SHARED_DATA")) {
    folder = named;
  } else if (const char* source = std::getenv("MODAR_SOURCE_DIR")) {
    folder = std::string(source) + "/../shared/data";
  }
  std::error_code error;
  return !folder.empty() && fs::is_directory(folder, error) ? folder : std::string();
}

}  // namespace modar::testing
