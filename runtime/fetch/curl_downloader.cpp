#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <thread>
#include <utility>

#include <curl/curl.h>

#include "downloader.hpp"
#include "modar/release.hpp"

namespace modar::fetch {
namespace {

using Clock = Transfer::Clock;

/// Seconds for a connection: the first packet, three repetitions (RFC 6298), and an answer over a
/// 2G link.
constexpr long kConnectSeconds = 15;
/// Bytes a second below which a connection is closed after stall_s: 2G has 3000.
constexpr long kLeastSpeed = 64;

/// A PEM file of authorities, as curl and OpenSSL take it from the environment; empty: the
/// system's.
std::string authorities_of(const TransferOptions& options) {
  if (!options.authorities.empty()) return options.authorities;
  for (const char* name : {"CURL_CA_BUNDLE", "SSL_CERT_FILE"}) {
    if (const char* value = std::getenv(name); value != nullptr && *value != '\0') return value;
  }
  return {};
}

bool is_tls_failure(CURLcode code) {
  return code == CURLE_PEER_FAILED_VERIFICATION || code == CURLE_SSL_CONNECT_ERROR ||
         code == CURLE_SSL_CACERT_BADFILE || code == CURLE_SSL_CERTPROBLEM ||
         code == CURLE_SSL_ISSUER_ERROR;
}

/// Options of one handle. Each is looked at: one that libcurl refuses would leave what it had.
class Options {
 public:
  explicit Options(CURL* handle) : handle_(handle), good_(handle != nullptr) {}

  template <class Value>
  Options& set(CURLoption option, Value value) {
    good_ = good_ && curl_easy_setopt(handle_, option, value) == CURLE_OK;
    return *this;
  }
  [[nodiscard]] bool good() const { return good_; }

 private:
  CURL* handle_;
  bool good_;
};

/// What all transfers of a handle share. Set once: curl_easy_reset() restores the size of the
/// buffer but keeps the buffer.
bool set_common(CURL* handle, const TransferOptions& options, const std::string& address) {
  const std::uint64_t capped = options.bytes_per_second / (2 * std::max(1u, options.parallel));
  const long least =
      options.bytes_per_second == 0
          ? kLeastSpeed
          : std::clamp(static_cast<long>(std::min<std::uint64_t>(capped, kLeastSpeed)), 1L,
                       kLeastSpeed);
  Options set(handle);
  set.set(CURLOPT_NOSIGNAL, 1L)
      .set(CURLOPT_FOLLOWLOCATION, 1L)
      .set(CURLOPT_MAXREDIRS, 5L)
      .set(CURLOPT_PROTOCOLS_STR, "http,https")
      .set(CURLOPT_REDIR_PROTOCOLS_STR, address.starts_with("https:") ? "https" : "http,https")
      .set(CURLOPT_CONNECTTIMEOUT, kConnectSeconds)
      .set(CURLOPT_LOW_SPEED_LIMIT, least)
      .set(CURLOPT_LOW_SPEED_TIME, std::max(1L, static_cast<long>(std::ceil(options.stall_s))))
      .set(CURLOPT_USERAGENT, options.user_agent.c_str());
  if (const std::string file = authorities_of(options); !file.empty()) {
    set.set(CURLOPT_CAINFO, file.c_str());
  }
  if (const char* folder = std::getenv("SSL_CERT_DIR"); folder != nullptr && *folder != '\0') {
    set.set(CURLOPT_CAPATH, folder);
  }
  // Small reads keep the rate limit smooth.
  if (options.bytes_per_second != 0) set.set(CURLOPT_BUFFERSIZE, 2048L);
  return set.good();
}

/// Holds all transfers together to a number of bytes a second.
struct RateLimit {
  std::uint64_t bytes_per_second = 0;  ///< 0: none
  Clock::time_point begin = Clock::now();

  /// Sleeps until the bytes received are within the limit. Meanwhile the socket fills up, and the
  /// server waits, too.
  void wait(std::uint64_t received) const {
    if (bytes_per_second == 0) return;
    const double allowed = std::chrono::duration<double>(Clock::now() - begin).count();
    const double taken = static_cast<double>(received) / static_cast<double>(bytes_per_second);
    const double ahead = std::min(1.0, taken - allowed);
    if (ahead > 0) std::this_thread::sleep_for(std::chrono::duration<double>(ahead));
  }
};

/// A place for one attempt at a time; its handle keeps its connections.
struct Download {
  Transfer* transfer = nullptr;  ///< nullptr: the place is free
  Attempts* attempts = nullptr;
  const RateLimit* limit = nullptr;
  CURL* handle = nullptr;
  std::uint64_t asked_from = 0;
  bool status_checked = false;                 ///< the status code was looked at
  bool welcome = false;                        ///< the body is the file, not an error page
  std::array<char, CURL_ERROR_SIZE> reason{};  ///< libcurl's words
};

void check_status(Download& download) {
  download.status_checked = true;
  long status = 0;
  curl_easy_getinfo(download.handle, CURLINFO_RESPONSE_CODE, &status);
  download.welcome = status == 206 || status == 200;
  // A server without range requests sends the file from its beginning.
  if (status == 200 && download.asked_from != 0) download.attempts->discard(*download.transfer);
}

std::size_t on_body(char* bytes, std::size_t unit, std::size_t count, void* user) {
  auto& download = *static_cast<Download*>(user);
  const std::size_t size = unit * count;
  download.attempts->count(size);
  download.limit->wait(download.attempts->stats().bytes);  // here: curl reads 100 times in a row
  if (!download.status_checked) check_status(download);
  if (!download.welcome) return size;
  const auto body = std::as_bytes(std::span(bytes, size));
  return download.attempts->take(*download.transfer, body) ? size : 0;
}

Answer answer_of(const Download& download, CURLcode code) {
  long status = 0;
  curl_easy_getinfo(download.handle, CURLINFO_RESPONSE_CODE, &status);
  if (is_tls_failure(code)) {
    const char* words =
        download.reason[0] != '\0' ? download.reason.data() : curl_easy_strerror(code);
    return {Answer::Kind::kFatal,
            {},
            {kExitNetwork, "fetch.tls", download.attempts->address_of(*download.transfer),
             std::string("the TLS connection failed: ") + words,
             "check the clock, log in to this network, or pass its authority with --cacert"}};
  }
  if (code == CURLE_UNSUPPORTED_PROTOCOL && (status < 300 || status > 399)) {
    return {Answer::Kind::kBroken, "the response has no HTTP header", {}};
  }
  if (status == 511) return {Answer::Kind::kLogin, {}, {}};  // Network Authentication Required
  if (code == CURLE_UNSUPPORTED_PROTOCOL) {
    return {Answer::Kind::kFatal,
            {},
            {kExitNetwork, "fetch.redirect", download.attempts->address_of(*download.transfer),
             "the server redirects to an address that is not HTTPS",
             "fetch from an address that stays on HTTPS"}};
  }
  if (status == 404 || status == 410) return {Answer::Kind::kMissing, {}, {}};
  if (status == 416 || code == CURLE_RANGE_ERROR || code == CURLE_BAD_DOWNLOAD_RESUME) {
    return {Answer::Kind::kNoRange, {}, {}};
  }
  if (status >= 400) {
    return {Answer::Kind::kBroken, "the server responded with " + std::to_string(status), {}};
  }
  if (code != CURLE_OK) return {Answer::Kind::kBroken, curl_easy_strerror(code), {}};
  return {};
}

/// All transfers over one multi handle.
class CurlDownloader : public Downloader {
 public:
  CurlDownloader(TransferOptions options, std::string address, CURLM* multi)
      : options_(std::move(options)),
        address_(std::move(address)),
        multi_(multi),
        places_(std::max(1u, options_.parallel)),
        limit_{options_.bytes_per_second} {
    for (Download& place : places_) {
      place.handle = curl_easy_init();
      ready_ = ready_ && set_common(place.handle, options_, address_);
    }
  }
  CurlDownloader(const CurlDownloader&) = delete;
  CurlDownloader& operator=(const CurlDownloader&) = delete;
  ~CurlDownloader() override {
    for (const Download& place : places_) curl_easy_cleanup(place.handle);
    curl_multi_cleanup(multi_);
  }

  Result<void> run(std::vector<Transfer>& transfers, Attempts& attempts) override;

 private:
  bool start(Transfer& transfer, Attempts& attempts);
  Outcome finish(Download& download, CURLcode code);

  TransferOptions options_;
  std::string address_;
  CURLM* multi_;
  std::vector<Download> places_;  // never grows: libcurl's callbacks point into it
  bool ready_ = true;             // all handles have their options
  RateLimit limit_;
};

/// There is a free place. False: the transfer's error says why.
bool CurlDownloader::start(Transfer& transfer, Attempts& attempts) {
  if (!attempts.begin(transfer)) return false;
  Download& download = *std::ranges::find(places_, nullptr, &Download::transfer);
  CURL* handle = download.handle;
  download = {&transfer, &attempts, &limit_, handle, transfer.have};
  Options set(handle);
  set.set(CURLOPT_URL, (address_ + "/" + transfer.path).c_str())
      .set(CURLOPT_RESUME_FROM_LARGE, static_cast<curl_off_t>(transfer.have))
      .set(CURLOPT_WRITEFUNCTION, on_body)
      .set(CURLOPT_WRITEDATA, &download)
      .set(CURLOPT_ERRORBUFFER, download.reason.data())
      .set(CURLOPT_PRIVATE, &download);
  if (ready_ && set.good() && curl_multi_add_handle(multi_, handle) == CURLM_OK) return true;
  download.transfer = nullptr;
  transfer.error = {ExitCode::kInternal, "fetch.curl", without_login(address_),
                    "libcurl cannot be initialised", "report this as a bug"};
  return false;
}

Outcome CurlDownloader::finish(Download& download, CURLcode code) {
  const Answer answer = answer_of(download, code);
  curl_multi_remove_handle(multi_, download.handle);
  return download.attempts->end(*std::exchange(download.transfer, nullptr), answer);
}

Result<void> CurlDownloader::run(std::vector<Transfer>& transfers, Attempts& attempts) {
  std::deque<Transfer*> waiting;
  for (Transfer& transfer : transfers) waiting.push_back(&transfer);
  std::size_t busy = 0;
  std::optional<Error> error;
  while (busy != 0 || (!waiting.empty() && !error)) {
    const auto now = Clock::now();
    for (std::size_t i = 0; !error && i < waiting.size() && busy < places_.size();) {
      Transfer& next = *waiting[i];
      if (next.not_before > now) {
        ++i;
        continue;
      }
      waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
      if (start(next, attempts)) {
        ++busy;
      } else {
        error = next.error;
      }
    }
    int running = 0;
    curl_multi_perform(multi_, &running);
    int left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi_, &left)) {
      if (message->msg != CURLMSG_DONE) continue;
      Download* download = nullptr;
      curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &download);
      Transfer* transfer = download->transfer;
      const Outcome outcome = finish(*download, message->data.result);
      --busy;
      if (outcome == Outcome::kAgain) waiting.push_back(transfer);
      if (outcome == Outcome::kFailed && !error) error = transfer->error;
    }
    if (busy != 0 || !waiting.empty()) curl_multi_poll(multi_, nullptr, 0, 50, nullptr);
  }
  if (error) return tl::unexpected(*error);
  return {};
}

}  // namespace

Result<std::unique_ptr<Downloader>> make_curl_downloader(const TransferOptions& options,
                                                         const std::string& address) {
  static const CURLcode global = curl_global_init(CURL_GLOBAL_DEFAULT);
  CURLM* multi = global == CURLE_OK ? curl_multi_init() : nullptr;
  if (multi == nullptr) {
    return fail(ExitCode::kInternal, "fetch.curl", without_login(address),
                "libcurl cannot be initialised", "report this as a bug");
  }
  return std::make_unique<CurlDownloader>(options, address, multi);
}

}  // namespace modar::fetch
