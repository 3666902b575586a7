#include "transfer.hpp"

#include <utility>
#include <vector>

#include "downloader.hpp"
#include "formats/base/utf8.hpp"

namespace modar::fetch {

std::string without_login(const std::string& url) {
  const std::size_t scheme = url.find("://");
  if (scheme == std::string::npos) return url;
  const std::size_t host = scheme + 3;
  const std::size_t at = url.substr(0, url.find('/', host)).rfind('@');
  return at == std::string::npos || at < host ? url : url.substr(0, host) + url.substr(at + 1);
}

struct Transfers::State {
  Attempts attempts;
  std::unique_ptr<Downloader> downloader;
  std::function<void(std::span<const FileNeed>)> needs;

  Result<void> run(std::vector<Transfer>& transfers) {
    if (needs) needs(needs_of(transfers));
    return downloader->run(transfers, attempts);
  }

  /// What a part that is there already has is not asked for; a complete one is, from the start.
  static std::vector<FileNeed> needs_of(const std::vector<Transfer>& transfers) {
    std::vector<FileNeed> list;
    for (const Transfer& transfer : transfers) {
      FileNeed need{transfer.path, 0, transfer.limit};
      if (transfer.object != nullptr) {
        const auto have = transfer.object->folder->size(transfer.part_name()).value_or(0);
        need.from = have < transfer.limit ? have : 0;
      }
      list.push_back(std::move(need));
    }
    return list;
  }
};

Transfers::Transfers(std::unique_ptr<State> state) : state_(std::move(state)) {}
Transfers::Transfers(Transfers&&) noexcept = default;
Transfers::~Transfers() = default;

Result<Transfers> Transfers::create(const TransferOptions& options) {
  if (options.source) {
    return Transfers(
        std::make_unique<State>(State{Attempts(options, "the release folder"),
                                      make_source_downloader(options.source), options.needs}));
  }
  std::string address = options.url;
  while (address.size() > 1 && address.back() == '/') address.pop_back();
  if (const auto folder = release_folder(address)) {
    if (folder->empty()) {
      return fail(ExitCode::kUsage, "fetch.url", options.url, "there is no such folder",
                  "give http://HOST/PATH or a folder that `modar ship publish` filled");
    }
    return Transfers(std::make_unique<State>(
        State{Attempts(options, *folder, false),
              make_source_downloader(folder_source(*folder, options.bytes_per_second)),
              {}}));
  }
  const std::string scheme = ascii_lower(address.substr(0, address.find("://")));
  if (scheme != "http" && scheme != "https") {
    return fail(ExitCode::kUsage, "fetch.url", options.url,
                "the address begins neither with http:// nor with https://",
                "give http://HOST/PATH or a folder that `modar ship publish` filled");
  }
  MODAR_ASSIGN(auto downloader, make_curl_downloader(options, address));
  return Transfers(std::make_unique<State>(
      State{Attempts(options, without_login(address)), std::move(downloader), {}}));
}

Result<std::string> Transfers::text(const std::string& path, std::size_t limit, bool optional) {
  std::vector<Transfer> transfers(1);
  transfers[0].path = path;
  transfers[0].limit = limit;
  transfers[0].optional = optional;
  MODAR_TRY(state_->run(transfers));
  return std::move(transfers[0].text);
}

Result<void> Transfers::objects(std::span<const ObjectRequest> requests,
                                const std::function<void(std::int64_t)>& on_bytes) {
  std::vector<Transfer> transfers(requests.size());
  for (std::size_t i = 0; i < requests.size(); ++i) {
    transfers[i].path = requests[i].path;
    transfers[i].object = &requests[i];
    transfers[i].limit = static_cast<std::size_t>(requests[i].size);
  }
  state_->attempts.report_progress(on_bytes);
  auto done = state_->run(transfers);
  state_->attempts.report_progress({});
  return done;
}

const TransferStats& Transfers::stats() const {
  return state_->attempts.stats();
}

}  // namespace modar::fetch
