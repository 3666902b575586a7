#include "modar/release.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <set>

#include <rapidjson/document.h>
#include <sodium.h>

#include "formats/json_writer.hpp"

namespace modar {

// --- Hashes ---

namespace {

template <class Hash>
Hash blake2b(std::span<const std::byte> bytes) {
#ifndef MODAR_PLAIN_SODIUM
  // Without it libsodium does not choose its SIMD code: half the speed.
  static const int ready = sodium_init();
  static_cast<void>(ready);
#endif
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

// --- Keys and signatures ---

namespace {

constexpr std::string_view kUntrusted = "untrusted comment: ";
constexpr std::string_view kTrusted = "trusted comment: ";

/// Removes the first line from `text` and returns it without its line end.
std::string_view parse_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// Decodes base64 of exactly `out`'s size.
bool from_base64(std::string_view text, std::span<std::uint8_t> out) {
  // libsodium 1.0.18 accepts some bytes above 127 as digits.
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
  std::string_view line = parse_line(text);
  if (line.starts_with(kUntrusted)) line = parse_line(text);
  std::array<std::uint8_t, 42> bytes{};
  if (!from_base64(line, bytes) || bytes[0] != 'E' || bytes[1] != 'd') {
    std::array<std::uint8_t, 158> secret{};
    const bool is_secret = from_base64(line, secret) && secret[0] == 'E' && secret[1] == 'd';
    return fail(ExitCode::kInvalidInput, "key.public", "public key",
                is_secret ? "it is the secret key, which nobody but its owner may have"
                          : "it is not a minisign public key",
                "give the file K.pub of `modar ship keygen`");
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
  if (!parse_line(text).starts_with(kUntrusted))
    return bad_text("its first line is not an untrusted comment");
  std::array<std::uint8_t, 74> bytes{};
  if (!from_base64(parse_line(text), bytes) || bytes[0] != 'E' || bytes[1] != 'D') {
    return bad_text("its second line is not an Ed25519 signature of the prehashed form");
  }
  Signature signature;
  std::copy_n(bytes.begin() + 2, 8, signature.key_id.begin());
  std::copy_n(bytes.begin() + 10, 64, signature.bytes.begin());
  const std::string_view comment = parse_line(text);
  if (!comment.starts_with(kTrusted)) return bad_text("its third line is not a trusted comment");
  signature.trusted_comment = comment.substr(kTrusted.size());
  if (!from_base64(parse_line(text), signature.comment_bytes) || !text.empty()) {
    return bad_text("its fourth line is not the signature of the trusted comment");
  }
  return signature;
}

std::string signature_text(const Signature& signature, std::string_view untrusted_comment) {
  std::array<std::uint8_t, 74> bytes{'E', 'D'};
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
                "it was made with key " + to_hex(signature.key_id) + ", the trusted key is " +
                    to_hex(key.id),
                "fetch from the right server, or give the publisher's key with --trust");
  }
  std::vector<std::uint8_t> hash(crypto_generichash_BYTES_MAX);
  const auto* bytes = reinterpret_cast<const unsigned char*>(message.data());
  crypto_generichash(hash.data(), hash.size(), bytes, message.size(), nullptr, 0);
  std::vector<std::uint8_t> comment(signature.bytes.begin(), signature.bytes.end());
  comment.insert(comment.end(), signature.trusted_comment.begin(), signature.trusted_comment.end());
  if (crypto_sign_verify_detached(signature.bytes.data(), hash.data(), hash.size(),
                                  key.bytes.data()) != 0 ||
      crypto_sign_verify_detached(signature.comment_bytes.data(), comment.data(), comment.size(),
                                  key.bytes.data()) != 0) {
    return fail(kExitWrongKey, "signature.bad", "signature", "it does not match what it signs",
                "fetch again; if that does not help, the server's files were changed");
  }
  return {};
}

// --- Root keys ---

namespace {

tl::unexpected<Error> bad_set(ExitCode exit, std::string cause) {
  return fail(exit, "key.set", "root keys", std::move(cause),
              "give the file K.pub of `modar ship keygen`, or one of `modar ship trust`");
}

}  // namespace

Result<RootSet> make_root_set(std::vector<PublicKey> keys, unsigned threshold) {
  std::sort(keys.begin(), keys.end(),
            [](const PublicKey& a, const PublicKey& b) { return a.id < b.id; });
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (keys[i].id != keys[j].id && keys[i].bytes != keys[j].bytes) continue;
      return bad_set(ExitCode::kUsage, "key " + to_hex(keys[i].id) + " is given twice");
    }
  }
  if (keys.empty() || keys.size() > kMaxRootKeys) {
    return bad_set(ExitCode::kUsage, std::to_string(keys.size()) + " keys are not 1 to " +
                                         std::to_string(kMaxRootKeys));
  }
  if (threshold < 1 || threshold > keys.size()) {
    return bad_set(ExitCode::kUsage, std::to_string(threshold) + " of " +
                                         std::to_string(keys.size()) + " keys cannot agree");
  }
  return RootSet{threshold, std::move(keys)};
}

Result<RootSet> parse_root_set(std::string_view text) {
  std::string_view rest = text;
  std::string_view line = parse_line(rest);
  if (line.starts_with(kUntrusted)) line = parse_line(rest);
  if (line.empty() || line.front() < '0' || line.front() > '9') {
    MODAR_ASSIGN(const auto key, parse_public_key(text));
    return RootSet{1, {key}};
  }
  unsigned threshold = 0;
  const auto number = std::from_chars(line.data(), line.data() + line.size(), threshold);
  if (number.ec != std::errc())
    return bad_set(ExitCode::kInvalidInput, "its threshold is not a number");
  line.remove_prefix(static_cast<std::size_t>(number.ptr - line.data()));
  std::vector<PublicKey> keys;
  while (!line.empty()) {
    if (line.front() != ' ')
      return bad_set(ExitCode::kInvalidInput, "its keys have no blanks between them");
    line.remove_prefix(1);
    const std::string_view word = line.substr(0, line.find(' '));
    MODAR_ASSIGN(const auto key, parse_public_key(word));
    if (keys.size() == kMaxRootKeys)
      return bad_set(ExitCode::kInvalidInput, "it has too many keys");
    keys.push_back(key);
    line.remove_prefix(word.size());
  }
  auto set = make_root_set(std::move(keys), threshold);
  if (!set) set.error().exit = ExitCode::kInvalidInput;
  return set;
}

std::string root_set_line(const RootSet& set) {
  if (set.keys.size() == 1) return public_key_line(set.keys.front());
  std::string line = std::to_string(set.threshold);
  for (const PublicKey& key : set.keys) line += " " + public_key_line(key);
  return line;
}

std::string signature_path(const std::string& document, const PublicKey& key) {
  return document + "." + to_hex(key.id) + ".minisig";
}

Result<void> verify_root_signatures(const std::string& document, std::string_view text,
                                    const RootSet& set, const SignatureReader& read) {
  unsigned good = 0;
  for (const PublicKey& key : set.keys) {
    MODAR_ASSIGN(const auto found, read(signature_path(document, key)));
    if (!found) continue;
    const auto signature = parse_signature(*found);
    if (signature && verify_signature(text, *signature, key) && ++good == set.threshold) return {};
  }
  return fail(kExitWrongKey, "signature.too-few", document,
              std::to_string(good) + " of the root keys signed it, " +
                  std::to_string(set.threshold) + " have to",
              "get more signatures: `modar ship sign`");
}

// --- Release documents ---

namespace {

constexpr const char* kReleaseFormat = "modar-release";
constexpr const char* kKeyFormat = "modar-key";
constexpr const char* kFreshFormat = "modar-fresh";
constexpr const char* kRootFormat = "modar-root";
constexpr const char* kRootLinkFormat = "modar-roots";
constexpr std::string_view kNeverText = "never";
constexpr std::uint64_t kMaxNumber = std::uint64_t{1} << 53;  ///< exact in JSON

tl::unexpected<Error> bad(std::string where, std::string cause) {
  return fail(ExitCode::kInvalidInput, "release.text", "release document: " + std::move(where),
              std::move(cause), "publish the release again");
}

/// Reads the members of an object and remembers the first that is missing or of the wrong type.
class Members {
 public:
  explicit Members(const rapidjson::Value& object) : object_(object) {}

  std::string text(const char* key) {
    const auto* v = find(key);
    if (v == nullptr || !v->IsString()) return miss<std::string>(key);
    return {v->GetString(), v->GetStringLength()};
  }
  std::uint64_t number(const char* key, std::uint64_t most) {
    const auto* v = find(key);
    if (v == nullptr || !v->IsUint64() || v->GetUint64() > most) return miss<std::uint64_t>(key);
    return v->GetUint64();
  }
  const rapidjson::Value* array(const char* key) {
    const auto* v = find(key);
    if (v == nullptr || !v->IsArray()) return miss<const rapidjson::Value*>(key);
    return v;
  }
  /// The first member that was missing or wrong, or empty.
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  const rapidjson::Value* find(const char* key) const {
    if (!object_.IsObject()) return nullptr;
    const auto member = object_.FindMember(key);
    return member == object_.MemberEnd() ? nullptr : &member->value;
  }
  template <class T>
  T miss(const char* key) {
    if (missing_.empty()) missing_ = key;
    return {};
  }
  const rapidjson::Value& object_;
  std::string missing_;
};

Result<ReleaseBundle> read_bundle(const rapidjson::Value& json) {
  Members members(json);
  ReleaseBundle bundle;
  bundle.name = members.text("name");
  bundle.size = members.number("size", kMaxBundleBytes);
  const std::string hash = members.text("hash");
  const std::string recipe = members.text("recipe");
  bundle.recipe_size = static_cast<std::uint32_t>(members.number("recipe_size", kMaxRecipeBytes));
  bundle.recipe_raw_size =
      static_cast<std::uint32_t>(members.number("recipe_raw_size", kMaxRecipeBytes));
  bundle.pieces = static_cast<std::uint32_t>(members.number("pieces", kMaxPieces));
  bundle.download_size = members.number("download_size", kMaxBundleBytes);
  const rapidjson::Value* devices = members.array("devices");
  if (!members.missing().empty()) return bad("bundle", members.missing() + " is missing or wrong");
  if (!is_plain_name(bundle.name)) return bad("bundle", "its name is not a plain file name");
  for (const rapidjson::Value& device : devices->GetArray()) {
    const std::string_view name =
        device.IsString() ? std::string_view(device.GetString(), device.GetStringLength())
                          : std::string_view();
    // Escapes may make text that is no UTF-8, and control characters.
    if (!is_plain_name(name)) return bad("bundle " + bundle.name, "a device is not a plain name");
    bundle.devices.emplace_back(name);
  }
  const auto hash_bytes = bundle_hash_of_hex(hash);
  const auto recipe_id = object_id_of_hex(recipe);
  if (!hash_bytes || !recipe_id) return bad("bundle " + bundle.name, "a hash is malformed");
  bundle.hash = *hash_bytes;
  bundle.recipe = *recipe_id;
  return bundle;
}

Result<rapidjson::Document> parse_document(std::string_view json, const char* format) {
  rapidjson::Document document;
  // Iterative: nesting cannot exhaust the stack.
  document.Parse<rapidjson::kParseIterativeFlag | rapidjson::kParseValidateEncodingFlag>(
      json.data(), json.size());
  if (json.size() > kMaxReleaseBytes || document.HasParseError() || !document.IsObject()) {
    return bad("byte " + std::to_string(document.GetErrorOffset()), "it is not a JSON object");
  }
  Members members(document);
  if (members.text("format") != format) {
    return bad("format", std::string("it is not a ") + format + " document");
  }
  if (members.number("format_version", 1000000) != 1) {
    return fail(ExitCode::kUnsupported, "release.version", "release document",
                "its format version is not 1", "use a newer modar-fetch");
  }
  return document;
}

/// A document of that format, whose other members `fill` puts.
template <class Fill>
std::string document_text(const char* format, const Fill& fill) {
  JsonWriter json(1);
  json.object([&] {
    json.put("format", format);
    json.put("format_version", 1);
    fill(json);
  });
  return json.str() + "\n";
}

void write_bundle(JsonWriter& json, const ReleaseBundle& bundle) {
  json.put("name", bundle.name);
  json.put("size", bundle.size);
  json.put("hash", to_hex(bundle.hash));
  json.put("recipe", to_hex(bundle.recipe));
  json.put("recipe_size", bundle.recipe_size);
  json.put("recipe_raw_size", bundle.recipe_raw_size);
  json.put("pieces", bundle.pieces);
  json.put("download_size", bundle.download_size);
  json.array("devices", [&] {
    for (const std::string& device : bundle.devices) json.add(device);
  });
}

}  // namespace

Result<Release> parse_release(std::string_view json) {
  MODAR_ASSIGN(const auto document, parse_document(json, kReleaseFormat));
  Members members(document);
  Release release;
  release.version = members.number("version", kMaxNumber);
  const std::string expires = members.text("expires");
  const rapidjson::Value* bundles = members.array("bundles");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  if (release.version == 0) return bad("version", "versions begin at 1");
  if (expires != kNeverText) {
    MODAR_ASSIGN(release.expires, parse_time(expires));
    if (release.expires == kNever) return bad("expires", "it is 1970");
  }
  if (document.HasMember("epoch")) {
    release.epoch = members.number("epoch", kMaxNumber);
    if (release.epoch == 0) return bad("epoch", "epochs begin at 1");
  }
  if (document.HasMember("fresh_days")) {
    release.fresh_days = members.number("fresh_days", 36500);
    if (release.fresh_days == 0) return bad("fresh_days", "it is 1 or more");
  }
  std::set<std::string> names;
  for (const rapidjson::Value& json_bundle : bundles->GetArray()) {
    MODAR_ASSIGN(auto bundle, read_bundle(json_bundle));
    if (!names.insert(lower_case(bundle.name)).second) {
      return bad("bundles", "two have the same name, or names that differ by case only");
    }
    release.bundles.push_back(std::move(bundle));
  }
  if (release.bundles.empty()) return bad("bundles", "it is absent");
  return release;
}

std::string release_text(const Release& release) {
  return document_text(kReleaseFormat, [&](JsonWriter& json) {
    if (release.epoch != 0) json.put("epoch", release.epoch);
    json.put("version", release.version);
    json.put("expires", time_text(release.expires));
    if (release.fresh_days != 0) json.put("fresh_days", release.fresh_days);
    json.array("bundles", [&] {
      for (const ReleaseBundle& bundle : release.bundles) {
        json.object([&] { write_bundle(json, bundle); });
      }
    });
  });
}

bool is_plain_name(std::string_view name) {
  if (name.empty() || name.size() > 100 || name.front() == '.') return false;
  for (const char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!letter && c != '.' && c != '_' && c != '-') return false;
  }
  return true;
}

std::string lower_case(std::string_view name) {
  std::string lower(name);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

Result<std::uint64_t> parse_latest(std::string_view text) {
  std::uint64_t version = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), version);
  if (parsed.ec != std::errc() || version == 0 ||
      std::string_view(parsed.ptr,
                       static_cast<std::size_t>(text.data() + text.size() - parsed.ptr)) != "\n") {
    return fail(kExitMixed, "fetch.latest", "latest", "it does not name a release",
                "give the address of a folder that `modar ship publish` filled");
  }
  return version;
}

// By the calendar of the standard library: time_t ends in 2038 on 32-bit phones and in WebAssembly.
Result<std::int64_t> parse_time(std::string_view text) {
  std::array<unsigned, 6> fields{};  // year, month, day, hour, minute, second
  constexpr std::array<std::size_t, 6> kStarts = {0, 5, 8, 11, 14, 17};
  bool shaped = text.size() == 20 && text[4] == '-' && text[7] == '-' && text[10] == 'T' &&
                text[13] == ':' && text[16] == ':' && text[19] == 'Z';
  for (std::size_t i = 0; shaped && i < fields.size(); ++i) {
    const char* end = text.data() + kStarts[i] + (i == 0 ? 4 : 2);
    const auto parsed = std::from_chars(text.data() + kStarts[i], end, fields[i]);
    shaped = parsed.ec == std::errc() && parsed.ptr == end;
  }
  if (!shaped) {
    return fail(ExitCode::kInvalidInput, "release.time", std::string(text), "it is not a time",
                "write it as 2027-01-31T00:00:00Z");
  }
  const auto [year, month, day, hour, minute, second] = fields;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(month), std::chrono::day(day)};
  if (!date.ok() || hour > 23 || minute > 59 || second > 59) {
    return fail(ExitCode::kInvalidInput, "release.time", std::string(text),
                "there is no such date or time", "check the day and the hour");
  }
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  return ((days * 24 + hour) * 60 + minute) * 60 + second;
}

std::string time_text(std::int64_t seconds) {
  if (seconds == kNever) return std::string(kNeverText);
  const std::chrono::sys_time<std::chrono::seconds> time{std::chrono::seconds(seconds)};
  const auto midnight = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date{midnight};
  const auto of_day = static_cast<int>((time - midnight).count());
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02dZ",
                static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                static_cast<unsigned>(date.day()), of_day / 3600, of_day / 60 % 60, of_day % 60);
  return text.data();
}

std::string freshness_path(std::uint64_t version) {
  return "releases/" + std::to_string(version) + ".fresh.json";
}

Result<Freshness> parse_freshness(std::string_view text) {
  MODAR_ASSIGN(const auto document, parse_document(text, kFreshFormat));
  Members members(document);
  Freshness freshness;
  if (document.HasMember("epoch")) freshness.epoch = members.number("epoch", kMaxNumber);
  freshness.version = members.number("version", kMaxNumber);
  const std::string time = members.text("time");
  const std::string expires = members.text("expires");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  MODAR_ASSIGN(freshness.time, parse_time(time));
  MODAR_ASSIGN(freshness.expires, parse_time(expires));
  return freshness;
}

std::string freshness_text(const Freshness& freshness) {
  return document_text(kFreshFormat, [&](JsonWriter& json) {
    if (freshness.epoch != 0) json.put("epoch", freshness.epoch);
    json.put("version", freshness.version);
    json.put("time", time_text(freshness.time));
    json.put("expires", time_text(freshness.expires));
  });
}

Result<KeyRotation> parse_key_rotation(std::string_view json) {
  MODAR_ASSIGN(const auto document, parse_document(json, kKeyFormat));
  Members members(document);
  KeyRotation link;
  link.serial = static_cast<std::uint32_t>(members.number("serial", 1000000));
  link.key = members.text("key");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  return link;
}

std::string key_rotation_text(const KeyRotation& link) {
  return document_text(kKeyFormat, [&](JsonWriter& json) {
    json.put("serial", std::uint64_t{link.serial});
    json.put("key", link.key);
  });
}

Result<RootMetadata> parse_root_metadata(std::string_view json) {
  MODAR_ASSIGN(const auto document, parse_document(json, kRootFormat));
  Members members(document);
  RootMetadata word;
  word.epoch = members.number("epoch", kMaxNumber);
  word.links = static_cast<std::uint32_t>(members.number("links", 1000000));
  word.key = members.text("key");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  if (word.epoch == 0) return bad("epoch", "epochs begin at 1");
  return word;
}

std::string root_metadata_text(const RootMetadata& word) {
  return document_text(kRootFormat, [&](JsonWriter& json) {
    json.put("epoch", word.epoch);
    json.put("links", std::uint64_t{word.links});
    json.put("key", word.key);
  });
}

std::string root_rotation_path(std::uint32_t serial) {
  return "roots/" + std::to_string(serial) + ".json";
}

Result<RootRotation> parse_root_rotation(std::string_view json) {
  MODAR_ASSIGN(const auto document, parse_document(json, kRootLinkFormat));
  Members members(document);
  RootRotation link;
  link.serial = static_cast<std::uint32_t>(members.number("serial", 1000000));
  const std::string roots = members.text("roots");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  if (link.serial == 0) return bad("serial", "links begin at 1");
  const auto set = parse_root_set(roots);
  if (!set) return bad("roots", set.error().cause);
  link.roots = *set;
  return link;
}

std::string root_rotation_text(const RootRotation& link) {
  return document_text(kRootLinkFormat, [&](JsonWriter& json) {
    json.put("serial", std::uint64_t{link.serial});
    json.put("roots", root_set_line(link.roots));
  });
}

}  // namespace modar
