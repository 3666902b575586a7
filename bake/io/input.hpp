// What commands read from files that others may have made.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "formats/base/error.hpp"
#include "formats/base/file_kind.hpp"

namespace modar {

/// Whether a name leads to a regular file. Opening a pipe or a device may wait for ever.
inline bool is_regular_file(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// Whether a path, all links followed, leads into a folder. False where it cannot be looked at.
bool is_inside(const std::string& folder, const std::filesystem::path& path);

/// The bytes of a regular file of at most `most` bytes; no more are read. Errors: kIo "io.open",
/// kInvalidInput "io.too-large".
Result<std::string> read_file(const std::string& path, std::size_t most);

/// Refuses a file of another kind by its first bytes: an empty file, a picture where a
/// model is wanted, and so on. start: at least 16 bytes, or the whole file. Errors: kInvalidInput
/// "io.empty"; kUsage "model.picture", "image.model" and so on: the wanted kind, the found one.
Result<void> require_kind(FileKind wanted, std::string_view start, const std::string& path);
/// The same of a file that can be opened.
Result<void> require_kind(FileKind wanted, const std::string& path);

/// A word that a shell takes unquoted, for commands in messages and build files.
std::string shell_quoted(const std::string& word);

/// The error of a part of a file, with the file's name before the place.
inline tl::unexpected<Error> in_file(const std::string& path, Error error) {
  error.where = path + (error.where.empty() ? "" : ", " + error.where);
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace modar
