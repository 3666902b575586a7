// libFuzzer target: any text as a publisher's secret key. Encrypted ones take a second and 1 GiB
// each, so that only their limits are tried.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bake/ship/keys/keys.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (modar::needs_pass_phrase(text)) return 0;
  const auto key = modar::parse_secret_key(text, "");
  if (!key) {
    modar::test::need_told(key.error());
    return 0;
  }
  // Accepted values are written and read again as the same.
  const auto written = modar::secret_key_text(*key, "");
  need(written.has_value());
  const auto again = modar::parse_secret_key(*written, "");
  need(again.has_value() && again->bytes == key->bytes && again->public_key == key->public_key);
  return 0;
}
