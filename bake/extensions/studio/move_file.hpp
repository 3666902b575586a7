// Gives a file a name that no other file has.
#pragma once

#include <string>

namespace modar {

/// False, with errno, where the name is taken (EEXIST) or the file cannot be moved.
bool move_to_free(const std::string& from, const std::string& to);

}  // namespace modar
