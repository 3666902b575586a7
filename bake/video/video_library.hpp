// Internal to bake/video: what the loaded library offers.
#pragma once

#include <cstdint>

#include "modar/image.hpp"

extern "C" {

/// nullptr where the file is no video. frames: as the file states it, 0 if it does not. The caller
/// closes what it gets.
void* modar_video_open(const char* path, std::uint64_t* frames);
/// Takes the next frame, valid until the next call. 0: none exists.
int modar_video_next(void* video, modar::GrayImage* frame);
void modar_video_close(void* video);
}
