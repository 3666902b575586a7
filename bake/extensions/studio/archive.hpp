// ZIP files that a page uploads, and those that it downloads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// What an archive may become. A photogrammetry model with its textures is a tenth of it.
inline constexpr std::uint64_t kMostUnpackedBytes = std::uint64_t{4} << 30;
inline constexpr std::size_t kMostUnpackedFiles = 2000;

/// Unpacks into an empty folder; answers the files' names in the archive, in its order, hidden ones
/// and those of macOS left out. Nothing is believed of what the archive says of its sizes. Errors:
/// kInvalidInput "zip.damaged", "zip.name" (one that leads elsewhere, or twice the same),
/// "zip.link", "zip.locked" (encrypted), "zip.too-large" (also where it grows by more than a
/// thousand times, as bombs do); kIo "io.write".
Result<std::vector<std::string>> unpack_zip(const std::string& archive, const std::string& folder);

/// Writes the files of a folder, in byte order and without times: the same files give the same
/// bytes. Errors: kIo "io.write", "io.open".
Result<void> pack_zip(const std::string& folder, const std::string& archive);

}  // namespace modar
