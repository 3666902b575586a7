#include "tests/render/moving_model.hpp"

#include <cmath>
#include <cstring>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace modar::test {
namespace {

/// A key: sample, then x, y, z of a translation or scale, or a quaternion w, x, y, z.
struct Key {
  std::uint16_t sample;
  std::array<double, 4> value;
};

struct Curve {
  std::uint32_t joint;
  TrackPath path;
  std::vector<Key> keys;
};

std::array<double, 4> about(const glm::dvec3& axis, double degrees) {
  const glm::dquat q = glm::angleAxis(glm::radians(degrees), glm::normalize(axis));
  return {q.w, q.x, q.y, q.z};
}

std::uint32_t samples_of(int clip) {
  return clip == 0 ? 121u : 61u;
}

/// The second key of a turn is further than half around: sums take the shorter way.
std::vector<Curve> curves_of(int clip) {
  if (clip == 1) {
    return {{1, TrackPath::kRotation, {{0, about({0, 0, 1}, -40)}, {60, about({0, 1, 1}, 30)}}},
            {2, TrackPath::kTranslation, {{0, {0.1, 0.3, 0}}, {60, {-0.2, 0.4, 0.1}}}}};
  }
  return {{0, TrackPath::kTranslation, {{0, {0, 0, 0}}, {40, {0.3, -0.1, 0.05}}, {120, {0, 0, 0}}}},
          {1,
           TrackPath::kRotation,
           {{0, about({0, 0, 1}, 0)},
            {30, about({0, 0, 1}, 70)},
            {90, about({0.2, 0, 1}, -60)},
            {120, about({0, 0, 1}, 0)}}},
          {2, TrackPath::kRotation, {{0, about({1, 0, 0}, 10)}, {120, about({1, 0, 0}, 200)}}},
          {2, TrackPath::kScale, {{0, {1, 1, 1}}, {60, {1.4, 0.8, 1.2}}, {120, {1, 1, 1}}}}};
}

glm::dquat quaternion(const std::array<double, 4>& v) {
  return {v[0], v[1], v[2], v[3]};
}

glm::dquat normalised_sum(const glm::dquat& a, const glm::dquat& b, double share) {
  const double sign = glm::dot(a, b) < 0 ? -1 : 1;
  return glm::normalize(a * (1 - share) + b * (sign * share));
}

template <class T>
void put(std::vector<std::byte>& bytes, const T& value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

constexpr double kLow = -2;
constexpr double kStep = 4.0 / 65535;

std::vector<std::byte> track_bytes(const std::vector<Curve>& curves, std::uint32_t samples) {
  std::vector<std::byte> bytes;
  put(bytes, ClipTracksHeader{static_cast<std::uint32_t>(curves.size()), samples, {}});
  std::size_t keys = sizeof(ClipTracksHeader) + curves.size() * sizeof(TrackRecord);
  for (const Curve& curve : curves) {
    TrackRecord record{};
    record.joint = curve.joint;
    record.path = static_cast<std::uint8_t>(curve.path);
    record.key_count = static_cast<std::uint16_t>(curve.keys.size());
    record.keys = static_cast<std::uint32_t>(keys);
    if (curve.path != TrackPath::kRotation) {
      std::fill_n(record.low, 3, static_cast<float>(kLow));
      std::fill_n(record.step, 3, static_cast<float>(kStep));
    }
    keys += 8 * curve.keys.size();
    put(bytes, record);
  }
  for (const Curve& curve : curves) {
    for (const Key& key : curve.keys) put(bytes, key.sample);
    for (const Key& key : curve.keys) {
      std::array<std::uint16_t, 3> words{};
      if (curve.path == TrackPath::kRotation) {
        words = pack_rotation({key.value[1], key.value[2], key.value[3], key.value[0]});
      } else {
        for (std::size_t i = 0; i < 3; ++i)
          words[i] = static_cast<std::uint16_t>(std::lround((key.value[i] - kLow) / kStep));
      }
      put(bytes, words);
    }
  }
  return bytes;
}

glm::dmat4 before_of(std::uint32_t joint) {
  if (joint == 0) return glm::rotate(glm::dmat4(1), 0.3, glm::dvec3(0, 1, 0));
  return joint == 1 ? glm::translate(glm::dmat4(1), glm::dvec3(0.1, -0.2, 0)) : glm::dmat4(1);
}

JointState rest_of(std::uint32_t joint) {
  JointState state;
  state.translation = joint == 2 ? glm::dvec3(0.1, 0.3, 0) : glm::dvec3(0);
  return state;
}

std::vector<glm::dmat4> joint_matrices(const std::vector<JointState>& states) {
  std::vector<glm::dmat4> matrices;
  for (std::uint32_t j = 0; j < states.size(); ++j) {
    glm::dmat4 own = before_of(j) * glm::translate(glm::dmat4(1), states[j].translation) *
                     glm::mat4_cast(states[j].rotation);
    own = own * glm::scale(glm::dmat4(1), states[j].scale);
    matrices.push_back(j == 0 ? own : matrices.back() * own);
  }
  return matrices;
}

std::vector<JointState> rest_states() {
  return {rest_of(0), rest_of(1), rest_of(2)};
}

constexpr std::array<std::uint32_t, kMovingBones> kJointOfBone = {1, 1, 2};

void put_rows(float (&rows)[12], const glm::dmat4& matrix) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column)
      rows[4 * row + column] = static_cast<float>(matrix[column][row]);
  }
}

/// Small squares in depth, so that parts cover each other; the skinned ones bend.
std::vector<Triangle> strip(const glm::dvec3& low, const glm::dvec3& high, Rgb colour,
                            bool skinned) {
  std::vector<Triangle> triangles;
  constexpr int kSteps = 8;
  for (int i = 0; i < kSteps; ++i) {
    const auto corner = [&](int step, bool right) {
      const glm::dvec3 share(right ? 1 : 0, static_cast<double>(step) / kSteps, right ? 1 : 0);
      return low + share * (high - low);
    };
    const auto weights = [&](int step) {
      const auto second = static_cast<std::uint8_t>(255 * step / kSteps);
      return std::array<std::uint8_t, 4>{static_cast<std::uint8_t>(255 - second), second, 0, 0};
    };
    for (const bool upper : {false, true}) {
      const std::array<std::pair<int, bool>, 3> corners =
          upper ? std::array<std::pair<int, bool>, 3>{{{i, true}, {i + 1, true}, {i + 1, false}}}
                : std::array<std::pair<int, bool>, 3>{{{i, false}, {i, true}, {i + 1, false}}};
      Triangle triangle;
      triangle.colour = colour;
      triangle.normals.fill(triangle.normal);
      for (std::size_t c = 0; c < 3; ++c) {
        triangle.corners[c] = corner(corners[c].first, corners[c].second);
        if (!skinned) continue;
        triangle.joints[c] = {0, 1, 0, 0};
        triangle.weights[c] = weights(corners[c].first);
      }
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

struct PartShape {
  std::vector<Triangle> triangles;
  std::uint32_t first_bone = 0;
  std::uint32_t bones = 0;
};

std::vector<PartShape> shapes() {
  return {{strip({-0.9, -0.8, -0.1}, {-0.5, 0.8, -0.1}, {200, 60, 40}, false), 0, 0},
          {strip({-0.3, -0.4, 0.0}, {0.1, 0.2, 0.1}, {40, 220, 80}, false), 0, 1},
          {strip({0.2, -0.5, 0.1}, {0.5, 0.6, 0.2}, {80, 90, 240}, true), 1, 2}};
}

/// The materials differ, so that no batch mixes parts.
BundleContent content_of(const std::vector<PartShape>& parts) {
  SceneMaker maker;
  add_square_pattern(maker.content);
  const std::uint32_t layout = maker.add_layout(Layout::kF32Skinned);
  std::vector<SceneMaker::Chunk> chunks;
  for (const PartShape& part : parts) {
    MaterialRecord material = flat_material();
    SceneMaker::Chunk chunk;
    chunk.levels = {part.triangles};
    chunk.material = maker.add_material(material);
    chunks.push_back(chunk);
  }
  maker.add_model(layout, chunks);
  return maker.content;
}

glm::dvec3 moved(const Triangle& triangle, std::size_t c, const PartShape& part,
                 const std::vector<glm::dmat4>& bones, const glm::dvec4& what) {
  glm::dvec4 sum(0);
  for (std::size_t i = 0; i < 4; ++i) {
    const double weight = triangle.weights[c][i] / 255.0;
    if (weight > 0) sum += weight * (bones[part.first_bone + triangle.joints[c][i]] * what);
  }
  return glm::dvec3(sum);
}

void add_scene(BundleContent& content) {
  SceneRecord scene{};
  scene.scale = 1;
  scene.rotation[3] = 1;
  content.scenes.push_back(scene);
}

}  // namespace

std::vector<JointState> joint_states(int clip, double seconds) {
  std::vector<JointState> states = rest_states();
  const double sample = seconds * kClipRate;
  for (const Curve& curve : curves_of(clip)) {
    std::size_t k = 0;
    while (k + 1 < curve.keys.size() && curve.keys[k + 1].sample <= sample) ++k;
    const Key& from = curve.keys[k];
    const Key& to = curve.keys[std::min(k + 1, curve.keys.size() - 1)];
    const double share =
        to.sample == from.sample ? 0 : (sample - from.sample) / (to.sample - from.sample);
    const auto vector = [](const Key& key) {
      return glm::dvec3(key.value[0], key.value[1], key.value[2]);
    };
    JointState& state = states[curve.joint];
    const glm::dvec3 mixed = glm::mix(vector(from), vector(to), share);
    if (curve.path == TrackPath::kTranslation) state.translation = mixed;
    if (curve.path == TrackPath::kScale) state.scale = mixed;
    if (curve.path == TrackPath::kRotation)
      state.rotation = normalised_sum(quaternion(from.value), quaternion(to.value), share);
  }
  return states;
}

std::vector<JointState> blended(const std::vector<JointState>& from,
                                const std::vector<JointState>& to, double share) {
  std::vector<JointState> states;
  for (std::size_t j = 0; j < from.size(); ++j) {
    states.push_back({glm::mix(from[j].translation, to[j].translation, share),
                      normalised_sum(from[j].rotation, to[j].rotation, share),
                      glm::mix(from[j].scale, to[j].scale, share)});
  }
  return states;
}

std::vector<glm::dmat4> bone_matrices(const std::vector<JointState>& states) {
  const auto joints = joint_matrices(states);
  const auto rest = joint_matrices(rest_states());
  std::vector<glm::dmat4> bones;
  for (const std::uint32_t joint : kJointOfBone)
    bones.push_back(joints[joint] * glm::inverse(rest[joint]));
  return bones;
}

BundleContent moving_content(std::uint32_t scenes) {
  const std::vector<PartShape> parts = shapes();
  BundleContent content = content_of(parts);
  const auto rest = joint_matrices(rest_states());
  for (std::uint32_t j = 0; j < rest.size(); ++j) {
    const JointState state = rest_of(j);
    JointRecord joint{};
    joint.parent = j == 0 ? kNone : j - 1;
    put_rows(joint.before, before_of(j));
    for (int i = 0; i < 3; ++i) {
      joint.translation[i] = static_cast<float>(state.translation[i]);
      joint.scale[i] = static_cast<float>(state.scale[i]);
    }
    joint.rotation[3] = 1;
    content.joints.push_back(joint);
  }
  for (const std::uint32_t j : kJointOfBone) {
    BoneRecord bone{};
    bone.joint = j;
    put_rows(bone.inverse, glm::inverse(rest[j]));
    content.bones.push_back(bone);
  }
  for (std::uint32_t m = 0; m < parts.size(); ++m) {
    if (parts[m].bones == 0) continue;
    content.parts.push_back({m, parts[m].first_bone, parts[m].bones, 0, {-3, -3, -3}, {3, 3, 3}});
  }
  const char* names[] = {"walk", "wave"};
  for (int c = 0; c < 2; ++c) {
    ClipRecord clip{};
    clip.name = content.intern(names[c]);
    clip.tracks = static_cast<std::uint32_t>(c);
    clip.seconds = static_cast<float>(c == 0 ? kFirstSeconds : kSecondSeconds);
    content.clips.push_back(clip);
    content.clip_tracks.push_back(track_bytes(curves_of(c), samples_of(c)));
  }
  for (std::uint32_t s = 0; s < scenes; ++s) {
    add_scene(content);
    content.scene_clips.push_back({s, 0, kSceneClipLoops, 0});
  }
  return content;
}

BundleContent posed_content(const std::vector<glm::dmat4>& bones) {
  std::vector<PartShape> parts = shapes();
  for (PartShape& part : parts) {
    if (part.bones == 0) continue;
    for (Triangle& triangle : part.triangles) {
      const Triangle rest = triangle;
      for (std::size_t c = 0; c < 3; ++c) {
        triangle.corners[c] = moved(rest, c, part, bones, glm::dvec4(rest.corners[c], 1));
        triangle.normals[c] =
            glm::normalize(moved(rest, c, part, bones, glm::dvec4(rest.normal, 0)));
      }
    }
  }
  BundleContent content = content_of(parts);
  add_scene(content);
  return content;
}

}  // namespace modar::test
