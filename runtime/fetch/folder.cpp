#include "folder.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "formats/base/atomic_file.hpp"
#include "modar/release.hpp"

namespace modar::fetch {
namespace {

constexpr const char* kStoreCure = "check that the store's folder is writable and has room";

tl::unexpected<Error> io(const char* code, const std::string& path, const char* cure = kStoreCure) {
  const bool full = errno == ENOSPC || errno == EDQUOT;
  return fail(full ? kExitNoSpace : ExitCode::kIo, code, path, std::strerror(errno), cure);
}

/// Closes itself.
struct Opened {
  int number;
  explicit Opened(int descriptor) : number(descriptor) {}
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  ~Opened() {
    if (number >= 0) ::close(number);
  }
};

/// Opens a regular file for reading; opening a pipe does not wait for somebody to write to it.
int open_regular(int folder, const std::string& name, int flags, struct stat& info) {
  const int file = ::openat(folder, name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | flags);
  if (file < 0) return -1;
  if (::fstat(file, &info) == 0 && S_ISREG(info.st_mode)) return file;
  ::close(file);
  errno = EINVAL;
  return -1;
}

std::optional<std::string> read_whole(int folder, const std::string& name, int flags,
                                      std::size_t limit) {
  struct stat info {};
  const Opened file(open_regular(folder, name, flags, info));
  if (file.number < 0 || static_cast<std::uint64_t>(info.st_size) > limit) return std::nullopt;
  std::string text(static_cast<std::size_t>(info.st_size), '\0');
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t got = ::read(file.number, text.data() + at, text.size() - at);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return std::nullopt;
    at += static_cast<std::size_t>(got);
  }
  return text;
}

}  // namespace

OutputFile::OutputFile(int descriptor, std::string path)
    : descriptor_(descriptor), path_(std::move(path)) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  return *this;
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<void> OutputFile::write_at(std::uint64_t offset, const void* bytes, std::size_t size) {
  const char* from = static_cast<const char*>(bytes);
  while (size != 0) {
    const ssize_t done = ::pwrite(descriptor_, from, size, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return io("io.write", path_);
    from += done;
    offset += static_cast<std::uint64_t>(done);
    size -= static_cast<std::size_t>(done);
  }
  return {};
}

Result<void> OutputFile::resize(std::uint64_t size) {
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) == 0) return {};
  // POSIX lets a file system refuse to make a file longer this way; some FAT drivers do.
  if (errno == EPERM && size != 0) return write_at(size - 1, "", 1);
  return io("io.write", path_);
}

Result<void> OutputFile::sync() {
  if (::fsync(descriptor_) != 0) return io("io.sync", path_);
  return {};
}

struct Folder::Descriptor : Opened {
  using Opened::Opened;
};

Folder::Folder(std::shared_ptr<const Descriptor> descriptor, std::string path)
    : descriptor_(std::move(descriptor)), path_(std::move(path)) {}

int Folder::number() const {
  return descriptor_->number;
}

Result<Folder> Folder::open(const std::string& path, bool make) {
  const bool made = make && ::mkdir(path.c_str(), 0755) == 0;
  if (make && !made && errno != EEXIST) return io("io.create", path);
  if (made && !sync_folder(path + "/..")) return io("io.sync", path);
  auto opened =
      std::make_shared<const Descriptor>(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened->number < 0) return io("io.create", path);
  return Folder(std::move(opened), path);
}

Result<Folder> Folder::below(const std::string& name, bool make) const {
  const std::string path = path_of(name);
  if (make && ::mkdirat(number(), name.c_str(), 0755) != 0 && errno != EEXIST) {
    return io("io.create", path);
  }
  auto opened = std::make_shared<const Descriptor>(
      ::openat(number(), name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW));
  if (opened->number >= 0) return Folder(std::move(opened), path);
  if (errno != ENOENT && !link_target(name).empty()) {
    return fail(ExitCode::kIo, "store.link", path, "it is a symbolic link",
                "remove the link; use --store for a store on another disk");
  }
  return io("io.create", path);
}

std::vector<std::string> Folder::list() const {
  std::vector<std::string> names;
  const int again = ::openat(number(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  DIR* folder = again < 0 ? nullptr : ::fdopendir(again);
  if (folder == nullptr) {
    if (again >= 0) ::close(again);
    return names;
  }
  while (const dirent* entry = ::readdir(folder)) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  ::closedir(folder);
  std::sort(names.begin(), names.end());
  return names;
}

bool Folder::has(const std::string& name) const {
  struct stat info {};
  return ::fstatat(number(), name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0;
}

std::optional<std::uint64_t> Folder::size(const std::string& name) const {
  struct stat info {};
  const int found = ::fstatat(number(), name.c_str(), &info, AT_SYMLINK_NOFOLLOW);
  if (found != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
  return static_cast<std::uint64_t>(info.st_size);
}

bool Folder::has_other_names(const std::string& name) const {
  struct stat info {};
  return ::fstatat(number(), name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0 && info.st_nlink > 1;
}

std::optional<std::string> Folder::read(const std::string& name, std::size_t limit) const {
  return read_whole(number(), name, O_NOFOLLOW, limit);
}

Result<MappedFile> Folder::map(const std::string& name) const {
  struct stat info {};
  const Opened file(open_regular(number(), name, O_NOFOLLOW, info));
  if (file.number < 0) return io("io.open", path_of(name), "run modar-fetch again");
  if (info.st_size == 0) {
    return fail(ExitCode::kInvalidInput, "io.empty", path_of(name), "the file is empty",
                "run modar-fetch again");
  }
  return MappedFile::open(file.number, 0, static_cast<std::uint64_t>(info.st_size));
}

Result<OutputFile> Folder::create(const std::string& name) const {
  MODAR_TRY(remove(name));
  const int descriptor =
      ::openat(number(), name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (descriptor < 0) return io("io.create", path_of(name));
  return OutputFile(descriptor, path_of(name));
}

Result<OutputFile> Folder::resume(const std::string& name) const {
  // O_NONBLOCK: a pipe without a reader refuses instead of waiting for one.
  const int descriptor =
      ::openat(number(), name.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  struct stat info {};
  if (descriptor < 0) return create(name);
  OutputFile file(descriptor, path_of(name));
  const bool ours = ::fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode) && info.st_nlink <= 1;
  return ours ? Result<OutputFile>(std::move(file)) : create(name);
}

Result<void> Folder::replace(const std::string& name, std::string_view text) const {
  const std::string beside = name + "." + std::to_string(::getpid()) + ".tmp";
  const auto written =
      create(beside)
          .and_then([&](OutputFile file) {
            return file.write_at(0, text.data(), text.size()).and_then([&] { return file.sync(); });
          })
          .and_then([&] { return rename(beside, name); })
          .and_then([&] { return sync(); });
  if (!written) ::unlinkat(number(), beside.c_str(), 0);
  return written;
}

Result<void> Folder::remove(const std::string& name) const {
  if (::unlinkat(number(), name.c_str(), 0) == 0 || errno == ENOENT) return {};
  return io("io.remove", path_of(name));
}

Result<void> Folder::rename(const std::string& from, const std::string& to) const {
  if (::renameat(number(), from.c_str(), number(), to.c_str()) == 0) return {};
  return io("io.rename", path_of(to));
}

Result<void> Folder::sync() const {
  // Some file systems cannot sync a folder; there is nothing more to do on them.
  if (::fsync(number()) != 0 && errno != EINVAL) return io("io.sync", path_);
  return {};
}

std::string Folder::link_target(const std::string& name) const {
  std::array<char, 4096> target{};
  const ssize_t size = ::readlinkat(number(), name.c_str(), target.data(), target.size());
  return size > 0 ? std::string(target.data(), static_cast<std::size_t>(size)) : std::string();
}

Result<bool> Folder::switch_link(const std::string& name, const std::string& target) const {
  const std::string beside = name + ".new";
  if (!link_target(beside).empty()) MODAR_TRY(remove(beside));
#ifdef __EMSCRIPTEN__  // whose symlinkat() takes its arguments in another order
  const int linked = ::symlink(target.c_str(), path_of(beside).c_str());
#else
  const int linked = ::symlinkat(target.c_str(), number(), beside.c_str());
#endif
  if (linked != 0) {
    // FAT and Android's shared storage.
    if (errno == EPERM || errno == EOPNOTSUPP || errno == ENOSYS || errno == EACCES) return false;
    return io("io.link", path_of(beside));
  }
  MODAR_TRY(rename(beside, name));
  return true;
}

Result<std::uint64_t> Folder::free_space() const {
  struct statvfs info {};
  if (::fstatvfs(number(), &info) != 0) return io("io.space", path_);
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

std::optional<std::string> read_small_file(const std::string& path, std::size_t limit) {
  return read_whole(AT_FDCWD, path, 0, limit);
}

}  // namespace modar::fetch
