// What a publisher signs and a device verifies: release documents, keys, signatures, and the hashes
// that name everything else. formats/shipping.md is the normative text.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// Exit codes of a fetch beyond the common ones (ExitCode leaves 10 and up to the commands).
inline constexpr ExitCode kExitWrongKey{10};  ///< not signed by the trusted key
inline constexpr ExitCode kExitRollBack{11};  ///< older than the installed release
inline constexpr ExitCode kExitExpired{12};   ///< past its expiry
inline constexpr ExitCode kExitMixed{13};     ///< the server's files belong to different releases
inline constexpr ExitCode kExitNoSpace{14};   ///< not enough free space
inline constexpr ExitCode kExitLocked{15};    ///< another process holds the folder
inline constexpr ExitCode kExitNetwork{16};   ///< gave up; the download is kept
inline constexpr ExitCode kExitBadBundle{
    17};  ///< the new bundle fails validation; the old one stays

/// @name Hashes
/// BLAKE2b by libsodium, and its hexadecimal text.
/// @{
ObjectId object_id(std::span<const std::byte> bytes);
BundleHash bundle_hash(std::span<const std::byte> bytes);

std::string to_hex(std::span<const std::uint8_t> bytes);
/// Nothing unless `text` is exactly 2 * N lower-case hexadecimal digits.
std::optional<ObjectId> object_id_of_hex(std::string_view text);
std::optional<BundleHash> bundle_hash_of_hex(std::string_view text);

/// "ab/abcdef...": the path of an object below `objects/`.
std::string object_path(const ObjectId& id);
/// @}

/// @name Keys and signatures
/// In minisign's file formats: Ed25519 over BLAKE2b-512.
/// @{
struct PublicKey {
  std::array<std::uint8_t, 8> id{};  ///< minisign's key number
  std::array<std::uint8_t, 32> bytes{};
  bool operator==(const PublicKey&) const = default;
};

/// Reads the base64 line of a minisign public key, or the whole file.
/// Errors: kInvalidInput "key.public".
Result<PublicKey> parse_public_key(std::string_view text);
/// The base64 line.
std::string public_key_line(const PublicKey& key);

/// Base64 as minisign's files use it (RFC 4648, padded).
std::string to_base64(std::span<const std::uint8_t> bytes);

/// A detached minisign signature.
struct Signature {
  std::array<std::uint8_t, 8> key_id{};
  std::array<std::uint8_t, 64> bytes{};
  std::string trusted_comment;
  std::array<std::uint8_t, 64> comment_bytes{};  ///< over `bytes` and the trusted comment
};

/// Reads a *.minisig file of the prehashed form ("ED"), the only one that devices accept.
/// Errors: kInvalidInput "signature.text".
Result<Signature> parse_signature(std::string_view text);
/// Its text. untrusted_comment: one line that nothing signs.
std::string signature_text(const Signature& signature, std::string_view untrusted_comment);

/// The keys that a device trusts to name the signing key, and how many of them must agree, so that
/// a single stolen key, lost pass phrase or colleague changes nothing.
struct RootSet {
  unsigned threshold = 1;       ///< 1 to the number of keys
  std::vector<PublicKey> keys;  ///< distinct in number and bytes, in the order of their numbers
  bool operator==(const RootSet&) const = default;
};
inline constexpr std::size_t kMaxRootKeys = 16;

/// Reads a public key (parse_public_key()), which is a set of one, or the line or the file of
/// root_set_line(). Errors: kInvalidInput "key.public", "key.set".
Result<RootSet> parse_root_set(std::string_view text);
/// A set of several: its threshold and keys, separated by spaces. Of one: public_key_line().
std::string root_set_line(const RootSet& set);
/// Sorts the keys. Errors: kUsage "key.set" (a key twice, no key, too many, an impossible
/// threshold).
Result<RootSet> make_root_set(std::vector<PublicKey> keys, unsigned threshold);

/// The path of the signature of a document by one of several keys:
/// "root.json.0123456789abcdef.minisig", with the key's number as in its file, byte by byte.
std::string signature_path(const std::string& document, const PublicKey& key);

/// Reads the signature at a path; nullopt if none exists.
using SignatureReader = std::function<Result<std::optional<std::string>>(const std::string& path)>;
/// Checks that enough keys of the set signed `text`, the contents of `document`. Each key counts
/// once; invalid signatures are ignored.
/// Errors: kExitWrongKey "signature.too-few", and "signature.key" or "signature.bad" for a set of
/// one; those of the reader.
Result<void> verify_root_signatures(const std::string& document, std::string_view text,
                                    const RootSet& set, const SignatureReader& read);

/// Checks that `key` signed both `message` and the trusted comment.
/// Errors: kExitWrongKey "signature.key" (made with another key), "signature.bad".
Result<void> verify_signature(std::string_view message, const Signature& signature,
                              const PublicKey& key);
/// @}

/// @name Release documents
/// @{
/// Largest document; about 350 bytes per bundle.
inline constexpr std::size_t kMaxReleaseBytes = 8u << 20;
inline constexpr std::size_t kMaxRecipeBytes =
    sizeof(RecipeHeader) + std::size_t{kMaxPieces} * sizeof(PieceRecord);

struct ReleaseBundle {
  std::string name;        ///< a file name without its extension: letters, digits, . _ - only
  std::uint64_t size = 0;  ///< bytes of the installed bundle
  BundleHash hash{};       ///< of the installed bundle
  ObjectId recipe{};       ///< the object with the recipe
  std::uint32_t recipe_size = 0;      ///< bytes as stored (zstd)
  std::uint32_t recipe_raw_size = 0;  ///< bytes unpacked
  std::uint32_t pieces = 0;
  std::uint64_t download_size = 0;   ///< bytes of all its objects, for a device that has none
  std::vector<std::string> devices;  ///< profiles for which it is meant; empty: all
};

struct Release {
  std::uint64_t epoch = 0;       ///< of the root document that named the signing key; 0: none
  std::uint64_t version = 0;     ///< 1 or more; only grows within an epoch
  std::int64_t expires = 0;      ///< seconds since 1970-01-01, UTC; kNever: does not
  std::uint64_t fresh_days = 0;  ///< interval in which its Freshness is signed; 0: it has none
  std::vector<ReleaseBundle> bundles;  ///< at least one; names differ in more than case
};
inline constexpr std::int64_t kNever = 0;

/// A file name that is valid on every file system and cannot leave its folder: 1 to 100 of
/// A-Z a-z 0-9 . _ -, the first no point.
bool is_plain_name(std::string_view name);
/// A bundle's name as case-insensitive file systems compare it.
std::string lower_case(std::string_view name);

/// Errors: kInvalidInput "release.*"; kUnsupported "release.version".
Result<Release> parse_release(std::string_view json);
/// The document: the same release always gives the same bytes.
std::string release_text(const Release& release);

/// The number of the newest release, from the server's file `latest`. Errors: kExitMixed
/// "fetch.latest".
Result<std::uint64_t> parse_latest(std::string_view text);

/// "2027-01-31T00:00:00Z" to seconds. Errors: kInvalidInput "release.time".
Result<std::int64_t> parse_time(std::string_view text);
std::string time_text(std::int64_t seconds);

/// States that a release is still the newest, and is signed every few days: an attacker who
/// withholds updates cannot sign it.
struct Freshness {
  std::uint64_t epoch = 0;
  std::uint64_t version = 0;  ///< of the release
  std::int64_t time = 0;      ///< when it was signed, seconds since 1970, UTC
  std::int64_t expires = 0;   ///< end of its validity
};
/// "releases/N.fresh.json".
std::string freshness_path(std::uint64_t version);
/// Errors: kInvalidInput "release.*".
Result<Freshness> parse_freshness(std::string_view json);
std::string freshness_text(const Freshness& freshness);

/// A link of the chain of keys: signed by one key, it names the key that follows.
struct KeyRotation {
  std::uint32_t serial = 0;  ///< from 1, without gaps
  std::string key;           ///< public_key_line()
};
/// Errors: kInvalidInput "release.text".
Result<KeyRotation> parse_key_rotation(std::string_view json);
std::string key_rotation_text(const KeyRotation& link);

/// The root document, signed by the root key that stays offline: names the signing key. Each
/// document begins an epoch, in which versions start again; the chain continues after its first
/// `links` links.
struct RootMetadata {
  std::uint64_t epoch = 0;  ///< from 1; only grows
  std::uint32_t links = 0;
  std::string key;  ///< public_key_line()
};
/// Errors: kInvalidInput "release.text".
Result<RootMetadata> parse_root_metadata(std::string_view json);
std::string root_metadata_text(const RootMetadata& word);

/// A link of the chain of root keys: the next set, signed by enough keys of the previous set and by
/// enough of its own.
struct RootRotation {
  std::uint32_t serial = 0;  ///< from 1, without gaps
  RootSet roots;
};
/// "roots/S.json".
std::string root_rotation_path(std::uint32_t serial);
/// Errors: kInvalidInput "release.text".
Result<RootRotation> parse_root_rotation(std::string_view json);
std::string root_rotation_text(const RootRotation& link);
/// @}

}  // namespace modar
