// What commands read from files that others may have made.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <system_error>

#include "formats/base/error.hpp"

namespace modar {

/// Whether a name leads to a regular file. Opening a pipe or a device may wait for ever.
inline bool is_regular_file(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// The bytes of a regular file of at most `most` bytes; no more are read. Errors: kIo "io.open",
/// kInvalidInput "io.too-large".
Result<std::string> read_file(const std::string& path, std::size_t most);

/// The error of a part of a file, with the file's name before the place.
inline tl::unexpected<Error> in_file(const std::string& path, Error error) {
  error.where = path + (error.where.empty() ? "" : ", " + error.where);
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace modar
