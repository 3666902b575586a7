// libFuzzer target: any text as what a page says of a bundle's patterns: the meta of the bundle,
// and the file of `modar web --texts`.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "bake/extensions/web/page_texts.hpp"
#include "bake/json.hpp"
#include "formats/meta_text.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using modar::Json;
using modar::test::need;

/// The texts of a page in a language: a text, and a name where one is given.
void need_texts(const Json& texts, bool named) {
  for (const char* language : {"en", "de"}) {
    const auto found = texts.find(language);
    if (found) need(found->find("name").has_value() == named && found->find("text").has_value());
  }
}

/// What the checker calls good, a page can read: JSON, and texts that are texts.
void hold_good_meta(std::string_view text) {
  const Json meta = Json::parse(text);
  need(!meta.is_null() && !meta.is_array() && !meta.text());
  const Json texts = meta.find("texts").value_or(Json::array());
  need(texts.is_array());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const Json entry = texts.at(i).value_or(Json());
    need(entry.find("pattern").value_or(Json()).text().has_value());
    need(!entry.find("text").value_or(Json()).is_null());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto fault = modar::check_meta_text(text)) {
    need(fault->offset <= size && fault->cause[0] != 0);
  } else {
    hold_good_meta(text);
  }
  need_texts(modar::bundle_texts(text, "cover", {"en", "de"}), false);
  const auto given = Json::parse(text).find("cover");
  if (!given) return 0;
  if (const auto texts = modar::given_texts(*given, "texts.json", "cover", {"en", "de"})) {
    need_texts(*texts, true);
  } else {
    modar::test::need_told(texts.error());
  }
  return 0;
}
