// Memory of large arrays.
#include "bake/memory/array.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "bake/memory/memory_limit.hpp"

namespace modar::detail {
namespace {

/// Alignment that lets the system use huge pages. madvise is not called: first touch of huge pages
/// is slower in virtual machines.
constexpr std::size_t kHugePage = std::size_t{2} << 20;

/// Pages are made resident in stretches of this size: what the last one of an array wastes at most.
constexpr std::size_t kTouched = std::size_t{256} << 10;

std::size_t to_pages(std::size_t size) {
  return (size + kHugePage - 1) / kHugePage * kHugePage;
}

/// Fresh address space, aligned to a huge page; none of it is in memory yet.
void* map_memory(std::size_t size) {
  const std::size_t wide = size + kHugePage;
  void* const at = ::mmap(nullptr, wide, PROT_READ | PROT_WRITE,
                          MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) out_of_memory();
  const auto address = reinterpret_cast<std::uintptr_t>(at);
  const std::size_t ahead = (kHugePage - address % kHugePage) % kHugePage;
  char* const first = static_cast<char*>(at) + ahead;
  if (ahead != 0) ::munmap(at, ahead);
  if (ahead != kHugePage) ::munmap(first + size, kHugePage - ahead);
  return first;
}

void* map(std::size_t size) {
  void* const in_file = map_file_block(size);
  return in_file != nullptr ? in_file : map_memory(size);
}

/// Grows or shrinks a large block; pages are remapped, not copied.
void* remap(void* block, std::size_t old_size, std::size_t size) {
  if (to_pages(old_size) == to_pages(size)) return block;
  if (void* const moved = resize_file_block(block, to_pages(old_size), to_pages(size))) {
    return moved;
  }
  if (size < old_size) {
    ::munmap(static_cast<char*>(block) + to_pages(size), to_pages(old_size) - to_pages(size));
    return block;
  }
  void* const at = map_memory(to_pages(size));
  void* const moved =
      ::mremap(block, to_pages(old_size), to_pages(size), MREMAP_MAYMOVE | MREMAP_FIXED, at);
  if (moved == MAP_FAILED) out_of_memory();
  return moved;
}

}  // namespace

void out_of_memory() {
  throw std::bad_alloc();
}

void* resize_block(void* block, std::size_t old_size, std::size_t size) {
  const bool was_large = block != nullptr && old_size >= kLargeBlock;
  void* result = nullptr;
  if (was_large && size >= kLargeBlock) {
    result = remap(block, old_size, size);
  } else if (!was_large && size < kLargeBlock) {
    result = std::realloc(block, size);
    if (result == nullptr) out_of_memory();
    return result;
  } else {
    result = size >= kLargeBlock ? map(to_pages(size)) : std::malloc(size);
    if (result == nullptr) out_of_memory();
    if (block != nullptr) std::memcpy(result, block, std::min(old_size, size));
    free_block(block, old_size);
  }
  return result;
}

void touch_pages(void* block, std::size_t size, std::size_t from, std::size_t to) {
#ifdef MADV_POPULATE_WRITE
  const auto round_up = [](std::size_t at) { return (at + kTouched - 1) / kTouched * kTouched; };
  if (size < kLargeBlock || round_up(from) == round_up(to) || has_file_blocks()) return;
  const std::size_t end = std::min(round_up(to), to_pages(size));
  // Linux before 5.14 does not know it, and then each page is touched when it is written.
  ::madvise(static_cast<char*>(block) + round_up(from), end - round_up(from), MADV_POPULATE_WRITE);
#endif
}

void free_block(void* block, std::size_t size) {
  if (block == nullptr) return;
  if (size >= kLargeBlock) {
    if (!free_file_block(block)) ::munmap(block, to_pages(size));
  } else {
    std::free(block);
  }
}

}  // namespace modar::detail
