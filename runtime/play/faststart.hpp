// Makes a movie start before it is loaded.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "formats/error.hpp"

namespace modar {

/// The index of an MP4 (its `moov` box, ISO 14496-12) to be put before its media data: the box with
/// its chunk offsets raised by its own size. Empty where it stands first already, or where the file
/// is not as simple as the players' own movies are.
std::vector<std::byte> leading_index(std::span<const std::byte> movie);

/// Writes the movie `from` to `to` through AtomicFile, its index first where it can be.
/// Errors: kIo.
Result<void> write_faststart(const std::string& from, const std::string& to);

}  // namespace modar
