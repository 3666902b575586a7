#include "bake/import/gltf/gltf_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include "bake/import/gltf/tinygltf_library.hpp"

namespace modar {
namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

/// From each node to the scene; nodes that are in a circle, or below one, stay in place.
std::vector<glm::dmat4> node_places(const tinygltf::Model& gltf) {
  const std::size_t count = gltf.nodes.size();
  std::vector<bool> child(count, false);
  const auto known = [count](int node) {
    return node >= 0 && static_cast<std::size_t>(node) < count;
  };
  for (const tinygltf::Node& node : gltf.nodes) {
    for (const int c : node.children) {
      if (known(c)) child[static_cast<std::size_t>(c)] = true;
    }
  }
  std::vector<glm::dmat4> places(count, glm::dmat4(1.0));
  std::vector<bool> seen(count, false);
  std::vector<std::size_t> waiting;
  for (std::size_t i = 0; i < count; ++i) {
    if (child[i]) continue;
    places[i] = node_transform(gltf.nodes[i]);
    waiting.push_back(i);
  }
  while (!waiting.empty()) {
    const std::size_t node = waiting.back();
    waiting.pop_back();
    if (seen[node]) continue;
    seen[node] = true;
    for (const int c : gltf.nodes[node].children) {
      if (!known(c) || seen[static_cast<std::size_t>(c)]) continue;
      places[static_cast<std::size_t>(c)] =
          places[node] * node_transform(gltf.nodes[static_cast<std::size_t>(c)]);
      waiting.push_back(static_cast<std::size_t>(c));
    }
  }
  return places;
}

/// An accessor that an object names; false where it is named and broken. there: whether it is.
bool open_named(const tinygltf::Model& gltf, const tinygltf::Value& names, const char* name,
                std::size_t components, GltfAccessor& accessor, bool& there) {
  there = names.IsObject() && names.Has(name);
  return !there ||
         (names.Get(name).IsInt() && accessor.open(gltf, names.Get(name).GetNumberAsInt()) &&
          accessor.components() == components);
}

}  // namespace

glm::dmat4 node_transform(const tinygltf::Node& node) {
  glm::dmat4 m(1.0);
  if (node.matrix.size() == 16) {
    for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
    return m;
  }
  if (node.rotation.size() == 4) {
    m = glm::mat4_cast(
        glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]));
  }
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (node.scale.size() == 3) m[i] *= node.scale[k];
    if (node.translation.size() == 3) m[3][i] = node.translation[k];
  }
  return m;
}

std::optional<std::vector<glm::dmat4>> node_copies(const tinygltf::Model& gltf,
                                                   const tinygltf::Node& node) {
  const auto found = node.extensions.find(kInstancing);
  if (found == node.extensions.end()) return std::vector{glm::dmat4(1.0)};
  if (!found->second.IsObject() || !found->second.Has("attributes")) return std::nullopt;
  const tinygltf::Value& names = found->second.Get("attributes");
  std::array<GltfAccessor, 3> accessors;
  std::array<bool, 3> there{};
  constexpr std::array<std::pair<const char*, std::size_t>, 3> kParts = {
      {{"TRANSLATION", 3}, {"ROTATION", 4}, {"SCALE", 3}}};
  std::optional<std::size_t> count;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!open_named(gltf, names, kParts[i].first, kParts[i].second, accessors[i], there[i])) {
      return std::nullopt;
    }
    if (!there[i]) continue;
    if (count && *count != accessors[i].size()) return std::nullopt;
    count = accessors[i].size();
  }
  std::vector<glm::dmat4> copies;
  for (std::size_t k = 0; k < count.value_or(0); ++k) {
    tinygltf::Node copy;
    const auto take = [&](std::size_t i, std::vector<double>& numbers) {
      for (std::size_t c = 0; there[i] && c < kParts[i].second; ++c) {
        numbers.push_back(accessors[i].at(k, c));
      }
    };
    take(0, copy.translation);
    take(1, copy.rotation);
    take(2, copy.scale);
    copies.push_back(node_transform(copy));
  }
  return copies;
}

std::optional<glm::dmat4> VertexPlaces::of(std::size_t vertex) const {
  if (sets_.empty()) return to_scene_;
  glm::dmat4 sum(0.0);
  double weights = 0;
  for (const Influences& set : sets_) {
    for (std::size_t c = 0; c < 4; ++c) {
      const double weight = set.weights.at(vertex, c);
      const double joint = set.joints.at(vertex, c);
      if (!(joint >= 0 && joint < static_cast<double>(joints_->size()))) return std::nullopt;
      if (!(weight > 0)) continue;
      weights += weight;
      sum += weight * (*joints_)[static_cast<std::size_t>(joint)];
    }
  }
  if (weights > 0) return sum / weights;
  return (*joints_)[static_cast<std::size_t>(sets_.front().joints.at(vertex, 0))];
}

std::vector<BoneShare> VertexPlaces::shares(std::size_t vertex) const {
  std::vector<BoneShare> shares;
  for (const Influences& set : sets_) {
    for (std::size_t c = 0; c < 4; ++c) {
      const double weight = set.weights.at(vertex, c);
      const auto bone = static_cast<std::uint32_t>(set.joints.at(vertex, c));
      if (!(weight > 0) || !std::isfinite(weight)) continue;
      const auto same = std::find_if(shares.begin(), shares.end(),
                                     [bone](const BoneShare& each) { return each.bone == bone; });
      if (same == shares.end()) {
        shares.push_back({bone, weight});
      } else {
        same->weight += weight;
      }
    }
  }
  std::stable_sort(shares.begin(), shares.end(),
                   [](const auto& a, const auto& b) { return a.weight > b.weight; });
  if (shares.empty()) {
    shares.push_back({static_cast<std::uint32_t>(sets_.front().joints.at(vertex, 0)), 1.0});
  }
  return shares;
}

SkinPoses::SkinPoses(const tinygltf::Model& gltf) : gltf_(gltf) {
  if (gltf.skins.empty()) return;
  const std::vector<glm::dmat4> places = node_places(gltf);
  for (const tinygltf::Skin& source : gltf.skins) {
    Skin skin;
    GltfAccessor inverses;
    const bool bound = source.inverseBindMatrices >= 0;
    skin.good =
        !source.joints.empty() &&
        (!bound || (inverses.open(gltf, source.inverseBindMatrices) &&
                    inverses.components() == 16 && inverses.size() >= source.joints.size()));
    for (std::size_t j = 0; skin.good && j < source.joints.size(); ++j) {
      const int node = source.joints[j];
      skin.good = node >= 0 && static_cast<std::size_t>(node) < places.size();
      if (!skin.good) break;
      glm::dmat4 inverse(1.0);
      for (int i = 0; bound && i < 16; ++i) {
        inverse[i / 4][i % 4] = inverses.at(j, static_cast<std::size_t>(i));
      }
      skin.inverses.push_back(inverse);
      skin.joints.push_back(places[static_cast<std::size_t>(node)] * inverse);
    }
    skins_.push_back(std::move(skin));
  }
}

std::optional<VertexPlaces> SkinPoses::bind(const tinygltf::Primitive& primitive, int skin,
                                            std::size_t vertices,
                                            const glm::dmat4& to_scene) const {
  VertexPlaces places(to_scene);
  if (skin < 0 || primitive.attributes.count("JOINTS_0") == 0) return places;
  const auto index = static_cast<std::size_t>(skin);
  if (index >= skins_.size() || !skins_[index].good) return std::nullopt;
  places.joints_ = &skins_[index].joints;
  for (int set = 0;; ++set) {
    const auto joints = primitive.attributes.find("JOINTS_" + std::to_string(set));
    const auto weights = primitive.attributes.find("WEIGHTS_" + std::to_string(set));
    if (joints == primitive.attributes.end() || weights == primitive.attributes.end()) break;
    VertexPlaces::Influences influences;
    if (!influences.joints.open(gltf_, joints->second) ||
        !influences.weights.open(gltf_, weights->second) || influences.joints.components() != 4 ||
        influences.weights.components() != 4 || influences.joints.size() < vertices ||
        influences.weights.size() < vertices) {
      return std::nullopt;
    }
    places.sets_.push_back(std::move(influences));
  }
  return places;
}

}  // namespace modar
