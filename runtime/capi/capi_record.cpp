// modar.h: users' own pictures as patterns.
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "formats/tracker_record.hpp"
#include "modar/pattern_record.hpp"
#include "modar/photo.hpp"
#include "runtime/capi/handles.hpp"
#include "runtime/capi/picture.hpp"

using modar::fail_null;
using modar::set_error;

namespace {

// Mean number of features that a random view repeats, below which a picture is refused. Higher
// refuses drawings that work from near by.
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

/// Empty if it is not a usable RGBA picture.
modar::Photo photo_of(const modar_picture* theirs) {
  if (theirs == nullptr) return {};
  const modar_picture picture = modar::grown(*theirs);
  if (picture.format != MODAR_RGBA || !modar::check_picture(picture)) return {};
  return {picture.planes[0], picture.width, picture.height, picture.strides[0]};
}

}  // namespace

modar_record* modar_record_create(const uint8_t* gray, size_t stride, int width, int height,
                                  modar_error* error) {
  if (gray == nullptr) return fail_null(modar::missing("gray"), error);
  if (width < 1 || stride < static_cast<std::size_t>(width))
    return fail_null({modar::ExitCode::kUsage, "capi.stride", "stride", "is shorter than a row",
                      "pass the bytes from one row to the next"},
                     error);
  double repeated = 0;
  const auto made =
      modar::make_tracker_record({gray, width, height, static_cast<std::ptrdiff_t>(stride)},
                                 modar::TrackerRecordOptions{}, {}, &repeated);
  if (!made) return fail_null(made.error(), error);
  if (repeated < kPlain) {
    set_error(
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
  if (bytes == nullptr) return fail_null(modar::missing("bytes"), error);
  modar_record* record = copied({static_cast<const std::byte*>(bytes), size});
  modar::TrackerRecordView view;
  const auto fault =
      modar::view_tracker_record(std::as_bytes(std::span(record->words)).first(record->size), view);
  const bool known = fault || view.header.describer_version == modar::kTrackerExtractorVersion;
  if (!fault && known) return record;
  delete record;
  return fail_null({modar::ExitCode::kInvalidInput, "tracker.record",
                    "byte " + std::to_string(fault ? fault->offset : 0) + " of a record",
                    fault ? fault->cause : "another version's feature extractor made it",
                    "make it again from the picture"},
                   error);
}

void modar_record_close(modar_record* record) {
  delete record;
}

int modar_photo_corners(const modar_picture* photo, float corners[8]) {
  if (corners == nullptr) return 0;
  const auto found = modar::photo_corners(photo_of(photo));
  if (!found) return 0;
  for (std::size_t i = 0; i < found->size(); ++i) {
    corners[2 * i] = static_cast<float>((*found)[i].x);
    corners[2 * i + 1] = static_cast<float>((*found)[i].y);
  }
  return 1;
}

int modar_photo_flat(const modar_picture* photo, const float corners[8], uint8_t* gray,
                     int* flat_width, int* flat_height) {
  if (corners == nullptr || gray == nullptr || flat_width == nullptr || flat_height == nullptr) {
    return 0;
  }
  static_assert(MODAR_FLAT_SIDE == modar::kFlatSide);
  if (!modar::usable(corners, 8)) return 0;
  modar::PhotoCorners points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = glm::dvec2(double{corners[2 * i]}, double{corners[2 * i + 1]});
  }
  const auto flat = modar::photo_flat(photo_of(photo), points);
  if (!flat) return 0;
  std::memcpy(gray, flat->pixels.data(), flat->pixels.size());
  *flat_width = flat->width;
  *flat_height = flat->height;
  return 1;
}
