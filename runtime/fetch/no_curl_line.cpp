// For builds without libcurl: an app gives its own ByteSource.
#include "line.hpp"

namespace modar::fetch {

Result<std::unique_ptr<Line>> make_curl_line(const TransferOptions& options, const std::string&) {
  return fail(ExitCode::kUnsupported, "fetch.curl", without_login(options.url),
              "this build has no libcurl", "set FetchOptions::source");
}

}  // namespace modar::fetch
