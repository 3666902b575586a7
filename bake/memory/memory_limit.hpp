// Work out of core: large arrays live in files while a limit stands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "formats/error.hpp"

namespace modar {

/// While one stands, blocks of Array from some megabytes on are mapped from nameless files instead
/// of memory, and a thread of its own watches the process's resident size: before it reaches the
/// limit, pages of those files are taken out of the process (the system writes them to disk where
/// it needs the room). What the program computes stays the same, to the bit. Holds what is in
/// arrays; what is elsewhere has to fit besides. At most one at a time; blocks may outlive it.
class MemoryLimit {
 public:
  /// folder: for the files, which take up to what the arrays hold. Errors: kIo "memory.folder"
  /// where no file can be made there; kUnsupported "memory.small" below kLeast.
  static Result<std::unique_ptr<MemoryLimit>> start(const std::string& folder, std::uint64_t bytes);
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;
  ~MemoryLimit();

  static constexpr std::uint64_t kLeast = 64'000'000;

 private:
  struct Watch;
  explicit MemoryLimit(std::unique_ptr<Watch> watch);
  std::unique_ptr<Watch> watch_;
};

namespace detail {
/// A block of whole pages in a file of its own; nullptr where no limit stands.
void* map_file_block(std::size_t size);
/// Grows or shrinks such a block; nullptr where `block` is none.
void* resize_file_block(void* block, std::size_t old_size, std::size_t size);
/// Answers whether `block` was such a block, and is gone.
bool free_file_block(void* block);
}  // namespace detail

}  // namespace modar
