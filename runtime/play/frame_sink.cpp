// Folders that outputs go to.
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "frame_sink.hpp"

namespace modar {

Result<void> make_folder(const std::string& path) {
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string part = path.substr(0, end);
    if (mkdir(part.c_str(), 0777) != 0 && errno != EEXIST) {
      return fail(ExitCode::kIo, "out.create", part,
                  std::string("the folder cannot be made: ") + std::strerror(errno),
                  "choose a place that can be written");
    }
    if (end == std::string::npos) break;
  }
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) return {};
  return fail(ExitCode::kIo, "out.create", path, "it is there and is no folder",
              "choose another place");
}

}  // namespace modar
