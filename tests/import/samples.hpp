// Where tests find OBJ files that none of us made, and small ones of our own.
#pragma once

#include <string>
#include <vector>

namespace modar::testing {

/// All .obj files of Debian's assimp-testmodels, sorted; empty where it is not installed.
std::vector<std::string> assimp_obj_files();

/// All .obj files below a folder, sorted.
std::vector<std::string> obj_files_below(const std::string& folder);

}  // namespace modar::testing
