// A release on a stick or a mounted disk: read by this program alone, since it is not signed yet.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <utility>

#include "downloader.hpp"

namespace modar::fetch {
namespace {

/// The characters that an address writes as %XX.
std::string unescaped(const std::string& text) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape =
        text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0;
    out += escape ? static_cast<char>(16 * digit(text[i + 1]) + digit(text[i + 2])) : text[i];
    if (escape) i += 2;
  }
  return out;
}

/// Closes itself.
struct Descriptor {
  int number;
  explicit Descriptor(int descriptor) : number(descriptor) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

tl::unexpected<Error> unreadable(const std::string& path, int number) {
  const bool missing = number == ENOENT || number == ENOTDIR;
  return fail(ExitCode::kIo, missing ? "fetch.missing" : "fetch.folder", path,
              std::strerror(number), "check the folder");
}

class FolderReader {
 public:
  FolderReader(std::string folder, std::uint64_t bytes_per_second)
      : folder_(std::move(folder)), bytes_per_second_(bytes_per_second) {}

  Result<void> operator()(const std::string& path, std::uint64_t offset,
                          const std::function<bool(std::span<const std::byte>)>& sink) {
    const std::string whole = folder_ + "/" + path;
    // Opening a pipe must not wait for somebody to write to it.
    const Descriptor file(::open(whole.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.number < 0) return unreadable(whole, errno);
    struct stat status {};
    if (::fstat(file.number, &status) != 0) return unreadable(whole, errno);
    if (!S_ISREG(status.st_mode)) return unreadable(whole, EINVAL);
    for (;;) {
      const ssize_t got = ::pread(file.number, block_.data(), room(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return unreadable(whole, errno);
      if (got == 0) return {};
      const auto size = static_cast<std::size_t>(got);
      if (!sink(std::as_bytes(std::span(block_.data(), size)))) return {};
      offset += size;
      wait_for(size);
    }
  }

 private:
  /// Bytes of one read: a tenth of a second's, where there is a limit.
  [[nodiscard]] std::size_t room() const {
    if (bytes_per_second_ == 0) return block_.size();
    return static_cast<std::size_t>(
        std::clamp<std::uint64_t>(bytes_per_second_ / 10, 1, block_.size()));
  }

  void wait_for(std::size_t bytes) const {
    if (bytes_per_second_ == 0) return;
    std::this_thread::sleep_for(std::chrono::duration<double>(
        static_cast<double>(bytes) / static_cast<double>(bytes_per_second_)));
  }

  std::string folder_;
  std::uint64_t bytes_per_second_;
  std::array<char, 65536> block_{};
};

}  // namespace

std::optional<std::string> release_folder(const std::string& url_or_folder) {
  constexpr std::string_view kScheme = "file://";
  std::string path = url_or_folder;
  if (path.starts_with(kScheme)) {
    path = unescaped(path.substr(kScheme.size()));
    if (path.starts_with("localhost/")) path.erase(0, std::string_view("localhost").size());
  } else if (path.find("://") != std::string::npos) {
    return std::nullopt;
  }
  char* absolute = ::realpath(path.c_str(), nullptr);
  const std::string folder = absolute == nullptr ? "" : absolute;
  std::free(absolute);
  struct stat status {};
  if (folder.empty() || ::stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return "";
  return folder;
}

ByteSource folder_source(std::string folder, std::uint64_t bytes_per_second) {
  return FolderReader(std::move(folder), bytes_per_second);
}

}  // namespace modar::fetch
