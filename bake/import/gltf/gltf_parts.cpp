#include "bake/import/gltf/gltf_parts.hpp"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "bake/import/gltf/tinygltf_library.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kNoPart = 0xFFFFFFFFu;

/// Whether a matrix can be undone: no direction vanishes next to the others.
bool invertible(const glm::dmat4& m) {
  const glm::dmat3 turn(m);
  const double most = std::max({glm::length(turn[0]), glm::length(turn[1]), glm::length(turn[2])});
  return most > 0 && std::abs(glm::determinant(turn)) > 1e-9 * most * most * most;
}

void begin_run(std::vector<FaceRun>& runs, std::uint64_t face, std::uint32_t value) {
  if (!runs.empty() && runs.back().first_face == face) runs.pop_back();
  if (runs.empty() || runs.back().value != value) runs.push_back({face, value});
}

/// How much of a primitive each bone moves; 0 for those of vertices that name none that exists.
std::vector<double> bone_weights(const VertexPlaces& places, std::size_t vertices,
                                 std::size_t bones) {
  std::vector<double> sums(bones, 0);
  for (std::size_t v = 0; v < vertices; ++v) {
    if (!places.of(v)) continue;
    for (const BoneShare& share : places.shares(v)) sums[share.bone] += share.weight;
  }
  return sums;
}

/// In kMorphUnits.
glm::ivec3 units_of(const glm::dvec3& way) {
  return glm::ivec3(glm::round(way * double{kMorphUnits}));
}

/// The place of a target in a part; kMostPartTargets: it has none.
std::size_t slot_of(const SourcePart& part, std::uint32_t target) {
  const auto found = std::find(part.targets.begin(), part.targets.end(), target);
  return found == part.targets.end() ? kMostPartTargets
                                     : static_cast<std::size_t>(found - part.targets.begin());
}

template <class T>
void push_twin(Array<T>& values, std::uint32_t of) {
  if (values.empty()) return;
  const T value = values[of];
  values.push_back(value);
}

}  // namespace

GltfParts::GltfParts(const tinygltf::Model& gltf, GltfClips clips)
    : gltf_(gltf), clips_(std::move(clips)) {}

std::uint32_t GltfParts::still_joint() {
  if (still_joint_ == kNoJoint) {
    still_joint_ = static_cast<std::uint32_t>(clips_.joints.size());
    clips_.joints.push_back({});
    clips_.stored.emplace_back(1.0);
  }
  return still_joint_;
}

std::uint32_t GltfParts::of_node(std::size_t node) {
  const std::uint32_t joint = any() ? clips_.node_joints[node] : kNoJoint;
  if (joint == kNoJoint || !invertible(clips_.stored[joint])) return kStill;
  const auto [found, fresh] =
      group_of_.try_emplace({false, joint}, static_cast<std::uint32_t>(groups_.size()));
  if (fresh) groups_.push_back({{{joint, glm::inverse(clips_.stored[joint])}}, glm::dmat4(1.0)});
  return found->second;
}

std::uint32_t GltfParts::of_still() {
  const auto [found, fresh] =
      group_of_.try_emplace({false, still_joint()}, static_cast<std::uint32_t>(groups_.size()));
  if (fresh) groups_.push_back({{{still_joint(), glm::dmat4(1.0)}}, glm::dmat4(1.0)});
  return found->second;
}

std::uint32_t GltfParts::weight_joint(std::size_t node, std::size_t target) const {
  const auto found = clips_.weights.find({static_cast<int>(node), target});
  return found == clips_.weights.end() ? kNoJoint : found->second;
}

glm::dmat4 GltfParts::to_stored(std::size_t node) const {
  return clips_.stored[clips_.node_joints[node]] * clips_.node_places[node];
}

std::uint32_t GltfParts::of_skin(std::size_t skin, const SkinPoses& skins,
                                 const VertexPlaces& places, std::size_t vertices) {
  const std::vector<int>& nodes = gltf_.skins[skin].joints;
  const auto moves = [this](int node) {
    return clips_.node_joints[static_cast<std::size_t>(node)] != kNoJoint;
  };
  if (!any() || std::none_of(nodes.begin(), nodes.end(), moves)) return kStill;
  const auto [found, fresh] =
      group_of_.try_emplace({true, skin}, static_cast<std::uint32_t>(groups_.size()));
  if (!fresh) return found->second;
  Group group;
  std::vector<glm::dmat4> in_joint;  // from the mesh
  double most = 0;
  const std::vector<double> weights = bone_weights(places, vertices, nodes.size());
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    const auto node = static_cast<std::size_t>(nodes[j]);
    const std::uint32_t moved = clips_.node_joints[node];
    const std::uint32_t joint = moved == kNoJoint ? still_joint() : moved;
    group.bones.push_back({joint, glm::dmat4(1.0)});
    in_joint.push_back(clips_.node_places[node] * skins.inverse(skin, j));
    const glm::dmat4 stored = clips_.stored[joint] * in_joint.back();
    if (!(weights[j] > most) || !invertible(stored)) continue;
    // The pose in which the mesh was bound, moved to where the bone of most of it is: with another,
    // no matrix of each bone would undo it.
    group.to_stored = stored;
    most = weights[j];
  }
  const glm::dmat4 back = glm::inverse(group.to_stored);
  for (std::size_t j = 0; j < nodes.size(); ++j) group.bones[j].inverse = in_joint[j] * back;
  groups_.push_back(std::move(group));
  return found->second;
}

void GltfParts::begin_faces(std::uint64_t face, std::uint32_t group) {
  begin_run(runs_, face, group);
}

void GltfParts::add_vertex(const std::vector<BoneShare>& shares, const std::vector<Way>& ways) {
  Vertex vertex;
  vertex.first_way = ways_.size();
  ways_.insert(ways_.end(), ways.begin(), ways.end());
  const std::size_t count = std::min<std::size_t>(shares.size(), 4);
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += shares[i].weight;
  for (std::size_t i = 0; i < count && sum > 0; ++i) {
    vertex.bones[i] = static_cast<std::uint16_t>(shares[i].bone);
    vertex.weights[i] = static_cast<float>(shares[i].weight / sum);
  }
  vertices_.push_back(vertex);
}

std::span<const GltfParts::Way> GltfParts::ways_of(std::uint32_t vertex) const {
  const bool last = vertex + 1 == vertices_.size();
  const std::size_t first = vertices_[vertex].first_way;
  return std::span(ways_).subspan(first,
                                  (last ? ways_.size() : vertices_[vertex + 1].first_way) - first);
}

/// The joints that weigh a corner's targets.
std::vector<std::uint32_t> GltfParts::targets_of(const SourceModel& model,
                                                 std::uint64_t face) const {
  std::vector<std::uint32_t> targets;
  for (std::size_t c = 3 * face; c < 3 * face + 3; ++c) {
    for (const Way& way : ways_of(model.corner_positions[c])) {
      const bool fresh = std::find(targets.begin(), targets.end(), way.joint) == targets.end();
      if (fresh && units_of(way.way) != glm::ivec3(0)) targets.push_back(way.joint);
    }
  }
  return targets;
}

/// Ways as parts of the farthest, which their joints get. Where more targets move a face than a
/// part holds, those that move the model least are left out.
void GltfParts::measure_targets(SourceModel& model) {
  std::vector<double> most(clips_.joints.size(), 0);
  std::vector<double> range(clips_.joints.size(), 0);
  for (const Way& way : ways_) most[way.joint] = std::max(most[way.joint], glm::length(way.way));
  for (const SourceClip& clip : clips_.clips) {
    for (const SourceTrack& track : clip.tracks) {
      for (const glm::dvec4& value : track.values) {
        const double away = std::abs(value.x - clips_.joints[track.joint].rest.translation.x);
        range[track.joint] = std::max(range[track.joint], away * most[track.joint]);
      }
    }
  }
  for (std::size_t j = 0; j < most.size(); ++j) {
    SourceJoint& joint = clips_.joints[j];
    if (!joint.weighs) continue;
    joint.before = glm::dmat4(0.0);
    joint.before[0][0] = most[j];
    joint.before[3] = glm::dvec4(-most[j] * joint.rest.translation.x, 0.0, 0.0, 1.0);
  }
  for (Way& way : ways_) way.way /= std::max(most[way.joint], 1e-300);
  if (!model.colours.empty() && !ways_.empty()) {
    for (Way& way : ways_) way.way = glm::dvec3(0.0);
    model.diagnostics.push_back({"gltf.morphs", DiagnosticSeverity::kWarning, model.name, 0,
                                 "its morph targets keep their weights in the file: vertices with "
                                 "colours have no room for them",
                                 "bake the colours into a texture"});
  }
  std::size_t lost = 0;
  for (std::uint64_t f = 0; f < model.corner_positions.size() / 3 && !ways_.empty(); ++f) {
    auto targets = targets_of(model, f);
    for (; targets.size() > kMostPartTargets; ++lost) {
      const auto least = std::min_element(targets.begin(), targets.end(),
                                          [&](auto a, auto b) { return range[a] < range[b]; });
      for (Way& way : ways_) way.way *= way.joint == *least ? 0.0 : 1.0;
      targets.erase(least);
    }
  }
  if (lost == 0) return;
  model.diagnostics.push_back({"gltf.morphs", DiagnosticSeverity::kWarning, model.name, 0,
                               std::to_string(lost) +
                                   " morph targets keep their weights in the file: more than " +
                                   std::to_string(kMostPartTargets) + " move one triangle",
                               "merge targets, or cut the mesh between what they move"});
}

std::uint32_t GltfParts::part_of(SourceModel& model, std::uint64_t face, std::uint32_t material,
                                 std::uint32_t group) {
  std::vector<std::uint16_t> bones;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vertex& vertex = vertices_[model.corner_positions[3 * face + i]];
    for (std::size_t k = 0; k < 4; ++k) {
      const bool fresh = std::find(bones.begin(), bones.end(), vertex.bones[k]) == bones.end();
      if (vertex.weights[k] > 0 && fresh) bones.push_back(vertex.bones[k]);
    }
  }
  const std::vector<std::uint32_t> targets = targets_of(model, face);
  std::vector<std::uint32_t>& open = open_[{material, group}];
  std::uint32_t best = kNoPart;
  std::size_t least = bones.size() + targets.size() + 1;
  for (const std::uint32_t p : open) {
    const auto added = static_cast<std::size_t>(std::count_if(
        bones.begin(), bones.end(), [&](auto b) { return parts_[p].local[b] == kAbsent; }));
    const SourcePart& part = model.movement.parts[p];
    const auto more =
        static_cast<std::size_t>(std::count_if(targets.begin(), targets.end(), [&](auto t) {
          return slot_of(part, t) == kMostPartTargets;
        }));
    if (part.bones.size() + added > kMostPartBones || added + more >= least ||
        part.targets.size() + more > kMostPartTargets) {
      continue;
    }
    best = p;
    least = added + more;
  }
  if (best == kNoPart) {
    best = static_cast<std::uint32_t>(parts_.size());
    open.push_back(best);
    parts_.push_back({static_cast<std::uint32_t>(model.materials.size()),
                      std::vector<std::uint8_t>(groups_[group].bones.size(), kAbsent)});
    model.movement.parts.emplace_back();
    SourceMaterial copy = model.materials[material];
    copy.part = best;
    model.materials.push_back(std::move(copy));
  }
  for (const std::uint32_t t : targets) {
    SourcePart& part = model.movement.parts[best];
    if (slot_of(part, t) == kMostPartTargets) part.targets.push_back(t);
  }
  std::vector<SourceBone>& own = model.movement.parts[best].bones;
  for (const std::uint16_t b : bones) {
    if (parts_[best].local[b] != kAbsent) continue;
    parts_[best].local[b] = static_cast<std::uint8_t>(own.size());
    own.push_back(groups_[group].bones[b]);
  }
  return best;
}

std::uint32_t GltfParts::vertex_in(SourceModel& model, std::uint32_t vertex, std::uint32_t part) {
  std::uint32_t at = vertex;
  if (first_part_[vertex] != kNoPart && first_part_[vertex] != part) {
    const auto next = static_cast<std::uint32_t>(model.positions.size());
    const auto [found, fresh] = further_.try_emplace({vertex, part}, next);
    if (!fresh) return found->second;
    at = next;
    push_twin(model.positions, vertex);
    push_twin(model.normals, vertex);
    push_twin(model.uvs, vertex);
    push_twin(model.colours, vertex);
    model.vertex_bones.push_back({});
  } else if (first_part_[vertex] == part) {
    return vertex;
  } else {
    first_part_[vertex] = part;
  }
  VertexBones& bones = model.vertex_bones[at];
  for (const Way& way : ways_of(vertex)) {
    const std::size_t slot = slot_of(model.movement.parts[part], way.joint);
    for (int i = 0; i < 3 && slot < kMostPartTargets; ++i) {
      bones.morphs[static_cast<std::size_t>(i)][slot] =
          static_cast<std::int16_t>(units_of(way.way)[i]);
    }
  }
  bones.weights = vertices_[vertex].weights;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint8_t local = parts_[part].local[vertices_[vertex].bones[k]];
    bones.bones[k] = bones.weights[k] > 0 ? local : std::uint8_t{0};
  }
  return at;
}

void GltfParts::drop_unused_joints(SourceMovement& movement) const {
  std::vector<std::uint32_t> to(clips_.joints.size(), kNoJoint);
  for (const SourcePart& part : movement.parts) {
    for (const SourceBone& bone : part.bones) {
      for (std::uint32_t j = bone.joint; j != kNoJoint; j = clips_.joints[j].parent) to[j] = 0;
    }
    for (const std::uint32_t t : part.targets) to[t] = 0;
  }
  for (std::size_t j = 0; j < to.size(); ++j) {
    if (to[j] == kNoJoint) continue;
    to[j] = static_cast<std::uint32_t>(movement.joints.size());
    movement.joints.push_back(clips_.joints[j]);
    std::uint32_t& parent = movement.joints.back().parent;
    if (parent != kNoJoint) parent = to[parent];
  }
  for (SourcePart& part : movement.parts) {
    for (SourceBone& bone : part.bones) bone.joint = to[bone.joint];
    for (std::uint32_t& t : part.targets) t = to[t];
  }
  for (SourceClip& clip : movement.clips) {
    std::erase_if(clip.tracks,
                  [&](const SourceTrack& track) { return to[track.joint] == kNoJoint; });
    for (SourceTrack& track : clip.tracks) track.joint = to[track.joint];
  }
}

void GltfParts::cut(SourceModel& model) {
  if (!any()) return;
  measure_targets(model);
  model.vertex_bones.assign(model.positions.size(), VertexBones());
  first_part_.assign(model.positions.size(), kNoPart);
  std::vector<FaceRun> runs;
  RunCursor materials(model.material_runs);
  RunCursor groups(runs_);
  for (std::uint64_t f = 0; f < model.corner_positions.size() / 3; ++f) {
    std::uint32_t material = materials.at(f);
    const std::uint32_t group = groups.at(f);
    if (group != kStill) {
      const std::uint32_t part = part_of(model, f, material, group);
      material = parts_[part].material;
      for (std::size_t c = 3 * f; c < 3 * f + 3; ++c) {
        const std::uint32_t v = vertex_in(model, model.corner_positions[c], part);
        model.corner_positions[c] = v;
        if (model.corner_uvs.own[c] != kNoIndex) model.corner_uvs.own[c] = v;
        if (model.corner_normals.own[c] != kNoIndex) model.corner_normals.own[c] = v;
      }
    }
    begin_run(runs, f, material);
  }
  model.material_runs = std::move(runs);
  SourceMovement& movement = model.movement;
  const bool several = std::any_of(movement.parts.begin(), movement.parts.end(),
                                   [](const SourcePart& part) { return !part.rigid(); });
  if (!several) model.vertex_bones.release();
  movement.clips = clips_.clips;
  drop_unused_joints(movement);
}

}  // namespace modar
