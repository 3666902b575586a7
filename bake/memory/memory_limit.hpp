// Out-of-core work: large arrays live in files while a memory limit is set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "formats/base/error.hpp"

namespace modar {

/// While one exists, blocks of Array from some megabytes on are mapped from nameless files instead
/// of memory, and a thread watches the process's resident size: near the limit, the pages of those
/// files are unmapped from the process (the system writes them to disk when it needs the memory).
/// Results stay the same to the bit. Only arrays are limited; everything else has to fit
/// besides. At most one at a time; blocks may outlive it.
class MemoryLimit {
 public:
  /// folder: for the files, which grow to the size of the arrays. Errors: kIo "memory.folder"
  /// where no file can be made there; kUnsupported "memory.small" below kMinMemoryLimit.
  static Result<std::unique_ptr<MemoryLimit>> start(const std::string& folder, std::uint64_t bytes);
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;
  ~MemoryLimit();

  static constexpr std::uint64_t kMinMemoryLimit = 64'000'000;

 private:
  struct Watch;
  explicit MemoryLimit(std::unique_ptr<Watch> watch);
  std::unique_ptr<Watch> watch_;
};

namespace detail {
/// A block of whole pages in a file of its own; nullptr where no limit is set.
void* map_file_block(std::size_t size);
/// Grows or shrinks such a block; nullptr where `block` is not one.
void* resize_file_block(void* block, std::size_t old_size, std::size_t size);
/// Whether there is such a block.
bool has_file_blocks();
/// Frees such a block; false where `block` is not one.
bool free_file_block(void* block);
}  // namespace detail

}  // namespace modar
