#include "transfer.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <optional>
#include <thread>
#include <utility>

#include <curl/curl.h>

#include "modar/mapped_file.hpp"
#include "modar/release.hpp"
#include "store.hpp"

namespace modar::fetch {
namespace {

using Clock = std::chrono::steady_clock;

/// Set by hand: a few round trips of a 2G link with lost packets.
constexpr long kConnectSeconds = 15;
/// "No such file" answers before an object counts as missing: servers err while files are replaced.
constexpr std::size_t kMissingAttempts = 3;

/// The URL of an address or folder without a slash at its end; empty if there is no such folder.
std::string server_address(const std::string& url_or_folder) {
  std::string base = url_or_folder;
  while (base.size() > 1 && base.back() == '/') base.pop_back();
  if (base.find("://") != std::string::npos) return base;
  char* absolute = ::realpath(base.c_str(), nullptr);
  if (absolute == nullptr) return {};
  CURLU* parts = curl_url();
  curl_url_set(parts, CURLUPART_SCHEME, "file", 0);
  curl_url_set(parts, CURLUPART_PATH, absolute, CURLU_URLENCODE);
  char* text = nullptr;
  if (curl_url_get(parts, CURLUPART_URL, &text, 0) == CURLUE_OK) base = text;
  curl_free(text);
  curl_url_cleanup(parts);
  std::free(absolute);
  return base;
}

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

/// An attempt counts as progress if it brought so many bytes more than any before, or the rest: a
/// server that sends a byte now and then cannot keep a fetch busy for ever. Set by hand.
constexpr std::uint64_t kLeastProgress = 1024;
/// Bytes a second below which a connection is closed after stall_s. Set by hand: 2G brings 3000.
constexpr long kLeastSpeed = 64;

class TransferLoop;

/// One download. libcurl's callbacks point here, so it never moves.
struct Transfer {
  TransferLoop* loop = nullptr;
  CURL* handle = nullptr;
  std::string path;
  std::string* text =
      nullptr;            ///< destination of a text; an object goes to the part file of `wanted`
  std::size_t limit = 0;  ///< greatest number of bytes
  const Wanted* wanted = nullptr;
  std::optional<OutputFile> part;
  std::uint64_t have = 0;  ///< bytes of the part file, or of the text
  std::uint64_t asked_from = 0;
  std::uint64_t received = 0;  ///< bytes of this attempt
  bool judged = false;         ///< the status code was checked
  bool welcome = false;        ///< the body is the file, not an error page
  bool too_long = false;
  bool failed_to_write = false;
  std::uint64_t furthest = 0;                  ///< most bytes that any attempt ended with
  std::array<char, CURL_ERROR_SIZE> reason{};  ///< libcurl's words
  unsigned fruitless = 0;                      ///< attempts in a row without any data
  bool optional = false;                       ///< believe the first answer "no such file"
  unsigned missing = 0;                        ///< answers "no such file"
  Clock::time_point not_before{};
  Error error;

  [[nodiscard]] std::string part_path() const { return wanted->file + ".part"; }
};

enum class Outcome { kDone, kAgain, kFailed };

/// Runs transfers over one libcurl multi handle.
class TransferLoop {
 public:
  explicit TransferLoop(TransferOptions options)
      : options_(std::move(options)),
        base_(options_.source ? std::string("the release folder") : server_address(options_.url)),
        multi_(curl_multi_init()) {}
  TransferLoop(const TransferLoop&) = delete;
  TransferLoop& operator=(const TransferLoop&) = delete;
  ~TransferLoop() {
    for (CURL* handle : idle_) curl_easy_cleanup(handle);
    curl_multi_cleanup(multi_);
  }

  [[nodiscard]] bool works() const { return multi_ != nullptr; }
  [[nodiscard]] const std::string& base() const { return base_; }
  [[nodiscard]] const TransferStats& stats() const { return stats_; }

  Result<void> run(std::vector<std::unique_ptr<Transfer>>& transfers,
                   const std::function<void(std::int64_t)>* on_bytes);
  std::size_t take(Transfer& transfer, const char* bytes, std::size_t size);

 private:
  bool open_part(Transfer& transfer);
  bool start(Transfer& transfer);
  void judge_status(Transfer& transfer);
  Outcome finish(Transfer& transfer, CURLcode code);
  Outcome close(Transfer& transfer, Outcome outcome);
  Outcome ask_source(Transfer& transfer);
  Result<void> run_source(std::vector<std::unique_ptr<Transfer>>& transfers);
  Outcome judge_answer(Transfer& transfer, CURLcode code, long status);
  Outcome judge_object(Transfer& transfer);
  Outcome again(Transfer& transfer, const std::string& cause);
  Outcome missing(Transfer& transfer);
  void discard(Transfer& transfer);
  void limit_rate() const;
  void tell(std::int64_t bytes) const {
    if (on_bytes_ != nullptr && bytes != 0) (*on_bytes_)(bytes);
  }

  TransferOptions options_;
  std::string base_;
  CURLM* multi_ = nullptr;
  std::vector<CURL*> idle_;
  TransferStats stats_;
  Clock::time_point begin_ = Clock::now();
  const std::function<void(std::int64_t)>* on_bytes_ = nullptr;
};

/// Discards what was received of an object or text.
void TransferLoop::discard(Transfer& transfer) {
  if (transfer.wanted != nullptr) {
    tell(-static_cast<std::int64_t>(transfer.have));
    if (transfer.part && !transfer.part->resize(0)) transfer.failed_to_write = true;
  } else {
    transfer.text->clear();
  }
  transfer.have = 0;
  transfer.received = 0;
}

void TransferLoop::judge_status(Transfer& transfer) {
  transfer.judged = true;
  long status = 0;
  curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
  // 0: not HTTP; file:// honours the range.
  transfer.welcome = status == 0 || status == 206 || status == 200;
  // A server without range requests sends the file from its beginning.
  if (status == 200 && transfer.asked_from != 0) discard(transfer);
}

std::size_t TransferLoop::take(Transfer& transfer, const char* bytes, std::size_t size) {
  stats_.bytes += size;
  if (!transfer.judged) judge_status(transfer);
  if (!transfer.welcome) return size;
  if (transfer.have + size > transfer.limit) {
    transfer.too_long = true;
    return 0;
  }
  if (transfer.wanted == nullptr) {
    transfer.text->append(bytes, size);
  } else if (!transfer.part->write_at(transfer.have, bytes, size)) {
    transfer.failed_to_write = true;
    return 0;
  }
  transfer.have += size;
  transfer.received += size;
  if (transfer.wanted != nullptr) tell(static_cast<std::int64_t>(size));
  return size;
}

std::size_t on_body(char* bytes, std::size_t unit, std::size_t count, void* user) {
  auto* transfer = static_cast<Transfer*>(user);
  return transfer->loop->take(*transfer, bytes, unit * count);
}

void set_common(CURL* handle, const TransferOptions& options) {
  curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(handle, CURLOPT_FOLLOWLOCATION, 1L);
  curl_easy_setopt(handle, CURLOPT_MAXREDIRS, 5L);
  curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https,file");
  curl_easy_setopt(handle, CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
  const std::uint64_t capped = options.bytes_per_second / (2 * std::max(1u, options.parallel));
  curl_easy_setopt(handle, CURLOPT_LOW_SPEED_LIMIT,
                   options.bytes_per_second == 0
                       ? kLeastSpeed
                       : std::clamp(static_cast<long>(std::min<std::uint64_t>(capped, kLeastSpeed)),
                                    1L, kLeastSpeed));
  curl_easy_setopt(handle, CURLOPT_USERAGENT, options.user_agent.c_str());
  if (const std::string file = authorities_of(options); !file.empty()) {
    curl_easy_setopt(handle, CURLOPT_CAINFO, file.c_str());
  }
  if (const char* folder = std::getenv("SSL_CERT_DIR"); folder != nullptr && *folder != '\0') {
    curl_easy_setopt(handle, CURLOPT_CAPATH, folder);
  }
  curl_easy_setopt(handle, CURLOPT_LOW_SPEED_TIME,
                   std::max(1L, static_cast<long>(std::ceil(options.stall_s))));
  // Small reads keep the rate limit smooth on slow links.
  if (options.bytes_per_second != 0) curl_easy_setopt(handle, CURLOPT_BUFFERSIZE, 2048L);
}

/// Opens the part file and counts what it holds from an earlier attempt or run.
bool TransferLoop::open_part(Transfer& transfer) {
  const std::uint64_t have = file_size(transfer.part_path()).value_or(0);
  auto file = OutputFile::open(transfer.part_path());
  if (!file) {
    transfer.error = file.error();
    return false;
  }
  transfer.part.emplace(std::move(*file));
  if (transfer.have == 0) tell(static_cast<std::int64_t>(have));
  transfer.have = have;
  // A complete part file was never verified (the run was killed): download it again.
  if (have >= transfer.wanted->size) discard(transfer);
  return true;
}

/// Errors: false, and transfer.error says why.
bool TransferLoop::start(Transfer& transfer) {
  transfer.loop = this;
  transfer.judged = transfer.welcome = transfer.too_long = false;
  if (transfer.wanted != nullptr && !open_part(transfer)) return false;
  transfer.received = 0;
  transfer.asked_from = transfer.have;
  if (idle_.empty()) idle_.push_back(curl_easy_init());
  transfer.handle = idle_.back();
  idle_.pop_back();
  CURL* handle = transfer.handle;
  curl_easy_reset(handle);
  set_common(handle, options_);
  curl_easy_setopt(handle, CURLOPT_URL, (base_ + "/" + transfer.path).c_str());
  curl_easy_setopt(handle, CURLOPT_RESUME_FROM_LARGE, static_cast<curl_off_t>(transfer.have));
  curl_easy_setopt(handle, CURLOPT_WRITEFUNCTION, on_body);
  curl_easy_setopt(handle, CURLOPT_WRITEDATA, &transfer);
  curl_easy_setopt(handle, CURLOPT_ERRORBUFFER, transfer.reason.data());
  curl_easy_setopt(handle, CURLOPT_PRIVATE, &transfer);
  if (curl_multi_add_handle(multi_, handle) == CURLM_OK) return true;
  transfer.error = {ExitCode::kInternal, "fetch.curl", base_, "libcurl refuses to start",
                    "report this as a bug"};
  return false;
}

/// Schedules another attempt, unless too many in a row brought no data.
Outcome TransferLoop::again(Transfer& transfer, const std::string& cause) {
  const bool progress = transfer.have >= transfer.furthest + kLeastProgress;
  transfer.furthest = std::max(transfer.furthest, transfer.have);
  transfer.fruitless = progress ? 0 : transfer.fruitless + 1;
  if (transfer.fruitless >= options_.attempts) {
    transfer.error = {kExitNetwork, "fetch.network", base_ + "/" + transfer.path,
                      cause + ", " + std::to_string(transfer.fruitless) + " times in a row",
                      "run modar-fetch again: it resumes where it stopped"};
    return Outcome::kFailed;
  }
  ++stats_.retries;
  const double wait = std::min(options_.max_wait_s,
                               options_.first_wait_s * std::exp2(double(transfer.fruitless) - 1));
  transfer.not_before = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(wait));
  return Outcome::kAgain;
}

Outcome TransferLoop::missing(Transfer& transfer) {
  transfer.received = 0;
  if (++transfer.missing < kMissingAttempts && !transfer.optional)
    return again(transfer, "the server has no such file");
  transfer.error = {kExitMixed, "fetch.missing", base_ + "/" + transfer.path,
                    "the server has no such file", "publish the release again, whole"};
  return Outcome::kFailed;
}

/// Verifies a complete object; discards it and tries again if it is wrong.
Outcome TransferLoop::judge_object(Transfer& transfer) {
  bool right = false;
  if (const auto file = MappedFile::open(transfer.part_path())) {
    right = object_id(file->bytes()) == transfer.wanted->id;
  }
  if (!right) {
    ++stats_.corrupt;
    discard(transfer);
    return again(transfer, "what came is not what was published");
  }
  if (auto moved = rename_file(transfer.part_path(), transfer.wanted->file); !moved) {
    transfer.error = moved.error();
    return Outcome::kFailed;
  }
  return Outcome::kDone;
}

Outcome TransferLoop::judge_answer(Transfer& transfer, CURLcode code, long status) {
  if (transfer.too_long) {
    discard(transfer);
    return again(transfer, "the server sends more than the file has");
  }
  if (is_tls_failure(code)) {
    transfer.error = {
        kExitNetwork, "fetch.tls", base_ + "/" + transfer.path,
        std::string("the TLS connection failed: ") +
            (transfer.reason[0] != '\0' ? transfer.reason.data() : curl_easy_strerror(code)),
        "give the authority of its certificate with --cacert, and check the clock"};
    return Outcome::kFailed;
  }
  if (status == 404 || status == 410 || code == CURLE_FILE_COULDNT_READ_FILE) {
    return missing(transfer);
  }
  if (status == 416 || code == CURLE_RANGE_ERROR || code == CURLE_BAD_DOWNLOAD_RESUME) {
    discard(transfer);
    return again(transfer, "the server does not know the rest of the file");
  }
  if (status >= 400) return again(transfer, "the server answers " + std::to_string(status));
  const bool whole = transfer.wanted != nullptr && transfer.have == transfer.wanted->size;
  if (code != CURLE_OK && !whole) {
    // A text is not resumed: its length is not known.
    if (transfer.wanted == nullptr) discard(transfer);
    return again(transfer, curl_easy_strerror(code));
  }
  if (transfer.wanted == nullptr) return Outcome::kDone;
  return whole ? judge_object(transfer) : again(transfer, "the connection ended early");
}

Outcome TransferLoop::finish(Transfer& transfer, CURLcode code) {
  long status = 0;
  curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
  curl_multi_remove_handle(multi_, transfer.handle);
  idle_.push_back(std::exchange(transfer.handle, nullptr));
  const bool written = !transfer.failed_to_write;
  return close(transfer, written ? judge_answer(transfer, code, status) : Outcome::kFailed);
}

Outcome TransferLoop::close(Transfer& transfer, Outcome outcome) {
  if (transfer.failed_to_write) {
    transfer.error = {ExitCode::kIo, "io.write", transfer.part_path(), "it cannot be written",
                      "see that the store has room"};
    outcome = Outcome::kFailed;
  }
  transfer.part.reset();
  return outcome;
}

/// One attempt through the caller's ByteSource.
Outcome TransferLoop::ask_source(Transfer& transfer) {
  transfer.loop = this;
  transfer.judged = transfer.welcome = true;
  transfer.too_long = false;
  if (transfer.wanted != nullptr && !open_part(transfer)) return Outcome::kFailed;
  transfer.received = 0;
  const auto handed =
      options_.source(transfer.path, transfer.have, [&](std::span<const std::byte> bytes) {
        return take(transfer, reinterpret_cast<const char*>(bytes.data()), bytes.size()) ==
               bytes.size();
      });
  if (transfer.failed_to_write) return close(transfer, Outcome::kFailed);
  if (!handed && handed.error().code == "fetch.missing") return close(transfer, missing(transfer));
  // libcurl's codes for the same: the rest is judged alike.
  return close(transfer, judge_answer(transfer, handed ? CURLE_OK : CURLE_RECV_ERROR, 0));
}

Result<void> TransferLoop::run_source(std::vector<std::unique_ptr<Transfer>>& transfers) {
  for (const auto& transfer : transfers) {
    Outcome outcome = Outcome::kAgain;
    while (outcome == Outcome::kAgain) {
      std::this_thread::sleep_until(transfer->not_before);
      outcome = ask_source(*transfer);
    }
    if (outcome == Outcome::kFailed) return tl::unexpected(transfer->error);
  }
  return {};
}

/// Sleeps until the bytes received are within the rate limit. Meanwhile the socket fills up, and
/// the server waits, too.
void TransferLoop::limit_rate() const {
  if (options_.bytes_per_second == 0) return;
  const double allowed = std::chrono::duration<double>(Clock::now() - begin_).count();
  const double taken =
      static_cast<double>(stats_.bytes) / static_cast<double>(options_.bytes_per_second);
  const double ahead = std::min(1.0, taken - allowed);
  if (ahead > 0) std::this_thread::sleep_for(std::chrono::duration<double>(ahead));
}

Result<void> TransferLoop::run(std::vector<std::unique_ptr<Transfer>>& transfers,
                               const std::function<void(std::int64_t)>* on_bytes) {
  on_bytes_ = on_bytes;
  if (options_.source) {
    auto done = run_source(transfers);
    on_bytes_ = nullptr;
    return done;
  }
  std::deque<Transfer*> waiting;
  for (const auto& transfer : transfers) waiting.push_back(transfer.get());
  unsigned busy = 0;
  std::optional<Error> error;
  while (busy != 0 || (!waiting.empty() && !error)) {
    const auto now = Clock::now();
    for (std::size_t i = 0; !error && i < waiting.size() && busy < options_.parallel;) {
      Transfer& next = *waiting[i];
      if (next.not_before > now) {
        ++i;
        continue;
      }
      waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
      if (start(next)) {
        ++busy;
      } else {
        error = next.error;
      }
    }
    limit_rate();
    int running = 0;
    curl_multi_perform(multi_, &running);
    int left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi_, &left)) {
      if (message->msg != CURLMSG_DONE) continue;
      Transfer* transfer = nullptr;
      curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &transfer);
      const Outcome outcome = finish(*transfer, message->data.result);
      --busy;
      if (outcome == Outcome::kAgain) waiting.push_back(transfer);
      if (outcome == Outcome::kFailed && !error) error = transfer->error;
    }
    if (busy != 0 || !waiting.empty()) curl_multi_poll(multi_, nullptr, 0, 50, nullptr);
  }
  on_bytes_ = nullptr;
  if (error) return tl::unexpected(*error);
  return {};
}

}  // namespace

struct Transfers::State : TransferLoop {
  using TransferLoop::TransferLoop;
};

Transfers::Transfers(std::unique_ptr<State> state) : state_(std::move(state)) {}
Transfers::Transfers(Transfers&&) noexcept = default;
Transfers::~Transfers() = default;

Result<Transfers> Transfers::create(const TransferOptions& options) {
  static const CURLcode global = curl_global_init(CURL_GLOBAL_DEFAULT);
  auto state = std::make_unique<State>(options);
  if (global != CURLE_OK || !state->works()) {
    return fail(ExitCode::kInternal, "fetch.curl", options.url, "libcurl does not start",
                "report this as a bug");
  }
  if (state->base().empty()) {
    return fail(ExitCode::kUsage, "fetch.url", options.url, "there is no such folder",
                "give http://HOST/PATH or a folder that `modar ship publish` filled");
  }
  return Transfers(std::move(state));
}

Result<std::string> Transfers::text(const std::string& path, std::size_t limit, bool optional) {
  std::string text;
  std::vector<std::unique_ptr<Transfer>> transfers;
  transfers.push_back(std::make_unique<Transfer>());
  transfers.back()->path = path;
  transfers.back()->text = &text;
  transfers.back()->limit = limit;
  transfers.back()->optional = optional;
  MODAR_TRY(state_->run(transfers, nullptr));
  return text;
}

Result<void> Transfers::objects(std::span<const Wanted> wanted,
                                const std::function<void(std::int64_t)>& on_bytes) {
  std::vector<std::unique_ptr<Transfer>> transfers;
  for (const Wanted& object : wanted) {
    transfers.push_back(std::make_unique<Transfer>());
    transfers.back()->path = object.path;
    transfers.back()->wanted = &object;
    transfers.back()->limit = object.size;
  }
  return state_->run(transfers, &on_bytes);
}

const TransferStats& Transfers::stats() const {
  return state_->stats();
}

}  // namespace modar::fetch
