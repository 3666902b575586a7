// Loads the library of media; raw frames and cameras that need none of it.
#include "desk_media.hpp"

#include <dlfcn.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

#include "desk_v4l2_source.hpp"
#include "raw_source.hpp"

namespace modar {
namespace {

/// Next to the running program: bin/../libexec/modar.
std::string library_path() {
  std::array<char, 4096> program{};
  const ssize_t length = readlink("/proc/self/exe", program.data(), program.size());
  const std::string path(program.data(), length < 0 ? 0 : static_cast<std::size_t>(length));
  return path.substr(0, path.rfind('/') + 1) + MODAR_LIBEXEC "/libmodar_media.so";
}

/// Ours first; a camera that sends compressed pictures only goes through OpenCV.
Result<std::unique_ptr<FrameSource>> open_camera(const std::string& input) {
  MODAR_ASSIGN(const int number, camera_number(input));
  MODAR_ASSIGN(auto device, open_video_device("/dev/video" + std::to_string(number)));
  auto source = start_camera(std::move(device), input, {});
  if (source || source.error().code != "camera.format") return source;
  MODAR_ASSIGN(const Media* library, media());
  auto compressed = library->open_camera(number, input);
  return compressed ? std::move(compressed) : std::move(source);
}

}  // namespace

Result<const Media*> media() {
  static const Media* loaded = nullptr;
  if (loaded != nullptr) return loaded;
  const std::string path = library_path();
  if (void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    const auto open =
        reinterpret_cast<decltype(&modar_play_media)>(dlsym(handle, "modar_play_media"));
    if (open != nullptr) return loaded = open();
  }
  const char* reason = dlerror();
  return fail(
      ExitCode::kUnsupported, "media.library", path,
      std::string("the library that reads and writes pictures and videos cannot be loaded: ") +
          (reason == nullptr ? "it is of another version" : reason),
      "install OpenCV's libraries (Debian: libopencv-videoio406), or ModAR again");
}

Result<std::unique_ptr<FrameSource>> open_frame_source(const std::string& input) {
  if (is_raw_input(input)) return open_raw_source(input);
  if (input == "camera" || input.starts_with("camera:")) return open_camera(input);
  // OpenCV would wait for a writer.
  struct stat status {};
  if (stat(input.c_str(), &status) == 0 && S_ISFIFO(status.st_mode)) {
    return fail(ExitCode::kUsage, "input.pipe", input, "it is a pipe",
                "send raw frames through it: y4m:" + input + ", or nv21:640x480@30:" + input);
  }
  MODAR_ASSIGN(const Media* library, media());
  return library->open_path(input);
}

}  // namespace modar
