// modar.h: nodes and the screen. Nothing of the tracker, and of the renderer what makes no GL call.
#include <memory>
#include <vector>

#include "formats/captions.hpp"
#include "formats/meta_text.hpp"
#include "modar/screen_machine.hpp"
#include "runtime/capi/handles.hpp"

static_assert(MODAR_NODE_MODEL == static_cast<int>(modar::NodeKind::kModel));
static_assert(MODAR_NODE_PICTURE == static_cast<int>(modar::NodeKind::kPicture));
static_assert(MODAR_NODE_LABEL == static_cast<int>(modar::NodeKind::kLabel));
static_assert(MODAR_NODE_VIDEO == static_cast<int>(modar::NodeKind::kVideo));
static_assert(MODAR_NODE_SOUND == static_cast<int>(modar::NodeKind::kSound));
static_assert(MODAR_PLAY == static_cast<int>(modar::ActionCommand::kPlay));
static_assert(MODAR_PAUSE == static_cast<int>(modar::ActionCommand::kPause));
static_assert(MODAR_SHOW_TEXT == static_cast<int>(modar::ActionCommand::kText));
static_assert(MODAR_OPEN_LINK == static_cast<int>(modar::ActionCommand::kLink));

struct modar_screen {
  explicit modar_screen(const modar::BundleView& bundle) : view(bundle), machine(bundle) {}

  modar::BundleView view;
  modar::ScreenMachine machine;
  std::vector<modar::SceneEvent> events;
  std::span<const modar::SceneCommand> commands;
  std::vector<modar::DrawItem> items;
};

namespace {

// modar_orbit(): the field of view across the smaller side, in radians, as from a hand's distance;
// and room around the content.
constexpr double kOrbitField = 0.6981317007977318;
constexpr double kOrbitMargin = 1.06;

bool has_node(const modar_screen* screen, uint32_t node) {
  return screen != nullptr && node < screen->view.nodes().size();
}

std::optional<modar::MetaText::Kind> kind_of(int kind) {
  switch (kind) {
    case MODAR_TEXT:
      return modar::MetaText::Kind::kText;
    case MODAR_ALT_TEXT:
      return modar::MetaText::Kind::kAlt;
    case MODAR_TITLE:
      return modar::MetaText::Kind::kTitle;
    case MODAR_CAPTIONS:
      return modar::MetaText::Kind::kCaptions;
    default:
      return std::nullopt;
  }
}

/// A pixel of the frame; false behind the eye.
bool project(const modar::Camera& camera, const glm::vec3& eye, modar_label& label) {
  if (!(eye.z < 0.0f)) return false;
  const glm::dvec3 at(eye);
  label.x = static_cast<float>(camera.cx - camera.fx * at.x / at.z);
  label.y = static_cast<float>(camera.cy + camera.fy * at.y / at.z);
  label.distance = static_cast<float>(glm::length(at));
  return true;
}

}  // namespace

uint32_t modar_node_count(const modar_bundle* bundle) {
  return bundle == nullptr ? 0 : bundle->view.nodes().size();
}

int modar_node_at(const modar_bundle* bundle, uint32_t index, modar_node* node) {
  if (index >= modar_node_count(bundle) || node == nullptr) return 0;
  const modar::NodeRecord& record = bundle->view.nodes()[index];
  const bool model = record.kind == static_cast<uint32_t>(modar::NodeKind::kModel);
  const float* place = model ? bundle->view.scenes()[record.subject].offset : record.place;
  modar::give({0,
               record.pattern,
               static_cast<int>(record.kind),
               model ? record.subject + 1 : 0,
               {place[0], place[1], place[2]},
               (record.flags & modar::kNodeHidden) != 0 ? 1 : 0,
               modar::plays_media(record) ? record.subject + 1 : 0,
               (record.flags & modar::kNodeLoops) != 0 ? 1 : 0,
               0},
              node);
  return 1;
}

int modar_media_at(const modar_bundle* bundle, uint32_t index, modar_media* media) {
  if (bundle == nullptr || index >= bundle->view.media().size() || media == nullptr) return 0;
  const modar::MediaRecord& record = bundle->view.media()[index];
  const std::span<const std::byte> bytes = bundle->view.media_data(index);
  modar::give(
      {0, static_cast<int>(record.width), static_cast<int>(record.height),
       (record.flags & modar::kMediaSound) != 0 ? 1 : 0, static_cast<double>(record.seconds),
       reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()},
      media);
  return 1;
}

size_t modar_node_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= modar_node_count(bundle)) return 0;
  return modar::copy_name(bundle->view.name(bundle->view.nodes()[index].name), text, size);
}

size_t modar_node_mark(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= modar_node_count(bundle)) return 0;
  return modar::copy_name(bundle->view.name(bundle->view.nodes()[index].mark), text, size);
}

namespace {

/// Of a node that exists; empty: it has none.
std::string words_of(const modar_bundle* bundle, uint32_t index, int kind, const char* language) {
  const modar::NodeRecord& node = bundle->view.nodes()[index];
  const std::string_view pattern = bundle->view.name(bundle->view.patterns()[node.pattern].name);
  const std::string_view name = bundle->view.name(node.name);
  std::string words;
  modar::visit_node_texts(bundle->view.meta(), [&](const modar::MetaText& each) {
    if (each.pattern == pattern && each.node == name && each.language == language &&
        each.kind == kind_of(kind)) {
      words = each.words;
    }
  });
  return words;
}

}  // namespace

size_t modar_node_text(const modar_bundle* bundle, uint32_t index, int kind, const char* language,
                       char* text, size_t size) {
  if (index >= modar_node_count(bundle) || language == nullptr) return 0;
  const std::string words = words_of(bundle, index, kind, language);
  return words.empty() ? 0 : modar::copy_name(words, text, size);
}

size_t modar_node_caption(const modar_bundle* bundle, uint32_t index, const char* language,
                          double seconds, char* text, size_t size) {
  if (index >= modar_node_count(bundle) || language == nullptr || !modar::usable(seconds)) return 0;
  const std::string captions = words_of(bundle, index, MODAR_CAPTIONS, language);
  const std::string words =
      seconds < 0 ? modar::transcript(captions) : modar::words_at(captions, seconds);
  return words.empty() ? 0 : modar::copy_name(words, text, size);
}

size_t modar_action_address(const modar_bundle* bundle, uint32_t action, char* text, size_t size) {
  if (bundle == nullptr || action >= bundle->view.actions().size()) return 0;
  return modar::copy_name(bundle->view.name(bundle->view.actions()[action].address), text, size);
}

modar_screen* modar_screen_create(const modar_bundle* bundle, modar_error* error) {
  if (bundle == nullptr) return modar::fail_null(modar::missing("bundle"), error);
  auto made = std::make_unique<modar_screen>(bundle->view);
  made->events.reserve(bundle->view.patterns().size() + 2 * bundle->view.nodes().size());
  made->items.reserve(bundle->view.scenes().size() + bundle->view.nodes().size());
  return made.release();
}

void modar_screen_destroy(modar_screen* screen) {
  delete screen;
}

void modar_screen_reset(modar_screen* screen) {
  if (screen == nullptr) return;
  screen->machine.reset();
  screen->commands = {};
}

int modar_orbit(const modar_bundle* bundle, uint32_t pattern, const modar_turntable* from,
                modar_camera* camera, modar_pose* pose) {
  if (pattern >= modar_pattern_count(bundle)) return 0;
  if (from == nullptr || camera == nullptr || pose == nullptr) return 0;
  const auto [size, turn, tilt, zoom] = modar::grown(*from);
  modar_camera lens = modar::grown(*camera);
  if (lens.width < 1 || lens.height < 1 || !(zoom > 0.0)) return 0;
  if (!modar::usable(turn) || !modar::usable(tilt) || !modar::usable(zoom) ||
      !modar::usable(1.0 / zoom))
    return 0;
  const modar::PatternRecord& plane = bundle->view.patterns()[pattern];
  const glm::vec3 half(plane.half_width, plane.half_height, 0.0f);
  glm::vec3 low = -half;
  glm::vec3 high = half;
  if (modar_pattern_bounds(bundle, pattern, &low.x, &high.x) != 0) {
    low = glm::min(low, -half);
    high = glm::max(high, half);
  }
  lens.fx = lens.fy = 0.5 * std::min(lens.width, lens.height) / std::tan(0.5 * kOrbitField);
  lens.cx = 0.5 * (lens.width - 1);
  lens.cy = 0.5 * (lens.height - 1);
  std::fill(std::begin(lens.distortion), std::end(lens.distortion), 0.0);
  // Who turns the content turns the eye the other way.
  const auto angle = static_cast<float>(-turn);
  const auto rise = static_cast<float>(tilt);
  const glm::vec3 right(std::cos(angle), std::sin(angle), 0.0f);
  const glm::vec3 back(right.y * std::cos(rise), -right.x * std::cos(rise), std::sin(rise));
  const glm::vec3 axes[3] = {right, glm::cross(right, back), -back};
  const double radius = 0.5 * static_cast<double>(glm::length(high - low));
  const double distance = kOrbitMargin * radius / std::sin(0.5 * kOrbitField) / zoom;
  const glm::vec3 eye = 0.5f * (high + low) + static_cast<float>(distance) * back;
  modar_pose ours{};
  ours.visible = ours.shown = 1;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      ours.rotation[3 * row + column] = axes[row][column];
    }
    ours.translation[row] = -glm::dot(axes[row], eye);
  }
  modar::give(lens, camera);
  modar::give(ours, pose);
  return 1;
}

int modar_screen_touch(modar_screen* screen, const modar_touch* touch) {
  if (screen == nullptr || touch == nullptr) return MODAR_NOTHING;
  const modar_touch asked = modar::grown(*touch);
  const double numbers[] = {asked.x, asked.y, asked.width, asked.height};
  if (!modar::usable(numbers, 4) || !(asked.width >= 1 && asked.height >= 1)) return MODAR_NOTHING;
  return screen->machine.touch(asked);
}

void modar_screen_press(modar_screen* screen, int button, double steps) {
  if (screen == nullptr || !modar::usable(steps)) return;
  if (button < MODAR_TURN || button > MODAR_CAPTIONS_SHOWN) return;
  screen->machine.press(button, steps);
}

void modar_screen_look_around(modar_screen* screen, uint32_t pattern, double time_s, int present) {
  if (screen == nullptr || !modar::usable(time_s)) return;
  screen->machine.look_around(pattern, time_s, present != 0);
}

void modar_screen_follow(modar_screen* screen, double time_s, uint32_t number, int reason,
                         double brightness) {
  if (screen == nullptr || !modar::usable(time_s) || !modar::usable(brightness)) return;
  screen->machine.follow(time_s, number, reason, brightness);
}

void modar_screen_status(const modar_screen* screen, modar_status* status) {
  if (screen != nullptr) modar::give(screen->machine.status(), status);
}

int modar_screen_turntable(modar_screen* screen, double time_s, modar_turntable* from) {
  if (screen == nullptr || from == nullptr || !modar::usable(time_s)) return 0;
  modar::give(screen->machine.turntable(time_s), from);
  return 1;
}

int modar_screen_add_pattern(modar_screen* screen, uint32_t scene) {
  if (screen == nullptr || scene >= screen->view.scenes().size()) return 0;
  screen->machine.add_pattern(scene);
  return 1;
}

void modar_screen_forget_patterns(modar_screen* screen) {
  if (screen != nullptr) screen->machine.forget_patterns();
}

size_t modar_screen_step(modar_screen* screen, double time_s, const modar_event* events,
                         size_t count) {
  if (screen == nullptr || !modar::usable(time_s)) return 0;
  screen->events.clear();
  count = modar::item_count(events, count);
  for (size_t i = 0; i < count; ++i) {
    const modar_event event = modar::item_at(events, i);
    using Kind = modar::SceneEvent::Kind;
    const Kind kind = event.kind == MODAR_TAP     ? Kind::kTap
                      : event.kind == MODAR_ENDED ? Kind::kEnded
                                                  : Kind::kSeen;
    screen->events.push_back({kind, event.subject, event.material - 1});
  }
  screen->commands = screen->machine.step(time_s, screen->events);
  return screen->commands.size();
}

int modar_screen_command(const modar_screen* screen, size_t index, modar_command* command) {
  if (screen == nullptr || index >= screen->commands.size()) return 0;
  const modar::SceneCommand& ours = screen->commands[index];
  modar::give({0, static_cast<int>(ours.command), ours.node, ours.action, 0}, command);
  return 1;
}

int modar_screen_shown(const modar_screen* screen, uint32_t node) {
  return has_node(screen, node) && screen->machine.shown(node) ? 1 : 0;
}

int modar_screen_waiting(const modar_screen* screen) {
  return screen != nullptr && screen->machine.waiting() ? 1 : 0;
}

uint32_t modar_clip_count(const modar_bundle* bundle) {
  return bundle == nullptr ? 0 : bundle->view.clips().size();
}

int modar_clip_at(const modar_bundle* bundle, uint32_t index, modar_clip* clip) {
  if (index >= modar_clip_count(bundle) || clip == nullptr) return 0;
  const modar::ClipRecord& record = bundle->view.clips()[index];
  modar::give({0, record.model, record.seconds}, clip);
  return 1;
}

size_t modar_clip_name(const modar_bundle* bundle, uint32_t index, char* text, size_t size) {
  if (index >= modar_clip_count(bundle)) return 0;
  return modar::copy_name(bundle->view.name(bundle->view.clips()[index].name), text, size);
}

int modar_clip_play(modar_screen* screen, uint32_t scene, uint32_t clip, int loops,
                    double blend_s) {
  if (screen == nullptr || !modar::usable(blend_s)) return 0;
  return screen->machine.play(scene, clip, loops != 0, blend_s) ? 1 : 0;
}

void modar_clip_stop(modar_screen* screen, uint32_t scene) {
  if (screen != nullptr) screen->machine.stop(scene);
}

uint32_t modar_clip_playing(const modar_screen* screen, uint32_t scene) {
  return screen == nullptr ? 0 : screen->machine.playing(scene) + 1;
}

size_t modar_clip_bones(const modar_screen* screen, uint32_t scene, float* rows, size_t capacity) {
  if (screen == nullptr) return 0;
  const auto bones = screen->machine.bones(scene);
  const size_t count = 12 * bones.size();
  if (rows != nullptr && count > 0)
    std::copy_n(glm::value_ptr(bones[0][0]), std::min(count, capacity), rows);
  return count;
}

size_t modar_screen_items(modar_screen* screen, uint32_t pattern, const float view[16],
                          modar_item* items, size_t capacity) {
  if (screen == nullptr || view == nullptr || capacity == 0 || !modar::usable(view, 16)) return 0;
  if (modar::item_count(items, capacity) == 0) return 0;
  screen->items.clear();
  screen->machine.add_items(pattern, glm::make_mat4(view), screen->items);
  const size_t count = std::min(capacity, screen->items.size());
  const size_t stride = items->size;
  for (size_t i = 0; i < count; ++i) {
    const modar::DrawItem& ours = screen->items[i];
    modar_item item{};
    item.model = ours.model;
    modar::copy_matrix(ours.to_eye, item.to_eye);
    item.scene = ours.scene + 1;
    modar::copy_matrix(ours.world_to_eye, item.world_to_eye);
    item.node = ours.node + 1;
    if (ours.bones != nullptr) item.bones = glm::value_ptr((*ours.bones)[0]);
    auto* to = reinterpret_cast<modar_item*>(reinterpret_cast<char*>(items) + i * stride);
    to->size = stride;
    modar::give(item, to);
  }
  return count;
}

int modar_label_project(const modar_screen* screen, uint32_t node, const modar_drawing* drawing,
                        const float view[16], modar_label* label) {
  if (!has_node(screen, node) || drawing == nullptr || view == nullptr || label == nullptr) {
    return 0;
  }
  const modar_drawing drawn = modar::grown(*drawing);
  if (!modar::usable(drawn) || drawn.camera == nullptr || !modar::usable(view, 16)) return 0;
  const modar::NodeRecord& record = screen->view.nodes()[node];
  if (record.kind != static_cast<uint32_t>(modar::NodeKind::kLabel) ||
      !screen->machine.shown(node)) {
    return 0;
  }
  const glm::vec4 point(record.place[0], record.place[1], record.place[2], 1.0f);
  const modar::Camera ours = modar::camera_of(*drawn.camera);
  modar_label found{};
  if (!project(ours, glm::vec3(glm::make_mat4(view) * point), found)) return 0;
  const modar_bundle bundle{{}, {}, screen->view};
  auto hit = modar::sized<modar_hit>();
  // Surfaces nearer than 98 % of the way cover the point: a label is on its own surface.
  constexpr float kNearer = 0.98f;
  found.covered = modar_pick(&bundle, drawing, static_cast<double>(found.x),
                             static_cast<double>(found.y), &hit) != 0 &&
                          hit.distance < kNearer * found.distance
                      ? 1
                      : 0;
  modar::give(found, label);
  return 1;
}
