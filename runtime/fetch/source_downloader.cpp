#include <thread>
#include <utility>

#include "downloader.hpp"

namespace modar::fetch {
namespace {

class SourceDownloader : public Downloader {
 public:
  explicit SourceDownloader(ByteSource source) : source_(std::move(source)) {}

  Result<void> run(std::vector<Transfer>& transfers, Attempts& attempts) override {
    for (Transfer& transfer : transfers) {
      Outcome outcome = Outcome::kAgain;
      while (outcome == Outcome::kAgain) {
        std::this_thread::sleep_until(transfer.not_before);
        outcome = ask(transfer, attempts);
      }
      if (outcome == Outcome::kFailed) return tl::unexpected(transfer.error);
    }
    return {};
  }

 private:
  Outcome ask(Transfer& transfer, Attempts& attempts) {
    if (!attempts.begin(transfer)) return Outcome::kFailed;
    const auto handed =
        source_(transfer.path, transfer.have, [&](std::span<const std::byte> bytes) {
          attempts.count(bytes.size());
          return attempts.take(transfer, bytes);
        });
    Answer answer;
    if (!handed) {
      const std::string& code = handed.error().code;
      answer.kind = code == "fetch.missing" ? Answer::Kind::kMissing
                    : code == "fetch.later" ? Answer::Kind::kFatal
                                            : Answer::Kind::kBroken;
      answer.cause = handed.error().cause;
      answer.error = handed.error();
    }
    return attempts.end(transfer, answer);
  }

  ByteSource source_;
};

}  // namespace

std::unique_ptr<Downloader> make_source_downloader(ByteSource source) {
  return std::make_unique<SourceDownloader>(std::move(source));
}

}  // namespace modar::fetch
