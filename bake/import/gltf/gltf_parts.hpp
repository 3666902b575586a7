// The faces of a glTF file by what moves them: each part is a material of its own.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "bake/import/gltf/gltf_clips.hpp"
#include "bake/import/gltf/gltf_pose.hpp"
#include "bake/import/source_model.hpp"

namespace modar {

/// Gathers what moves the primitives of a scene, then cuts the model into parts.
class GltfParts {
 public:
  GltfParts(const tinygltf::Model& gltf, GltfClips clips);

  /// What moves a primitive: a joint, or the joints of a skin.
  struct Group {
    std::vector<SourceBone> bones;
    glm::dmat4 to_stored{1.0};  ///< of a skin: from its mesh to where vertices are stored
  };
  static constexpr std::uint32_t kStill = 0xFFFFFFFFu;

  [[nodiscard]] bool any() const { return !clips_.clips.empty(); }
  /// The groups of a node's mesh without a skin, and of a skin's; kStill: nothing moves it. places:
  /// of the skin's first primitive, which has `vertices`.
  std::uint32_t of_node(std::size_t node);
  /// Of what morph targets alone move: vertices are stored in the scene.
  std::uint32_t of_still();
  std::uint32_t of_skin(std::size_t skin, const SkinPoses& skins, const VertexPlaces& places,
                        std::size_t vertices);
  [[nodiscard]] const Group& group(std::uint32_t index) const { return groups_[index]; }
  /// From a node to where the vertices of its mesh are stored.
  [[nodiscard]] glm::dmat4 to_stored(std::size_t node) const;

  /// The vertices that follow in the model belong to the group, until the next call.
  void begin_faces(std::uint64_t face, std::uint32_t group);
  /// The joint that weighs a morph target, or kNoJoint.
  [[nodiscard]] std::uint32_t weight_joint(std::size_t node, std::size_t target) const;
  /// How far a target moves a vertex, in the scene.
  struct Way {
    std::uint32_t joint = kNoJoint;  ///< that weighs it
    glm::dvec3 way{0.0};
  };
  /// One a position of the model; shares: by index in the group's bones, the greatest first.
  void add_vertex(const std::vector<BoneShare>& shares, const std::vector<Way>& ways);

  /// Materials of their own for what moves, and what moves them. Call it once, last.
  void cut(SourceModel& model);

 private:
  struct Part {
    std::uint32_t material = 0;
    std::vector<std::uint8_t> local;  ///< of each bone of the group, kAbsent
  };
  struct Vertex {
    std::array<std::uint16_t, 4> bones{};
    std::array<float, 4> weights{1.0f, 0.0f, 0.0f, 0.0f};
    std::size_t first_way = 0;
  };
  static constexpr std::uint8_t kAbsent = 255;

  std::uint32_t still_joint();
  /// A vertex's ways.
  [[nodiscard]] std::span<const Way> ways_of(std::uint32_t vertex) const;
  [[nodiscard]] std::vector<std::uint32_t> targets_of(const SourceModel& model,
                                                      std::uint64_t face) const;
  void measure_targets(SourceModel& model);
  std::uint32_t part_of(SourceModel& model, std::uint64_t face, std::uint32_t material,
                        std::uint32_t group);
  std::uint32_t vertex_in(SourceModel& model, std::uint32_t vertex, std::uint32_t part);
  void drop_unused_joints(SourceMovement& movement) const;

  const tinygltf::Model& gltf_;
  GltfClips clips_;
  std::uint32_t still_joint_ = kNoJoint;  // of bones of skins that nothing moves
  std::vector<Group> groups_;
  std::map<std::pair<bool, std::size_t>, std::uint32_t> group_of_;  // of a skin or a joint
  std::vector<FaceRun> runs_;                                       // groups
  std::vector<Vertex> vertices_;
  std::vector<Way> ways_;  // of all vertices; after measure_targets() parts of the farthest
  std::vector<Part> parts_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> open_;
  std::vector<std::uint32_t> first_part_;  // of each vertex
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> further_;
};

}  // namespace modar
