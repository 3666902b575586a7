#include "bake/mesh/clip/movement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

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
/// Vertices whose places are bounded together, and sought where a bound is not enough.
constexpr std::size_t kCluster = 8;

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
  std::uint32_t number = 0;
  glm::dvec4 at{0.0};
  int count = 0;
  std::array<std::uint8_t, 4> bones{};
  std::array<double, 4> wanted{};
  std::array<double, 4> stored{};
};

/// Vertices of a part with the same bones.
struct Cluster {
  std::size_t first = 0;
  std::size_t end = 0;
  int count = 0;
  std::array<std::uint8_t, 4> bones{};
  glm::dvec3 middle{0.0};
  glm::dvec3 half{0.0};
  /// Greatest distance of stored shares from those of the source: of the sum, then of each bone
  /// but the first.
  std::array<double, 4> rounding{};
  std::size_t parts = 0;  ///< of it: as many of the next clusters; 0: it is not cut
};

/// A bone at a sample: from tracks as stored, and away from the source's place.
struct PosedBone {
  glm::dmat4 stored{1.0};
  glm::dmat4 apart{0.0};
};

glm::dvec3 placed(const glm::dmat4& m, const glm::dvec3& p) {
  return glm::dvec3(m[0]) * p.x + glm::dvec3(m[1]) * p.y + glm::dvec3(m[2]) * p.z +
         glm::dvec3(m[3]);
}

/// How far from its middle a box with these half sides extends where a matrix takes it.
glm::dvec3 reach_of(const glm::dmat4& m, const glm::dvec3& half) {
  return glm::abs(glm::dvec3(m[0])) * half.x + glm::abs(glm::dvec3(m[1])) * half.y +
         glm::abs(glm::dvec3(m[2])) * half.z;
}

/// The greatest length of what a matrix makes of a point of the cluster, from above.
double length_of(const glm::dmat4& m, const Cluster& cluster) {
  return glm::length(placed(m, cluster.middle)) + glm::length(reach_of(m, cluster.half));
}

bool inside(const PartBox& box, const glm::dvec3& middle, const glm::dvec3& reach) {
  return glm::all(glm::lessThanEqual(box.low, middle - reach)) &&
         glm::all(glm::lessThanEqual(middle + reach, box.high));
}

/// No vertex of the cluster is further than `most` from its place in the source, or out of the box.
bool within(const Cluster& cluster, const std::vector<PosedBone>& bones, double most,
            const PartBox& box) {
  const glm::dmat4& first = bones[cluster.bones[0]].stored;
  double apart = 0;
  double rounded = cluster.rounding[0] > 0 ? cluster.rounding[0] * length_of(first, cluster) : 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(cluster.count); ++k) {
    const PosedBone& bone = bones[cluster.bones[k]];
    if (!inside(box, placed(bone.stored, cluster.middle), reach_of(bone.stored, cluster.half)))
      return false;
    apart = std::max(apart, length_of(bone.apart, cluster));
    if (k > 0) rounded += cluster.rounding[k] * length_of(bone.stored - first, cluster);
    if (apart + rounded > most) return false;
  }
  return true;
}

MovedVertex moved_vertex(const SourceModel& model, std::uint32_t v) {
  const VertexBones shares = model.vertex_bones.empty() ? VertexBones() : model.vertex_bones[v];
  const auto bytes = shares.bytes();
  MovedVertex vertex;
  vertex.number = v;
  vertex.at = glm::dvec4(model.positions[v], 1.0);
  for (std::size_t k = 0; k < 4; ++k) {
    if (shares.weights[k] <= 0 && bytes[k] == 0) continue;
    const auto n = static_cast<std::size_t>(vertex.count++);
    vertex.bones[n] = shares.bones[k];
    vertex.wanted[n] = static_cast<double>(shares.weights[k]);
    vertex.stored[n] = bytes[k] / 255.0;
    for (std::size_t i = n; i > 0 && vertex.bones[i] < vertex.bones[i - 1]; --i) {
      std::swap(vertex.bones[i], vertex.bones[i - 1]);
      std::swap(vertex.wanted[i], vertex.wanted[i - 1]);
      std::swap(vertex.stored[i], vertex.stored[i - 1]);
    }
  }
  return vertex;
}

Cluster cluster_of(const std::vector<MovedVertex>& vertices, std::size_t first, std::size_t end) {
  Cluster cluster{first, end, vertices[first].count, vertices[first].bones, {}, {}, {}, 0};
  PartBox box = kNowhere;
  for (std::size_t v = first; v < end; ++v) {
    extend(box, glm::dvec3(vertices[v].at));
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double off = vertices[v].stored[k] - vertices[v].wanted[k];
      sum += off;
      if (k > 0) cluster.rounding[k] = std::max(cluster.rounding[k], std::abs(off));
    }
    cluster.rounding[0] = std::max(cluster.rounding[0], std::abs(sum));
  }
  cluster.middle = (box.low + box.high) / 2.0;
  cluster.half = (box.high - box.low) / 2.0;
  return cluster;
}

/// Halves, and halves of these.
void split(std::vector<MovedVertex>& vertices, std::size_t first, std::size_t end,
           std::vector<Cluster>& clusters) {
  const std::size_t own = clusters.size();
  clusters.push_back(cluster_of(vertices, first, end));
  if (end - first <= kCluster) return;
  const glm::dvec3& half = clusters[own].half;
  const int longer = half.x >= half.y ? 0 : 1;
  const int axis = half[longer] >= half.z ? longer : 2;
  const std::size_t middle = (first + end) / 2;
  const auto at = [&](std::size_t i) { return vertices.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(end),
                   [axis](const auto& a, const auto& b) { return a.at[axis] < b.at[axis]; });
  split(vertices, first, middle, clusters);
  split(vertices, middle, end, clusters);
  clusters[own].parts = clusters.size() - own - 1;
}

std::vector<Cluster> clusters_of(std::vector<MovedVertex>& vertices) {
  const auto bones = [](const MovedVertex& v) { return std::tie(v.count, v.bones); };
  std::sort(vertices.begin(), vertices.end(),
            [&](const auto& a, const auto& b) { return bones(a) < bones(b); });
  std::vector<Cluster> clusters;
  std::size_t end = 0;
  for (std::size_t first = 0; first < vertices.size(); first = end) {
    while (end < vertices.size() && bones(vertices[first]) == bones(vertices[end])) ++end;
    split(vertices, first, end, clusters);
  }
  return clusters;
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
      clusters_.push_back(clusters_of(moved));
    }
    const auto rest = clip_pose(joints(), {}, 0);
    Most most{0, boxes_};
    compare(rest, rest, most);
    boxes_ = most.boxes;
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
    const auto at = [&](std::uint64_t part, std::uint64_t parts) {
      return static_cast<std::uint32_t>(samples * part / parts);
    };
    std::vector<std::uint32_t> keys;
    // What a few samples show bounds most vertices of the others.
    Most start{0, boxes_};
    for (std::uint32_t s = 0; s < kStretches; ++s)
      measure(clip, view, at(s, kStretches), keys, start);
    std::vector<Most> found(kStretches, start);
    parallel_rows(kStretches, jobs_, [&](std::uint32_t s) {
      std::vector<std::uint32_t> own_keys;
      for (std::uint32_t i = at(s, kStretches); i < at(s + 1, kStretches); ++i)
        measure(clip, view, i, own_keys, found[s]);
    });
    for (const Most& each : found) {
      start.error = std::max(start.error, each.error);
      for (std::size_t p = 0; p < boxes_.size(); ++p) {
        boxes_[p] = {glm::min(boxes_[p].low, each.boxes[p].low),
                     glm::max(boxes_[p].high, each.boxes[p].high)};
      }
    }
    return start.error;
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

  /// What samples have shown so far.
  struct Most {
    double error = 0;
    std::vector<PartBox> boxes;
  };

  void measure(const SourceClip& clip, const ClipTracksView& view, std::uint32_t sample,
               std::vector<std::uint32_t>& keys, Most& most) const {
    const double time = clip.duration * sample / (view.header->sample_count - 1);
    compare(clip_pose(joints(), clip, time), tracks_pose(joints(), view, sample, keys), most);
  }

  /// The greatest distance of a vertex in two poses: with its weights, and with these as stored.
  void compare(const std::vector<glm::dmat4>& source, const std::vector<glm::dmat4>& stored,
               Most& most) const {
    std::vector<PosedBone> bones;
    for (std::size_t p = 0; p < moved_.size(); ++p) {
      bones.clear();
      for (const SourceBone& bone : model_.movement.parts[p].bones) {
        const glm::dmat4 kept = stored[bone.joint] * bone.inverse;
        bones.push_back({kept, kept - source[bone.joint] * bone.inverse});
      }
      const bool morphs = !model_.movement.parts[p].targets.empty();
      for (std::size_t c = 0; c < clusters_[p].size(); ++c) {
        const Cluster& cluster = clusters_[p][c];
        if (!morphs && within(cluster, bones, most.error, most.boxes[p])) {
          c += cluster.parts;
          continue;
        }
        for (std::size_t n = cluster.first; cluster.parts == 0 && n < cluster.end; ++n)
          compare_vertex(p, n, bones, source, stored, most);
      }
    }
  }

  void compare_vertex(std::size_t part, std::size_t n, const std::vector<PosedBone>& bones,
                      const std::vector<glm::dmat4>& source, const std::vector<glm::dmat4>& stored,
                      Most& most) const {
    const MovedVertex& vertex = moved_[part][n];
    glm::dvec3 from(vertex.at);
    glm::dvec3 to = from;
    double rounding = 0;  // of ways
    const std::vector<std::uint32_t>& targets = model_.movement.parts[part].targets;
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const auto& [x, y, z] = model_.vertex_bones[vertex.number].morphs;
      const glm::dvec3 way = glm::dvec3(x[t], y[t], z[t]) / double{kMorphUnits};
      from += source[targets[t]][3].x * way;
      to += stored[targets[t]][3].x * way;
      rounding += std::abs(source[targets[t]][3].x) * std::sqrt(0.75) / kMorphUnits;
    }
    glm::dvec3 wanted(0.0);
    glm::dvec3 found(0.0);
    for (std::size_t k = 0; k < static_cast<std::size_t>(vertex.count); ++k) {
      const PosedBone& bone = bones[vertex.bones[k]];
      wanted += vertex.wanted[k] * (placed(bone.stored, from) - placed(bone.apart, from));
      found += vertex.stored[k] * placed(bone.stored, to);
    }
    extend(most.boxes[part], found);
    most.error = std::max(most.error, glm::length(found - wanted) + rounding);
  }

  const SourceModel& model_;
  unsigned jobs_;
  std::vector<std::vector<std::uint32_t>> vertices_;  // of each part
  std::vector<std::vector<MovedVertex>> moved_;       // the same, as clusters hold them
  std::vector<std::vector<Cluster>> clusters_;
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
