// Downloads from a server or a folder, by libcurl: several at once, resumed where they were
// interrupted, retried with growing waits. Internal to runtime/fetch.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "folder.hpp"
#include "formats/base/error.hpp"
#include "formats/transport/recipe.hpp"
#include "modar/fetch.hpp"

namespace modar::fetch {

struct TransferOptions {
  std::string url;                     ///< http://, https://, file:// or a folder
  unsigned parallel = 4;               ///< transfers at once
  std::uint64_t bytes_per_second = 0;  ///< of all transfers together; 0: no limit
  unsigned attempts = 8;               ///< in a row without any data, then it gives up
  double first_wait_s = 0.5;           ///< before the second attempt; doubles up to max_wait_s
  double max_wait_s = 30;
  std::string user_agent;
  std::string authorities;  ///< PEM file; empty: of the environment, else the system's
  ByteSource source;        ///< instead of libcurl
  std::function<void(std::span<const FileNeed>)> needs;  ///< may be empty
  double stall_s = 30;  ///< a transfer without data for so long is aborted
  std::function<void(const FetchWait&)> waiting;  ///< may be empty
};

/// One object to download.
struct ObjectRequest {
  ObjectId id{};
  std::uint64_t size = 0;          ///< bytes
  std::string path;                ///< below the URL
  const Folder* folder = nullptr;  ///< its destination, under to_hex(id), with ".part" until it is
                                   ///< complete
};

struct TransferStats {
  std::uint64_t bytes = 0;  ///< of response bodies, useful or not
  std::uint32_t retries = 0;
  std::uint32_t corrupt = 0;  ///< objects that were complete and wrong, and were discarded
};

class Transfers {
 public:
  /// Errors: kUsage "fetch.url"; kInternal "fetch.curl".
  static Result<Transfers> create(const TransferOptions& options);
  Transfers(Transfers&&) noexcept;
  Transfers& operator=(Transfers&&) = delete;
  ~Transfers();

  /// A small file as text, at most `limit` bytes.
  /// Errors: kExitNetwork "fetch.network"; kExitMixed "fetch.missing" (the server has no such
  /// file).
  /// optional: "fetch.missing" at the first answer of that kind.
  Result<std::string> text(const std::string& path, std::size_t limit, bool optional = false);

  /// Downloads objects into their files, each verified by its id. `on_bytes` receives the number of
  /// bytes since the last call (negative: discarded). Errors: as text(); kIo "io.*"; kExitMixed
  /// "fetch.damaged" where a folder's file is not the published one.
  Result<void> objects(std::span<const ObjectRequest> requests,
                       const std::function<void(std::int64_t)>& on_bytes);

  [[nodiscard]] const TransferStats& stats() const;

 private:
  struct State;
  explicit Transfers(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar::fetch
