// Maps a file for reading with mmap.
#include "modar/mapped_file.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats/base/lost_pages.hpp"
#include "formats/base/path.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// A mapping that the handler may look at: entries are reused and never freed. end is 0 in free
/// ones.
struct MappedRange {
  std::atomic<std::uintptr_t> begin{0};
  std::atomic<std::uintptr_t> end{0};
  std::atomic<bool> lost{false};
  MappedRange* next = nullptr;
};

namespace {

std::atomic<MappedRange*> ranges{nullptr};
struct sigaction previous_action;

std::array<std::int64_t, 4> stamp_of(const struct stat& status) {
  return {static_cast<std::int64_t>(status.st_dev), static_cast<std::int64_t>(status.st_ino),
          std::int64_t{status.st_size},
          std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec};
}

MappedRange* add_range(std::span<const std::byte> pages) {
  const auto begin = reinterpret_cast<std::uintptr_t>(pages.data());
  MappedRange* range = ranges;
  for (; range != nullptr; range = range->next) {
    std::uintptr_t free = 0;
    if (range->begin.compare_exchange_strong(free, begin)) break;
  }
  if (range == nullptr) {
    range = new MappedRange;
    range->begin = begin;
    range->next = ranges;
    while (!ranges.compare_exchange_weak(range->next, range)) continue;
  }
  range->end = begin + pages.size();
  return range;
}

void remove_range(MappedRange* range) {
  if (range == nullptr) return;
  range->end = 0;
  if (range->lost.exchange(false)) --lost_mappings;
  range->begin = 0;
}

/// Replaces the pages from the fault to the end of its mapping by zeros. False: it is in no
/// mapping.
bool fill_lost_pages(const void* fault) {
  const auto address = reinterpret_cast<std::uintptr_t>(fault);
  for (MappedRange* range = ranges; range != nullptr; range = range->next) {
    const std::uintptr_t end = range->end;
    if (address >= end || address < range->begin) continue;
    const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    const std::uintptr_t first = address / page * page;
    if (::mmap(reinterpret_cast<void*>(first), end - first, PROT_READ,
               MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) == MAP_FAILED) {
      return false;
    }
    if (!range->lost.exchange(true)) ++lost_mappings;
    return true;
  }
  return false;
}

void on_bus_error(int signal, siginfo_t* info, void* context) {
  const int number = errno;
  const bool ours = info->si_code == BUS_ADRERR && fill_lost_pages(info->si_addr);
  errno = number;
  if (ours) return;
  if ((previous_action.sa_flags & SA_SIGINFO) != 0) {
    return previous_action.sa_sigaction(signal, info, context);
  }
  if (previous_action.sa_handler != SIG_DFL && previous_action.sa_handler != SIG_IGN) {
    return previous_action.sa_handler(signal);
  }
  // The access is repeated without a handler, or the signal sent again, and ends the process.
  ::signal(signal, SIG_DFL);
  if (info->si_code <= 0) ::raise(signal);
}

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
    return missing_file(path, {ExitCode::kIo, "io.open", path, std::strerror(errno),
                               "check the path and its permissions"});
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
  mapped.range_ = add_range(mapped.mapped_);
  mapped.path_ = path;
  mapped.stamp_ = stamp_of(status);
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
  part.range_ = add_range(part.mapped_);
  part.bytes_ = part.mapped_.subspan(static_cast<std::size_t>(lead));
  return part;
}

Result<void> MappedFile::intact() const {
  struct stat status {};
  bool written = false;
  if (!path_.empty() && ::stat(path_.c_str(), &status) == 0) {
    const auto now = stamp_of(status);
    written = now != stamp_ && now[0] == stamp_[0] && now[1] == stamp_[1];
  }
  if (!written && (range_ == nullptr || !range_->lost)) return {};
  return fail(ExitCode::kIo, "io.changed", path_,
              "the file was changed, cut short or removed with its disk while it was in use",
              "try again; replace a file in use by renaming the new one over it (mv)");
}

Result<void> MappedFile::keep(std::size_t size) {
#ifndef __EMSCRIPTEN__  // where mapping is copying
  if (mapped_.empty()) return {};
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto lead = static_cast<std::size_t>(bytes_.data() - mapped_.data());
  const std::size_t whole = (std::min(lead + size, mapped_.size()) + page - 1) / page * page;
  void* const copy =
      ::mmap(nullptr, whole, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (copy != MAP_FAILED) {
    std::memcpy(copy, mapped_.data(), std::min(whole, mapped_.size()));
    ::mprotect(copy, whole, PROT_READ);
  }
  if (copy == MAP_FAILED || ::mremap(copy, whole, whole, MREMAP_MAYMOVE | MREMAP_FIXED,
                                     const_cast<std::byte*>(mapped_.data())) == MAP_FAILED) {
    return fail(ExitCode::kIo, "io.map", path_, std::strerror(errno),
                "free some memory or address space");
  }
#endif
  return {};
}

Result<BundleView> open_bundle(MappedFile& file) {
  constexpr std::uint32_t kPayloads = 256;  // the first type that is no table or small text
  auto view = BundleView::open(file.bytes());
  if (view) {
    std::uint64_t tables = file.bytes().size();
    for (const SectionEntry& section : view->sections()) {
      if (section.type >= kPayloads) tables = std::min(tables, section.offset);
    }
    MODAR_TRY(file.keep(static_cast<std::size_t>(tables)));
    view = BundleView::open(file.bytes());
  }
  return file.settle(std::move(view));
}

MappedFile::MappedFile(MappedFile&& other) noexcept {
  *this = std::move(other);
}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(stamp_, other.stamp_);
  std::swap(range_, other.range_);
  std::swap(bytes_, other.bytes_);
  std::swap(mapped_, other.mapped_);
  std::swap(copy_, other.copy_);
  return *this;
}

MappedFile::~MappedFile() {
  remove_range(range_);
  unmap(mapped_);
}

void guard_mapped_files() {
  static const bool installed = [] {
    struct sigaction action {};
    action.sa_sigaction = on_bus_error;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    ::sigemptyset(&action.sa_mask);
    return ::sigaction(SIGBUS, &action, &previous_action) == 0;
  }();
  static_cast<void>(installed);
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
