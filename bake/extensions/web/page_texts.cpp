#include "bake/extensions/web/page_texts.hpp"

#include <algorithm>

#include "formats/base/address.hpp"
#include "formats/base/ranges.hpp"

namespace modar {

bool is_link_address(std::string_view url) {
  if (address_fault(url) != nullptr) return false;
  for (const char* scheme : {"https://", "http://", "mailto:", "tel:"}) {
    if (url.starts_with(scheme)) return true;
  }
  return !url.empty() && url.find(':') == std::string_view::npos && url[0] != '/';
}

std::string title_of(std::string_view name) {
  std::string title(name);
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
}

std::string models_on(const BundleView& bundle, std::uint32_t pattern) {
  std::vector<std::string> names;
  for (const SceneRecord& scene : bundle.scenes()) {
    if (scene.pattern != pattern) continue;
    const std::string name = title_of(bundle.name(bundle.models()[scene.model].name));
    if (ranges::find(names, name) == names.end()) names.push_back(name);
  }
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return all;
}

Json bundle_texts(std::string_view meta, const std::string& pattern,
                  const std::vector<std::string>& languages) {
  Json texts;
  for (const Json& scene : Json::parse(meta)["texts"].elements()) {
    if (scene.text_at("pattern") != pattern) continue;
    for (const std::string& language : languages) {
      for (const char* key : {"text", "alt"}) {
        const auto words = scene[std::string(key) + "/" + language].text();
        if (!words) continue;
        Json entry = texts.find(language).value_or(Json{{"text", ""}});
        const std::string before = entry.text_at(key);
        entry.set(key, before.empty() ? *words : before + " " + *words);
        texts.set(language, entry);
      }
    }
  }
  return texts;
}

Result<Json> given_texts(const Json& given, const std::string& file, const std::string& pattern,
                         const std::vector<std::string>& languages) {
  Json texts = Json::object();
  for (const std::string& language : languages) {
    const auto name = given[language + "/name"].text();
    if (!given.find(language)) continue;
    if (!name) {
      return fail(ExitCode::kInvalidInput, "web.texts", file + ", " + pattern + ", " + language,
                  "there is no name", R"(write {"name": "...", "text": "...", "alt": "..."})");
    }
    Json entry = {{"name", *name}, {"text", given.find(language + "/text").value_or("")}};
    if (const auto alt = given.find(language + "/alt")) entry.set("alt", *alt);
    texts.set(language, entry);
  }
  return texts;
}

}  // namespace modar
