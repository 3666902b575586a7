// Errors of the C API, in one object: each of their texts takes code to build.
#include "runtime/capi/handles.hpp"
#include "runtime/capi/picture.hpp"

namespace modar {
namespace {

/// Cuts the text to what the array holds; at most a part of the last UTF-8 letter is lost.
template <std::size_t kSize>
void copy_text(const std::string& text, char (&to)[kSize]) {
  const std::size_t length = std::min(text.size(), kSize - 1);
  std::memcpy(to, text.data(), length);
  to[length] = '\0';
}

}  // namespace

int set_error(const Error& error, modar_error* to) {
  const int status = static_cast<int>(error.exit);
  if (to == nullptr) return status;
  modar_error ours{};
  ours.status = status;
  copy_text(error.code, ours.code);
  copy_text(error.where, ours.where);
  copy_text(error.cause, ours.cause);
  copy_text(error.cure, ours.cure);
  give(ours, to);
  return status;
}

Error missing(const char* what) {
  return {ExitCode::kUsage, "capi.null", what, "is NULL", "pass it"};
}

Error bad_number(const char* where) {
  return {ExitCode::kUsage, "capi.number", where, "is no number, or larger than 1e12",
          "pass a finite one"};
}

Result<void> check_picture(const modar_picture& picture) {
  const auto wrong = [](const char* code, const char* where, std::string cause, const char* cure) {
    return fail(ExitCode::kUsage, code, where, std::move(cause), cure);
  };
  const bool colour = picture.format == MODAR_RGB || picture.format == MODAR_RGBA;
  const bool pairs = picture.format == MODAR_NV21 || picture.format == MODAR_NV12;
  if (picture.format < MODAR_RGB || picture.format > MODAR_YUV_420_888) {
    return wrong("capi.picture", "format", std::to_string(picture.format) + " is no format",
                 "use MODAR_RGB and its kin");
  }
  if (picture.width < 1 || picture.height < 1 || picture.width > 65536 || picture.height > 65536 ||
      (!colour && (picture.width % 2 != 0 || picture.height % 2 != 0))) {
    return wrong("capi.picture", "width, height",
                 std::to_string(picture.width) + " x " + std::to_string(picture.height) + " pixels",
                 "pass even sides; odd ones for RGB and RGBA alone");
  }
  const bool spread = picture.format == MODAR_YUV_420_888;
  if (spread && picture.chroma_step != 1 && picture.chroma_step != 2) {
    return wrong("capi.picture", "chroma_step",
                 std::to_string(picture.chroma_step) + " is neither 1 nor 2",
                 "pass the pixel stride of the planes U and V");
  }
  const int planes = colour ? 1 : pairs ? 2 : 3;
  for (int i = 0; i < planes; ++i) {
    if (picture.planes[i] == nullptr) {
      return wrong("capi.null", "planes", "plane " + std::to_string(i) + " is NULL", "pass it");
    }
    const std::ptrdiff_t pixels = i == 0 ? picture.width : picture.width / 2;
    const std::ptrdiff_t row = i == 0   ? pixels * (picture.format == MODAR_RGB ? 3
                                                    : colour                    ? 4
                                                                                : 1)
                               : pairs  ? 2 * pixels
                               : spread ? (pixels - 1) * picture.chroma_step + 1
                                        : pixels;
    if (picture.strides[i] < row) {
      return wrong("capi.stride", "strides",
                   "plane " + std::to_string(i) + " has " + std::to_string(picture.strides[i]) +
                       " bytes from row to row, where a row takes " + std::to_string(row),
                   "pass the plane's own row stride");
    }
  }
  return {};
}

}  // namespace modar
