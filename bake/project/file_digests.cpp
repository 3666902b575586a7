#include "bake/project/file_digests.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// A file that changed less than this before it was read may change again without a new time: file
/// systems count in steps, of 2 s on FAT.
constexpr std::int64_t kSettledAfter = 2'000'000'000;  // nanoseconds

std::int64_t nanoseconds(const timespec& time) {
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

std::string digest_of(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(hash.high64),
                static_cast<unsigned long long>(hash.low64));
  return text;
}

std::string FileDigests::of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return kNoFile;
  Look look;
  look.size = static_cast<std::uint64_t>(status.st_size);
  look.time = std::max(nanoseconds(status.st_mtim), nanoseconds(status.st_ctim));
  look.inode = status.st_ino;
  {
    const std::lock_guard lock(mutex_);
    const auto known = known_.find(path);
    if (known != known_.end() && known->second.size == look.size &&
        known->second.time == look.time && known->second.inode == look.inode) {
      return known->second.digest;
    }
  }
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  look.settled = nanoseconds(now) - look.time > kSettledAfter;
  if (look.size == 0) {
    look.digest = digest_of("");
  } else {
    const auto file = MappedFile::open(path);
    if (!file) return kNoFile;
    look.digest =
        digest_of({reinterpret_cast<const char*>(file->bytes().data()), file->bytes().size()});
    look.settled = look.settled && file->intact();
  }
  const std::lock_guard lock(mutex_);
  learnt_ = learnt_ || look.settled;
  return (known_[path] = std::move(look)).digest;
}

Json FileDigests::json(const std::string& folder) const {
  const std::lock_guard lock(mutex_);
  Json list = Json::array();
  for (const auto& [path, look] : known_) {
    if (!look.settled) continue;
    const std::string name = path.starts_with(folder) ? path.substr(folder.size()) : path;
    list.push_back(Json::array({name, look.size, look.time, look.inode, look.digest}));
  }
  return list;
}

void FileDigests::read(const Json& json, const std::string& folder) {
  for (std::size_t i = 0; i < json.size(); ++i) {
    const Json one = json.at(i).value_or(Json());
    const auto path = one.at(0).value_or(Json()).text();
    const auto size = one.at(1).value_or(Json()).count();
    const auto time = one.at(2).value_or(Json()).count();
    const auto inode = one.at(3).value_or(Json()).count();
    const auto digest = one.at(4).value_or(Json()).text();
    if (!path || !size || !time || !inode || !digest) continue;
    known_[path->starts_with('/') ? *path : folder + *path] = {
        *size, static_cast<std::int64_t>(*time), *inode, *digest, true};
  }
}

}  // namespace modar
