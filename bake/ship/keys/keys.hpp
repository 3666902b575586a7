// The publisher's keys, in minisign's file formats: either program reads the other's files.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "modar/release.hpp"

namespace modar {

struct SecretKey {
  PublicKey public_key;
  std::array<std::uint8_t, 64> bytes{};  ///< libsodium's: seed and public key
};

/// Generates a pair of keys. Errors: kInternal "key.random".
Result<SecretKey> make_key();

/// The text of the secret file; encrypted (scrypt) unless the pass phrase is empty.
/// Errors: kInternal "key.memory" (scrypt needs 1 GiB).
Result<std::string> secret_key_text(const SecretKey& key, const std::string& pass_phrase);
/// Errors: kInvalidInput "key.secret", "key.pass-phrase".
Result<SecretKey> parse_secret_key(std::string_view text, const std::string& pass_phrase);
bool needs_pass_phrase(std::string_view text);
/// The text of K.pub.
std::string public_key_text(const PublicKey& key);

/// Signs `message`; returns the text of a *.minisig file.
std::string sign(const SecretKey& key, std::string_view message,
                 const std::string& trusted_comment);

}  // namespace modar
