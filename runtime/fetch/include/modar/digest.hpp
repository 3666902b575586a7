// BLAKE2b and hexadecimal text, by libsodium.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "formats/transport/recipe.hpp"

namespace modar {

ObjectId object_id(std::span<const std::byte> bytes);
BundleHash bundle_hash(std::span<const std::byte> bytes);

std::string to_hex(std::span<const std::uint8_t> bytes);
/// Nothing unless `text` is exactly 2 * N lower-case hexadecimal digits.
std::optional<ObjectId> object_id_of_hex(std::string_view text);
std::optional<BundleHash> bundle_hash_of_hex(std::string_view text);

/// "ab/abcdef...": where an object lies below `objects/`.
std::string object_path(const ObjectId& id);

}  // namespace modar
