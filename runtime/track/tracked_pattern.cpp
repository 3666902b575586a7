// Views of the arrays of a tracker record.
#include "tracked_pattern.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "formats/tracker_record.hpp"
#include "kernels.hpp"
#include "modar/tracker_features.hpp"

namespace modar::tracker {
namespace {

static_assert(kFeatureExtractorVersion == kTrackerExtractorVersion);

void halve(const GrayImage& image, int level_count, PatternPyramid& out) {
  const auto area = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  out.pixels.resize(area / 3 + 1);
  out.levels[0] = image;
  std::uint8_t* next = out.pixels.data();
  for (int level = 1; level < level_count; ++level) {
    const GrayImage& from = out.levels[static_cast<std::size_t>(level) - 1];
    const int width = from.width / 2;
    const int height = from.height / 2;
    out.levels[static_cast<std::size_t>(level)] = {next, width, height, width};
    for (int y = 0; y < height; ++y, next += width) {
      const std::uint8_t* top = from.pixels + 2 * y * from.stride;
      kernels().halve_row(top, top + from.stride, next, width);
    }
  }
}

void view_patches(const TrackerRecordView& view, TrackedPattern& out) {
  std::size_t first = 0;
  for (std::uint32_t level = 0; level < view.header.level_count; ++level) {
    std::size_t last = first;
    while (last < view.patches.size() && view.patches[last].level == level) ++last;
    out.patches[level] = view.patches.subspan(first, last - first);
    first = last;
  }
}

}  // namespace

glm::dvec2 TrackedPattern::to_world(glm::dvec2 pixel) const {
  const double longest = std::max(width(), height());
  return shape * glm::dvec2((2.0 * pixel.x + 1.0 - width()) / longest,
                            (height() - 2.0 * pixel.y - 1.0) / longest);
}

glm::dmat3 TrackedPattern::world_from_pixels() const {
  const double longest = std::max(width(), height());
  const glm::dvec2 middle = to_world({0.0, 0.0});
  glm::dmat3 m(1.0);
  m[0] = glm::dvec3(shape[0] * (2.0 / longest), 0.0);
  m[1] = glm::dvec3(shape[1] * (-2.0 / longest), 0.0);
  m[2] = {middle, 1.0};
  return m;
}

std::span<const GrayImage> TrackedPattern::pyramid() const {
  if (!coarser->made) {
    const std::lock_guard lock(coarser->making);
    if (!coarser->made) halve(image, level_count, *coarser);
    coarser->made = true;
  }
  return std::span(coarser->levels).first(static_cast<std::size_t>(level_count));
}

glm::dvec3 TrackedPattern::on_surface(glm::dvec2 pixel) const {
  if (surface.flat()) return {to_world(pixel), 0.0};
  const auto at = surface.at(pixel.x, pixel.y).at;
  return {at[0], at[1], at[2]};
}

[[gnu::cold]] Result<TrackedPattern> view_tracked_pattern(std::span<const std::byte> bytes,
                                                          std::uint32_t index,
                                                          PatternPyramid& coarser,
                                                          std::span<const std::byte> shape) {
  std::uint32_t version = 0;
  if (bytes.size() >= sizeof version) std::memcpy(&version, bytes.data(), sizeof version);
  if (bytes.size() >= sizeof(TrackerRecordHeader) && version != kFeatureExtractorVersion) {
    return fail(ExitCode::kUnsupported, "tracker.record-version", "",
                "the pattern's loop record is of another version", "bake the pattern again");
  }
  TrackerRecordView view;
  if (const auto fault = view_tracker_record(bytes, view)) {
    return fail(ExitCode::kInvalidInput, "tracker.record",
                "byte " + std::to_string(fault->offset) + " of a loop record", fault->cause,
                "bake the pattern again");
  }
  TrackedPattern out;
  out.index = index;
  out.bright_count = view.header.bright_count;
  out.features = view.features;
  out.codes = view.codes.data();
  out.image = {view.pixels.data(), static_cast<int>(view.header.width),
               static_cast<int>(view.header.height),
               static_cast<std::ptrdiff_t>(view.header.width)};
  out.level_count = static_cast<int>(view.header.level_count);
  out.coarser = &coarser;
  view_patches(view, out);
  if (shape.empty()) return out;
  if (const char* cause =
          view_pattern_shape(shape, view.header.width, view.header.height, out.surface)) {
    return fail(ExitCode::kInvalidInput, "tracker.record", "a pattern's shape", cause,
                "bake the pattern again");
  }
  return out;
}

}  // namespace modar::tracker
