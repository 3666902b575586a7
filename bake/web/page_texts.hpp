// What a page says of a bundle's patterns, from texts that may be anyone's.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bake/json.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Whether a page may link to this: https, http, mailto, tel, or a file beside the page.
bool is_link_address(std::string_view url);

/// "red_vase" as people write it.
std::string title_of(std::string_view name);

/// Of a pattern, what a bundle's meta (modar.toml) has to say of its scenes in these languages:
/// {LANGUAGE: {"name", "text", "alt"}}; null where that is nothing.
Json bundle_texts(std::string_view meta, const std::string& pattern,
                  const std::vector<std::string>& languages);

/// The same of the file of `modar web --texts`, {PATTERN: {LANGUAGE: {"name", "text", "alt"}}}:
/// `given` is what it has of the pattern. file: for messages. Errors: kInvalidInput "web.texts"
/// where a language has no name.
Result<Json> given_texts(const Json& given, const std::string& file, const std::string& pattern,
                         const std::vector<std::string>& languages);

}  // namespace modar
