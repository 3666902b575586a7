// The reader's threads. Blocks are cut at fixed places, so that the result knows nothing of
// threads.
#include "bake/import/obj/obj_blocks.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "bake/import/obj/number_parser.hpp"

namespace modar {
namespace {

/// Text and what it parses to stay in a core's second-level cache.
constexpr std::uint64_t kBlockBytes = std::uint64_t{1} << 18;
constexpr std::uint64_t kMaxStatement = std::uint64_t{1} << 30;  ///< bytes
/// Looked at ahead of a block to tell whether its first line continues another: "\\\r\n".
constexpr std::uint64_t kContext = 3;

enum class LoadResult { kLoaded, kEmpty, kFailed, kTooLarge };

/// The text of one block: mapped, or in a buffer of its own where it ends the file or is very long.
struct BlockText {
  std::string_view text;    ///< whole statements, padded
  bool unfinished = false;  ///< it lacked the last line's end, which was added
  MappedStretch mapped;
  std::string buffer;
};

/// Loads the statements that begin in block `index`, that is behind a statement's end that lies
/// behind the block's begin, up to the end of the last of them. A statement longer than a block
/// belongs to the block where it begins; the blocks in its middle are empty.
class BlockLoader {
 public:
  BlockLoader(const ByteSource& source, std::uint64_t start) : source_(source), start_(start) {}

  [[nodiscard]] std::uint64_t count() const {
    return (source_.size() - start_ + kBlockBytes - 1) / kBlockBytes;
  }

  LoadResult load(std::uint64_t index, BlockText& block) const {
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

 private:
  /// Mapped behind a block to find the end of its last statement.
  static constexpr std::size_t kSlack = 4096;

  /// Where the block's own statements begin; false where none does.
  static bool find_first(std::uint64_t index, std::string_view text, std::size_t& first) {
    first = index == 0 ? 0 : first_statement_end(text, static_cast<std::size_t>(kContext) - 1);
    return index == 0 || first != 0;
  }

  static LoadResult cut(std::string_view text, std::size_t first, std::size_t last,
                        BlockText& block) {
    if (first >= last) return LoadResult::kEmpty;
    block.text = text.substr(first, last - first);
    return LoadResult::kLoaded;
  }

  LoadResult load_copy(std::uint64_t index, std::uint64_t from, std::uint64_t end,
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

  /// `text` ends at `end` of the source; goes on to the first statement end at or behind its last
  /// byte, which the next block will find as well.
  LoadResult load_to_statement_end(std::uint64_t end, std::string& text) const {
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
      const std::int64_t got =
          source_.read(end, static_cast<std::size_t>(step), text.data() + look);
      if (got < 0) return LoadResult::kFailed;
      text.resize(look + static_cast<std::size_t>(got));
      if (got == 0) return LoadResult::kLoaded;
      end += static_cast<std::uint64_t>(got);
      step = std::min<std::uint64_t>(2 * step, 1u << 24);
    }
  }

  const ByteSource& source_;
  std::uint64_t start_;
};

/// Hands blocks out in order and takes them back in order.
class BlockQueue {
 public:
  explicit BlockQueue(std::uint64_t count) : count_(count) {}

  /// The next block to parse, nothing when all are out or one has failed.
  std::optional<std::uint64_t> next() {
    const std::lock_guard lock(mutex_);
    if (failed_ || next_ >= count_) return std::nullopt;
    return next_++;
  }
  /// Waits for the turn of block `index`, runs `join` and passes the turn on. Answers false where a
  /// block has failed meanwhile.
  template <class Join>
  bool in_turn(std::uint64_t index, const Join& join) {
    std::unique_lock lock(mutex_);
    turn_.wait(lock, [&] { return failed_ || joined_ == index; });
    if (failed_) return false;
    const bool good = join();
    ++joined_;
    failed_ = !good;
    turn_.notify_all();
    return good;
  }

 private:
  std::mutex mutex_;
  std::condition_variable turn_;
  std::uint64_t count_;
  std::uint64_t next_ = 0;
  std::uint64_t joined_ = 0;
  bool failed_ = false;
};

/// Where the statements begin: behind a UTF-8 byte order mark.
std::uint64_t text_start(const ByteSource& source) {
  char head[3];
  return source.read(0, 3, head) == 3 && std::memcmp(head, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
}

Result<void> to_result(LoadResult worst, const std::string& label) {
  if (worst == LoadResult::kFailed) {
    return fail(ExitCode::kIo, "io.read", label, "the file cannot be read",
                "check the disk and the file's permissions");
  }
  if (worst == LoadResult::kTooLarge) {
    return fail(
        ExitCode::kInvalidInput, "obj.too-large", label,
        "the file holds more than 1,073,741,823 vertices, corners or bytes in one statement",
        "split the model into several files");
  }
  return {};
}

}  // namespace

Result<void> read_obj_blocks(const ByteSource& source, const std::string& label, unsigned jobs,
                             const ObjCounts* totals, ObjAssembler& assembler) {
  const BlockLoader loader(source, text_start(source));
  BlockQueue queue(loader.count());
  LoadResult worst = LoadResult::kLoaded;  // guarded by the queue's turn
  const auto work = [&] {
    ObjBlock block;
    BlockText loading;
    while (const auto index = queue.next()) {
      const LoadResult loaded = loader.load(*index, loading);
      ObjLimits limits;
      if (totals != nullptr) limits = {assembler.counts(), *totals};
      if (loaded == LoadResult::kLoaded) {
        parse_obj_block(loading.text.data(), loading.text.size(),
                        totals != nullptr ? &limits : nullptr, block);
        if (loading.unfinished) --block.lines;
      }
      const bool good = queue.in_turn(*index, [&] {
        if (loaded == LoadResult::kEmpty) return true;
        worst = loaded;
        if (loaded != LoadResult::kLoaded) return false;
        assembler.add(block);
        if (assembler.too_large()) worst = LoadResult::kTooLarge;
        return worst == LoadResult::kLoaded;
      });
      if (!good) return;
    }
  };
  const std::uint64_t useful = std::min<std::uint64_t>(loader.count(), 64);
  const unsigned threads = totals != nullptr ? 1u : std::min(jobs, static_cast<unsigned>(useful));
  std::vector<std::thread> others;
  for (unsigned i = 1; i < threads; ++i) others.emplace_back(work);
  work();
  for (std::thread& thread : others) thread.join();
  return to_result(worst, label);
}

}  // namespace modar
