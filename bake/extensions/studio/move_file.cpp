#include "bake/extensions/studio/move_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace modar {

bool move_to_free(const std::string& from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  // FUSE and network shares cannot do this in one step: an empty file keeps the name free of
  // others.
  const int descriptor = ::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor < 0) return false;
  ::close(descriptor);
  if (::rename(from.c_str(), to.c_str()) == 0) return true;
  const int number = errno;
  ::unlink(to.c_str());
  errno = number;
  return false;
}

}  // namespace modar
