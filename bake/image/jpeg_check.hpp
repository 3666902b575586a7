// Whether a JPEG file's coded data is whole.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace modar {

/// What libjpeg finds wrong with the coded data: OpenCV shows gray or shifted pixels there and
/// calls that a success. Empty: nothing, or only stray bytes between markers, which spoil no pixel.
std::string jpeg_damage(std::span<const std::byte> bytes);

}  // namespace modar
