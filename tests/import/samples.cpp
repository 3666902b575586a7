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

}  // namespace modar::testing
