// A model of three parts for tests: one that nothing moves, a rigid one and a skinned one, with two
// clips; and the places of its bones, calculated in double precision from the curves that the clips
// were made from.
#pragma once

#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>

#include "formats/clips.hpp"
#include "tests/render/scene.hpp"

namespace modar::test {

inline constexpr std::uint32_t kMovingBones = 3;
inline constexpr double kFirstSeconds = 1.0;
inline constexpr double kSecondSeconds = 0.5;

/// A model with joints 0 <- 1 <- 2. The rigid part has bone 0, of joint 1; the skinned one has
/// bones 1 and 2, of joints 1 and 2. Scenes of the square pattern: `scenes` of them; the first clip
/// is theirs, and loops.
BundleContent moving_content(std::uint32_t scenes = 1);

/// Translation, rotation, scale of each joint at a time of a clip (0 or 1), as keys have them
/// between which sums are normalised.
struct JointState {
  glm::dvec3 translation{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 scale{1.0};
};
std::vector<JointState> joint_states(int clip, double seconds);
std::vector<JointState> blended(const std::vector<JointState>& from,
                                const std::vector<JointState>& to, double share);
/// Matrices from the rest pose to that pose, one a bone.
std::vector<glm::dmat4> bone_matrices(const std::vector<JointState>& states);

/// The same model without parts, its vertices where the bones take them.
BundleContent posed_content(const std::vector<glm::dmat4>& bones);

}  // namespace modar::test
