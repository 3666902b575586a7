#include "modar/release.hpp"

#include <array>
#include <charconv>
#include <cstdio>
#include <ctime>
#include <set>

#include <rapidjson/document.h>
#include <rapidjson/prettywriter.h>

#include "modar/digest.hpp"

namespace modar {
namespace {

constexpr const char* kReleaseFormat = "modar-release";
constexpr const char* kKeyFormat = "modar-key";

tl::unexpected<Error> bad(std::string where, std::string cause) {
  return fail(ExitCode::kInvalidInput, "release.text", "release document: " + std::move(where),
              std::move(cause), "publish the release again");
}

/// Reads members of one object, remembering the first that is missing or of another kind.
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
  /// The first member that was not as it should be, or empty.
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

/// A file name that means the same everywhere and leads nowhere else.
bool is_plain_name(std::string_view name) {
  if (name.empty() || name.size() > 100 || name.front() == '.') return false;
  for (const char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!letter && c != '.' && c != '_' && c != '-') return false;
  }
  return true;
}

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
  if (!is_plain_name(bundle.name)) return bad("bundle", "its name is no plain file name");
  for (const rapidjson::Value& device : devices->GetArray()) {
    if (!device.IsString()) return bad("bundle " + bundle.name, "a device is no text");
    bundle.devices.emplace_back(device.GetString(), device.GetStringLength());
  }
  const auto hash_bytes = bundle_hash_of_hex(hash);
  const auto recipe_id = object_id_of_hex(recipe);
  if (!hash_bytes || !recipe_id) return bad("bundle " + bundle.name, "a hash is not one");
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
    return bad("byte " + std::to_string(document.GetErrorOffset()), "it is no JSON object");
  }
  Members members(document);
  if (members.text("format") != format) {
    return bad("format", std::string("it is no ") + format);
  }
  if (members.number("format_version", 1000000) != 1) {
    return fail(ExitCode::kUnsupported, "release.version", "release document",
                "it is of another version of the format", "use a newer modar-fetch");
  }
  return document;
}

using Writer = rapidjson::PrettyWriter<rapidjson::StringBuffer>;

void put(Writer& json, const char* key, const std::string& text) {
  json.Key(key);
  json.String(text.data(), static_cast<rapidjson::SizeType>(text.size()));
}

void put(Writer& json, const char* key, std::uint64_t number) {
  json.Key(key);
  json.Uint64(number);
}

void write_bundle(Writer& json, const ReleaseBundle& bundle) {
  json.StartObject();
  put(json, "name", bundle.name);
  put(json, "size", bundle.size);
  put(json, "hash", to_hex(bundle.hash));
  put(json, "recipe", to_hex(bundle.recipe));
  put(json, "recipe_size", bundle.recipe_size);
  put(json, "recipe_raw_size", bundle.recipe_raw_size);
  put(json, "pieces", bundle.pieces);
  put(json, "download_size", bundle.download_size);
  json.Key("devices");
  json.StartArray();
  for (const std::string& device : bundle.devices) json.String(device.c_str());
  json.EndArray();
  json.EndObject();
}

}  // namespace

Result<Release> parse_release(std::string_view json) {
  const auto document = parse_document(json, kReleaseFormat);
  if (!document) return tl::unexpected(document.error());
  Members members(*document);
  Release release;
  release.version = members.number("version", std::uint64_t{1} << 53);
  const std::string expires = members.text("expires");
  const rapidjson::Value* bundles = members.array("bundles");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  if (release.version == 0) return bad("version", "versions begin at 1");
  const auto time = parse_time(expires);
  if (!time) return tl::unexpected(time.error());
  release.expires = *time;
  std::set<std::string> names;
  for (const rapidjson::Value& json_bundle : bundles->GetArray()) {
    auto bundle = read_bundle(json_bundle);
    if (!bundle) return tl::unexpected(bundle.error());
    if (!names.insert(bundle->name).second) return bad("bundles", "two have the same name");
    release.bundles.push_back(std::move(*bundle));
  }
  if (release.bundles.empty()) return bad("bundles", "there is none");
  return release;
}

std::string release_text(const Release& release) {
  rapidjson::StringBuffer buffer;
  Writer json(buffer);
  json.SetIndent(' ', 1);
  json.StartObject();
  put(json, "format", kReleaseFormat);
  put(json, "format_version", std::uint64_t{1});
  put(json, "version", release.version);
  put(json, "expires", time_text(release.expires));
  json.Key("bundles");
  json.StartArray();
  for (const ReleaseBundle& bundle : release.bundles) write_bundle(json, bundle);
  json.EndArray();
  json.EndObject();
  return std::string(buffer.GetString(), buffer.GetSize()) + "\n";
}

Result<std::int64_t> parse_time(std::string_view text) {
  std::tm time{};
  const auto field = [&](std::size_t at, std::size_t digits, int& out) {
    const auto parsed = std::from_chars(text.data() + at, text.data() + at + digits, out);
    return parsed.ec == std::errc() && parsed.ptr == text.data() + at + digits && out >= 0;
  };
  const bool shaped = text.size() == 20 && text[4] == '-' && text[7] == '-' && text[10] == 'T' &&
                      text[13] == ':' && text[16] == ':' && text[19] == 'Z';
  if (!shaped || !field(0, 4, time.tm_year) || !field(5, 2, time.tm_mon) ||
      !field(8, 2, time.tm_mday) || !field(11, 2, time.tm_hour) || !field(14, 2, time.tm_min) ||
      !field(17, 2, time.tm_sec)) {
    return fail(ExitCode::kInvalidInput, "release.time", std::string(text),
                "it is no time as 2027-01-31T00:00:00Z", "write it so");
  }
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  const std::int64_t seconds = timegm(&time);
  // A date that the calendar does not have comes back as another.
  if (time_text(seconds) != text) {
    return fail(ExitCode::kInvalidInput, "release.time", std::string(text),
                "the calendar has no such time", "write one that it has");
  }
  return seconds;
}

std::string time_text(std::int64_t seconds) {
  const std::time_t clock = seconds;
  std::tm time{};
  gmtime_r(&clock, &time);
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02d-%02dT%02d:%02d:%02dZ", time.tm_year + 1900,
                time.tm_mon + 1, time.tm_mday, time.tm_hour, time.tm_min, time.tm_sec);
  return text.data();
}

Result<KeyLink> parse_key_link(std::string_view json) {
  const auto document = parse_document(json, kKeyFormat);
  if (!document) return tl::unexpected(document.error());
  Members members(*document);
  KeyLink link;
  link.serial = static_cast<std::uint32_t>(members.number("serial", 1000000));
  link.key = members.text("key");
  if (!members.missing().empty()) return bad(members.missing(), "it is missing or wrong");
  return link;
}

std::string key_link_text(const KeyLink& link) {
  rapidjson::StringBuffer buffer;
  Writer json(buffer);
  json.SetIndent(' ', 1);
  json.StartObject();
  put(json, "format", kKeyFormat);
  put(json, "format_version", std::uint64_t{1});
  put(json, "serial", std::uint64_t{link.serial});
  put(json, "key", link.key);
  json.EndObject();
  return std::string(buffer.GetString(), buffer.GetSize()) + "\n";
}

}  // namespace modar
