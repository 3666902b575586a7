// What of a pattern's scenes and nodes is shown, as items; and the places of its labels.
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "modar/renderer.hpp"

namespace modar {
namespace {

/// A turn about the node's place.
glm::mat4 turn_about(const NodeTurn& turn, const glm::vec3& place) {
  const glm::mat4 turned = glm::mat4_cast(glm::quat(turn.w, turn.x, turn.y, turn.z));
  return glm::translate(glm::translate(glm::mat4(1.0f), place) * turned, -place);
}

/// The square [-1, 1] of the plane z = 0 to the picture's place.
glm::mat4 picture_matrix(const NodeRecord& node) {
  const glm::quat rotation(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
  glm::mat4 matrix = glm::mat4_cast(glm::normalize(rotation));
  matrix[0] *= node.half_size[0];
  matrix[1] *= node.half_size[1];
  matrix[3] = glm::vec4(node.place[0], node.place[1], node.place[2], 1.0f);
  return matrix;
}

/// The node of a scene's model, or kNone.
std::uint32_t node_of_scene(const BundleView& bundle, std::uint32_t scene) {
  for (std::uint32_t i = 0; i < bundle.nodes().size(); ++i) {
    const NodeRecord& node = bundle.nodes()[i];
    if (kind_is(node, NodeKind::kModel) && node.subject == scene) return i;
  }
  return kNone;
}

}  // namespace

bool is_picture(const BundleView& bundle, std::uint32_t node) {
  return node < bundle.nodes().size() && (kind_is(bundle.nodes()[node], NodeKind::kPicture) ||
                                          kind_is(bundle.nodes()[node], NodeKind::kVideo));
}

void add_items(const BundleView& bundle, const ActionMachine& machine, std::uint32_t pattern,
               std::vector<DrawItem>& items) {
  const auto add = [&](std::uint32_t model, const glm::mat4& place, std::uint32_t scene,
                       std::uint32_t node) {
    glm::mat4 turned = place;
    if (node != kNone) {
      if (!machine.shown(node)) return;
      turned = turn_about(machine.turn_of(node), glm::vec3(place[3])) * place;
    }
    DrawItem item{model, turned, scene, glm::mat4(1.0f)};
    item.node = node;
    items.push_back(item);
  };
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    const SceneRecord& scene = bundle.scenes()[s];
    if (scene.pattern != pattern) continue;
    add(scene.model, scene_matrix(scene), s, node_of_scene(bundle, s));
  }
  for (std::uint32_t n = 0; n < bundle.nodes().size(); ++n) {
    const NodeRecord& node = bundle.nodes()[n];
    if (node.pattern != pattern || !is_picture(bundle, n)) continue;
    add(kNone, picture_matrix(node), kNone, n);
  }
}

}  // namespace modar
