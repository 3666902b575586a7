// JPEG files through libjpeg-turbo, with its default settings (accurate integer DCT, smooth
// upsampling). libjpeg reports errors by longjmp(): functions that call setjmp() keep all that they
// change, and all that has a destructor, in an object of their caller.
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <jerror.h>
#include <jpeglib.h>

#include "bake/image/decoders.hpp"

namespace modar {
namespace {

/// libjpeg's error manager and the message that it gave up with. The manager must come first:
/// libjpeg hands us a pointer to it.
struct ErrorManager {
  jpeg_error_mgr manager;
  std::jmp_buf escape;
  std::array<char, JMSG_LENGTH_MAX> message;
  bool ended = false;  // before its end marker
};

ErrorManager& manager_of(j_common_ptr info) {
  return *reinterpret_cast<ErrorManager*>(info->err);
}

/// Warnings that mean lost or invented pixels; the others are stray bytes between markers.
bool spoils_pixels(int code) {
  return code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE || code == JWRN_MUST_RESYNC;
}

[[noreturn]] void give_up(j_common_ptr info) {
  ErrorManager& manager = manager_of(info);
  (*info->err->format_message)(info, manager.message.data());
  std::longjmp(manager.escape, 1);
}

void on_message(j_common_ptr info, int level) {
  if (level < 0 && info->err->msg_code == JWRN_JPEG_EOF) manager_of(info).ended = true;
  if (level < 0 && spoils_pixels(info->err->msg_code)) give_up(info);
}

class JpegReader {
 public:
  explicit JpegReader(std::span<const std::byte> bytes) : bytes_(bytes) {
    info_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = give_up;
    errors_.manager.emit_message = on_message;
  }
  ~JpegReader() {
    jpeg_destroy_decompress(&info_);
    std::free(profile_);
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  [[nodiscard]] std::string error() const { return errors_.message.data(); }
  [[nodiscard]] std::uint32_t width() const { return info_.image_width; }
  [[nodiscard]] std::uint32_t height() const { return info_.image_height; }

  bool read_header() {
    if (setjmp(errors_.escape) != 0) return false;
    jpeg_create_decompress(&info_);
    jpeg_save_markers(&info_, JPEG_APP0 + 1, 0xFFFF);
    jpeg_save_markers(&info_, JPEG_APP0 + 2, 0xFFFF);
    jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes_.data()),
                 static_cast<unsigned long>(bytes_.size()));
    jpeg_read_header(&info_, TRUE);
    return true;
  }

  /// The ICC profile; nothing: none, or a part is missing.
  std::vector<std::byte> profile() {
    std::vector<std::byte> bytes;
    if (read_profile()) {
      const auto* first = reinterpret_cast<const std::byte*>(profile_);
      bytes.assign(first, first + profile_size_);
    }
    return bytes;
  }

  /// Rows of width() * 4 bytes: RGBA, or CMYK where is_cmyk(). Reads up to the end marker.
  bool read_pixels(std::uint8_t* pixels) {
    if (setjmp(errors_.escape) != 0) return false;
    info_.out_color_space = is_cmyk() ? JCS_CMYK : JCS_EXT_RGBA;
    jpeg_start_decompress(&info_);
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = pixels + std::size_t{info_.output_scanline} * info_.output_width * 4;
      jpeg_read_scanlines(&info_, &row, 1);
    }
    const bool all_scans = has_all_scans();  // what it looks at is freed by the next call
    jpeg_finish_decompress(&info_);
    if (!errors_.ended || all_scans) return true;
    constexpr char kCut[] = "it ends before its last scan";
    std::memcpy(errors_.message.data(), kCut, sizeof kCut);
    return false;
  }
  /// YCCK counts as CMYK, which libjpeg makes of it.
  [[nodiscard]] bool is_cmyk() const { return info_.num_components == 4; }
  /// Programs that state Adobe's segment store the inks inverted, and libjpeg hands them on so.
  [[nodiscard]] bool is_inverted() const { return info_.saw_Adobe_marker != FALSE; }

  /// Valid after read_header().
  [[nodiscard]] ExifFacts exif() const {
    for (const jpeg_marker_struct* marker = info_.marker_list; marker != nullptr;
         marker = marker->next) {
      // Segments of other programs have the same marker.
      const auto segment = std::as_bytes(std::span(marker->data, marker->data_length));
      if (segment.size() > 4 && std::memcmp(segment.data(), "Exif", 4) == 0) {
        return exif_facts(segment);
      }
    }
    return {};
  }

 private:
  bool read_profile() {
    if (setjmp(errors_.escape) != 0) return false;
    return jpeg_read_icc_profile(&info_, &profile_, &profile_size_) != FALSE;
  }

  /// Whether nothing but the end marker can be missing: where the data of a scan end early, libjpeg
  /// warns of that, but not where a whole scan is missing.
  [[nodiscard]] bool has_all_scans() const {
    if (info_.coef_bits == nullptr) return info_.comps_in_scan == info_.num_components;
    for (int c = 0; c < info_.num_components; ++c) {
      for (const int missing_bits : info_.coef_bits[c]) {
        if (missing_bits != 0) return false;
      }
    }
    return true;
  }

  std::span<const std::byte> bytes_;
  ErrorManager errors_{};
  jpeg_decompress_struct info_{};
  JOCTET* profile_ = nullptr;  // libjpeg's, by malloc()
  unsigned profile_size_ = 0;
};

class JpegWriter {
 public:
  explicit JpegWriter(const RgbaImage& image) : image_(image) {
    info_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = give_up;
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&info_);
    std::free(buffer_);
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  [[nodiscard]] std::string error() const { return errors_.message.data(); }
  [[nodiscard]] std::vector<std::byte> bytes() const {
    const auto* first = reinterpret_cast<const std::byte*>(buffer_);
    return {first, first + size_};
  }

  bool write(int quality) {
    if (setjmp(errors_.escape) != 0) return false;
    jpeg_create_compress(&info_);
    jpeg_mem_dest(&info_, &buffer_, &size_);
    info_.image_width = image_.width;
    info_.image_height = image_.height;
    info_.input_components = 4;
    info_.in_color_space = JCS_EXT_RGBX;
    jpeg_set_defaults(&info_);
    jpeg_set_quality(&info_, quality, TRUE);
    info_.optimize_coding = TRUE;
    jpeg_simple_progression(&info_);
    jpeg_start_compress(&info_, TRUE);
    while (info_.next_scanline < info_.image_height) {
      const std::uint8_t* row =
          image_.pixels.data() + std::size_t{info_.next_scanline} * image_.width * 4;
      JSAMPROW rows[] = {const_cast<std::uint8_t*>(row)};  // libjpeg only reads it
      jpeg_write_scanlines(&info_, rows, 1);
    }
    jpeg_finish_compress(&info_);
    return true;
  }

 private:
  const RgbaImage& image_;
  ErrorManager errors_{};
  jpeg_compress_struct info_{};
  unsigned char* buffer_ = nullptr;  // libjpeg's, by malloc()
  unsigned long size_ = 0;
};

}  // namespace

Result<StoredImage> decode_jpeg(std::span<const std::byte> bytes, const std::string& name) {
  JpegReader reader(bytes);
  const auto damaged = [&] {
    return damaged_image(name, "the JPEG data is damaged (" + reader.error() + ")");
  };
  if (!reader.read_header()) return damaged();
  MODAR_TRY(check_image_size(reader.width(), reader.height(), bytes.size(), name));
  StoredImage stored;
  stored.exif = reader.exif();
  std::vector<std::byte> profile = reader.profile();
  allocate_pixels(stored.image, reader.width(), reader.height());
  if (!reader.read_pixels(stored.image.pixels.data())) return damaged();
  if (reader.is_cmyk()) {
    convert_inks(profile, reader.is_inverted(), stored.image);
  } else {
    stored.colours.profile = std::move(profile);
  }
  return stored;
}

Result<std::vector<std::byte>> encode_jpeg(const RgbaImage& image, int quality) {
  JpegWriter writer(image);
  if (writer.write(quality)) return writer.bytes();
  return fail(ExitCode::kInternal, "image.encode", "JPEG", writer.error(), "report this as a bug");
}

}  // namespace modar
