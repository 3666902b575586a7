#include "modar/signature.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include <sodium.h>

#include "modar/digest.hpp"

namespace modar {
namespace {

constexpr std::string_view kUntrusted = "untrusted comment: ";
constexpr std::string_view kTrusted = "trusted comment: ";

/// The text up to the next line's end, which is taken off `text`.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// Fills `out` from base64 that holds exactly its size.
bool from_base64(std::string_view text, std::span<std::uint8_t> out) {
  // libsodium 1.0.18 takes some bytes above 127 for digits.
  if (std::any_of(text.begin(), text.end(), [](char c) { return (c & 0x80) != 0; })) return false;
  std::size_t length = 0;
  return sodium_base642bin(out.data(), out.size(), text.data(), text.size(), nullptr, &length,
                           nullptr, sodium_base64_VARIANT_ORIGINAL) == 0 &&
         length == out.size();
}

tl::unexpected<Error> bad_text(const char* cause) {
  return fail(ExitCode::kInvalidInput, "signature.text", "signature", cause,
              "fetch it again, or sign the release again");
}

}  // namespace

std::string to_base64(std::span<const std::uint8_t> bytes) {
  std::string text(sodium_base64_ENCODED_LEN(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  text.pop_back();
  return text;
}

Result<PublicKey> parse_public_key(std::string_view text) {
  std::string_view line = take_line(text);
  if (line.starts_with(kUntrusted)) line = take_line(text);
  std::array<std::uint8_t, 42> bytes{};
  if (!from_base64(line, bytes) || bytes[0] != 'E' || bytes[1] != 'd') {
    return fail(ExitCode::kInvalidInput, "key.public", "public key",
                "it is not a minisign public key", "give the file K.pub of `modar ship keygen`");
  }
  PublicKey key;
  std::copy_n(bytes.begin() + 2, 8, key.id.begin());
  std::copy_n(bytes.begin() + 10, 32, key.bytes.begin());
  return key;
}

std::string public_key_line(const PublicKey& key) {
  std::array<std::uint8_t, 42> bytes{'E', 'd'};
  std::copy(key.id.begin(), key.id.end(), bytes.begin() + 2);
  std::copy(key.bytes.begin(), key.bytes.end(), bytes.begin() + 10);
  return to_base64(bytes);
}

Result<Signature> parse_signature(std::string_view text) {
  if (!take_line(text).starts_with(kUntrusted)) return bad_text("its first line is no comment");
  std::array<std::uint8_t, 74> bytes{};
  if (!from_base64(take_line(text), bytes) || bytes[0] != 'E' ||
      (bytes[1] != 'D' && bytes[1] != 'd')) {
    return bad_text("its second line is no Ed25519 signature");
  }
  Signature signature;
  signature.prehashed = bytes[1] == 'D';
  std::copy_n(bytes.begin() + 2, 8, signature.key_id.begin());
  std::copy_n(bytes.begin() + 10, 64, signature.bytes.begin());
  const std::string_view comment = take_line(text);
  if (!comment.starts_with(kTrusted)) return bad_text("its third line is no trusted comment");
  signature.trusted_comment = comment.substr(kTrusted.size());
  if (!from_base64(take_line(text), signature.comment_bytes) || !text.empty()) {
    return bad_text("its fourth line does not sign the trusted comment");
  }
  return signature;
}

std::string signature_text(const Signature& signature, std::string_view untrusted_comment) {
  std::array<std::uint8_t, 74> bytes{'E',
                                     static_cast<std::uint8_t>(signature.prehashed ? 'D' : 'd')};
  std::copy(signature.key_id.begin(), signature.key_id.end(), bytes.begin() + 2);
  std::copy(signature.bytes.begin(), signature.bytes.end(), bytes.begin() + 10);
  return std::string(kUntrusted) + std::string(untrusted_comment) + "\n" + to_base64(bytes) + "\n" +
         std::string(kTrusted) + signature.trusted_comment + "\n" +
         to_base64(signature.comment_bytes) + "\n";
}

Result<void> verify_signature(std::string_view message, const Signature& signature,
                              const PublicKey& key) {
  if (signature.key_id != key.id) {
    return fail(kExitWrongKey, "signature.key", "signature",
                "it is of key " + to_hex(signature.key_id) + ", trusted is " + to_hex(key.id),
                "fetch from the right server, or give the publisher's key with --trust");
  }
  std::vector<std::uint8_t> hash(crypto_generichash_BYTES_MAX);
  const auto* bytes = reinterpret_cast<const unsigned char*>(message.data());
  crypto_generichash(hash.data(), hash.size(), bytes, message.size(), nullptr, 0);
  if (!signature.prehashed) hash.assign(bytes, bytes + message.size());
  std::vector<std::uint8_t> comment(signature.bytes.begin(), signature.bytes.end());
  comment.insert(comment.end(), signature.trusted_comment.begin(), signature.trusted_comment.end());
  if (crypto_sign_verify_detached(signature.bytes.data(), hash.data(), hash.size(),
                                  key.bytes.data()) != 0 ||
      crypto_sign_verify_detached(signature.comment_bytes.data(), comment.data(), comment.size(),
                                  key.bytes.data()) != 0) {
    return fail(kExitWrongKey, "signature.bad", "signature", "it does not fit what it signs",
                "fetch again; if it stays, the server's files were changed");
  }
  return {};
}

}  // namespace modar
