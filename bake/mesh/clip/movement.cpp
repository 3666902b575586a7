#include "bake/mesh/clip/movement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "formats/base/parallel.hpp"
#include "formats/clips.hpp"

namespace modar {
namespace {

/// Matrices that a fit holds at once: 128 bytes each, 1 GiB.
constexpr std::size_t kMostPoses = std::size_t{1} << 23;
/// Share from which on a vertex counts for a bone while keys are chosen; the stated error has all.
constexpr float kMuch = 0.25f;
/// Beyond the samples, between which parts move on: of a part's diagonal.
constexpr double kBetween = 0.005;
constexpr std::uint32_t kStretches = 64;  ///< of samples, measured by one thread each

using PartBox = FittedMovement::Box;

constexpr PartBox kNowhere = {glm::dvec3(std::numeric_limits<double>::infinity()),
                              glm::dvec3(-std::numeric_limits<double>::infinity())};

void extend(PartBox& box, const glm::dvec3& at) {
  box.low = glm::min(box.low, at);
  box.high = glm::max(box.high, at);
}

/// Positions of each part, in the order of their first use.
std::vector<std::vector<std::uint32_t>> vertices_of(const SourceModel& model) {
  std::vector<std::vector<std::uint32_t>> result(model.movement.parts.size());
  std::vector<bool> seen(model.positions.size(), false);
  RunCursor materials(model.material_runs);
  for (std::size_t f = 0; f < model.face_count(); ++f) {
    const std::uint32_t part = model.materials[materials.at(f)].part;
    if (part >= result.size()) continue;
    for (std::size_t c = model.face_first(f); c < model.face_first(f) + 3; ++c) {
      const std::uint32_t v = model.corner_positions[c];
      if (!seen[v]) result[part].push_back(v);
      seen[v] = true;
    }
  }
  return result;
}

/// A vertex with what moves it: the shares of the source, and those that are stored.
struct MovedVertex {
  glm::dvec4 at{0.0};
  int count = 0;
  std::array<std::uint8_t, 4> bones{};
  std::array<double, 4> wanted{};
  std::array<double, 4> stored{};
};

MovedVertex moved_vertex(const SourceModel& model, std::uint32_t v) {
  const VertexBones shares = model.vertex_bones.empty() ? VertexBones() : model.vertex_bones[v];
  const auto bytes = shares.bytes();
  MovedVertex vertex;
  vertex.at = glm::dvec4(model.positions[v], 1.0);
  for (std::size_t k = 0; k < 4; ++k) {
    if (shares.weights[k] <= 0 && bytes[k] == 0) continue;
    const auto n = static_cast<std::size_t>(vertex.count++);
    vertex.bones[n] = shares.bones[k];
    vertex.wanted[n] = static_cast<double>(shares.weights[k]);
    vertex.stored[n] = bytes[k] / 255.0;
  }
  return vertex;
}

/// Of many points those that are furthest in some direction.
class Extremes {
 public:
  void add(const glm::dvec3& p) {
    for (std::size_t i = 0; i < most_.size(); ++i) {
      const auto d = static_cast<int>(i < 13 ? i : i + 1);  // without the middle
      const glm::dvec3 direction(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
      const double along = glm::dot(direction, p);
      if (any_ && along <= most_[i]) continue;
      most_[i] = along;
      points_[i] = p;
    }
    any_ = true;
  }
  [[nodiscard]] std::vector<glm::dvec3> points() const {
    std::vector<glm::dvec3> result;
    for (const glm::dvec3& p : points_) {
      if (any_ && std::find(result.begin(), result.end(), p) == result.end()) result.push_back(p);
    }
    return result;
  }

 private:
  bool any_ = false;
  std::array<double, 26> most_{};
  std::array<glm::dvec3, 26> points_{};
};

class Measure {
 public:
  Measure(const SourceModel& model, unsigned jobs)
      : model_(model), jobs_(jobs), vertices_(vertices_of(model)) {
    for (const std::vector<std::uint32_t>& part : vertices_) {
      PartBox& box = boxes_.emplace_back(kNowhere);
      std::vector<MovedVertex>& moved = moved_.emplace_back();
      for (const std::uint32_t v : part) {
        extend(box, model.positions[v]);
        moved.push_back(moved_vertex(model, v));
      }
    }
    pose(clip_pose(joints(), {}, 0), boxes_);
  }

  [[nodiscard]] std::span<const SourceJoint> joints() const { return model_.movement.joints; }

  /// In the spaces of the joints that move them.
  [[nodiscard]] std::vector<JointPoints> points() const {
    std::vector<Extremes> extremes(joints().size());
    for (std::size_t p = 0; p < vertices_.size(); ++p) {
      const std::vector<SourceBone>& bones = model_.movement.parts[p].bones;
      for (const std::uint32_t v : vertices_[p]) {
        const VertexBones shares = bones_of(v);
        for (std::size_t k = 0; k < 4; ++k) {
          if (shares.weights[k] < kMuch) continue;
          const SourceBone& bone = bones[shares.bones[k]];
          extremes[bone.joint].add(glm::dvec3(bone.inverse * glm::dvec4(model_.positions[v], 1.0)));
        }
      }
    }
    for (const SourcePart& part : model_.movement.parts) {
      for (const std::uint32_t t : part.targets) extremes[t].add(glm::dvec3(0.0));
    }
    std::vector<JointPoints> result;
    for (std::uint32_t j = 0; j < extremes.size(); ++j) {
      result.push_back({j, extremes[j].points()});
    }
    return result;
  }

  /// The greatest distance of all vertices through the clip; extends the boxes.
  double error_of(const SourceClip& clip, std::span<const std::byte> bytes) {
    ClipTracksView view;
    view_clip_tracks(bytes, static_cast<std::uint32_t>(joints().size()), view);
    const std::uint32_t samples = view.header->sample_count;
    std::vector<double> errors(kStretches, 0);
    std::vector<std::vector<PartBox>> boxes(kStretches,
                                            std::vector<PartBox>(boxes_.size(), kNowhere));
    parallel_rows(kStretches, jobs_, [&](std::uint32_t s) {
      std::vector<std::uint32_t> keys;
      const auto end = static_cast<std::uint32_t>(std::uint64_t{samples} * (s + 1) / kStretches);
      for (auto i = static_cast<std::uint32_t>(std::uint64_t{samples} * s / kStretches); i < end;
           ++i) {
        const auto source = clip_pose(joints(), clip, clip.duration * i / (samples - 1));
        const auto stored = tracks_pose(joints(), view, i, keys);
        errors[s] = std::max(errors[s], compare(source, stored, boxes[s]));
      }
    });
    for (const std::vector<PartBox>& each : boxes) {
      for (std::size_t p = 0; p < each.size(); ++p) {
        boxes_[p] = {glm::min(boxes_[p].low, each[p].low), glm::max(boxes_[p].high, each[p].high)};
      }
    }
    return *std::max_element(errors.begin(), errors.end());
  }

  [[nodiscard]] std::vector<PartBox> boxes(double error) const {
    std::vector<PartBox> result = boxes_;
    for (PartBox& box : result) {
      const glm::dvec3 room(error + kBetween * glm::length(box.high - box.low));
      box = {box.low - room, box.high + room};
    }
    return result;
  }

 private:
  [[nodiscard]] VertexBones bones_of(std::uint32_t vertex) const {
    return model_.vertex_bones.empty() ? VertexBones() : model_.vertex_bones[vertex];
  }

  [[nodiscard]] std::vector<glm::dmat4> bone_matrices(const std::vector<glm::dmat4>& joints,
                                                      std::size_t part) const {
    std::vector<glm::dmat4> result;
    for (const SourceBone& bone : model_.movement.parts[part].bones) {
      result.push_back(joints[bone.joint] * bone.inverse);
    }
    return result;
  }

  void pose(const std::vector<glm::dmat4>& joints, std::vector<PartBox>& boxes) const {
    compare(joints, joints, boxes);
  }

  /// The greatest distance of a vertex in two poses: with its weights, and with these as stored.
  double compare(const std::vector<glm::dmat4>& source, const std::vector<glm::dmat4>& stored,
                 std::vector<PartBox>& boxes) const {
    double most = 0;
    for (std::size_t p = 0; p < vertices_.size(); ++p) {
      const std::vector<glm::dmat4> exact = bone_matrices(source, p);
      const std::vector<glm::dmat4> kept = bone_matrices(stored, p);
      const std::vector<std::uint32_t>& targets = model_.movement.parts[p].targets;
      double rounding = 0;  // of ways
      for (const std::uint32_t t : targets)
        rounding += std::abs(source[t][3].x) * std::sqrt(0.75) / kMorphUnits;
      for (std::size_t n = 0; n < moved_[p].size(); ++n) {
        const MovedVertex& vertex = moved_[p][n];
        glm::dvec4 from = vertex.at;
        glm::dvec4 to = vertex.at;
        for (std::size_t t = 0; t < targets.size(); ++t) {
          const auto& [x, y, z] = model_.vertex_bones[vertices_[p][n]].morphs;
          const glm::dvec4 way = glm::dvec4(x[t], y[t], z[t], 0) / double{kMorphUnits};
          from += source[targets[t]][3].x * way;
          to += stored[targets[t]][3].x * way;
        }
        glm::dvec3 wanted(0.0);
        glm::dvec3 found(0.0);
        for (std::size_t k = 0; k < static_cast<std::size_t>(vertex.count); ++k) {
          wanted += vertex.wanted[k] * glm::dvec3(exact[vertex.bones[k]] * from);
          found += vertex.stored[k] * glm::dvec3(kept[vertex.bones[k]] * to);
        }
        extend(boxes[p], found);
        const glm::dvec3 apart = found - wanted;
        most = std::max(most, glm::length(apart) + rounding);
      }
    }
    return most;
  }

  const SourceModel& model_;
  unsigned jobs_;
  std::vector<std::vector<std::uint32_t>> vertices_;  // of each part
  std::vector<std::vector<MovedVertex>> moved_;       // the same
  std::vector<PartBox> boxes_;
};

/// The name, or with a number where another clip has it.
std::string own_name(const std::string& name, std::set<std::string>& taken) {
  std::string own = name;
  for (int i = 2; !taken.insert(own).second; ++i) own = name + " " + std::to_string(i);
  return own;
}

}  // namespace

FittedMovement fit_movement(const SourceModel& model, double bound, unsigned jobs,
                            std::vector<Diagnostic>& diagnostics) {
  FittedMovement result;
  Measure measure(model, jobs);
  const std::vector<JointPoints> points = measure.points();
  std::set<std::string> names;
  double error = 0;
  for (const SourceClip& clip : model.movement.clips) {
    const bool long_clip = clip.duration > static_cast<double>(kMostClipSeconds) ||
                           clip_samples(clip) * measure.joints().size() > kMostPoses;
    if (long_clip || result.clips.size() == kMostClips) {
      diagnostics.push_back({"model.clip", DiagnosticSeverity::kWarning, model.name, 0,
                             "the clip '" + clip.name + "' is left out: " +
                                 (long_clip ? "it is too long for its joints"
                                            : "the model has more than a bundle holds"),
                             long_clip ? "split it into shorter clips" : "export fewer"});
      continue;
    }
    FittedClip fitted = fit_clip(measure.joints(), clip, points, bound);
    if (fitted.bytes.empty()) continue;
    fitted.error = measure.error_of(clip, fitted.bytes);
    error = std::max(error, fitted.error);
    // One key is a pose, which takes a sample's time.
    const double seconds = std::max(clip.duration, 1.0 / kClipRate);
    result.clips.push_back({own_name(clip.name, names), seconds, std::move(fitted)});
  }
  result.boxes = measure.boxes(error);
  return result;
}

namespace {

/// Of any length. Bones of skins turn normals like points, nodes keep them perpendicular.
glm::dvec3 normal_by(const glm::dmat3& m, bool skinned, const glm::dvec3& normal) {
  if (skinned) return m * normal;
  const glm::dmat3 cofactor(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
  return glm::sign(glm::determinant(m)) * (cofactor * normal);
}

}  // namespace

TriMesh moved_mesh(const TriMesh& mesh, const SourceMovement& movement, const SourceClip& clip,
                   double time) {
  const std::vector<glm::dmat4> joints = clip_pose(movement.joints, clip, time);
  const auto& [center, scale] = mesh.placement;
  TriMesh moved = mesh;
  std::vector<bool> seen(mesh.positions.size(), false);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t number = mesh.materials[mesh.triangle_material[t]].part;
    if (number >= movement.parts.size()) continue;
    const SourcePart& part = movement.parts[number];
    const auto& [bones, targets] = part;
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (seen[v]) continue;
      seen[v] = true;
      const VertexBones shares = mesh.vertex_bones.empty() ? VertexBones() : mesh.vertex_bones[v];
      glm::dvec3 at = center + scale * mesh.positions[v];
      for (std::size_t k = 0; k < targets.size(); ++k) {
        const auto& [x, y, z] = shares.morphs;
        at += joints[targets[k]][3].x / double{kMorphUnits} * glm::dvec3(x[k], y[k], z[k]);
      }
      glm::dmat4 turn(0.0);
      for (std::size_t k = 0; k < 4; ++k) {
        const SourceBone& bone = bones[shares.bones[k]];
        turn += static_cast<double>(shares.weights[k]) * (joints[bone.joint] * bone.inverse);
      }
      moved.positions[v] = (glm::dvec3(turn * glm::dvec4(at, 1.0)) - center) / scale;
      if (mesh.normals.empty()) continue;
      const glm::vec3 normal = normal_by(glm::dmat3(turn), !part.rigid(), mesh.normals[v]);
      if (glm::length(normal) > 0) moved.normals[v] = glm::normalize(normal);
    }
  }
  return moved;
}

}  // namespace modar
