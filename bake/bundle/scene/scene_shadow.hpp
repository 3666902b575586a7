// The soft shadow of a scene's model on its pattern's plane.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/bundle_writer.hpp"

namespace modar {

/// The kShadow section of a scene: 64 x 64 texels (4 KB) of the light that a neutral room, or the
/// scene's own light, leaves on the plane below the models; transparent parts let light through.
/// Empty where nothing does. content: with its models and scenes, and the scene's light where it
/// has one. The same on any number of threads.
std::vector<std::byte> scene_shadow(const BundleContent& content, std::uint32_t scene,
                                    unsigned jobs);

}  // namespace modar
