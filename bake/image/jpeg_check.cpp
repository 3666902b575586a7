// Runs libjpeg over a file at an eighth of its size, for its warnings alone.
#include "bake/image/jpeg_check.hpp"

#include <array>
#include <csetjmp>
#include <cstdio>
#include <vector>

#include <jerror.h>
#include <jpeglib.h>

namespace modar {
namespace {

/// libjpeg's error manager and what we keep of its messages. It must come first: libjpeg hands us a
/// pointer to it.
struct Listener {
  jpeg_error_mgr manager;
  std::jmp_buf escape;
  std::array<char, JMSG_LENGTH_MAX> message;
};

Listener& listener_of(j_common_ptr info) {
  return *reinterpret_cast<Listener*>(info->err);
}

/// Warnings that mean lost or invented pixels.
bool spoils_pixels(int code) {
  return code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE || code == JWRN_JPEG_EOF ||
         code == JWRN_MUST_RESYNC;
}

[[noreturn]] void give_up(j_common_ptr info) {
  Listener& listener = listener_of(info);
  (*info->err->format_message)(info, listener.message.data());
  std::longjmp(listener.escape, 1);
}

void hear(j_common_ptr info, int level) {
  if (level < 0 && spoils_pixels(info->err->msg_code)) give_up(info);
}

/// Everything that changes after setjmp() lives outside of the function that calls it.
struct Check {
  Listener listener{};
  jpeg_decompress_struct info{};
  std::vector<JSAMPLE> row;
};

void read_all(Check& check, std::span<const std::byte> bytes) {
  jpeg_decompress_struct& info = check.info;
  if (setjmp(check.listener.escape) != 0) return;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()),
               static_cast<unsigned long>(bytes.size()));
  jpeg_read_header(&info, TRUE);
  info.scale_num = 1;
  info.scale_denom = 8;
  info.out_color_space = info.jpeg_color_space;  // no conversion: nobody sees these pixels
  jpeg_start_decompress(&info);
  check.row.resize(std::size_t{info.output_width} *
                   static_cast<std::size_t>(info.output_components));
  JSAMPROW rows[] = {check.row.data()};
  while (info.output_scanline < info.output_height) jpeg_read_scanlines(&info, rows, 1);
  jpeg_finish_decompress(&info);
}

}  // namespace

std::string jpeg_damage(std::span<const std::byte> bytes) {
  Check check;
  check.info.err = jpeg_std_error(&check.listener.manager);
  check.listener.manager.error_exit = give_up;
  check.listener.manager.emit_message = hear;
  read_all(check, bytes);
  jpeg_destroy_decompress(&check.info);
  return check.listener.message.data();
}

}  // namespace modar
