// The light of a frame's items, turned from the pattern's world to the eye's. Internal to
// runtime/render.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "modar/renderer.hpp"
#include "runtime/render/light_estimate.hpp"

namespace modar {

/// What shaders/model.vert takes: u_sky, u_key, u_key_colour.
struct EyeLight {
  std::array<glm::vec4, 7> sky{};
  glm::vec4 key{0.0f};
  glm::vec4 key_colour{0.0f};
};

/// world_to_eye: its first three columns turn; their lengths do not matter.
/// gain: what a white surface that looks up gets then, in parts of 1 (see LightEstimator).
RoomLight scaled_light(const RoomLight& light, const glm::vec3& gain);

EyeLight turn_light(const RoomLight& light, const glm::mat4& world_to_eye, float ambient_strength,
                    float light_strength);

/// One light for all items that share one, so that they can share draw calls.
class LightList {
 public:
  /// Keeps its memory from call to call. estimator: null where light is as stated.
  void build(const BundleView& bundle, std::span<const DrawItem> items,
             const RenderOptions& options, const LightEstimator* estimator);
  [[nodiscard]] std::uint32_t of_item(std::uint32_t item) const { return of_item_[item]; }
  [[nodiscard]] const EyeLight& light(std::uint32_t index) const { return lights_[index]; }

 private:
  std::vector<EyeLight> lights_;
  std::vector<std::uint32_t> first_item_;  ///< of each light
  std::vector<std::uint32_t> of_item_;
};

}  // namespace modar
