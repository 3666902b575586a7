// For builds without libcurl: an app gives its own ByteSource.
#include "downloader.hpp"

namespace modar::fetch {

Result<std::unique_ptr<Downloader>> make_curl_downloader(const TransferOptions& options,
                                                         const std::string&) {
  return fail(ExitCode::kUnsupported, "fetch.curl", without_login(options.url),
              "this build has no libcurl", "set FetchOptions::source");
}

}  // namespace modar::fetch
