// The light of a frame's items, turned from the pattern's world to the eye's or a model's. Internal
// to runtime/render.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "modar/renderer.hpp"
#include "runtime/render/light_estimate.hpp"

namespace modar {

/// What shaders/model.vert takes: u_sky, u_key, u_key_colour.
struct TurnedLight {
  std::array<glm::vec4, 7> sky{};
  glm::vec4 key{0.0f};
  glm::vec4 key_colour{0.0f};
};

/// The turn of a matrix that keeps angles; it may mirror.
glm::mat3 rotation_of(const glm::mat4& matrix);

/// gain: what a white surface that looks up gets then, in parts of 1 (see LightEstimator).
RoomLight scaled_light(const RoomLight& light, const glm::vec3& gain);

TurnedLight turn_light(const RoomLight& light, const glm::mat3& turn, float ambient_strength,
                       float light_strength);

/// One light for all items in the same light that is turned the same way, whichever scenes are
/// theirs, so that they can share draw calls.
class LightList {
 public:
  /// Keeps its memory from call to call. estimator: null where light is as stated.
  void build(const BundleView& bundle, std::span<const DrawItem> items,
             const RenderOptions& options, const LightEstimator* estimator);
  [[nodiscard]] std::uint32_t of_item(std::uint32_t item) const { return of_item_[item]; }
  [[nodiscard]] TurnedLight in_eye_space(std::uint32_t light) const;
  /// The item's matrix keeps angles.
  [[nodiscard]] TurnedLight in_model_space(const DrawItem& item, std::uint32_t light) const;
  /// The key light's colour as the shader has it.
  [[nodiscard]] glm::vec4 key_colour(std::uint32_t light) const;

 private:
  struct Light {
    RoomLight room;
    glm::mat3 to_eye{1.0f};
    bool operator==(const Light&) const = default;
  };
  std::vector<Light> lights_;
  std::vector<std::uint32_t> of_item_;
  float ambient_strength_ = 1.0f;
  float light_strength_ = 1.0f;
};

}  // namespace modar
