#include "files.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace modar::fetch {
namespace {

tl::unexpected<Error> io(const char* code, const std::string& path, const char* cure) {
  return fail(ExitCode::kIo, code, path, std::strerror(errno), cure);
}

constexpr const char* kStoreCure = "see that the store's folder can be written and has room";

}  // namespace

Result<void> make_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0755) == 0) return {};
  struct stat info {};
  if (errno == EEXIST && ::stat(path.c_str(), &info) == 0 && S_ISDIR(info.st_mode)) return {};
  return io("io.create", path, kStoreCure);
}

std::vector<std::string> list_folder(const std::string& path) {
  std::vector<std::string> names;
  DIR* folder = ::opendir(path.c_str());
  if (folder == nullptr) return names;
  while (const dirent* entry = ::readdir(folder)) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  ::closedir(folder);
  std::sort(names.begin(), names.end());
  return names;
}

Result<void> empty_folder(const std::string& path) {
  for (const std::string& name : list_folder(path)) {
    if (auto gone = remove_file(path + "/" + name); !gone) return gone;
  }
  return {};
}

std::optional<std::string> read_small_file(const std::string& path, std::size_t limit) {
  const auto size = file_size(path);
  if (!size || *size > limit) return std::nullopt;
  std::FILE* file = std::fopen(path.c_str(), "rbe");
  if (file == nullptr) return std::nullopt;
  std::string text(*size, '\0');
  const bool whole = std::fread(text.data(), 1, text.size(), file) == text.size();
  std::fclose(file);
  if (!whole) return std::nullopt;
  return text;
}

std::optional<std::uint64_t> file_size(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
  return static_cast<std::uint64_t>(info.st_size);
}

Result<void> remove_file(const std::string& path) {
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return io("io.remove", path, kStoreCure);
  return {};
}

Result<void> rename_file(const std::string& from, const std::string& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) return io("io.rename", to, kStoreCure);
  return {};
}

Result<void> sync_folder(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return io("io.sync", path, kStoreCure);
  const int synced = ::fsync(descriptor);
  ::close(descriptor);
  // Some file systems cannot sync a folder and say so; there is nothing more to do on them.
  if (synced != 0 && errno != EINVAL) return io("io.sync", path, kStoreCure);
  return {};
}

Result<void> switch_link(const std::string& path, const std::string& target) {
  const std::string beside = path + ".new";
  if (auto gone = remove_file(beside); !gone) return gone;
  if (::symlink(target.c_str(), beside.c_str()) != 0) return io("io.link", beside, kStoreCure);
  return rename_file(beside, path);
}

bool share_file(const std::string& path, const std::string& second) {
  return ::link(path.c_str(), second.c_str()) == 0;
}

std::string link_target(const std::string& path) {
  std::array<char, 4096> target{};
  const ssize_t size = ::readlink(path.c_str(), target.data(), target.size());
  return size > 0 ? std::string(target.data(), static_cast<std::size_t>(size)) : std::string();
}

Result<std::uint64_t> free_space(const std::string& path) {
  struct statvfs info {};
  if (::statvfs(path.c_str(), &info) != 0) return io("io.space", path, kStoreCure);
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

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

Result<OutputFile> OutputFile::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) return io("io.create", path, kStoreCure);
  return OutputFile(descriptor, path);
}

Result<void> OutputFile::write_at(std::uint64_t offset, const void* bytes, std::size_t size) {
  const char* from = static_cast<const char*>(bytes);
  while (size != 0) {
    const ssize_t done = ::pwrite(descriptor_, from, size, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return io("io.write", path_, kStoreCure);
    from += done;
    offset += static_cast<std::uint64_t>(done);
    size -= static_cast<std::size_t>(done);
  }
  return {};
}

Result<void> OutputFile::resize(std::uint64_t size) {
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) != 0)
    return io("io.write", path_, kStoreCure);
  return {};
}

Result<void> OutputFile::sync() {
  if (::fsync(descriptor_) != 0) return io("io.sync", path_, kStoreCure);
  return {};
}

}  // namespace modar::fetch
