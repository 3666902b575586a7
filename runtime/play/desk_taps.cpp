#include "taps.hpp"

namespace modar {

std::optional<SceneEvent> tap_at(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                                 std::span<const DrawItem> items) {
  const auto hit = pick(bundle, camera, pixel, items);
  if (!hit || items[hit->item].node == kNone) return std::nullopt;
  return SceneEvent{SceneEvent::Kind::kTap, items[hit->item].node, hit->material};
}

}  // namespace modar
