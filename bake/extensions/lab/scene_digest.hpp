// Whether a mutated bundle still shows the same scene, as two independent readers see it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// XXH64 over every field of every record, names as text, the bytes of vertex attributes, indices,
/// blocks and features: equal only where the scene is. 0 for a bundle that does not open.
std::uint64_t scene_digest(std::span<const std::byte> bytes);

/// A line a file: a digest of the decoded scene, or why the reader refuses it. Writes the files to
/// a folder of their own under the system's temporary one, removed afterwards, and starts the
/// reader once. Errors: kIo "mutate.second-reader".
Result<std::vector<std::string>> read_scenes(const std::string& reader,
                                             const std::vector<std::span<const std::byte>>& files);

}  // namespace modar
