// What stands behind the opaque handles of modar.h, and how our errors and matrices cross over.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

#include <glm/gtc/type_ptr.hpp>

#include "formats/bundle_view.hpp"
#include "modar/camera.hpp"
#include "modar/camera_yml.hpp"
#include "modar/mapped_file.hpp"
#include "modar/modar.h"

struct modar_bundle {
  modar::MappedFile file;           ///< empty where the bytes are the caller's
  std::vector<std::uint64_t> copy;  ///< of bytes that were not aligned; else empty
  modar::BundleView view;
};

/// A tracker record of modar_record_create(), aligned.
struct modar_record {
  std::vector<std::uint64_t> words;
  std::size_t size;
};

namespace modar {

static_assert(MODAR_USAGE == static_cast<int>(ExitCode::kUsage));
static_assert(MODAR_IO == static_cast<int>(ExitCode::kIo));
static_assert(MODAR_INVALID == static_cast<int>(ExitCode::kInvalidInput));
static_assert(MODAR_INTERNAL == static_cast<int>(ExitCode::kInternal));
static_assert(MODAR_UNSUPPORTED == static_cast<int>(ExitCode::kUnsupported));

/// Into the caller's structure, which may be of an older version and shorter, or of a newer one,
/// whose further fields stay.
template <class Struct>
void give(Struct ours, Struct* to) {
  if (to == nullptr || to->size < sizeof to->size) return;
  ours.size = to->size;
  std::memcpy(to, &ours, std::min(ours.size, sizeof ours));
}

/// Tells the caller, who may not want to know; answers the status.
int set_error(const Error& error, modar_error* to);

inline int set_error(const Result<void>& result, modar_error* to) {
  return result ? 0 : set_error(result.error(), to);
}

/// The same, where the answer is a handle: NULL.
inline std::nullptr_t fail_null(const Error& error, modar_error* to) {
  set_error(error, to);
  return nullptr;
}

/// The caller's structure in one of this version's size: what an older caller did not know is 0.
template <class Struct>
Struct grown(const Struct& theirs) {
  Struct ours{};
  std::memcpy(&ours, &theirs, std::min(theirs.size, sizeof ours));
  return ours;
}

/// An element of an array whose elements have the caller's size.
template <class Struct>
Struct item_at(const Struct* items, std::size_t index) {
  const auto* bytes = reinterpret_cast<const std::byte*>(items) + index * items->size;
  Struct ours{};
  std::memcpy(&ours, bytes, std::min(items->size, sizeof ours));
  return ours;
}

/// 0 for an array that is NULL or whose elements have no size.
template <class Struct>
std::size_t item_count(const Struct* items, std::size_t count) {
  return items == nullptr || items->size < sizeof items->size ? 0 : count;
}

/// strlcpy's contract.
inline std::size_t copy_name(std::string_view name, char* text, std::size_t size) {
  if (text != nullptr && size > 0) {
    const std::size_t length = std::min(name.size(), size - 1);
    std::memcpy(text, name.data(), length);
    text[length] = '\0';
  }
  return name.size();
}

/// What a caller forgot.
Error missing(const char* what);

/// Largest amount of a caller's number: calculations with larger ones overflow. Seconds since 1970
/// fit, and pixels of a direction next to the camera's plane.
constexpr double kLargestNumber = 1e12;

/// False for NaN and too large values.
inline bool usable(double number) {
  return std::fabs(number) <= kLargestNumber;
}
template <class Number>
bool usable(const Number* numbers, std::size_t count) {
  return std::all_of(numbers, numbers + count, [](Number each) { return usable(double{each}); });
}
/// Whether frames of the camera can be calculated with, whatever its size.
inline bool usable(const modar_camera& theirs) {
  const modar_camera camera = grown(theirs);
  const double lens[] = {camera.fx, camera.fy, camera.cx, camera.cy};
  return usable(lens, 4) && usable(camera.distortion, std::size(camera.distortion));
}
inline bool usable(const modar_item& item) {
  return usable(item.to_eye, 16) && usable(item.world_to_eye, 16) && usable(double{item.opacity});
}

/// Of the camera and the projection; NULL counts as usable. drawing: of this version's
/// size.
inline bool usable(const modar_drawing& drawing) {
  return (drawing.camera == nullptr || usable(*drawing.camera)) &&
         (drawing.projection == nullptr || usable(drawing.projection, 16));
}

/// The error of a number that is not usable().
Error bad_number(const char* where);

inline Camera camera_of(const modar_camera& theirs) {
  const modar_camera camera = grown(theirs);
  Camera ours{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, {}};
  std::copy_n(camera.distortion, ours.distortion.size(), ours.distortion.begin());
  return ours;
}

inline void give_camera(const Camera& ours, modar_camera* to) {
  modar_camera camera{0, ours.width, ours.height, ours.fx, ours.fy, ours.cx, ours.cy, {}};
  std::copy(ours.distortion.begin(), ours.distortion.end(), camera.distortion);
  give(camera, to);
}

inline void copy_matrix(const glm::mat4& from, float* to) {
  std::copy_n(glm::value_ptr(from), 16, to);
}

}  // namespace modar
