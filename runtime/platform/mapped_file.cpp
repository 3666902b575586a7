// Maps a file for reading with mmap.
#include "modar/mapped_file.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace modar {
namespace {

/// A descriptor that is closed when the function ends: a mapping outlives it.
struct Descriptor {
  int value = -1;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

void unmap(std::span<const std::byte> bytes) {
  if (!bytes.empty()) ::munmap(const_cast<std::byte*>(bytes.data()), bytes.size());
}

}  // namespace

Result<MappedFile> MappedFile::open(const std::string& path) {
  // Opening a pipe must not wait for somebody to write to it.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.value < 0) {
    return fail(ExitCode::kIo, "io.open", path, std::strerror(errno),
                "check the path and its permissions");
  }
  struct stat status {};
  if (::fstat(file.value, &status) != 0 || !S_ISREG(status.st_mode)) {
    return fail(ExitCode::kIo, "io.map", path, "this is not a regular file", "name a file");
  }
  if (status.st_size == 0) {
    return fail(ExitCode::kInvalidInput, "io.empty", path, "the file is empty",
                "make it again, or copy it again");
  }
  const std::size_t size = static_cast<std::size_t>(status.st_size);
  void* const address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.value, 0);
  if (address == MAP_FAILED) {
    return fail(ExitCode::kIo, "io.map", path, std::strerror(errno),
                "free some memory or address space");
  }
  // Opening touches the tables only: without this, the kernel would read payload pages ahead that
  // may never be drawn.
  ::madvise(address, size, MADV_RANDOM);
  MappedFile mapped;
  mapped.bytes_ = {static_cast<const std::byte*>(address), size};
  mapped.mapped_ = mapped.bytes_;
  return mapped;
}

Result<MappedFile> MappedFile::open(int descriptor, std::uint64_t offset, std::uint64_t length) {
  struct stat status {};
  const std::string where = "descriptor " + std::to_string(descriptor);
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    return fail(ExitCode::kIo, "io.map", where, "this is not a regular file", "open a file");
  }
  const std::uint64_t file_size = static_cast<std::uint64_t>(status.st_size);
  if (length == 0 || offset > file_size || length > file_size - offset || length > SIZE_MAX / 2) {
    return fail(ExitCode::kUsage, "io.range", where, "the file does not hold that range",
                "pass the asset's own offset and length");
  }
  const std::size_t size = static_cast<std::size_t>(length);
  MappedFile part;
  if (offset % alignof(std::uint64_t) != 0) {
    part.copy_.reset(new std::byte[size]);
    for (std::size_t at = 0; at < size;) {
      const ssize_t got =
          ::pread(descriptor, part.copy_.get() + at, size - at, static_cast<off_t>(offset + at));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) {
        return fail(ExitCode::kIo, "io.map", where,
                    got < 0 ? std::strerror(errno) : "the file ends early", "check the file");
      }
      at += static_cast<std::size_t>(got);
    }
    part.bytes_ = {part.copy_.get(), size};
    return part;
  }
  const std::uint64_t lead = offset % static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  const std::size_t whole = size + static_cast<std::size_t>(lead);
  void* const address =
      ::mmap(nullptr, whole, PROT_READ, MAP_PRIVATE, descriptor, static_cast<off_t>(offset - lead));
  if (address == MAP_FAILED) {
    return fail(ExitCode::kIo, "io.map", where, std::strerror(errno),
                "free some memory or address space");
  }
  ::madvise(address, whole, MADV_RANDOM);
  part.mapped_ = {static_cast<const std::byte*>(address), whole};
  part.bytes_ = part.mapped_.subspan(static_cast<std::size_t>(lead));
  return part;
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : bytes_(std::exchange(other.bytes_, {})),
      mapped_(std::exchange(other.mapped_, {})),
      copy_(std::move(other.copy_)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  if (this != &other) {
    unmap(mapped_);
    bytes_ = std::exchange(other.bytes_, {});
    mapped_ = std::exchange(other.mapped_, {});
    copy_ = std::move(other.copy_);
  }
  return *this;
}

MappedFile::~MappedFile() {
  unmap(mapped_);
}

void expect_reading(std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  const std::uintptr_t page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t address = reinterpret_cast<std::uintptr_t>(bytes.data());
  const std::size_t lead = address % page;
  void* const start = const_cast<std::byte*>(bytes.data()) - lead;
  ::madvise(start, bytes.size() + lead, MADV_WILLNEED);
}

void forget_read(std::span<const std::byte> bytes) {
  const std::uintptr_t page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t address = reinterpret_cast<std::uintptr_t>(bytes.data());
  // Whole pages only: others share theirs with bytes that may be wanted.
  const std::uintptr_t first = (address + page - 1) / page * page;
  const std::uintptr_t end = (address + bytes.size()) / page * page;
  if (first >= end) return;
  ::madvise(const_cast<std::byte*>(bytes.data()) + (first - address), end - first, MADV_DONTNEED);
}

}  // namespace modar
