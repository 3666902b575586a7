// A pattern's picture as everything in this folder sees it: gray, and no larger than is useful.
#pragma once

#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/pattern/view_render.hpp"
#include "formats/error.hpp"

namespace modar {

/// Gray as cameras deliver it (Rec. 601); what is transparent shows white paper.
GrayPicture gray_of(const RgbaImage& image);
/// Reads an image file as gray. Errors: those of read_image().
Result<GrayPicture> load_gray(const std::string& path);
/// The same, its longer side at most 720 pixels. shrunk: whether it was made smaller.
Result<GrayPicture> load_pattern(const std::string& path, bool& shrunk);
/// The PNG and JPEG files of a folder in the order of their names, or the file itself. Errors: kIo
/// "pictures.folder" where there is none.
Result<std::vector<std::string>> pictures_of(const std::string& path);
/// The paths with its pictures in each folder's place. Errors: those of pictures_of().
Result<void> open_folders(std::vector<std::string>& paths);

}  // namespace modar
