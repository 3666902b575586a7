// Image targets of 8th Wall: a JSON file next to its pictures, as its tools leave them in a
// project.
#pragma once

#include <string>
#include <string_view>

#include "bake/pattern/picture.hpp"
#include "bake/pattern/shape.hpp"

namespace modar {

/// Whether the file's name ends in .json.
bool is_target_file(std::string_view path);

/// The picture that a target file names, next to it: the cropped one, else the one whose luminance
/// is tracked. Errors: kIo "target.picture" (none is there), "io.open"; kInvalidInput
/// "target.json"; kUnsupported "target.type".
Result<std::string> target_picture(const std::string& path);

/// That picture in gray, upright: targets that are wider than high are stored on their side. Of
/// cylinders and cones with the proportions that it has on them. Errors: those above, and of
/// read_image().
Result<GrayPicture> load_target(const std::string& path);

/// The same picture in its colours, with the proportions of the file.
Result<RgbaImage> read_target_colours(const std::string& path);

/// What the target says of a cylinder or a cone, of the part that the picture shows; flat of type
/// "PLANAR". Errors: those above.
Result<ShapeRequest> target_shape(const std::string& path);

}  // namespace modar
