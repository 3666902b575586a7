// Which chunks of which items are drawn, at which level, in which order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/cull.hpp"

namespace modar {

struct DrawCommand {
  std::uint32_t item = 0;
  std::uint32_t chunk = 0;  ///< of the bundle
  std::uint32_t level = 0;  ///< of the bundle
  std::uint32_t program = 0;
  std::uint32_t texture = 0;  ///< kNone: none
  std::uint32_t material = 0;
  float distance = 0.0f;  ///< eye space
  bool blended = false;
};

/// What a chunk needs from the renderer's set-up.
struct ChunkSetup {
  std::uint32_t program = 0;
  std::uint32_t material = 0;  ///< the first one of its values
  bool blended = false;
};

class DrawList {
 public:
  /// Collects what is visible. setups: one a chunk of the bundle. Keeps its memory from call to
  /// call.
  void build(const BundleView& bundle, std::span<const ChunkSetup> setups,
             const glm::mat4& projection, int height, std::span<const DrawItem> items,
             float lod_pixels);
  /// Nearest first: the order in which GPU memory is given out.
  void sort_by_distance();
  /// Opaque ones by program, texture and material, then blended ones from far to near.
  void sort_by_state(const BundleView& bundle);

  [[nodiscard]] std::vector<DrawCommand>& commands() { return commands_; }
  [[nodiscard]] const ModelView& view(std::uint32_t item) const { return views_[item]; }
  [[nodiscard]] int culled() const { return culled_; }

 private:
  std::vector<DrawCommand> commands_;
  std::vector<ModelView> views_;  ///< one an item
  int culled_ = 0;
};

}  // namespace modar
