// Asks scripts/read_bundle.py, which shares no code with us, what it decodes.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "formats/error.hpp"

namespace modar {

/// A line a file: a digest of the decoded scene, or why the reader refuses it. Writes the files to
/// a folder of their own under the system's temporary one, removed afterwards, and starts the
/// reader once. Errors: kIo "mutate.second-reader".
Result<std::vector<std::string>> read_scenes(const std::string& reader,
                                             const std::vector<std::span<const std::byte>>& files);

}  // namespace modar
