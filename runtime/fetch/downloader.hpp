// Downloads by libcurl or an app's ByteSource. Internal to runtime/fetch.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "attempts.hpp"

namespace modar::fetch {

class Downloader {
 public:
  virtual ~Downloader() = default;
  /// Runs all transfers to their end, or until one has failed. Errors: that transfer's.
  virtual Result<void> run(std::vector<Transfer>& transfers, Attempts& attempts) = 0;
};

/// An address for messages: without user name and password.
std::string without_login(const std::string& url);

/// The absolute path of the release folder that a path or a file:// address names. nullopt: it is
/// the address of a server. Empty: there is no such folder.
std::optional<std::string> release_folder(const std::string& url_or_folder);

/// The regular files in a folder, read at most at that many bytes per second (0: no limit). A
/// missing file gives "fetch.missing".
ByteSource folder_source(std::string folder, std::uint64_t bytes_per_second);

/// Several transfers at once over HTTP or HTTPS. Errors: kInternal "fetch.curl". In a build without
/// libcurl: kUnsupported "fetch.curl".
Result<std::unique_ptr<Downloader>> make_curl_downloader(const TransferOptions& options,
                                                         const std::string& address);

/// One transfer after another.
std::unique_ptr<Downloader> make_source_downloader(ByteSource source);

}  // namespace modar::fetch
