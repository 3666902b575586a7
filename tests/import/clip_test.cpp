// Clips of glTF files against three.js, and the bytes of their tracks.
#include "bake/mesh/clip/movement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include "bake/import/read_model.hpp"

namespace modar {
namespace {

const char* source_folder() {
  const char* folder = std::getenv("MODAR_SOURCE_DIR");
  return folder != nullptr ? folder : ".";
}

std::string clip_file(const std::string& name) {
  return std::string(source_folder()) + "/tests/import/clips/" + name;
}

SourceModel model_of(const std::string& name) {
  auto model = read_gltf(clip_file(name));
  EXPECT_TRUE(model) << to_line(model.error());
  return std::move(*model);
}

/// A triangle that turns (linear), moves (cubic) and grows (step), below a node that nothing moves.
SourceModel moving_model() {
  return model_of("moving.gltf");
}

/// The places of a file's vertices at 20 times, by three.js: tests/import/clips/three.mjs.
std::vector<glm::dvec3> expected_places(const std::string& name = "moving.txt") {
  std::ifstream file(clip_file(name));
  std::vector<glm::dvec3> places;
  for (glm::dvec3 at; file >> at.x >> at.y >> at.z;) places.push_back(at);
  return places;
}

/// Where a corner of the model is while its joints are in these places.
glm::dvec3 posed(const SourceModel& model, const std::vector<glm::dmat4>& pose, std::size_t face,
                 std::size_t corner) {
  RunCursor materials(model.material_runs);
  const SourcePart& part = model.movement.parts.at(model.materials.at(materials.at(face)).part);
  const std::uint32_t v = model.corner_positions[3 * face + corner];
  const VertexBones shares = model.vertex_bones.empty() ? VertexBones() : model.vertex_bones[v];
  glm::dvec4 stored(model.positions[v], 1.0);
  for (std::size_t t = 0; t < part.targets.size(); ++t) {
    const auto& [x, y, z] = shares.morphs;
    stored += pose.at(part.targets[t])[3].x * glm::dvec4(x[t], y[t], z[t], 0) / 32767.0;
  }
  glm::dvec3 at(0.0);
  for (std::size_t k = 0; k < 4; ++k) {
    if (shares.weights[k] <= 0) continue;
    const SourceBone& bone = part.bones.at(shares.bones[k]);
    at += static_cast<double>(shares.weights[k]) *
          glm::dvec3(pose.at(bone.joint) * bone.inverse * stored);
  }
  return at;
}

double time_of(const SourceClip& clip, int step) {
  return clip.duration * (step + 0.37) / 20;
}

/// The model's positions in the space of the joint that all of them move with.
JointPoints points_of(const SourceModel& model) {
  const SourceBone& bone = model.movement.parts.at(0).bones.at(0);
  JointPoints result{bone.joint, {}};
  for (const glm::dvec3& p : model.positions) {
    result.points.push_back(glm::dvec3(bone.inverse * glm::dvec4(p, 1.0)));
  }
  return result;
}

TEST(Clips, StepLinearAndCubicTracksMoveAsThreeHasThem) {
  const SourceModel model = moving_model();
  ASSERT_EQ(model.movement.clips.size(), 1U);
  const SourceClip& clip = model.movement.clips[0];
  EXPECT_EQ(clip.name, "all three");
  EXPECT_EQ(clip.duration, 2.0);
  const JointPoints points = points_of(model);
  const auto expected = expected_places();
  ASSERT_EQ(expected.size(), 60U);
  for (int step = 0; step < 20; ++step) {
    const auto pose = clip_pose(model.movement.joints, clip, time_of(clip, step));
    for (std::size_t v = 0; v < 3; ++v) {
      const glm::dvec3 at(pose[points.joint] * glm::dvec4(points.points[v], 1.0));
      const glm::dvec3& wanted = expected[static_cast<std::size_t>(step) * 3 + v];
      EXPECT_LT(glm::distance(at, wanted), 2e-6) << "step " << step << ", corner " << v;
    }
  }
}

/// 40 joints, which one part cannot hold, in another pose than that in which the mesh was bound.
TEST(Clips, SkinsAreCutIntoPartsThatMoveAsThreeHasThem) {
  const SourceModel model = model_of("skinned.gltf");
  ASSERT_EQ(model.movement.clips.size(), 1U);
  EXPECT_EQ(model.movement.joints.size(), 39U) << "one keeps still";
  ASSERT_EQ(model.movement.parts.size(), 2U);
  for (const SourcePart& part : model.movement.parts) EXPECT_LE(part.bones.size(), 32U);
  const auto expected = expected_places("skinned.txt");
  ASSERT_EQ(expected.size(), 20U * 82);
  // The vertices of each face in the file, two triangles a row.
  constexpr std::array<std::array<std::size_t, 3>, 2> kCorners = {{{0, 1, 2}, {1, 3, 2}}};
  for (int step = 0; step < 20; ++step) {
    const SourceClip& clip = model.movement.clips[0];
    const auto pose = clip_pose(model.movement.joints, clip, time_of(clip, step));
    for (std::size_t f = 0; f < 80; ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t vertex = f / 2 * 2 + kCorners[f % 2][c];
        EXPECT_LT(glm::distance(posed(model, pose, f, c),
                                expected[static_cast<std::size_t>(step) * 82 + vertex]),
                  2e-5)
            << "step " << step << ", vertex " << vertex;
      }
    }
  }
}

/// Seven targets, of which no triangle has more than two, on a node that turns; one keeps its
/// weight.
TEST(Clips, MorphTargetsMoveAsThreeHasThem) {
  const SourceModel model = model_of("morphs.gltf");
  ASSERT_EQ(model.movement.clips.size(), 2U);
  ASSERT_EQ(model.movement.parts.size(), 2U);
  for (const SourcePart& part : model.movement.parts) EXPECT_LE(part.targets.size(), 4U);
  EXPECT_TRUE(model.diagnostics.empty());
  std::vector<Diagnostic> diagnostics;
  const FittedMovement fitted = fit_movement(model, 1e-3, 2, diagnostics);
  for (std::size_t c = 0; c < 2; ++c) {
    const auto expected = expected_places(c == 0 ? "morphs.txt" : "morphs_cubic.txt");
    ASSERT_EQ(expected.size(), 20U * 24);
    const SourceClip& clip = model.movement.clips[c];
    EXPECT_LT(fitted.clips.at(c).fitted.error, 2e-3);
    ClipTracksView view;
    view_clip_tracks(fitted.clips[c].fitted.bytes,
                     static_cast<std::uint32_t>(model.movement.joints.size()), view);
    std::vector<std::uint32_t> keys;
    for (int step = 0; step < 20; ++step) {
      const auto pose = clip_pose(model.movement.joints, clip, time_of(clip, step));
      const auto kept = tracks_pose(model.movement.joints, view,
                                    (step + 0.37) / 20 * (view.header->sample_count - 1), keys);
      for (std::size_t v = 0; v < 24; ++v) {
        const glm::dvec3& wanted = expected[static_cast<std::size_t>(step) * 24 + v];
        EXPECT_LT(glm::distance(posed(model, pose, v / 3, v % 3), wanted), 1e-4);
        const glm::dvec3 at = posed(model, kept, v / 3, v % 3);
        EXPECT_LT(glm::distance(at, wanted), fitted.clips[c].fitted.error + 1e-3);
        RunCursor materials(model.material_runs);
        const FittedMovement::Box& box =
            fitted.boxes.at(model.materials.at(materials.at(v / 3)).part);
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(at, box.low)) &&
                    glm::all(glm::lessThanEqual(at, box.high)));
      }
    }
  }
}

TEST(Clips, MovementStatesItsErrorAndBoxes) {
  const SourceModel model = model_of("skinned.gltf");
  std::vector<Diagnostic> diagnostics;
  const FittedMovement fitted = fit_movement(model, 1e-3, 2, diagnostics);
  EXPECT_TRUE(diagnostics.empty());
  ASSERT_EQ(fitted.clips.size(), 1U);
  EXPECT_EQ(fitted.clips[0].name, "bend");
  EXPECT_LT(fitted.clips[0].fitted.error, 5e-3) << "40 rotations of 48 bits in a row";
  for (const glm::dvec3& at : expected_places("skinned.txt")) {
    const auto inside = [&](const FittedMovement::Box& box) {
      return glm::all(glm::greaterThanEqual(at, box.low)) &&
             glm::all(glm::lessThanEqual(at, box.high));
    };
    EXPECT_TRUE(std::any_of(fitted.boxes.begin(), fitted.boxes.end(), inside));
  }
  // Each corner at each sample, with shares as stored.
  SourceModel stored = model;
  for (VertexBones& shares : stored.vertex_bones) {
    const auto bytes = shares.bytes();
    for (std::size_t k = 0; k < 4; ++k) shares.weights[k] = static_cast<float>(bytes[k]) / 255.0f;
  }
  const SourceClip& clip = model.movement.clips[0];
  ClipTracksView view;
  view_clip_tracks(fitted.clips[0].fitted.bytes,
                   static_cast<std::uint32_t>(model.movement.joints.size()), view);
  const std::uint32_t samples = view.header->sample_count;
  std::vector<std::uint32_t> keys;
  double most = 0;
  for (std::uint32_t i = 0; i < samples; ++i) {
    const auto pose = clip_pose(model.movement.joints, clip, clip.duration * i / (samples - 1));
    const auto kept = tracks_pose(model.movement.joints, view, i, keys);
    for (std::size_t c = 0; c < model.corner_count(); ++c) {
      most = std::max(
          most, glm::distance(posed(model, pose, c / 3, c % 3), posed(stored, kept, c / 3, c % 3)));
    }
  }
  EXPECT_NEAR(fitted.clips[0].fitted.error, most, 1e-7);
}

/// A file with a part of its text replaced.
Result<SourceModel> changed_model(const std::string& name,
                                  const std::vector<std::pair<std::string, std::string>>& changes) {
  std::ifstream file(clip_file(name));
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const auto& [from, to] : changes) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
  }
  const std::string path = ::testing::TempDir() + "changed.gltf";
  std::ofstream(path) << text;
  return read_gltf(path);
}

bool says(const SourceModel& model, const std::string& words) {
  return std::any_of(
      model.diagnostics.begin(), model.diagnostics.end(),
      [&](const Diagnostic& each) { return each.message.find(words) != std::string::npos; });
}

TEST(Clips, MissingInverseBindMatricesAreIdentities) {
  const auto model = changed_model("skinned.gltf", {{", \"inverseBindMatrices\": 5", ""}});
  ASSERT_TRUE(model) << to_line(model.error());
  ASSERT_EQ(model->movement.clips.size(), 1U);
  // Each vertex is then moved on by its joint from where the mesh has it.
  const auto pose = clip_pose(model->movement.joints, {}, 0);
  const SourceModel bound = model_of("skinned.gltf");
  EXPECT_GT(glm::distance(posed(*model, pose, 79, 1), posed(bound, pose, 79, 1)), 1);
}

TEST(Clips, WhatIsMalformedIsAFinding) {
  struct Case {
    std::vector<std::pair<std::string, std::string>> changes;
    std::string words;
  };
  const Case cases[] = {
      {{{"\"path\": \"rotation\"", "\"path\": \"pointer\""}}, "KHR_animation_pointer"},
      {{{"\"path\": \"rotation\"", "\"path\": \"weights\""}},
       "weights of a mesh without morph targets"},
      {{{"\"target\": {\"node\": 2,", "\"target\": {\"node\": 999,"}},
       "a target that does not exist"},
      {{{"\"sampler\": 0", "\"sampler\": 99"}}, "a sampler that does not exist"},
      {{{"\"input\": 6", "\"input\": 4"}}, "keys whose times fall"},
      {{{"\"output\": 7", "\"output\": 0"}}, "values that are missing"},
  };
  for (const Case& each : cases) {
    const auto model = changed_model("skinned.gltf", each.changes);
    ASSERT_TRUE(model) << each.words;
    EXPECT_TRUE(says(*model, each.words)) << each.words;
    EXPECT_EQ(model->movement.clips.size(), 1U) << "the other channels stay";
  }
}

TEST(Clips, BrokenSkinsAreErrors) {
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"\"joints\": [2, ", "\"joints\": [999, "},
        {"\"JOINTS_0\": 2", "\"JOINTS_0\": 4"},
        {"\"children\": [3]", "\"children\": [0]"}}) {
    EXPECT_FALSE(changed_model("skinned.gltf", {{from, to}})) << from;
  }
}

TEST(Clips, ClipsCanBeLeftOut) {
  ReadOptions options;
  options.clips = false;
  const auto model = read_gltf(clip_file("skinned.gltf"), options);
  ASSERT_TRUE(model);
  EXPECT_TRUE(model->movement.parts.empty());
  EXPECT_TRUE(model->vertex_bones.empty());
  EXPECT_TRUE(says(*model, "the pose of the file's nodes is baked"));
}

TEST(Clips, WeightsAreBytesWhoseSumIs255) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> part(0, 1);
  for (int i = 0; i < 10000; ++i) {
    VertexBones bones;
    float sum = 0;
    for (float& weight : bones.weights) sum += weight = part(random);
    for (float& weight : bones.weights) weight /= sum;
    int total = 0;
    for (const std::uint8_t byte : bones.bytes()) total += byte;
    EXPECT_EQ(total, 255);
  }
}

TEST(Clips, PackedTracksStayWithinTheBound) {
  const SourceModel model = moving_model();
  const SourceClip& clip = model.movement.clips.at(0);
  const std::array points = {points_of(model)};
  std::size_t before = 0;
  for (const double bound : {1e-1, 1e-2, 1e-3}) {
    const FittedClip fitted = fit_clip(model.movement.joints, clip, points, bound);
    EXPECT_LE(fitted.error, bound);
    EXPECT_GT(fitted.bytes.size(), before) << "a looser bound takes fewer keys";
    before = fitted.bytes.size();
    ClipTracksView view;
    ASSERT_EQ(view_clip_tracks(fitted.bytes, 2, view), nullptr);
    // Independent of the fit's own measure: where three.js has the corners.
    const auto expected = expected_places();
    for (int step = 0; step < 20; ++step) {
      const double sample = time_of(clip, step) / clip.duration * (view.header->sample_count - 1);
      std::vector<std::uint32_t> keys;
      const auto pose = tracks_pose(model.movement.joints, view, sample, keys);
      for (std::size_t v = 0; v < 3; ++v) {
        const glm::dvec3 at(pose[points[0].joint] * glm::dvec4(points[0].points[v], 1.0));
        EXPECT_LT(glm::distance(at, expected.at(static_cast<std::size_t>(step) * 3 + v)),
                  1.2 * bound);
      }
    }
  }
}

TEST(Clips, WhatMovesNothingGivesNoBytes) {
  SourceModel model = moving_model();
  const std::array points = {points_of(model)};
  EXPECT_TRUE(
      fit_clip(model.movement.joints, model.movement.clips.at(0), points, 100).bytes.empty());
  const std::array nowhere = {JointPoints{points[0].joint, {}}};
  EXPECT_TRUE(
      fit_clip(model.movement.joints, model.movement.clips.at(0), nowhere, 1e-3).bytes.empty());
}

TEST(Clips, RotationsKeepTheirDirectionIn48Bits) {
  std::mt19937 random(7);
  std::normal_distribution<double> part;
  for (int i = 0; i < 10000; ++i) {
    glm::dvec4 q(part(random), part(random), part(random), part(random));
    q = glm::normalize(q);
    const auto words = pack_rotation({q.x, q.y, q.z, q.w});
    EXPECT_EQ(words[2] & 0x8000, 0);
    const TrackValue back = unpack_rotation(words);
    const glm::dvec4 packed(back[0], back[1], back[2], back[3]);
    // Half a step of 4.3e-5 in three parts, and at most as much in the largest.
    EXPECT_LT(std::min(glm::distance(packed, q), glm::distance(packed, -q)), 8e-5) << i;
  }
}

TEST(Clips, DamagedTracksAreRefusedOrAnswer) {
  const SourceModel model = moving_model();
  const std::array points = {points_of(model)};
  const FittedClip fitted =
      fit_clip(model.movement.joints, model.movement.clips.at(0), points, 1e-2);
  std::mt19937 random(11);
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::byte> bytes = fitted.bytes;
    if (i % 5 == 0) bytes.resize(random() % bytes.size());
    for (unsigned k = 0; k < 1 + random() % 3 && !bytes.empty(); ++k) {
      bytes[random() % std::min<std::size_t>(bytes.size(), 200)] = static_cast<std::byte>(random());
    }
    ClipTracksView view;
    if (view_clip_tracks(bytes, 2, view) != nullptr) {
      ++refused;
      continue;
    }
    for (const TrackRecord& track : view.tracks) {
      std::uint32_t key = static_cast<std::uint32_t>(random());
      const auto last = static_cast<float>(view.header->sample_count - 1);
      for (const float part : {0.0f, 0.3f, 1.0f}) {
        for (const float value : view.at(track, part * last, key))
          EXPECT_TRUE(std::isfinite(value));
      }
    }
  }
  EXPECT_GT(refused, 15000);
}

}  // namespace
}  // namespace modar
