// Files of a web server, read one after another: what `modar ship verify URL` asks for.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "formats/base/error.hpp"

namespace modar {

/// Whether the text is an address of a web server.
bool is_web_address(const std::string& text);

/// Reads the files below an address, none longer than the limit of the request; nothing
/// where the server has no such file. Keeps one connection. Follows no redirects: another place is
/// another mirror. A name and a password in the address are sent, and never printed.
/// Errors: kUsage "http.url"; of the reader: kIo "http.answer", "http.connection".
Result<std::function<Result<std::optional<std::string>>(const std::string& path, std::size_t)>>
web_reader(const std::string& address);

}  // namespace modar
