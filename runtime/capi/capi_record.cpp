// modar.h: pictures of one's own as patterns.
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "formats/tracker_record.hpp"
#include "modar/pattern_record.hpp"
#include "modar/photo.hpp"
#include "runtime/capi/handles.hpp"

using modar::hand_over;
using modar::no_handle;

namespace {

// Features that a random view of a picture repeats, in the mean, below which it is refused: trades
// drawings of few lines that would be found from near by for pictures that never are. Of 38
// pictures those of grade E (`modar pattern score`) have up to 37, those of A to C 42 and more,
// blurred ones 41.
constexpr double kPlain = 38.0;

modar_record* copied(std::span<const std::byte> bytes) {
  // Whole words, so that the record's spans are aligned; the rest is zero.
  auto* record =
      new modar_record{std::vector<std::uint64_t>((bytes.size() + sizeof(std::uint64_t) - 1) /
                                                  sizeof(std::uint64_t)),
                       bytes.size()};
  if (!bytes.empty()) std::memcpy(record->words.data(), bytes.data(), bytes.size());
  return record;
}

}  // namespace

modar_record* modar_record_create(const uint8_t* gray, size_t stride, int width, int height,
                                  modar_error* error) {
  if (gray == nullptr) return no_handle(modar::missing("gray"), error);
  if (width < 1 || stride < static_cast<std::size_t>(width))
    return no_handle({modar::ExitCode::kUsage, "capi.stride", "stride", "is shorter than a row",
                      "pass the bytes from one row to the next"},
                     error);
  double repeated = 0;
  const auto made =
      modar::make_tracker_record({gray, width, height, static_cast<std::ptrdiff_t>(stride)},
                                 modar::TrackerRecordOptions{}, {}, &repeated);
  if (!made) return no_handle(made.error(), error);
  if (repeated < kPlain) {
    hand_over(
        {modar::ExitCode::kInvalidInput, "pattern.plain", "the picture",
         "too little in it is found again in other views",
         "choose one with more detail: print, ornaments, photos; crop away empty margins, and "
         "take it sharp, in even light"},
        error);
    return nullptr;
  }
  return copied(*made);
}

const void* modar_record_bytes(const modar_record* record, size_t* size) {
  if (size != nullptr) *size = record == nullptr ? 0 : record->size;
  return record == nullptr ? nullptr : record->words.data();
}

modar_record* modar_record_open(const void* bytes, size_t size, modar_error* error) {
  if (bytes == nullptr) return no_handle(modar::missing("bytes"), error);
  modar_record* record = copied({static_cast<const std::byte*>(bytes), size});
  modar::TrackerRecordView view;
  const auto fault =
      modar::view_tracker_record(std::as_bytes(std::span(record->words)).first(record->size), view);
  if (!fault) return record;
  delete record;
  hand_over({modar::ExitCode::kInvalidInput, "tracker.record",
             "byte " + std::to_string(fault->offset) + " of a record", fault->cause,
             "make it again of the picture"},
            error);
  return nullptr;
}

void modar_record_close(modar_record* record) {
  delete record;
}

int modar_photo_corners(const uint8_t* rgba, int width, int height, float corners[8]) {
  if (corners == nullptr) return 0;
  const auto found = modar::photo_corners({rgba, width, height});
  if (!found) return 0;
  for (std::size_t i = 0; i < found->size(); ++i) {
    corners[2 * i] = static_cast<float>((*found)[i].x);
    corners[2 * i + 1] = static_cast<float>((*found)[i].y);
  }
  return 1;
}

int modar_photo_flat(const uint8_t* rgba, int width, int height, const float corners[8],
                     uint8_t* gray, int* flat_width, int* flat_height) {
  if (corners == nullptr || gray == nullptr || flat_width == nullptr || flat_height == nullptr) {
    return 0;
  }
  static_assert(MODAR_FLAT_SIDE == modar::kFlatSide);
  modar::PhotoCorners points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = glm::dvec2(double{corners[2 * i]}, double{corners[2 * i + 1]});
  }
  const auto flat = modar::photo_flat({rgba, width, height}, points);
  if (!flat) return 0;
  std::memcpy(gray, flat->pixels.data(), flat->pixels.size());
  *flat_width = flat->width;
  *flat_height = flat->height;
  return 1;
}
