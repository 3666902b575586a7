// The text of an OBJ file, in blocks of whole statements. Internal to the OBJ reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace modar {

/// A range of a file, mapped for as long as this object lives.
class MappedStretch {
 public:
  MappedStretch() = default;
  MappedStretch(void* pages, std::size_t page_bytes, std::string_view text)
      : pages_(pages), page_bytes_(page_bytes), text_(text) {}
  MappedStretch(MappedStretch&& other) noexcept { *this = std::move(other); }
  MappedStretch& operator=(MappedStretch&& other) noexcept {
    std::swap(pages_, other.pages_);
    std::swap(page_bytes_, other.page_bytes_);
    std::swap(text_, other.text_);
    return *this;
  }
  MappedStretch(const MappedStretch&) = delete;
  MappedStretch& operator=(const MappedStretch&) = delete;
  ~MappedStretch();

  [[nodiscard]] std::string_view text() const { return text_; }

 private:
  void* pages_ = nullptr;
  std::size_t page_bytes_ = 0;
  std::string_view text_;
};

/// Bytes by offset, from a file or from memory. Thread-safe. A large file is never in memory as a
/// whole: ranges of it are mapped (which saves a copy, half the cost of a plain read) or read.
class ByteSource {
 public:
  explicit ByteSource(std::string_view text) : text_(text), size_(text.size()) {}
  /// descriptor: of an open regular file; stays the caller's.
  ByteSource(int descriptor, std::uint64_t size) : descriptor_(descriptor), size_(size) {}

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// The bytes [offset, offset + count), fewer at the end of the file; empty where they cannot be
  /// mapped or the file has shrunk (reading a page beyond its end would kill the process).
  [[nodiscard]] MappedStretch map(std::uint64_t offset, std::size_t count) const;
  /// Copies up to `count` bytes from `offset` to `out`. Returns how many, -1 where reading failed.
  std::int64_t read(std::uint64_t offset, std::size_t count, char* out) const;

 private:
  std::string_view text_;
  int descriptor_ = -1;
  std::uint64_t size_;
};

enum class LoadResult { kLoaded, kEmpty, kFailed, kTooLarge };

/// The text of one block: mapped, or in a buffer of its own at the end of the file or where one
/// statement is very long.
struct BlockText {
  std::string_view text;    ///< whole statements, padded with kTextPadding readable bytes
  bool unfinished = false;  ///< the last line had no line end; one was added
  MappedStretch mapped;
  std::string buffer;
};

/// Loads the statements that begin in block `index` (those behind the end of a statement that lies
/// behind the start of the block), each up to its end. A statement longer than a block belongs to
/// the block where it begins; the blocks in its middle are empty.
class BlockLoader {
 public:
  /// start: offset of the first statement. source: outlives this.
  BlockLoader(const ByteSource& source, std::uint64_t start) : source_(source), start_(start) {}

  [[nodiscard]] std::uint64_t count() const;
  LoadResult load(std::uint64_t index, BlockText& block) const;

 private:
  LoadResult load_copy(std::uint64_t index, std::uint64_t from, std::uint64_t end,
                       BlockText& block) const;
  LoadResult load_to_statement_end(std::uint64_t end, std::string& text) const;

  const ByteSource& source_;
  std::uint64_t start_;
};

}  // namespace modar
