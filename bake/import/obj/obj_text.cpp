// Reads stretches of a file, and cuts them into blocks of whole statements.
#include "bake/import/obj/obj_text.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "bake/import/obj/number_parser.hpp"
#include "bake/import/obj/obj_block.hpp"
#include "bake/import/read_model.hpp"

namespace modar {
namespace {

/// Bytes of a statement at most; the format has no limit. Higher reads more of a file without line
/// ends before it is refused.
constexpr std::uint64_t kMaxStatement = std::uint64_t{1} << 26;
/// Bytes looked at ahead of a block to see whether its first line continues another: "\\\r\n".
constexpr std::uint64_t kContext = 3;
/// Bytes read behind a block at first to find the end of its last statement.
constexpr std::size_t kSlack = 4096;

/// Where the block's own statements begin in the bytes read from kContext bytes ahead of it; 0
/// where none does.
std::size_t find_first(std::string_view text) {
  return first_statement_end(text, static_cast<std::size_t>(kContext) - 1);
}

}  // namespace

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
  return (source_.size() - start_ + kObjBlockBytes - 1) / kObjBlockBytes;
}

LoadResult BlockLoader::load(std::uint64_t index, BlockText& block) const {
  const std::uint64_t begin = start_ + index * kObjBlockBytes;
  const std::uint64_t end = std::min(begin + kObjBlockBytes, source_.size());
  const std::uint64_t from = index == 0 ? begin : begin - kContext;
  const std::size_t size = static_cast<std::size_t>(end - from);
  std::string& text = block.buffer;
  text.resize(kTextPadding + size + kSlack);
  const std::int64_t got = source_.read(from, size + kSlack, text.data() + kTextPadding);
  if (got < 0) return LoadResult::kFailed;
  if (got == 0) return LoadResult::kEmpty;
  text.resize(kTextPadding + static_cast<std::size_t>(got));
  const std::size_t inside = std::min(size, static_cast<std::size_t>(got));
  const std::size_t first =
      index == 0 ? 0 : find_first(std::string_view(text).substr(kTextPadding, inside));
  if (index != 0 && first == 0) return LoadResult::kEmpty;
  const LoadResult rest = load_to_statement_end(from + static_cast<std::uint64_t>(got),
                                                kTextPadding + inside - 1, text);
  if (rest != LoadResult::kLoaded) return rest;
  const bool complete = text.back() == '\n';
  const std::size_t begins = kTextPadding + first;
  if (begins >= text.size()) return LoadResult::kEmpty;
  block.unfinished = !complete;
  if (!complete) text += '\n';
  const std::size_t ends = text.size();
  text.append(kTextPadding, '\0');
  block.text = std::string_view(text).substr(begins, ends - begins);
  return LoadResult::kLoaded;
}

/// `text` ends at offset `at` of the source. Cuts it at the first statement end whose last byte
/// is at `look` or behind it, which the next block finds as well; reads on where it has none.
LoadResult BlockLoader::load_to_statement_end(std::uint64_t at, std::size_t look,
                                              std::string& text) const {
  std::uint64_t step = kSlack;
  while (true) {
    if (const std::size_t end = first_statement_end(text, look); end != 0) {
      text.resize(end);
      return LoadResult::kLoaded;
    }
    if (at >= source_.size()) return LoadResult::kLoaded;
    if (text.size() > kMaxStatement) return LoadResult::kTooLarge;
    look = text.size();
    text.resize(look + static_cast<std::size_t>(step));
    const std::int64_t got = source_.read(at, static_cast<std::size_t>(step), text.data() + look);
    if (got < 0) return LoadResult::kFailed;
    text.resize(look + static_cast<std::size_t>(got));
    if (got == 0) return LoadResult::kLoaded;
    at += static_cast<std::uint64_t>(got);
    step = std::min<std::uint64_t>(2 * step, 1u << 24);
  }
}

}  // namespace modar
