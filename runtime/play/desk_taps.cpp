#include <cstdio>
#include <string>

#include "formats/meta_text.hpp"
#include "taps.hpp"

namespace modar {

std::optional<SceneEvent> tap_at(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                                 std::span<const DrawItem> items) {
  const auto hit = pick(bundle, camera, pixel, items);
  if (!hit || items[hit->item].node == kNone) return std::nullopt;
  return SceneEvent{SceneEvent::Kind::kTap, items[hit->item].node, hit->material};
}

void log_command(const BundleView& bundle, const SceneCommand& command,
                 std::vector<std::string>& log) {
  if (command.command == ActionCommand::kLink) {
    log.push_back("link " + std::string(bundle.name(bundle.actions()[command.action].address)));
    return;
  }
  const char* verb = command.command == ActionCommand::kPlay    ? "play "
                     : command.command == ActionCommand::kPause ? "pause "
                                                                : "text ";
  log.push_back(verb + std::string(bundle.name(bundle.nodes()[command.node].name)));
}

void print_command(const BundleView& bundle, const SceneCommand& command) {
  if (command.command == ActionCommand::kLink) {
    const std::string address(bundle.name(bundle.actions()[command.action].address));
    std::fprintf(stderr, "modar-play: link: %s\n", address.c_str());
  }
  if (command.command != ActionCommand::kText) return;
  const NodeRecord& node = bundle.nodes()[command.node];
  const std::string_view pattern = bundle.name(bundle.patterns()[node.pattern].name);
  const std::string_view name = bundle.name(node.name);
  visit_node_texts(bundle.meta(), [&](const MetaText& each) {
    const bool shown = each.kind == MetaText::Kind::kTitle || each.kind == MetaText::Kind::kText;
    if (each.pattern != pattern || each.node != name || !shown) return;
    std::fprintf(stderr, "modar-play: %s [%s]: %s\n", each.node.c_str(), each.language.c_str(),
                 each.words.c_str());
  });
}

}  // namespace modar
