// Clicks and actions, apart from drawing: left out of the build of the device, which has no
// window.
#pragma once

#include <optional>
#include <span>

#include "formats/action_machine.hpp"
#include "modar/renderer.hpp"

namespace modar {

/// The tap on the node under a pixel of the picture, if any.
std::optional<SceneEvent> tap_at(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                                 std::span<const DrawItem> items);

}  // namespace modar
