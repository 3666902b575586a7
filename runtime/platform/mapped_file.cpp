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
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
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
  return mapped;
}

MappedFile::MappedFile(MappedFile&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  if (this != &other) {
    unmap(bytes_);
    bytes_ = std::exchange(other.bytes_, {});
  }
  return *this;
}

MappedFile::~MappedFile() {
  unmap(bytes_);
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
