#include "modar/digest.hpp"

#include <sodium.h>

namespace modar {
namespace {

template <class Hash>
Hash blake2b(std::span<const std::byte> bytes) {
  // Without it libsodium hashes at half its speed.
  static const int ready = sodium_init();
  static_cast<void>(ready);
  Hash hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(bytes.data()),
                     bytes.size(), nullptr, 0);
  return hash;
}

template <class Hash>
std::optional<Hash> of_hex(std::string_view text) {
  Hash hash{};
  if (text.size() != 2 * hash.size()) return std::nullopt;
  for (const char c : text) {
    if ((c < '0' || c > '9') && (c < 'a' || c > 'f')) return std::nullopt;
  }
  std::size_t length = 0;
  if (sodium_hex2bin(hash.data(), hash.size(), text.data(), text.size(), nullptr, &length,
                     nullptr) != 0 ||
      length != hash.size()) {
    return std::nullopt;
  }
  return hash;
}

}  // namespace

ObjectId object_id(std::span<const std::byte> bytes) {
  return blake2b<ObjectId>(bytes);
}
BundleHash bundle_hash(std::span<const std::byte> bytes) {
  return blake2b<BundleHash>(bytes);
}

std::string to_hex(std::span<const std::uint8_t> bytes) {
  std::string text(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  text.pop_back();
  return text;
}

std::optional<ObjectId> object_id_of_hex(std::string_view text) {
  return of_hex<ObjectId>(text);
}
std::optional<BundleHash> bundle_hash_of_hex(std::string_view text) {
  return of_hex<BundleHash>(text);
}

std::string object_path(const ObjectId& id) {
  const std::string hex = to_hex(id);
  return hex.substr(0, 2) + "/" + hex;
}

}  // namespace modar
