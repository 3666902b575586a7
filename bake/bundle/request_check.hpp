// What can be said of a request before anything is baked.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"

namespace modar {

/// A scene with the indices of what it names.
struct KnownScene {
  SceneRequest scene;
  std::uint32_t pattern = 0;
  std::uint32_t model = 0;
};

/// The request's scenes; where it has none, the one that one model and one pattern make. Names must
/// be set. Errors: kUsage "bake.scene-unknown".
Result<std::vector<KnownScene>> find_scenes(const BakeRequest& request);

}  // namespace modar
