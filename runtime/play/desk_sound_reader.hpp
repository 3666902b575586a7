// FFmpeg's own libraries, which OpenCV gives no sound of.
#pragma once

#include "desk_media.hpp"

namespace modar {

/// See Media::open_sound.
Result<std::unique_ptr<SoundReader>> open_sound(std::span<const std::byte> file,
                                                const std::string& name);

}  // namespace modar
