// One download and the rules for trying again: received bytes, whether they are right, when to give
// up. Knows nothing about networks. Internal to runtime/fetch.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "formats/base/error.hpp"
#include "store.hpp"
#include "transfer.hpp"

namespace modar::fetch {

/// One download. Its address stays the same while it runs: libcurl's callbacks hold it.
struct Transfer {
  using Clock = std::chrono::steady_clock;

  std::string path;       ///< below the release folder
  std::size_t limit = 0;  ///< most bytes that are accepted
  const ObjectRequest* object =
      nullptr;            ///< an object, received into its part file; nullptr: a text
  std::string text;       ///< the received part of a text
  bool optional = false;  ///< believe the first answer "no such file"

  std::optional<OutputFile> part;
  std::uint64_t have = 0;      ///< bytes of the part file, or of the text
  std::uint64_t furthest = 0;  ///< most bytes that any attempt ended with
  unsigned fruitless = 0;      ///< attempts in a row without progress
  unsigned missing = 0;        ///< answers "no such file"
  bool too_long = false;
  Clock::time_point not_before{};  ///< of the next attempt
  Error error;                     ///< after Outcome::kFailed

  [[nodiscard]] std::string part_name() const { return to_hex(object->id) + ".part"; }
};

/// How an attempt ended, as far as the network knows.
struct Answer {
  enum class Kind {
    kEnded,    ///< at the end of the file
    kBroken,   ///< before it, or with an error
    kNoRange,  ///< the file cannot be continued from the requested place
    kMissing,  ///< there is no such file
    kLogin,    ///< the network wants a login first
    kFatal,    ///< trying again is of no use
  };
  Kind kind = Kind::kEnded;
  std::string cause;  ///< of kBroken
  Error error;        ///< of kFatal
};

enum class Outcome { kDone, kAgain, kFailed };

/// Receives transfers and decides about further attempts.
class Attempts {
 public:
  /// address: of the release folder, for messages. is_server: missing files may come soon.
  Attempts(const TransferOptions& options, std::string address, bool is_server = true)
      : options_(options), address_(std::move(address)), is_server_(is_server) {}

  /// Receives progress in bytes, negative for discarded ones; may be empty.
  void report_progress(std::function<void(std::int64_t)> on_bytes) {
    on_bytes_ = std::move(on_bytes);
  }
  [[nodiscard]] const TransferStats& stats() const { return stats_; }
  [[nodiscard]] std::string address_of(const Transfer& transfer) const {
    return address_ + "/" + transfer.path;
  }

  /// Begins an attempt, from byte transfer.have on; opens the part file, which may hold bytes of an
  /// earlier run. False: transfer.error says why.
  bool begin(Transfer& transfer);
  /// Counts bytes of a body, useful or not.
  void count(std::size_t bytes) { stats_.bytes += bytes; }
  /// Takes the next bytes of the file; false: the attempt is to be broken off.
  bool take(Transfer& transfer, std::span<const std::byte> bytes);
  /// Forgets all received bytes.
  void discard(Transfer& transfer);
  /// Ends an attempt. After kAgain the next one is due at transfer.not_before.
  Outcome end(Transfer& transfer, const Answer& answer);

 private:
  Outcome classify(Transfer& transfer, const Answer& answer);
  Outcome check_object(Transfer& transfer);
  Outcome again(Transfer& transfer, const std::string& cause);
  void tell(std::int64_t bytes) const {
    if (on_bytes_ && bytes != 0) on_bytes_(bytes);
  }

  TransferOptions options_;
  std::string address_;
  bool is_server_;
  TransferStats stats_;
  std::function<void(std::int64_t)> on_bytes_;
};

}  // namespace modar::fetch
