// modar.h: bundles with their names and scenes; the camera, and from a pose to GL's matrices.
// Nothing of the tracker and nothing of the renderer: what both halves share.
#include <algorithm>
#include <limits>
#include <memory>
#include <new>
#include <utility>

#include "formats/check.hpp"
#include "modar/renderer.hpp"
#include "runtime/capi/handles.hpp"

using modar::hand_over;

namespace {

modar_bundle* opened(modar::MappedFile file, std::span<const std::byte> bytes, modar_error* error) {
  auto view = modar::BundleView::open(bytes);
  if (!view) {
    hand_over(view.error(), error);
    return nullptr;
  }
  return new modar_bundle{std::move(file), {}, *view};
}

/// strlcpy's contract.
size_t copy_name(std::string_view name, char* text, size_t size) {
  if (text != nullptr && size > 0) {
    const size_t length = std::min(name.size(), size - 1);
    std::memcpy(text, name.data(), length);
    text[length] = '\0';
  }
  return name.size();
}

}  // namespace

static_assert(MODAR_VERSION_NUMBER == MODAR_BUILT_VERSION,
              "modar.h and CMakeLists.txt name two versions");

uint32_t modar_version(void) {
  return MODAR_VERSION_NUMBER;
}

modar_bundle* modar_bundle_open(const char* path, modar_error* error) {
  if (path == nullptr) {
    hand_over(modar::missing("path"), error);
    return nullptr;
  }
  auto file = modar::MappedFile::open(path);
  if (!file) {
    hand_over(file.error(), error);
    return nullptr;
  }
  const std::span<const std::byte> bytes = file->bytes();
  return opened(std::move(*file), bytes, error);
}

modar_bundle* modar_bundle_open_fd(int fd, int64_t offset, int64_t length, modar_error* error) {
  if (offset < 0 || length < 0) {
    hand_over(
        {modar::ExitCode::kUsage, "io.range", "offset", "is negative", "pass the asset's own"},
        error);
    return nullptr;
  }
  auto file = modar::MappedFile::open(fd, static_cast<std::uint64_t>(offset),
                                      static_cast<std::uint64_t>(length));
  if (!file) {
    hand_over(file.error(), error);
    return nullptr;
  }
  const std::span<const std::byte> bytes = file->bytes();
  return opened(std::move(*file), bytes, error);
}

modar_bundle* modar_bundle_open_bytes(const void* bytes, size_t size, modar_error* error) {
  if (bytes == nullptr) {
    hand_over(modar::missing("bytes"), error);
    return nullptr;
  }
  const auto* first = static_cast<const std::byte*>(bytes);
  if (reinterpret_cast<std::uintptr_t>(bytes) % alignof(std::uint64_t) == 0)
    return opened({}, {first, size}, error);
  std::vector<std::uint64_t> copy(size / sizeof(std::uint64_t) + 1);
  std::memcpy(copy.data(), first, size);
  const std::span<const std::byte> aligned = std::as_bytes(std::span(copy)).first(size);
  modar_bundle* bundle = opened({}, aligned, error);
  if (bundle != nullptr) bundle->copy = std::move(copy);
  return bundle;
}

void modar_bundle_close(modar_bundle* bundle) {
  delete bundle;
}

int modar_bundle_verify(const modar_bundle* bundle, modar_error* error) {
  if (bundle == nullptr) return hand_over(modar::missing("bundle"), error);
  return hand_over(modar::verify_sections(bundle->view), error);
}

uint32_t modar_model_count(const modar_bundle* bundle) {
  return bundle->view.models().size();
}

uint32_t modar_pattern_count(const modar_bundle* bundle) {
  return bundle->view.patterns().size();
}

uint32_t modar_scene_count(const modar_bundle* bundle) {
  return bundle->view.scenes().size();
}

size_t modar_model_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= bundle->view.models().size()) return 0;
  return copy_name(bundle->view.name(bundle->view.models()[index].name), text, size);
}

size_t modar_pattern_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= bundle->view.patterns().size()) return 0;
  return copy_name(bundle->view.name(bundle->view.patterns()[index].name), text, size);
}

int modar_model_bounds(const modar_bundle* bundle, uint32_t index, float low[3], float high[3]) {
  if (index >= bundle->view.models().size()) return 0;
  const modar::ModelRecord& model = bundle->view.models()[index];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::numeric_limits<float>::max();
    high[axis] = std::numeric_limits<float>::lowest();
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      const modar::ChunkRecord& chunk = bundle->view.chunks()[model.first_chunk + c];
      low[axis] = std::min(low[axis], chunk.bounds_min[axis]);
      high[axis] = std::max(high[axis], chunk.bounds_max[axis]);
    }
  }
  return 1;
}

double modar_pattern_width_mm(const modar_bundle* bundle, uint32_t index) {
  if (index >= bundle->view.patterns().size()) return 0.0;
  return static_cast<double>(bundle->view.patterns()[index].width_mm);
}

int modar_camera_read(const char* path, modar_camera* camera, modar_error* error) {
  if (path == nullptr || camera == nullptr) {
    return hand_over(modar::missing(path == nullptr ? "path" : "camera"), error);
  }
  const auto read = modar::read_camera_yml(path);
  if (!read) return hand_over(read.error(), error);
  *camera = {read->width, read->height, read->fx, read->fy, read->cx, read->cy, {}};
  std::copy(read->distortion.begin(), read->distortion.end(), camera->distortion);
  return 0;
}

int modar_scene_at(const modar_bundle* bundle, uint32_t index, modar_scene* scene) {
  if (index >= bundle->view.scenes().size()) return 0;
  const modar::SceneRecord& record = bundle->view.scenes()[index];
  scene->pattern = record.pattern;
  scene->model = record.model;
  modar::copy_matrix(modar::scene_matrix(record), scene->place);
  scene->number = index + 1;
  return 1;
}

modar_camera modar_camera_default(int width, int height) {
  const modar::Camera ours = modar::default_camera(width, height);
  return {ours.width, ours.height, ours.fx, ours.fy, ours.cx, ours.cy, {}};
}

void modar_projection(const modar_camera* camera, double near_plane, double far_plane,
                      float projection[16]) {
  modar::copy_matrix(modar::gl_projection(modar::camera_of(*camera), near_plane, far_plane),
                     projection);
}
