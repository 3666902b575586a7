// What carries transfers: libcurl, or an app's ByteSource. Internal to runtime/fetch.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "attempts.hpp"

namespace modar::fetch {

class Line {
 public:
  virtual ~Line() = default;
  /// Runs all transfers to their end, or until one has failed. Errors: that transfer's.
  virtual Result<void> run(std::vector<Transfer>& transfers, Attempts& attempts) = 0;
};

/// An address as it is printed: without a name and a password.
std::string without_login(const std::string& url);

/// The folder that a release is to be read from, as an absolute path: of a path, or of a file://
/// address. Nothing: it is the address of a server. Empty: there is no such folder.
std::optional<std::string> release_folder(const std::string& url_or_folder);

/// The files below a folder, regular ones only, at most that many bytes a second (0: any). A file
/// that is not there answers "fetch.missing".
ByteSource folder_source(std::string folder, std::uint64_t bytes_per_second);

/// Several transfers at once over HTTP or HTTPS. Errors: kInternal "fetch.curl". In a build without
/// libcurl: kUnsupported "fetch.curl".
Result<std::unique_ptr<Line>> make_curl_line(const TransferOptions& options,
                                             const std::string& address);

/// One transfer after another.
std::unique_ptr<Line> make_source_line(ByteSource source);

}  // namespace modar::fetch
