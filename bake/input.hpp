// What commands read from files that others may have made.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace modar {

/// Whether a name leads to a regular file. Opening a pipe or a device may wait for ever.
inline bool is_regular_file(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

}  // namespace modar
