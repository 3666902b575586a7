#include "bake/ship/keys/keys.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include <sodium.h>

#include "modar/release.hpp"

namespace modar {
namespace {

// minisign's secret key: "Ed", kind of key derivation, "B2", salt, limits, then, masked by the
// derived stream, key number, secret key and their checksum.
constexpr std::size_t kHead = 6;
constexpr std::size_t kSalt = 32;
constexpr std::size_t kMasked = 8 + 64 + 32;
constexpr std::size_t kTotal = kHead + kSalt + 16 + kMasked;
using Record = std::array<std::uint8_t, kTotal>;

tl::unexpected<Error> bad_secret(const char* code, const char* cause, const char* cure) {
  return fail(ExitCode::kInvalidInput, code, "secret key", cause, cure);
}

std::array<std::uint8_t, 32> checksum(const std::uint8_t* number, const std::uint8_t* secret) {
  std::array<std::uint8_t, 32> sum{};
  crypto_generichash_state state;
  crypto_generichash_init(&state, nullptr, 0, sum.size());
  const std::array<std::uint8_t, 2> algorithm = {'E', 'd'};
  crypto_generichash_update(&state, algorithm.data(), algorithm.size());
  crypto_generichash_update(&state, number, 8);
  crypto_generichash_update(&state, secret, 64);
  crypto_generichash_final(&state, sum.data(), sum.size());
  return sum;
}

void put_number(std::uint8_t* to, std::uint64_t number) {
  for (int i = 0; i < 8; ++i) to[i] = static_cast<std::uint8_t>(number >> (8 * i));
}

std::uint64_t get_number(const std::uint8_t* from) {
  std::uint64_t number = 0;
  for (int i = 7; i >= 0; --i) number = number << 8 | from[i];
  return number;
}

/// Masks or unmasks the last part of the record.
bool apply_mask(Record& record, const std::string& pass_phrase) {
  const std::uint8_t* salt = record.data() + kHead;
  // Limits above minisign's own would keep a foreign file's reader busy for as long as it likes.
  if (get_number(salt + kSalt) > crypto_pwhash_scryptsalsa208sha256_opslimit_sensitive() ||
      get_number(salt + kSalt + 8) > crypto_pwhash_scryptsalsa208sha256_memlimit_sensitive()) {
    return false;
  }
  std::vector<std::uint8_t> stream(kMasked);
  if (crypto_pwhash_scryptsalsa208sha256(stream.data(), stream.size(), pass_phrase.data(),
                                         pass_phrase.size(), salt, get_number(salt + kSalt),
                                         get_number(salt + kSalt + 8)) != 0) {
    return false;
  }
  for (std::size_t i = 0; i < kMasked; ++i) record[kTotal - kMasked + i] ^= stream[i];
  sodium_memzero(stream.data(), stream.size());
  return true;
}

std::string second_line(std::string_view text) {
  const std::size_t begin = text.find('\n');
  if (begin == std::string_view::npos) return {};
  std::string_view rest = text.substr(begin + 1);
  rest = rest.substr(0, rest.find('\n'));
  if (!rest.empty() && rest.back() == '\r') rest.remove_suffix(1);
  return std::string(rest);
}

bool read_record(std::string_view text, Record& record) {
  const std::string line = second_line(text);
  std::size_t length = 0;
  return sodium_base642bin(record.data(), record.size(), line.data(), line.size(), nullptr, &length,
                           nullptr, sodium_base64_VARIANT_ORIGINAL) == 0 &&
         length == record.size() && record[0] == 'E' && record[1] == 'd' && record[4] == 'B' &&
         record[5] == '2';
}

}  // namespace

Result<SecretKey> make_key() {
  if (sodium_init() < 0) {
    return fail(ExitCode::kInternal, "key.random", "", "the system provides no random numbers",
                "check that /dev/urandom exists");
  }
  SecretKey key;
  randombytes_buf(key.public_key.id.data(), key.public_key.id.size());
  crypto_sign_keypair(key.public_key.bytes.data(), key.bytes.data());
  return key;
}

Result<std::string> secret_key_text(const SecretKey& key, const std::string& pass_phrase) {
  Record record{'E', 'd', 0, 0, 'B', '2'};
  std::uint8_t* salt = record.data() + kHead;
  if (!pass_phrase.empty()) {
    record[2] = 'S';
    record[3] = 'c';
    randombytes_buf(salt, kSalt);
    put_number(salt + kSalt, crypto_pwhash_scryptsalsa208sha256_OPSLIMIT_SENSITIVE);
    put_number(salt + kSalt + 8, crypto_pwhash_scryptsalsa208sha256_MEMLIMIT_SENSITIVE);
  }
  std::uint8_t* masked = record.data() + kTotal - kMasked;
  std::copy(key.public_key.id.begin(), key.public_key.id.end(), masked);
  std::copy(key.bytes.begin(), key.bytes.end(), masked + 8);
  const auto sum = checksum(masked, masked + 8);
  std::copy(sum.begin(), sum.end(), masked + 72);
  if (!pass_phrase.empty() && !apply_mask(record, pass_phrase)) {
    return fail(ExitCode::kInternal, "key.memory", "",
                "scrypt needs 1 GiB of memory, which is not available",
                "free memory, or use no pass phrase");
  }
  return std::string("untrusted comment: minisign ") +
         (pass_phrase.empty() ? "unencrypted" : "encrypted") + " secret key\n" + to_base64(record) +
         "\n";
}

bool needs_pass_phrase(std::string_view text) {
  Record record{};
  return read_record(text, record) && record[2] == 'S';
}

Result<SecretKey> parse_secret_key(std::string_view text, const std::string& pass_phrase) {
  Record record{};
  if (!read_record(text, record)) {
    return bad_secret("key.secret", "it is not a minisign secret key",
                      "give the file that `modar ship keygen` wrote");
  }
  if (record[2] == 'S' && !apply_mask(record, pass_phrase)) {
    return bad_secret("key.secret", "its limits of scrypt are out of range", "make a new key");
  }
  const std::uint8_t* number = record.data() + kTotal - kMasked;
  const std::uint8_t* secret = number + 8;
  const auto sum = checksum(number, secret);
  // minisign leaves the checksum of an unencrypted key empty.
  const bool unchecked = record[2] == 0 && sodium_is_zero(secret + 64, sum.size()) != 0;
  if (!unchecked && sodium_memcmp(sum.data(), secret + 64, sum.size()) != 0) {
    return bad_secret("key.pass-phrase", "the pass phrase is wrong, or the file was damaged",
                      "give the right pass phrase with --pass-phrase-file");
  }
  SecretKey key;
  std::copy_n(number, 8, key.public_key.id.begin());
  std::copy_n(secret, 64, key.bytes.begin());
  std::copy_n(secret + 32, 32, key.public_key.bytes.begin());
  return key;
}

std::string public_key_text(const PublicKey& key) {
  std::string number;
  for (std::size_t i = key.id.size(); i-- > 0;) number += to_hex(std::span(&key.id[i], 1));
  std::transform(number.begin(), number.end(), number.begin(),
                 [](char c) { return c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c; });
  return "untrusted comment: minisign public key " + number + "\n" + public_key_line(key) + "\n";
}

std::string sign(const SecretKey& key, std::string_view message,
                 const std::string& trusted_comment) {
  Signature signature;
  signature.key_id = key.public_key.id;
  signature.trusted_comment = trusted_comment;
  std::array<std::uint8_t, crypto_generichash_BYTES_MAX> hash{};
  crypto_generichash(hash.data(), hash.size(),
                     reinterpret_cast<const unsigned char*>(message.data()), message.size(),
                     nullptr, 0);
  crypto_sign_detached(signature.bytes.data(), nullptr, hash.data(), hash.size(), key.bytes.data());
  std::vector<std::uint8_t> comment(signature.bytes.begin(), signature.bytes.end());
  comment.insert(comment.end(), trusted_comment.begin(), trusted_comment.end());
  crypto_sign_detached(signature.comment_bytes.data(), nullptr, comment.data(), comment.size(),
                       key.bytes.data());
  return signature_text(signature, "signature of a modar release");
}

}  // namespace modar
