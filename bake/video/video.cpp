#include "bake/video/video.hpp"

#include <dlfcn.h>

#include "bake/process/process.hpp"
#include "bake/video/video_library.hpp"

namespace modar {
namespace {

struct VideoLibrary {
  decltype(&modar_video_open) open = nullptr;
  decltype(&modar_video_next) next = nullptr;
  decltype(&modar_video_close) close = nullptr;
};

std::string library_file() {
  return companion_file("libmodar_video.so");
}

/// Loaded once, and never unloaded. Empty where that fails.
const VideoLibrary& video_library() {
  static const VideoLibrary loaded = [] {
    VideoLibrary found;
    void* handle = dlopen(library_file().c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) return found;
    const auto take = [handle](auto& function, const char* name) {
      function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(handle, name));
    };
    take(found.open, "modar_video_open");
    take(found.next, "modar_video_next");
    take(found.close, "modar_video_close");
    return found;
  }();
  return loaded;
}

}  // namespace

Result<Video> Video::open(const std::string& path) {
  const VideoLibrary& library = video_library();
  if (library.open == nullptr || library.next == nullptr || library.close == nullptr) {
    return fail(ExitCode::kIo, "video.library", library_file(),
                "the library that reads videos cannot be loaded",
                "install modar-player and libopencv-videoio406, or build ModAR again");
  }
  Video video;
  if (void* reader = library.open(path.c_str(), &video.frames_)) {
    video.reader_ = std::shared_ptr<void>(reader, library.close);
  }
  return video;
}

std::optional<GrayImage> Video::next() {
  GrayImage frame;
  if (!reader_ || video_library().next(reader_.get(), &frame) == 0) return std::nullopt;
  return frame;
}

}  // namespace modar
