// Arrays in nameless files, and the thread that drops their pages near the limit.
#include "bake/memory/memory_limit.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

#include "bake/memory/array.hpp"

namespace modar {
namespace {

/// Time between two looks at the resident size. Longer may exceed the limit before the next look.
constexpr auto kPause = std::chrono::milliseconds(1);
/// Share of the limit at which pages are dropped. The rest is for pages touched until the next
/// look.
constexpr double kHigh = 0.82;

struct FileBlock {
  std::size_t size = 0;
  int descriptor = -1;
};

/// All blocks in files, by their address. One for the process, like the heap.
struct FileHeap {
  std::mutex mutex;
  std::string folder;
  std::map<char*, FileBlock> blocks;

  /// Unmaps all pages from the process. They stay in the system's cache, so touching them again
  /// costs a minor fault, unless the system needed the memory.
  void drop_pages() {
    const std::lock_guard lock(mutex);
    for (const auto& [at, block] : blocks) ::madvise(at, block.size, MADV_DONTNEED);
  }
};

FileHeap& file_heap() {
  static FileHeap heap;
  return heap;
}
std::atomic<bool> spilling{false};
std::atomic<std::size_t> file_blocks{0};

int nameless_file(const std::string& folder) {
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0) return descriptor;
  std::string name = folder + "/.modar-XXXXXX";  // for file systems without O_TMPFILE
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

/// Allocates space on the disk: a page without it would kill the process later.
bool allocate(int descriptor, std::size_t size) {
  if (::fallocate(descriptor, 0, 0, static_cast<off_t>(size)) == 0) return true;
  return errno == EOPNOTSUPP && ::ftruncate(descriptor, static_cast<off_t>(size)) == 0;
}

std::uint64_t resident_bytes(int statm) {
  char text[128];
  const ssize_t size = ::pread(statm, text, sizeof text, 0);
  if (size <= 0) return 0;
  const char* const second = std::find(text, text + size, ' ');
  std::uint64_t pages = 0;
  if (second != text + size) std::from_chars(second + 1, text + size, pages);
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

struct MemoryLimit::Watch {
  std::uint64_t bytes = 0;
  int statm = -1;
  std::mutex mutex;
  std::condition_variable wake;
  bool over = false;
  std::thread thread;

  void run() {
    const auto high = static_cast<std::uint64_t>(kHigh * static_cast<double>(bytes));
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, kPause, [&] { return over; })) {
      if (resident_bytes(statm) > high) file_heap().drop_pages();
    }
  }
};

MemoryLimit::MemoryLimit(std::unique_ptr<Watch> watch) : watch_(std::move(watch)) {}

Result<std::unique_ptr<MemoryLimit>> MemoryLimit::start(const std::string& folder,
                                                        std::uint64_t bytes) {
  if (bytes < kMinMemoryLimit) {
    return fail(ExitCode::kUnsupported, "memory.small", "--memory",
                "the program itself needs more than that",
                "allow at least " + std::to_string(kMinMemoryLimit / 1'000'000) + "M");
  }
  const int trial = nameless_file(folder);
  if (trial < 0) {
    return fail(ExitCode::kIo, "memory.folder", folder, std::strerror(errno),
                "write the bundle into a folder where files can be made");
  }
  ::close(trial);
  auto watch = std::make_unique<Watch>();
  watch->bytes = bytes;
  watch->statm = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  {
    FileHeap& heap = file_heap();
    const std::lock_guard lock(heap.mutex);
    heap.folder = folder;
  }
  spilling = true;
  Watch& running = *watch;
  watch->thread = std::thread([&running] { running.run(); });
  return std::unique_ptr<MemoryLimit>(new MemoryLimit(std::move(watch)));
}

MemoryLimit::~MemoryLimit() {
  spilling = false;
  {
    const std::lock_guard lock(watch_->mutex);
    watch_->over = true;
  }
  watch_->wake.notify_all();
  watch_->thread.join();
  if (watch_->statm >= 0) ::close(watch_->statm);
}

namespace detail {

void* map_file_block(std::size_t size) {
  if (!spilling) return nullptr;
  FileHeap& heap = file_heap();
  const std::lock_guard lock(heap.mutex);
  const int descriptor = nameless_file(heap.folder);
  if (descriptor < 0) out_of_memory();
  void* const at = allocate(descriptor, size)
                       ? ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0)
                       : MAP_FAILED;
  if (at == MAP_FAILED) {
    ::close(descriptor);
    out_of_memory();
  }
  heap.blocks[static_cast<char*>(at)] = {size, descriptor};
  ++file_blocks;
  return at;
}

void* resize_file_block(void* block, std::size_t old_size, std::size_t size) {
  if (file_blocks == 0) return nullptr;
  FileHeap& heap = file_heap();
  const std::lock_guard lock(heap.mutex);
  const auto found = heap.blocks.find(static_cast<char*>(block));
  if (found == heap.blocks.end()) return nullptr;
  const int descriptor = found->second.descriptor;
  if (size > old_size && !allocate(descriptor, size)) out_of_memory();
  void* const moved = ::mremap(block, old_size, size, MREMAP_MAYMOVE);
  if (moved == MAP_FAILED) out_of_memory();
  // Best effort: parts beyond the end only take disk space.
  if (size < old_size && ::ftruncate(descriptor, static_cast<off_t>(size)) != 0) errno = 0;
  heap.blocks.erase(found);
  heap.blocks[static_cast<char*>(moved)] = {size, descriptor};
  return moved;
}

bool has_file_blocks() {
  return file_blocks != 0;
}

bool free_file_block(void* block) {
  if (file_blocks == 0) return false;
  FileHeap& heap = file_heap();
  const std::lock_guard lock(heap.mutex);
  const auto found = heap.blocks.find(static_cast<char*>(block));
  if (found == heap.blocks.end()) return false;
  ::munmap(block, found->second.size);
  ::close(found->second.descriptor);
  heap.blocks.erase(found);
  --file_blocks;
  return true;
}

}  // namespace detail
}  // namespace modar
