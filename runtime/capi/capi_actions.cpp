// modar.h: nodes and actions. Nothing of the tracker, and of the renderer what makes no GL call.
#include <memory>
#include <vector>

#include "formats/captions.hpp"
#include "formats/meta_text.hpp"
#include "modar/renderer.hpp"
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

struct modar_actions {
  modar::BundleView view;
  modar::ActionMachine machine;
  std::vector<modar::SceneEvent> events;
  std::span<const modar::SceneCommand> commands;
  std::vector<modar::DrawItem> items;
};

namespace {

bool has_node(const modar_actions* actions, uint32_t node) {
  return actions != nullptr && node < actions->view.nodes().size();
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

modar_actions* modar_actions_create(const modar_bundle* bundle, modar_error* error) {
  if (bundle == nullptr) return modar::fail_null(modar::missing("bundle"), error);
  auto made = std::make_unique<modar_actions>(
      modar_actions{bundle->view, modar::ActionMachine(bundle->view), {}, {}, {}});
  made->events.reserve(bundle->view.patterns().size() + 2 * bundle->view.nodes().size());
  made->items.reserve(bundle->view.scenes().size() + bundle->view.nodes().size());
  return made.release();
}

void modar_actions_destroy(modar_actions* actions) {
  delete actions;
}

void modar_actions_reset(modar_actions* actions) {
  if (actions == nullptr) return;
  actions->machine.reset();
  actions->commands = {};
}

size_t modar_actions_step(modar_actions* actions, double time_s, const modar_event* events,
                          size_t count) {
  if (actions == nullptr || !modar::usable(time_s)) return 0;
  actions->events.clear();
  count = modar::item_count(events, count);
  for (size_t i = 0; i < count; ++i) {
    const modar_event event = modar::item_at(events, i);
    using Kind = modar::SceneEvent::Kind;
    const Kind kind = event.kind == MODAR_TAP     ? Kind::kTap
                      : event.kind == MODAR_ENDED ? Kind::kEnded
                                                  : Kind::kSeen;
    actions->events.push_back({kind, event.subject, event.material - 1});
  }
  actions->commands = actions->machine.step(time_s, actions->events);
  return actions->commands.size();
}

int modar_actions_command(const modar_actions* actions, size_t index, modar_command* command) {
  if (actions == nullptr || index >= actions->commands.size()) return 0;
  const modar::SceneCommand& ours = actions->commands[index];
  modar::give({0, static_cast<int>(ours.command), ours.node, ours.action, 0}, command);
  return 1;
}

int modar_actions_shown(const modar_actions* actions, uint32_t node) {
  return has_node(actions, node) && actions->machine.shown(node) ? 1 : 0;
}

int modar_actions_waiting(const modar_actions* actions) {
  return actions != nullptr && actions->machine.waiting() ? 1 : 0;
}

size_t modar_actions_items(modar_actions* actions, uint32_t pattern, const float view[16],
                           modar_item* items, size_t capacity) {
  capacity = modar::item_count(items, capacity);
  if (actions == nullptr || view == nullptr || capacity == 0 || !modar::usable(view, 16)) return 0;
  actions->items.clear();
  modar::add_items(actions->view, actions->machine, pattern, glm::make_mat4(view), actions->items);
  const size_t count = std::min(capacity, actions->items.size());
  const size_t stride = items->size;
  for (size_t i = 0; i < count; ++i) {
    const modar::DrawItem& ours = actions->items[i];
    modar_item item{};
    item.model = ours.model;
    modar::copy_matrix(ours.to_eye, item.to_eye);
    item.scene = ours.scene + 1;
    modar::copy_matrix(ours.world_to_eye, item.world_to_eye);
    item.node = ours.node + 1;
    auto* to = reinterpret_cast<modar_item*>(reinterpret_cast<char*>(items) + i * stride);
    to->size = stride;
    modar::give(item, to);
  }
  return count;
}

int modar_label_project(const modar_actions* actions, uint32_t node, const modar_drawing* drawing,
                        const float view[16], modar_label* label) {
  if (!has_node(actions, node) || drawing == nullptr || view == nullptr || label == nullptr) {
    return 0;
  }
  const modar_drawing drawn = modar::grown(*drawing);
  if (!modar::usable(drawn) || drawn.camera == nullptr || !modar::usable(view, 16)) return 0;
  const modar::NodeRecord& record = actions->view.nodes()[node];
  if (record.kind != static_cast<uint32_t>(modar::NodeKind::kLabel) ||
      !actions->machine.shown(node)) {
    return 0;
  }
  const glm::vec4 point(record.place[0], record.place[1], record.place[2], 1.0f);
  const modar::Camera ours = modar::camera_of(*drawn.camera);
  modar_label found{};
  if (!project(ours, glm::vec3(glm::make_mat4(view) * point), found)) return 0;
  const modar_bundle bundle{{}, {}, actions->view};
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
