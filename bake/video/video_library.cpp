// The library that is loaded for videos: VideoReader behind functions of C.
#include "bake/video/video_library.hpp"

#include <memory>

#include "modar/video_reader.hpp"

void* modar_video_open(const char* path, std::uint64_t* frames) {
  auto reader = modar::VideoReader::open_file(path);
  if (!reader) return nullptr;
  *frames = reader->frames();
  return std::make_unique<modar::VideoReader>(std::move(*reader)).release();
}

int modar_video_next(void* video, modar::GrayImage* frame) {
  auto& reader = *static_cast<modar::VideoReader*>(video);
  if (!reader.next().value_or(false)) return 0;
  *frame = reader.gray();
  return 1;
}

void modar_video_close(void* video) {
  delete static_cast<modar::VideoReader*>(video);
}
