// modar.h: bundles with their names and scenes; the camera, and from a pose to GL's matrices.
// Nothing of the tracker and nothing of the renderer: what both halves share.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "formats/check.hpp"
#include "formats/meta_text.hpp"
#include "formats/tracker_record.hpp"
#include "modar/renderer.hpp"
#include "runtime/capi/handles.hpp"

// `size` tells a caller of another version only if an appended member makes the structure longer.
#define MODAR_ENDS_WITH(type, last) \
  static_assert(sizeof(type) == offsetof(type, last) + sizeof(type::last), "padding at the end")
MODAR_ENDS_WITH(modar_error, reserved);
MODAR_ENDS_WITH(modar_scene, reserved);
MODAR_ENDS_WITH(modar_camera, distortion);
MODAR_ENDS_WITH(modar_picture, chroma_step);
MODAR_ENDS_WITH(modar_pose, reserved);
MODAR_ENDS_WITH(modar_tracker_options, max_instances);
MODAR_ENDS_WITH(modar_turntable, zoom);
MODAR_ENDS_WITH(modar_item, bones);
MODAR_ENDS_WITH(modar_clip, seconds);
MODAR_ENDS_WITH(modar_drawing, item_count);
MODAR_ENDS_WITH(modar_render_stats, bytes_uploaded);
MODAR_ENDS_WITH(modar_render_options, reserved);
MODAR_ENDS_WITH(modar_surface, keep_depth);
MODAR_ENDS_WITH(modar_hit, reserved);
MODAR_ENDS_WITH(modar_node, reserved);
MODAR_ENDS_WITH(modar_media, byte_count);
MODAR_ENDS_WITH(modar_event, reserved);
MODAR_ENDS_WITH(modar_command, reserved);
MODAR_ENDS_WITH(modar_label, covered);
#undef MODAR_ENDS_WITH

using modar::copy_name;
using modar::fail_null;
using modar::set_error;
using modar::usable;

namespace {

modar_bundle* opened(modar::Result<modar::MappedFile> file, modar_error* error) {
  if (!file) return fail_null(file.error(), error);
  const auto view = modar::open_bundle(*file);
  if (!view) return fail_null(view.error(), error);
  return new modar_bundle{std::move(*file), {}, *view};
}

modar_bundle* opened(std::span<const std::byte> bytes, modar_error* error) {
  const auto view = modar::BundleView::open(bytes);
  if (!view) return fail_null(view.error(), error);
  return new modar_bundle{{}, {}, *view};
}

}  // namespace

static_assert(MODAR_VERSION_NUMBER == MODAR_BUILT_VERSION,
              "modar.h and CMakeLists.txt name two versions");

uint32_t modar_version(void) {
  return MODAR_VERSION_NUMBER;
}

modar_bundle* modar_bundle_open(const char* path, modar_error* error) {
  if (path == nullptr) return fail_null(modar::missing("path"), error);
  return opened(modar::MappedFile::open(path), error);
}

modar_bundle* modar_bundle_open_fd(int fd, int64_t offset, int64_t length, modar_error* error) {
  if (offset < 0 || length < 0)
    return fail_null(
        {modar::ExitCode::kUsage, "io.range", "offset", "is negative", "pass the asset's own"},
        error);
  return opened(modar::MappedFile::open(fd, static_cast<std::uint64_t>(offset),
                                        static_cast<std::uint64_t>(length)),
                error);
}

modar_bundle* modar_bundle_open_bytes(const void* bytes, size_t size, modar_error* error) {
  if (bytes == nullptr) return fail_null(modar::missing("bytes"), error);
  const auto* first = static_cast<const std::byte*>(bytes);
  if (reinterpret_cast<std::uintptr_t>(bytes) % alignof(std::uint64_t) == 0)
    return opened(std::span(first, size), error);
  std::vector<std::uint64_t> copy(size / sizeof(std::uint64_t) + 1);
  std::memcpy(copy.data(), first, size);
  const std::span<const std::byte> aligned = std::as_bytes(std::span(copy)).first(size);
  modar_bundle* bundle = opened(aligned, error);
  if (bundle != nullptr) bundle->copy = std::move(copy);
  return bundle;
}

void modar_bundle_close(modar_bundle* bundle) {
  delete bundle;
}

int modar_bundle_verify(const modar_bundle* bundle, modar_error* error) {
  if (bundle == nullptr) return set_error(modar::missing("bundle"), error);
  return set_error(bundle->file.settle(modar::verify_sections(bundle->view)), error);
}

void modar_guard_files(void) {
  modar::guard_mapped_files();
}

int modar_bundle_intact(const modar_bundle* bundle, modar_error* error) {
  if (bundle == nullptr) return set_error(modar::missing("bundle"), error);
  return set_error(bundle->file.intact(), error);
}

uint32_t modar_model_count(const modar_bundle* bundle) {
  return bundle == nullptr ? 0 : bundle->view.models().size();
}

uint32_t modar_pattern_count(const modar_bundle* bundle) {
  return bundle == nullptr ? 0 : bundle->view.patterns().size();
}

uint32_t modar_scene_count(const modar_bundle* bundle) {
  return bundle == nullptr ? 0 : bundle->view.scenes().size();
}

size_t modar_model_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= modar_model_count(bundle)) return 0;
  return copy_name(bundle->view.name(bundle->view.models()[index].name), text, size);
}

size_t modar_pattern_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= modar_pattern_count(bundle)) return 0;
  return copy_name(bundle->view.name(bundle->view.patterns()[index].name), text, size);
}

int modar_model_bounds(const modar_bundle* bundle, uint32_t index, float low[3], float high[3]) {
  if (index >= modar_model_count(bundle) || low == nullptr || high == nullptr) return 0;
  const modar::ModelRecord& model = bundle->view.models()[index];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::numeric_limits<float>::max();
    high[axis] = std::numeric_limits<float>::lowest();
    modar::visit_boxes(bundle->view, model, [&](const auto& least, const auto& greatest) {
      low[axis] = std::min(low[axis], least[axis]);
      high[axis] = std::max(high[axis], greatest[axis]);
    });
  }
  return 1;
}

double modar_pattern_width_mm(const modar_bundle* bundle, uint32_t index) {
  if (index >= modar_pattern_count(bundle)) return 0.0;
  return static_cast<double>(bundle->view.patterns()[index].width_mm);
}

int modar_camera_read(const char* path, modar_camera* camera, modar_error* error) {
  if (path == nullptr || camera == nullptr) {
    return set_error(modar::missing(path == nullptr ? "path" : "camera"), error);
  }
  const auto read = modar::read_camera_yml(path);
  if (!read) return set_error(read.error(), error);
  modar::give_camera(*read, camera);
  return MODAR_OK;
}

int modar_scene_at(const modar_bundle* bundle, uint32_t index, modar_scene* scene) {
  if (index >= modar_scene_count(bundle) || scene == nullptr) return 0;
  const modar::SceneRecord& record = bundle->view.scenes()[index];
  modar_scene ours{0, record.pattern, record.model, {}, index + 1, 0};
  modar::copy_matrix(modar::scene_matrix(record), ours.place);
  modar::give(ours, scene);
  return 1;
}

int modar_pattern_bounds(const modar_bundle* bundle, uint32_t pattern, float low[3],
                         float high[3]) {
  if (bundle == nullptr || low == nullptr || high == nullptr) return 0;
  glm::vec3 least(std::numeric_limits<float>::max());
  glm::vec3 greatest(std::numeric_limits<float>::lowest());
  auto scene = modar::sized<modar_scene>();
  for (uint32_t s = 0; modar_scene_at(bundle, s, &scene) != 0; ++s) {
    glm::vec3 box[2];
    if (scene.pattern != pattern) continue;
    if (modar_model_bounds(bundle, scene.model, &box[0].x, &box[1].x) == 0) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::vec4 at(box[corner & 1].x, box[corner >> 1 & 1].y, box[corner >> 2].z, 1.0f);
      const glm::vec3 placed(glm::make_mat4(scene.place) * at);
      least = glm::min(least, placed);
      greatest = glm::max(greatest, placed);
    }
  }
  for (const modar::NodeRecord& node : bundle->view.nodes()) {
    if (node.pattern != pattern || node.kind == static_cast<uint32_t>(modar::NodeKind::kModel)) {
      continue;
    }
    const glm::quat rotation(node.rotation[3], node.rotation[0], node.rotation[1],
                             node.rotation[2]);
    for (int corner = 0; corner < 4; ++corner) {  // a label's are its point
      const glm::vec3 at(corner % 2 == 0 ? -node.half_size[0] : node.half_size[0],
                         corner / 2 == 0 ? -node.half_size[1] : node.half_size[1], 0.0f);
      const glm::vec3 placed = glm::make_vec3(node.place) + rotation * at;
      least = glm::min(least, placed);
      greatest = glm::max(greatest, placed);
    }
  }
  if (least.x > greatest.x) return 0;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = least[axis];
    high[axis] = greatest[axis];
  }
  return 1;
}

int modar_pattern_picture(const modar_bundle* bundle, uint32_t index, int* width, int* height,
                          const uint8_t** gray) {
  if (index >= modar_pattern_count(bundle)) return 0;
  modar::TrackerRecordView record;
  const auto section = bundle->view.section(modar::SectionType::kTrackerRecord, index);
  if (section.empty() || modar::view_tracker_record(section, record)) return 0;
  if (width != nullptr) *width = static_cast<int>(record.header.width);
  if (height != nullptr) *height = static_cast<int>(record.header.height);
  if (gray != nullptr) *gray = record.pixels.data();
  return 1;
}

size_t modar_language(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (bundle == nullptr) return 0;
  std::vector<std::string> languages;
  const auto add = [&languages](const modar::MetaText& each) {
    if (std::find(languages.begin(), languages.end(), each.language) == languages.end()) {
      languages.push_back(each.language);
    }
  };
  modar::visit_meta_texts(bundle->view.meta(), add);
  modar::visit_node_texts(bundle->view.meta(), add);
  return index < languages.size() ? copy_name(languages[index], text, size) : 0;
}

size_t modar_pattern_text(const modar_bundle* bundle, uint32_t pattern, int kind,
                          const char* language, char* text, size_t size) {
  if (pattern >= modar_pattern_count(bundle) || language == nullptr) return 0;
  const std::string_view name = bundle->view.name(bundle->view.patterns()[pattern].name);
  const auto wanted =
      kind == MODAR_ALT_TEXT ? modar::MetaText::Kind::kAlt : modar::MetaText::Kind::kText;
  std::string joined;
  modar::visit_meta_texts(bundle->view.meta(), [&](const modar::MetaText& each) {
    if (each.pattern != name || each.language != language || each.kind != wanted) return;
    if (!joined.empty()) joined += ' ';
    joined += each.words;
  });
  return joined.empty() ? 0 : copy_name(joined, text, size);
}

void modar_camera_default(int width, int height, modar_camera* camera) {
  modar::give_camera(modar::default_camera(width, height), camera);
}

void modar_projection(const modar_camera* camera, double near_plane, double far_plane,
                      float projection[16]) {
  if (camera == nullptr || projection == nullptr) return;
  if (!usable(*camera) || !usable(near_plane) || !usable(far_plane)) return;
  modar::copy_matrix(modar::gl_projection(modar::camera_of(*camera), near_plane, far_plane),
                     projection);
}
