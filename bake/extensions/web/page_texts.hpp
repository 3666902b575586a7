// What a page says of a bundle's patterns, from texts that may be anyone's.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bake/json.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// Whether a page may link to this: https, http, mailto, tel, or a file next to the page.
bool is_link_address(std::string_view url);

/// "red_vase" as people write it.
std::string title_of(std::string_view name);

/// The models of a pattern's scenes, each once: "red vase, plinth"; empty if none.
std::string models_on(const BundleView& bundle, std::uint32_t pattern);

/// Of a pattern, what a bundle's meta (modar.toml) has to say of its scenes in these languages:
/// {LANGUAGE: {"text", "alt"}}; null where that is nothing.
Json bundle_texts(std::string_view meta, const std::string& pattern,
                  const std::vector<std::string>& languages);

/// The same of the file of `modar web --texts`, {PATTERN: {LANGUAGE: {"name", "text", "alt"}}}:
/// `given` is what it has of the pattern. file: for messages. Errors: kInvalidInput "web.texts"
/// where a language has no name.
Result<Json> given_texts(const Json& given, const std::string& file, const std::string& pattern,
                         const std::vector<std::string>& languages);

}  // namespace modar
