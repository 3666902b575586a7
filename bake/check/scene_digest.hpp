// One number for all that a bundle shows and recognises, apart from how the file is laid out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

/// XXH64 over every field of every record, names as text, the bytes of vertex attributes, indices,
/// blocks and features: equal only where the scene is. 0 for a bundle that does not open.
std::uint64_t scene_digest(std::span<const std::byte> bytes);

}  // namespace modar
