// Pattern pictures in memory: read, in gray, and no larger than is useful.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "formats/base/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Rec. 601 luma, as cameras deliver it; transparent pixels show white paper.
GrayPicture gray_of(const RgbaImage& image);
/// Reads an image file as gray. Errors: those of read_image().
Result<GrayPicture> load_gray(const std::string& path);
/// The same of a picture, or of the one that an image target of 8th Wall names (target_file.hpp),
/// its longer side at most 720 pixels. shrunk: whether it was made smaller. Errors: also
/// kUnsupported "pattern.mind", and those of load_target().
Result<GrayPicture> load_pattern(const std::string& path, bool& shrunk);
/// The sides of the picture that load_pattern() makes of one.
std::array<int, 2> pattern_sides(int width, int height);
/// The SectionType::kPatternColours section of a picture: the mean colours of eight by eight cells,
/// in linear light, transparent pixels as white paper.
std::vector<std::byte> pattern_colours(const RgbaImage& image);
/// The PNG and JPEG files of a folder sorted by name, or the file itself. Errors: kIo
/// "pictures.folder" if none.
Result<std::vector<std::string>> pictures_of(const std::string& path);
/// Replaces each folder in `paths` by its pictures. Errors: those of pictures_of().
Result<void> open_folders(std::vector<std::string>& paths);

}  // namespace modar
