// Maps and reads stretches of a file.
#include "bake/import/obj/byte_source.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace modar {

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

}  // namespace modar
