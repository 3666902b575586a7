#include "attempts.hpp"

#include <algorithm>
#include <cmath>

#include "modar/mapped_file.hpp"
#include "modar/release.hpp"

namespace modar::fetch {
namespace {

/// "No such file" answers before an object counts as missing: servers err while files are replaced.
constexpr unsigned kMissingAttempts = 3;

/// Bytes beyond all earlier attempts that count as progress. Lower lets a slow server have endless
/// attempts.
constexpr std::uint64_t kLeastProgress = 1024;

/// Bytes that are kept of a text that is too long: enough to see what it is.
constexpr std::size_t kStart = 64;

/// A network that wants a login first answers everything with its own page. No document of a
/// release begins like one.
bool is_web_page(std::string_view text) {
  const std::size_t first = text.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  return first != std::string_view::npos && text[first] == '<';
}

constexpr const char* kWebPage = "a web page came in place of the file; log in to this network";

}  // namespace

bool Attempts::begin(Transfer& transfer) {
  transfer.too_long = false;
  if (transfer.object == nullptr) return true;
  const Folder& folder = *transfer.object->folder;
  auto file = folder.resume(transfer.part_name());
  if (!file) {
    transfer.error = file.error();
    return false;
  }
  transfer.part.emplace(std::move(*file));
  const std::uint64_t have = folder.size(transfer.part_name()).value_or(0);
  if (transfer.have == 0) tell(static_cast<std::int64_t>(have));
  transfer.have = have;
  // A complete part file was never verified (the run was killed): download it again.
  if (have >= transfer.object->size) discard(transfer);
  return true;
}

bool Attempts::take(Transfer& transfer, std::span<const std::byte> bytes) {
  if (transfer.have + bytes.size() > transfer.limit) {
    transfer.too_long = true;
    const std::size_t kept = transfer.object == nullptr ? std::min(bytes.size(), kStart) : 0;
    transfer.text.append(reinterpret_cast<const char*>(bytes.data()), kept);
    return false;
  }
  if (transfer.object == nullptr) {
    transfer.text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  } else if (auto written = transfer.part->write_at(transfer.have, bytes.data(), bytes.size());
             !written) {
    transfer.error = written.error();
    return false;
  } else {
    tell(static_cast<std::int64_t>(bytes.size()));
  }
  transfer.have += bytes.size();
  return true;
}

void Attempts::discard(Transfer& transfer) {
  if (transfer.object != nullptr) {
    tell(-static_cast<std::int64_t>(transfer.have));
    if (auto emptied = transfer.part->resize(0); !emptied) transfer.error = emptied.error();
  } else {
    transfer.text.clear();
  }
  transfer.have = 0;
}

Outcome Attempts::end(Transfer& transfer, const Answer& answer) {
  // What cannot be written is not tried again.
  const bool written = transfer.error.code.empty();
  Outcome outcome = written ? classify(transfer, answer) : Outcome::kFailed;
  if (!transfer.error.code.empty()) outcome = Outcome::kFailed;
  transfer.part.reset();
  return outcome;
}

Outcome Attempts::classify(Transfer& transfer, const Answer& answer) {
  const bool whole = transfer.too_long || answer.kind == Answer::Kind::kEnded;
  if (answer.kind == Answer::Kind::kLogin || (whole && is_web_page(transfer.text))) {
    transfer.error = {kExitNetwork, "fetch.login", address_of(transfer), kWebPage,
                      "then run modar-fetch again: it resumes where it stopped"};
    return Outcome::kFailed;
  }
  if (transfer.too_long && transfer.object == nullptr) {  // no document of a release is so long
    transfer.error = {kExitMixed, "fetch.too-long", address_of(transfer),
                      "it is longer than " + std::to_string(transfer.limit) + " bytes",
                      "publish the release again, or use a newer modar-fetch"};
    return Outcome::kFailed;
  }
  if (transfer.too_long) {
    discard(transfer);
    return again(transfer, "the server sends more than the file has");
  }
  switch (answer.kind) {
    case Answer::Kind::kFatal:
      transfer.error = answer.error;
      return Outcome::kFailed;
    case Answer::Kind::kMissing:
      if (is_server_ && ++transfer.missing < kMissingAttempts && !transfer.optional) {
        return again(transfer, "the server has no such file");
      }
      transfer.error = {kExitMixed, "fetch.missing", address_of(transfer),
                        is_server_ ? "the server has no such file" : "the folder has no such file",
                        transfer.object == nullptr ? "check the address, or publish a release there"
                                                   : "publish the release again, whole"};
      return Outcome::kFailed;
    case Answer::Kind::kNoRange:
      discard(transfer);
      return again(transfer, "the server does not know the rest of the file");
    case Answer::Kind::kLogin:
    case Answer::Kind::kBroken:
    case Answer::Kind::kEnded:
      break;
  }
  const bool ended = answer.kind == Answer::Kind::kEnded;
  if (transfer.object == nullptr) {
    if (ended) return Outcome::kDone;
    discard(transfer);  // a text is not resumed: its length is not known
    return again(transfer, answer.cause);
  }
  const bool complete = transfer.have == transfer.object->size;
  return ended || complete ? check_object(transfer) : again(transfer, answer.cause);
}

/// Verifies an object that was received; tries again if it is wrong, from the start if it is not a
/// part of the right one.
Outcome Attempts::check_object(Transfer& transfer) {
  bool right = false;
  bool page = false;
  const ObjectRequest& object = *transfer.object;
  if (const auto file = object.folder->map(transfer.part_name())) {
    const std::string_view bytes(reinterpret_cast<const char*>(file->bytes().data()),
                                 file->bytes().size());
    right = bytes.size() == object.size && object_id(file->bytes()) == object.id;
    page = is_web_page(bytes.substr(0, kStart));
  }
  if (!right && !page && transfer.have < object.size) {
    return again(transfer, "the connection ended early");
  }
  if (!right) {
    ++stats_.corrupt;
    discard(transfer);
    if (!is_server_) {  // reading it again gives the same
      transfer.error = {kExitMixed, "fetch.damaged", address_of(transfer),
                        "the file differs from the published one", "copy the release again, whole"};
      return Outcome::kFailed;
    }
    return again(transfer, page ? kWebPage : "the received data differs from the published data");
  }
  if (auto moved = object.folder->rename(transfer.part_name(), to_hex(object.id)); !moved) {
    transfer.error = moved.error();
    return Outcome::kFailed;
  }
  return Outcome::kDone;
}

/// Schedules another attempt, unless too many in a row received no data.
Outcome Attempts::again(Transfer& transfer, const std::string& cause) {
  const bool progress = transfer.have >= transfer.furthest + kLeastProgress;
  transfer.furthest = std::max(transfer.furthest, transfer.have);
  transfer.fruitless = progress ? 0 : transfer.fruitless + 1;
  if (transfer.fruitless >= options_.attempts) {
    transfer.error = {kExitNetwork, "fetch.network", address_of(transfer),
                      transfer.fruitless == 1
                          ? cause
                          : cause + ", " + std::to_string(transfer.fruitless) + " times in a row",
                      "check address and network, and run modar-fetch again: it resumes where it "
                      "stopped"};
    return Outcome::kFailed;
  }
  ++stats_.retries;
  const double wait = std::min(options_.max_wait_s,
                               options_.first_wait_s * std::exp2(double(transfer.fruitless) - 1));
  transfer.not_before =
      Transfer::Clock::now() +
      std::chrono::duration_cast<Transfer::Clock::duration>(std::chrono::duration<double>(wait));
  if (options_.waiting) {
    options_.waiting(
        {address_of(transfer), cause, transfer.fruitless + 1, options_.attempts, wait});
  }
  return Outcome::kAgain;
}

}  // namespace modar::fetch
