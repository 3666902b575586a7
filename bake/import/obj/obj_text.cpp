// Maps and reads stretches of a file, and cuts them into blocks of whole statements.
#include "bake/import/obj/obj_text.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "bake/import/obj/number_parser.hpp"
#include "bake/import/obj/obj_block.hpp"

namespace modar {
namespace {

/// Small enough for the text and what it parses to to stay in a core's second-level cache; set by
/// hand.
constexpr std::uint64_t kBlockBytes = std::uint64_t{1} << 18;
constexpr std::uint64_t kMaxStatement = std::uint64_t{1} << 30;  ///< bytes; the format has no limit
/// Bytes looked at ahead of a block to see whether its first line continues another: "\\\r\n".
constexpr std::uint64_t kContext = 3;
/// Bytes mapped behind a block to find the end of its last statement; longer ones are read again.
constexpr std::size_t kSlack = 4096;

/// Where the block's own statements begin; false where none does.
bool find_first(std::uint64_t index, std::string_view text, std::size_t& first) {
  first = index == 0 ? 0 : first_statement_end(text, static_cast<std::size_t>(kContext) - 1);
  return index == 0 || first != 0;
}

LoadResult cut(std::string_view text, std::size_t first, std::size_t last, BlockText& block) {
  if (first >= last) return LoadResult::kEmpty;
  block.text = text.substr(first, last - first);
  return LoadResult::kLoaded;
}

}  // namespace

MappedStretch::~MappedStretch() {
  if (pages_ != nullptr) ::munmap(pages_, page_bytes_);
}

MappedStretch ByteSource::map(std::uint64_t offset, std::size_t count) const {
  if (offset >= size_) return {};
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, size_ - offset));
  if (descriptor_ < 0) return {nullptr, 0, text_.substr(static_cast<std::size_t>(offset), count)};
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0 || static_cast<std::uint64_t>(status.st_size) < size_) {
    return {};
  }
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  const std::uint64_t ahead = offset % page;
  const std::size_t bytes = static_cast<std::size_t>(ahead) + count;
  void* const pages = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, descriptor_,
                             static_cast<off_t>(offset - ahead));
  if (pages == MAP_FAILED) return {};
  return {pages, bytes, {static_cast<const char*>(pages) + ahead, count}};
}

std::int64_t ByteSource::read(std::uint64_t offset, std::size_t count, char* out) const {
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, size_ - std::min(size_, offset)));
  if (descriptor_ < 0) {
    if (count != 0) std::memcpy(out, text_.data() + offset, count);
    return static_cast<std::int64_t>(count);
  }
  std::size_t done = 0;
  while (done < count) {
    const ssize_t n =
        ::pread(descriptor_, out + done, count - done, static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return -1;
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return static_cast<std::int64_t>(done);
}

std::uint64_t BlockLoader::count() const {
  return (source_.size() - start_ + kBlockBytes - 1) / kBlockBytes;
}

LoadResult BlockLoader::load(std::uint64_t index, BlockText& block) const {
  const std::uint64_t begin = start_ + index * kBlockBytes;
  const std::uint64_t end = std::min(begin + kBlockBytes, source_.size());
  const std::uint64_t from = index == 0 ? begin : begin - kContext;
  const auto size = static_cast<std::size_t>(end - from);
  block.unfinished = false;
  block.mapped = source_.map(from, size + kSlack + kTextPadding);
  const std::string_view seen = block.mapped.text();
  if (seen.size() == size + kSlack + kTextPadding) {
    std::size_t first = 0;
    if (!find_first(index, seen.substr(0, size), first)) return LoadResult::kEmpty;
    const std::size_t last = first_statement_end(seen.substr(0, size + kSlack), size - 1);
    if (last != 0) return cut(seen, first, last, block);
  }
  return load_copy(index, from, end, block);
}

LoadResult BlockLoader::load_copy(std::uint64_t index, std::uint64_t from, std::uint64_t end,
                                  BlockText& block) const {
  std::string& text = block.buffer;
  text.resize(static_cast<std::size_t>(end - from));
  const std::int64_t got = source_.read(from, text.size(), text.data());
  if (got < 0) return LoadResult::kFailed;
  text.resize(static_cast<std::size_t>(got));
  std::size_t first = 0;
  if (text.empty() || !find_first(index, text, first)) return LoadResult::kEmpty;
  if (const LoadResult rest = load_to_statement_end(end, text); rest != LoadResult::kLoaded) {
    return rest;
  }
  block.unfinished = text.back() != '\n';
  if (block.unfinished) text += '\n';
  const std::size_t last = text.size();
  text.append(kTextPadding, '\0');
  return cut(text, first, block.unfinished && first + 1 == last ? first : last, block);
}

/// `text` ends at `end` of the source. Goes on to the first statement end at or behind its last
/// byte, which the next block finds as well.
LoadResult BlockLoader::load_to_statement_end(std::uint64_t end, std::string& text) const {
  std::size_t look = text.size() - 1;
  std::uint64_t step = kSlack;
  while (true) {
    if (const std::size_t at = first_statement_end(text, look); at != 0) {
      text.resize(at);
      return LoadResult::kLoaded;
    }
    if (end >= source_.size()) return LoadResult::kLoaded;
    if (text.size() > kMaxStatement) return LoadResult::kTooLarge;
    look = text.size();
    text.resize(look + static_cast<std::size_t>(step));
    const std::int64_t got = source_.read(end, static_cast<std::size_t>(step), text.data() + look);
    if (got < 0) return LoadResult::kFailed;
    text.resize(look + static_cast<std::size_t>(got));
    if (got == 0) return LoadResult::kLoaded;
    end += static_cast<std::uint64_t>(got);
    step = std::min<std::uint64_t>(2 * step, 1u << 24);
  }
}

}  // namespace modar
