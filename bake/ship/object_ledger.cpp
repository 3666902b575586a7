#include "bake/ship/object_ledger.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <string_view>

#include "formats/base/atomic_file.hpp"
#include "modar/mapped_file.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

constexpr const char* kLedgerFile = "/.objects";
constexpr std::string_view kLedgerHead = "modar objects 1\n";
/// A file that changed less than this before it was read may change again without a new time: file
/// systems count in steps, of 2 s on FAT.
constexpr std::int64_t kLedgerSettledAfter = 2'000'000'000;  // nanoseconds

std::int64_t in_nanoseconds(const timespec& time) {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// The next word of a line; empty at its end.
std::string_view take_word(std::string_view& line) {
  const std::size_t end = std::min(line.find(' '), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(std::min(end + 1, line.size()));
  return word;
}

template <class Number>
bool take_number(std::string_view& line, Number& to) {
  const std::string_view word = take_word(line);
  const auto parsed = std::from_chars(word.data(), word.data() + word.size(), to);
  return parsed.ec == std::errc() && parsed.ptr == word.data() + word.size();
}

}  // namespace

ObjectLedger::ObjectLedger(const std::string& folder) : folder_(folder) {
  const auto file = MappedFile::open(folder + kLedgerFile);
  if (!file) return;
  std::string_view text(reinterpret_cast<const char*>(file->bytes().data()), file->bytes().size());
  if (!text.starts_with(kLedgerHead)) return;
  text.remove_prefix(kLedgerHead.size());
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string name(take_word(line));
    Look look;
    if (take_number(line, look.size) && take_number(line, look.time) &&
        take_number(line, look.inode) && line.empty()) {
      known_[name] = look;
    }
  }
}

bool ObjectLedger::holds(const ObjectId& id) {
  const std::string name = to_hex(id);
  if (seen_.contains(name)) return true;
  const std::string path = folder_ + "/objects/" + object_path(id);
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  const Look look{static_cast<std::uint64_t>(status.st_size),
                  std::max(in_nanoseconds(status.st_mtim), in_nanoseconds(status.st_ctim)),
                  status.st_ino};
  const auto known = known_.find(name);
  if (known == known_.end() || known->second != look) {
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    const auto file = MappedFile::open(path);
    if (!file || object_id(file->bytes()) != id) return false;
    if (in_nanoseconds(now) - look.time <= kLedgerSettledAfter) return true;
  }
  seen_[name] = look;
  return true;
}

Result<void> ObjectLedger::save() const {
  std::string text(kLedgerHead);
  for (const auto& [name, look] : seen_) {
    text += name + " " + std::to_string(look.size) + " " + std::to_string(look.time) + " " +
            std::to_string(look.inode) + "\n";
  }
  return write_file(folder_ + kLedgerFile, std::string_view(text));
}

}  // namespace modar
