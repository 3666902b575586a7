// Writes a file next to its place, syncs it and renames it over the old one.
#include "formats/base/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <utility>

#include "formats/base/lost_pages.hpp"

namespace modar {
namespace {

constexpr int kMostLinks = 40;  // as Linux follows

std::string reason(const char* deed, int number) {
  return std::string(deed) + ": " + std::strerror(number);
}

/// A rename is durable once the folder that holds the names is synced too.
bool sync_folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return sync_folder(slash == std::string::npos ? "." : path.substr(0, slash == 0 ? 1 : slash));
}

/// Where a symbolic link leads to, so that the link stays; the path itself if it is no link.
std::string followed(const std::string& path) {
  std::string target = path;
  for (int links = 0; links < kMostLinks; ++links) {
    std::string text(PATH_MAX, '\0');
    const ssize_t length = ::readlink(target.c_str(), text.data(), text.size());
    if (length < 0) return target;
    text.resize(static_cast<std::size_t>(length));
    const std::size_t slash = target.rfind('/');
    const bool relative = !text.starts_with('/') && slash != std::string::npos;
    target.resize(relative ? slash + 1 : 0);
    target += text;
  }
  return path;  // links in a circle: opening it says so
}

}  // namespace

bool sync_folder(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  // Some file systems cannot sync a folder and say EINVAL; there is nothing more to do there.
  const bool synced = ::fsync(descriptor) == 0 || errno == EINVAL;
  ::close(descriptor);
  return synced;
}

const char* cure_of_writing(int number) {
  switch (number) {
    case ENOSPC:
    case EDQUOT:
      return "make room on the disk and try again";
    case EFBIG:
      return "use a disk whose file system takes files of this size";
    case EIO:
      return "check the disk";
    case EINVAL:
    case EILSEQ:
    case ENAMETOOLONG:
      return "rename the file: the disk's file system does not take its name";
    default:
      return "check that the folder exists and may be written";
  }
}

AtomicFile::AtomicFile(int descriptor, std::string path, std::string temporary, Leftover leftover)
    : descriptor_(descriptor),
      path_(std::move(path)),
      temporary_(std::move(temporary)),
      leftover_(std::move(leftover)) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, std::string())),
      leftover_(std::move(other.leftover_)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  const auto refused = [&path] {
    return fail(ExitCode::kIo, "io.create", path, reason("cannot create the file", errno),
                cure_of_writing(errno));
  };
  const std::string target = followed(path);
  struct stat old {};
  const bool there = ::stat(target.c_str(), &old) == 0;
  if (!there && errno == ELOOP) return refused();
  if (there && !S_ISREG(old.st_mode)) {
    // A device, a pipe or a socket is written to, not replaced; a folder refuses by itself.
    const int descriptor = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    return descriptor < 0 ? Result<AtomicFile>(refused()) : AtomicFile(descriptor, target, "", {});
  }
  std::string temporary = target + "." + std::to_string(::getpid()) + ".tmp";
  // What an interrupted process of this number left is removed, whatever it is: never written to.
  ::unlink(temporary.c_str());
  Leftover leftover(temporary);  // before the file is there: a signal may come at any time
  const int descriptor =
      ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor < 0) return refused();
  if (there) {
    // As the file that is replaced. Only its owner or root may give it away; others are replaced
    // themselves, as editors do.
    [[maybe_unused]] const int given = ::fchown(descriptor, old.st_uid, old.st_gid);
    const bool moded = ::fchmod(descriptor, old.st_mode & 07777) == 0;
    // FAT and the like have no modes of their own.
    if (!moded && errno != ENOSYS && errno != EPERM && errno != EOPNOTSUPP) {
      const int number = errno;
      ::close(descriptor);
      ::unlink(temporary.c_str());
      errno = number;
      return refused();
    }
  }
  return AtomicFile(descriptor, target, std::move(temporary), std::move(leftover));
}

Result<void> AtomicFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return fail(ExitCode::kIo, "io.write", path_, reason("cannot write", errno),
                  cure_of_writing(errno));
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> AtomicFile::commit() {
  const auto failed = [this](const char* deed) {
    return fail(ExitCode::kIo, "io.commit", path_, reason(deed, errno),
                "check the disk; the old file, if there was one, is unchanged");
  };
  if (descriptor_ < 0) {
    return fail(ExitCode::kInternal, "io.commit", path_, "the file was committed before", "");
  }
  if (lost_mappings != 0) {
    return fail(ExitCode::kIo, "io.changed", path_,
                "an input was cut short or removed with its disk while it was read",
                "try again; the old file, if there was one, is unchanged");
  }
  if (temporary_.empty()) {  // no regular file: there is nothing to sync and to rename
    if (::close(std::exchange(descriptor_, -1)) != 0) return failed("cannot close");
    return {};
  }
  if (::fsync(descriptor_) != 0) return failed("cannot sync");
  // close() gives the descriptor back even where it fails, so it is never closed twice.
  if (::close(std::exchange(descriptor_, -1)) != 0) return failed("cannot close");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) return failed("cannot rename");
  temporary_.clear();
  if (!sync_folder_of(path_)) {
    return fail(ExitCode::kIo, "io.commit", path_, reason("cannot sync the folder", errno),
                "the new file is written, but may not survive a power cut; check the disk");
  }
  return {};
}

Result<void> write_file(const std::string& path, std::string_view text) {
  return write_file(path, std::as_bytes(std::span(text.data(), text.size())));
}

Result<void> write_file(const std::string& path, std::span<const std::byte> bytes) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(std::move(file.error()));
  if (auto written = file->write(bytes); !written) return written;
  return file->commit();
}

}  // namespace modar
