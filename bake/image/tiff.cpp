// The first image of TIFF files through libtiff's conversion to RGBA.
#include <cstdarg>
#include <cstdio>
#include <memory>

#include <tiffio.h>

#include "bake/image/decoders.hpp"

namespace modar {
namespace {

struct TiffState {
  MemoryFile in;
  std::string error;  ///< the first one
};

TiffState& state_of(thandle_t handle) {
  return *static_cast<TiffState*>(handle);
}

tmsize_t on_read(thandle_t handle, void* to, tmsize_t count) {
  return static_cast<tmsize_t>(state_of(handle).in.read(to, static_cast<std::size_t>(count)));
}
tmsize_t on_write(thandle_t, void*, tmsize_t) {
  return 0;
}
toff_t on_seek(thandle_t handle, toff_t offset, int whence) {
  MemoryFile& in = state_of(handle).in;
  const toff_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? in.at : in.bytes.size();
  in.at = static_cast<std::size_t>(std::min<toff_t>(from + offset, in.bytes.size()));
  return in.at;
}
int on_close(thandle_t) {
  return 0;
}
toff_t on_size(thandle_t handle) {
  return state_of(handle).in.bytes.size();
}

int on_error(TIFF*, void* user, const char*, const char* format, va_list arguments) {
  TiffState& state = *static_cast<TiffState*>(user);
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  if (state.error.empty()) state.error = text;
  return 1;
}
int on_warning(TIFF*, void*, const char*, const char*, va_list) {
  return 1;
}

using TiffFile = std::unique_ptr<TIFF, void (*)(TIFF*)>;

TiffFile open_tiff(TiffState& state, const std::string& name) {
  TIFFOpenOptions* const options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, &state);
  TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, nullptr);
  // A strip or tile is at most the whole image, of four 16-bit samples a pixel.
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, tmsize_t{kMaxImageSide} * kMaxImageSide * 8);
  TIFF* const file = TIFFClientOpenExt(name.c_str(), "rm", &state, on_read, on_write, on_seek,
                                       on_close, on_size, nullptr, nullptr, options);
  TIFFOpenOptionsFree(options);
  return {file, &TIFFClose};
}

/// The orientation of the file, which is set to "upright" for libtiff, that only mirrors; and alpha
/// that is not multiplied in declared as if it were, so that libtiff leaves colours unchanged.
std::uint16_t leave_pixels_as_stored(TIFF* file) {
  std::uint16_t orientation = ORIENTATION_TOPLEFT;
  TIFFGetFieldDefaulted(file, TIFFTAG_ORIENTATION, &orientation);
  TIFFSetField(file, TIFFTAG_ORIENTATION, std::uint16_t{ORIENTATION_TOPLEFT});
  std::uint16_t count = 0;
  std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(file, TIFFTAG_EXTRASAMPLES, &count, &kinds);
  if (count != 0 && kinds[0] == EXTRASAMPLE_UNASSALPHA) {
    std::vector<std::uint16_t> declared(kinds, kinds + count);
    declared[0] = EXTRASAMPLE_ASSOCALPHA;
    TIFFSetField(file, TIFFTAG_EXTRASAMPLES, count, declared.data());
  }
  return orientation;
}

}  // namespace

Result<StoredImage> decode_tiff(std::span<const std::byte> bytes, const std::string& name) {
  TiffState state{{bytes}, {}};
  const TiffFile file = open_tiff(state, name);
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  const auto damaged = [&] {
    return damaged_image(
        name, "the TIFF data is damaged, cut short or of an unknown kind (" + state.error + ")");
  };
  if (!file || TIFFGetField(file.get(), TIFFTAG_IMAGEWIDTH, &width) == 0 ||
      TIFFGetField(file.get(), TIFFTAG_IMAGELENGTH, &height) == 0) {
    return damaged();
  }
  MODAR_TRY(check_image_size(width, height, bytes.size(), name));
  StoredImage stored;
  stored.exif.orientation = leave_pixels_as_stored(file.get());
  std::vector<std::uint32_t> raster(std::size_t{width} * height);
  const bool read = TIFFReadRGBAImageOriented(file.get(), width, height, raster.data(),
                                              ORIENTATION_TOPLEFT, 1) != 0;
  std::uint32_t profile_size = 0;
  const std::byte* profile = nullptr;
  if (TIFFGetField(file.get(), TIFFTAG_ICCPROFILE, &profile_size, &profile) != 0) {
    stored.colours.profile.assign(profile, profile + profile_size);
  }
  // libtiff continues after some kinds of damage without reporting it in its result.
  if (!read || !state.error.empty()) return damaged();
  allocate_pixels(stored.image, width, height);
  std::uint8_t* out = stored.image.pixels.data();
  for (const std::uint32_t pixel : raster) {
    *out++ = static_cast<std::uint8_t>(TIFFGetR(pixel));
    *out++ = static_cast<std::uint8_t>(TIFFGetG(pixel));
    *out++ = static_cast<std::uint8_t>(TIFFGetB(pixel));
    *out++ = static_cast<std::uint8_t>(TIFFGetA(pixel));
  }
  return stored;
}

}  // namespace modar
