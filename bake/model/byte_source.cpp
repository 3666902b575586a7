// Reads stretches of a file.
#include "bake/model/byte_source.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace modar {

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

}  // namespace modar
