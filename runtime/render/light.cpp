// A room's light as a polynomial of the normal, and its turn from world to eye.
#include "runtime/render/light.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace modar {

glm::mat3 rotation_of(const glm::mat4& matrix) {
  glm::mat3 turn;
  for (int i = 0; i < 3; ++i) {
    const glm::vec3 axis(matrix[i]);
    const float length = glm::length(axis);
    turn[i] = length > 0.0f ? axis / length : axis;
  }
  return turn;
}

RoomLight neutral_room() {
  // A bright ceiling, gray walls and a floor that gives back some of it; a lamp over the viewer's
  // left shoulder, 42 degrees high. White that looks up gets 1.0 in all, what faces the lamp 1.25,
  // a wall that it does not reach 0.25, what looks down 0.12. More of the lamp shows more form of
  // scans without a picture, and more of the shadows that it has no rays for: by the lab's bench
  // light and by three.js' pictures of four busts, whose spread of brightness this comes near.
  RoomLight room;
  room.sky[0] = {0.267f, 0.270f, 0.276f};
  room.sky[1] = glm::vec3(-0.030f);
  room.sky[2] = {0.145f, 0.150f, 0.158f};
  room.sky[3] = glm::vec3(-0.040f);
  room.direction = {-0.55f, -0.50f, 0.67f};
  room.key = {0.880f, 0.860f, 0.825f};
  return room;
}

glm::vec4 mirror_factors(float shininess, float reflectance, float metalness) {
  // The sky's polynomials are weakened to 2/3 and 1/4 of its radiance; a lobe cos^s with s = n / 4
  // about the mirrored ray weakens them by (s + 1) / (s + 2) and s / (s + 3).
  const float n = std::max(shininess, 4.0f);
  const float roughness = std::sqrt(std::sqrt(2.0f / (shininess + 2.0f)));
  // Rough surfaces mirror less: fits of Karis' approximation ("Physically Based Shading on Mobile",
  // 2014) straight on and at a grazing angle.
  const float smooth = 1.0f - roughness;
  const float dielectric = reflectance > 0.0f ? 1.0f - metalness : 0.0f;
  return {1.5f * (n + 4.0f) / (n + 8.0f), 4.0f * n / (n + 12.0f),
          reflectance * dielectric * (0.45f + 0.55f * smooth),
          (reflectance > 0.0f ? 1.0f - 0.5f * metalness : 0.0f) * smooth * smooth * smooth};
}

RoomLight light_of_record(const LightRecord& record) {
  RoomLight light;
  for (std::size_t k = 0; k < light.sky.size(); ++k) {
    light.sky[k] = {record.sky[3 * k], record.sky[3 * k + 1], record.sky[3 * k + 2]};
  }
  light.direction = {record.direction[0], record.direction[1], record.direction[2]};
  light.key = {record.key[0], record.key[1], record.key[2]};
  return light;
}

RoomLight scene_light(const BundleView& bundle, std::uint32_t scene) {
  for (const LightRecord& light : bundle.lights()) {
    if (light.scene == scene) return light_of_record(light);
  }
  return neutral_room();
}

RoomLight scaled_light(const RoomLight& light, const glm::vec3& gain) {
  const float length = glm::length(light.direction);
  const float height = length > 0.0f ? std::max(light.direction.z / length, 0.0f) : 0.0f;
  const glm::vec3 up = light.sky[0] + light.sky[2] + 2.0f * light.sky[6] + light.key * height;
  const glm::vec3 factor = gain / glm::max(up, 0.05f);
  RoomLight scaled = light;
  for (glm::vec3& coefficient : scaled.sky) coefficient *= factor;
  scaled.key *= factor;
  return scaled;
}

TurnedLight turn_light(const RoomLight& light, const glm::mat3& turn, float ambient_strength,
                       float light_strength) {
  const glm::mat3 back = glm::transpose(turn);
  TurnedLight turned;
  for (int c = 0; c < 3; ++c) {
    const auto at = [&](std::size_t i) { return light.sky[i][c] * ambient_strength; };
    // The quadratic part as a symmetric matrix without trace: p = n^T q n.
    const glm::mat3 q = {glm::vec3(at(8) - at(6), 0.5f * at(4), 0.5f * at(7)),
                         glm::vec3(0.5f * at(4), -at(8) - at(6), 0.5f * at(5)),
                         glm::vec3(0.5f * at(7), 0.5f * at(5), 2.0f * at(6))};
    const glm::mat3 e = turn * q * back;
    const glm::vec3 linear = turn * glm::vec3(at(3), at(1), at(2));
    // With x^2 + y^2 + z^2 = 1: the diagonal is (e00 - e11) / 2 (x^2 - y^2) + 3/2 e22 z^2 - e22
    // / 2.
    const std::size_t channel = static_cast<std::size_t>(c);
    turned.sky[channel] = glm::vec4(linear, at(0) - 0.5f * e[2][2]);
    turned.sky[3 + channel] = {2.0f * e[1][0], 2.0f * e[2][1], 1.5f * e[2][2], 2.0f * e[2][0]};
    turned.sky[6][c] = 0.5f * (e[0][0] - e[1][1]);
  }
  const float length = glm::length(light.direction);
  turned.key = glm::vec4(length > 0.0f ? turn * light.direction / length : glm::vec3(0.0f), 0.0f);
  turned.key_colour = glm::vec4(light.key * light_strength, 1.0f);
  return turned;
}

void LightList::build(const BundleView& bundle, std::span<const DrawItem> items,
                      const RenderOptions& options, const LightEstimator* estimator) {
  ambient_strength_ = options.ambient_strength;
  light_strength_ = options.light_strength;
  lights_.clear();
  of_item_.clear();
  const DrawItem* before = nullptr;
  for (const DrawItem& item : items) {
    const DrawItem* last = std::exchange(before, &item);
    // Moving parts follow each other.
    if (last != nullptr && last->scene == item.scene && last->world_to_eye == item.world_to_eye) {
      of_item_.push_back(of_item_.back());
      continue;
    }
    RoomLight light = options.light ? *options.light : scene_light(bundle, item.scene);
    if (estimator != nullptr) {
      if (const auto gain = estimator->at_model(item.scene)) light = scaled_light(light, *gain);
    }
    const Light own{light, rotation_of(item.world_to_eye)};
    const auto same = std::find(lights_.begin(), lights_.end(), own);
    of_item_.push_back(static_cast<std::uint32_t>(same - lights_.begin()));
    if (same == lights_.end()) lights_.push_back(own);
  }
}

TurnedLight LightList::in_eye_space(std::uint32_t light) const {
  return turn_light(lights_[light].room, lights_[light].to_eye, ambient_strength_, light_strength_);
}

TurnedLight LightList::in_model_space(const DrawItem& item, std::uint32_t light) const {
  const glm::mat3 to_model = glm::transpose(rotation_of(item.to_eye)) * lights_[light].to_eye;
  return turn_light(lights_[light].room, to_model, ambient_strength_, light_strength_);
}

glm::vec4 LightList::key_colour(std::uint32_t light) const {
  return glm::vec4(lights_[light].room.key * light_strength_, 1.0f);
}

}  // namespace modar
