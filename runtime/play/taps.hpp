// What clicks and actions need beside drawing: left out of the build of the device, which has no
// window.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/action_machine.hpp"
#include "modar/renderer.hpp"

namespace modar {

/// The tap on what lies under a pixel of the picture, if a node does.
std::optional<SceneEvent> tap_at(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                                 std::span<const DrawItem> items);

/// Appends "play NODE", "pause NODE", "text NODE" or "link ADDRESS".
void log_command(const BundleView& bundle, const SceneCommand& command,
                 std::vector<std::string>& log);

/// Prints a label's words, or the address of a link, to stderr.
void print_command(const BundleView& bundle, const SceneCommand& command);

}  // namespace modar
