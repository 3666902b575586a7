// Pictures to tracker records, as a module of its own that is loaded where a visitor adds one: code
// that few need would be a tenth of the engine (engine.cpp). Built by the preset `web` only.
#include <cstdlib>

#include <emscripten.h>

#include "modar/modar.h"

namespace {

modar_error error = modar::sized<modar_error>();
modar_record* record = nullptr;

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE void* web_reserve(size_t size) {
  return std::malloc(size);
}

/// Of the last web_record() that failed. field: 0 code, 1 where, 2 cause, 3 cure.
EMSCRIPTEN_KEEPALIVE const char* web_error(int field) {
  const char* const fields[] = {error.code, error.where, error.cause, error.cure};
  return fields[field];
}

/// Makes the record of an RGBA picture, which is overwritten. 0, or the status of an error.
EMSCRIPTEN_KEEPALIVE int web_record(uint8_t* rgba, int width, int height) {
  auto picture = modar::sized<modar_picture>();
  picture.format = MODAR_RGBA;
  picture.width = width;
  picture.height = height;
  picture.planes[0] = rgba;
  picture.strides[0] = 4 * static_cast<ptrdiff_t>(width);
  const int wrong = modar_gray(&picture, rgba, &error);
  if (wrong != 0) return wrong;
  record = modar_record_create(rgba, static_cast<size_t>(width), width, height, &error);
  return record == nullptr ? error.status : 0;
}
EMSCRIPTEN_KEEPALIVE const void* web_record_bytes() {
  return modar_record_bytes(record, nullptr);
}
EMSCRIPTEN_KEEPALIVE size_t web_record_size() {
  size_t size = 0;
  modar_record_bytes(record, &size);
  return size;
}

}  // extern "C"
