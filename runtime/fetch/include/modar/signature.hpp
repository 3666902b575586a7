// Signatures of release documents, as minisign writes and verifies them (Ed25519 over BLAKE2b-512).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "formats/error.hpp"

namespace modar {

/// What fetches answer beyond the common exit codes (ExitCode has room from 10 up).
inline constexpr ExitCode kExitWrongKey{10};   ///< not signed by the trusted key
inline constexpr ExitCode kExitRollBack{11};   ///< older than what is installed
inline constexpr ExitCode kExitExpired{12};    ///< past its expiry
inline constexpr ExitCode kExitMixed{13};      ///< the server's files are not of one release
inline constexpr ExitCode kExitNoSpace{14};    ///< not enough free space
inline constexpr ExitCode kExitLocked{15};     ///< another fetch is at work
inline constexpr ExitCode kExitNetwork{16};    ///< gave up; what came is kept
inline constexpr ExitCode kExitBadBundle{17};  ///< the new bundle fails its check; the old stays

struct PublicKey {
  std::array<std::uint8_t, 8> id{};  ///< minisign's key number
  std::array<std::uint8_t, 32> bytes{};
  bool operator==(const PublicKey&) const = default;
};

/// The second line of a minisign public key, or the whole file. Errors: kInvalidInput "key.public".
Result<PublicKey> parse_public_key(std::string_view text);
/// minisign's base64 line.
std::string public_key_line(const PublicKey& key);

/// As minisign's files hold bytes.
std::string to_base64(std::span<const std::uint8_t> bytes);

/// A detached minisign signature, split up.
struct Signature {
  bool prehashed = true;
  std::array<std::uint8_t, 8> key_id{};
  std::array<std::uint8_t, 64> bytes{};
  std::string trusted_comment;
  std::array<std::uint8_t, 64> comment_bytes{};  ///< over `bytes` and the trusted comment
};

/// A *.minisig file. Errors: kInvalidInput "signature.text".
Result<Signature> parse_signature(std::string_view text);
/// Its text. untrusted_comment: one line, for people.
std::string signature_text(const Signature& signature, std::string_view untrusted_comment);

/// Whether `key` signed `message` and the trusted comment.
/// Errors: kExitWrongKey "signature.key" (signed by another), "signature.bad" (by none).
Result<void> verify_signature(std::string_view message, const Signature& signature,
                              const PublicKey& key);

}  // namespace modar
