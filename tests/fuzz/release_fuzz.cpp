// libFuzzer target: any text as what a server hands to a device before anything is trusted: a
// release, the number of the newest, a link of keys, a public key, a signature, a time.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "modar/release.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace modar;
  using test::need;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto release = parse_release(text)) {
    need(release->version >= 1 && !release->bundles.empty());
    // Accepted values are written and read again as the same.
    const std::string written = release_text(*release);
    const auto again = parse_release(written);
    need(again.has_value() && release_text(*again) == written);
  } else {
    test::need_told(release.error());
  }
  if (const auto link = parse_key_rotation(text)) {
    const auto again = parse_key_rotation(key_rotation_text(*link));
    need(again.has_value() && again->serial == link->serial && again->key == link->key);
  }
  if (const auto word = parse_root_metadata(text)) {
    const auto again = parse_root_metadata(root_metadata_text(*word));
    need(again.has_value() && again->epoch == word->epoch && again->links == word->links &&
         again->key == word->key);
  }
  if (const auto link = parse_root_rotation(text)) {
    const auto again = parse_root_rotation(root_rotation_text(*link));
    need(again.has_value() && again->serial == link->serial && again->roots == link->roots);
  }
  if (const auto roots = parse_root_set(text)) {
    need(roots->threshold >= 1 && roots->threshold <= roots->keys.size());
    need(*parse_root_set(root_set_line(*roots)) == *roots);
  }
  const auto key = parse_public_key(text);
  if (key) need(*parse_public_key(public_key_line(*key)) == *key);
  if (const auto signature = parse_signature(text)) {
    // Nobody has signed with a key of zeros.
    need(!verify_signature(text, *signature, key.value_or(PublicKey{})).has_value());
  }
  if (const auto latest = parse_latest(text)) {
    const std::string digits = std::to_string(*latest) + "\n";
    need(*latest > 0 && text.ends_with(digits));  // zeros may precede
  }
  if (const auto time = parse_time(text)) need(parse_time(time_text(*time)) == *time);
  return 0;
}
