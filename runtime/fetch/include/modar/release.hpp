// The release document: what a publisher signs and a device believes (formats/shipping.md).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/error.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

inline constexpr std::size_t kMaxReleaseBytes = 1u << 20;
inline constexpr std::size_t kMaxRecipeBytes = sizeof(RecipeHeader) + std::size_t{kMaxPieces} * 64;

struct ReleaseBundle {
  std::string name;        ///< a file name without its extension: letters, digits, . _ - only
  std::uint64_t size = 0;  ///< bytes of the installed bundle
  BundleHash hash{};       ///< of the installed bundle
  ObjectId recipe{};       ///< the object that holds the recipe, zstd
  std::uint32_t recipe_size = 0;      ///< bytes as stored
  std::uint32_t recipe_raw_size = 0;  ///< bytes
  std::uint32_t pieces = 0;
  std::uint64_t download_size = 0;   ///< bytes of all its objects, for a device that has none
  std::vector<std::string> devices;  ///< profiles that it is for; empty: all
};

struct Release {
  std::uint64_t version = 0;           ///< at least 1; only grows
  std::int64_t expires = 0;            ///< seconds since 1970-01-01, UTC
  std::vector<ReleaseBundle> bundles;  ///< at least one; names differ
};

/// Errors: kInvalidInput "release.*"; kUnsupported "release.version".
Result<Release> parse_release(std::string_view json);
/// The document, always the same bytes for the same release.
std::string release_text(const Release& release);

/// "2027-01-31T00:00:00Z". Errors: kInvalidInput "release.time".
Result<std::int64_t> parse_time(std::string_view text);
std::string time_text(std::int64_t seconds);

/// A link of the chain of keys: signed by the key before, it names the one that follows.
struct KeyLink {
  std::uint32_t serial = 0;  ///< from 1, without gaps
  std::string key;           ///< public_key_line()
};
/// Errors: kInvalidInput "keylink.text".
Result<KeyLink> parse_key_link(std::string_view json);
std::string key_link_text(const KeyLink& link);

}  // namespace modar
