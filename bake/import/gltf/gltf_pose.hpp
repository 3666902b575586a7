// The places of a glTF file's vertices: transforms of nodes, joints of skins, copies of nodes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/mat4x4.hpp>

#include "bake/import/gltf/gltf_accessor.hpp"

namespace tinygltf {
class Model;
class Node;
struct Primitive;
}  // namespace tinygltf

namespace modar {

/// From the node to its parent.
glm::dmat4 node_transform(const tinygltf::Node& node);

/// The copies of a node that EXT_mesh_gpu_instancing asks for, each from the copy to the node; one
/// that stays in place without the extension. Nothing where an accessor is broken, or the numbers
/// of its elements differ.
std::optional<std::vector<glm::dmat4>> node_copies(const tinygltf::Model& gltf,
                                                   const tinygltf::Node& node);

/// How far a vertex follows a joint of its skin.
struct BoneShare {
  std::uint32_t bone = 0;
  double weight = 0;
};

/// What moves the vertices of a primitive: its node, or the joints of a skin.
class VertexPlaces {
 public:
  explicit VertexPlaces(const glm::dmat4& to_scene) : to_scene_(to_scene) {}

  /// Whether each vertex has a place of its own.
  [[nodiscard]] bool skinned() const { return !sets_.empty(); }
  /// From the mesh to the scene; vertex: below the number that was bound, or 0 without a skin.
  /// Nothing where the vertex names a joint that its skin has not.
  [[nodiscard]] std::optional<glm::dmat4> of(std::size_t vertex) const;
  /// The joints of a vertex that of() has a place for, the greatest share first; not empty.
  [[nodiscard]] std::vector<BoneShare> shares(std::size_t vertex) const;

 private:
  friend class SkinPoses;
  struct Influences {
    GltfAccessor joints;
    GltfAccessor weights;
  };
  glm::dmat4 to_scene_;
  const std::vector<glm::dmat4>* joints_ = nullptr;
  std::vector<Influences> sets_;  // of four joints a vertex
};

/// Skins in the pose that the nodes of the file have, which viewers show while nothing plays.
class SkinPoses {
 public:
  explicit SkinPoses(const tinygltf::Model& gltf);

  /// The places of a skinned primitive's vertices: the node that it hangs on does not count, as the
  /// specification has it, but where the primitive names no joints. Nothing where the skin, its
  /// matrices or the primitive's attributes are broken. Points into this object.
  [[nodiscard]] std::optional<VertexPlaces> bind(const tinygltf::Primitive& primitive, int skin,
                                                 std::size_t vertices,
                                                 const glm::dmat4& to_scene) const;
  /// The inverse bind matrix of a joint of a skin that bind() has found good.
  [[nodiscard]] const glm::dmat4& inverse(std::size_t skin, std::size_t joint) const {
    return skins_[skin].inverses[joint];
  }

 private:
  struct Skin {
    bool good = false;
    std::vector<glm::dmat4> inverses;
    std::vector<glm::dmat4> joints;  // from the bound mesh to the scene
  };
  const tinygltf::Model& gltf_;
  std::vector<Skin> skins_;
};

}  // namespace modar
