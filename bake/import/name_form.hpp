// Names of files in one form, so that two spellings of a name compare equal. Internal to this room.
#pragma once

#include <string>

namespace modar {

/// ASCII in lower case; letters with marks as one character (macOS writes them as two); cp1252, of
/// which old exporters' files are, as UTF-8.
std::string name_form(const std::string& name);

/// A name or URI for a message: at most 60 bytes of it.
std::string short_name(const std::string& name);

/// A URI with %XX decoded (RFC 3986, 2.1); other text stays.
std::string percent_decoded(const std::string& uri);

}  // namespace modar
