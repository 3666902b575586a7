// What carries transfers: libcurl, or an app's ByteSource. Internal to runtime/fetch.
#pragma once

#include <memory>
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

/// The release folder's URL: of an address, or of a local folder; empty if there is no such folder.
/// Without libcurl, always empty.
std::string curl_address(const std::string& url_or_folder);

/// Several transfers at once over HTTP, HTTPS or from a folder. Errors: kInternal "fetch.curl".
/// In a build without libcurl: kUnsupported "fetch.curl".
Result<std::unique_ptr<Line>> make_curl_line(const TransferOptions& options,
                                             const std::string& address);

/// One transfer after another.
std::unique_ptr<Line> make_source_line(ByteSource source);

}  // namespace modar::fetch
