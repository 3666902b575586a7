#pragma once

#include <string>

namespace modar::fetch {

/// The URL that paths are appended to: folders become file URLs, other URLs lose their last slash.
/// Empty if there is no such folder.
std::string server_address(const std::string& url_or_folder);

}  // namespace modar::fetch
