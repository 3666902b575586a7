// What files hold, as digests. A file whose size and times are those of the last look is not read
// again.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "bake/json.hpp"

namespace modar {

/// 32 hexadecimal digits (XXH3, 128 bits): equal for equal bytes. No protection against files that
/// were made to collide.
std::string digest_of(std::string_view bytes);

inline constexpr const char* kNoFile = "absent";  ///< digest of a file that is not there

class FileDigests {
 public:
  /// Of the file at `path`, kNoFile where it cannot be read. May be called by several threads.
  std::string of(const std::string& path);

  /// The known digests, for the next run: an array of [path, size, time, inode, digest]. Paths that
  /// begin with `folder` stand without it, so that a run from elsewhere knows them.
  [[nodiscard]] Json json(const std::string& folder) const;
  void read(const Json& json, const std::string& folder);
  /// True if a digest was computed that was not in the cache.
  [[nodiscard]] bool learnt() const { return learnt_; }

 private:
  struct Look {
    std::uint64_t size = 0;
    std::int64_t time = 0;  ///< of the last change, nanoseconds
    std::uint64_t inode = 0;
    std::string digest;
    bool settled = false;  ///< the file was old enough when it was read
  };
  mutable std::mutex mutex_;
  std::map<std::string, Look> known_;
  bool learnt_ = false;
};

}  // namespace modar
