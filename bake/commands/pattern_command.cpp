// `modar pattern rectify`: from a photo and four corners to a frontal picture.
#include <cstdio>

#include "bake/commands/commands.hpp"
#include "bake/commands/json_output.hpp"
#include "bake/commands/terminal.hpp"

namespace modar {

int run_rectify(const RectifyCommand& command) {
  Result<RgbaImage> photo = read_image(command.photo);
  if (!photo) return print_error(photo.error());
  Result<RgbaImage> image = rectify(*photo, command.options);
  if (!image) {
    Error error = image.error();
    if (error.where.empty()) error.where = command.photo;
    return print_error(error);
  }
  if (auto wrote = write_pattern_png(*image, command.options.width_mm, command.output); !wrote) {
    return print_error(wrote.error());
  }
  std::fprintf(stderr, "wrote %s, %u x %u pixels\n", command.output.c_str(), image->width,
               image->height);
  if (command.json) {
    std::fputs(
        rectify_json(command.output, image->width, image->height, command.options.width_mm).c_str(),
        stdout);
  }
  return static_cast<int>(ExitCode::kOk);
}

}  // namespace modar
