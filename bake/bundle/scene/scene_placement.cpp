#include "bake/bundle/scene/scene_placement.hpp"

#include "bake/bundle/scene/model_pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/trigonometric.hpp>

#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/options/request_text.hpp"
#include "formats/base/ranges.hpp"
#include "formats/rules.hpp"

namespace modar {
namespace {

constexpr double kSameSize = 0.02;  ///< a scale that differs by less stays 1

/// Takes the axis to +z.
glm::dquat turn_to_z(UpAxis up) {
  const double h = std::sqrt(0.5);
  switch (up) {
    case UpAxis::kX:
      return {h, 0, -h, 0};
    case UpAxis::kMinusX:
      return {h, 0, h, 0};
    case UpAxis::kY:
      return {h, h, 0, 0};
    case UpAxis::kMinusY:
      return {h, -h, 0, 0};
    case UpAxis::kMinusZ:
      return {0, 1, 0, 0};
    case UpAxis::kZ:
      break;
  }
  return {1, 0, 0, 0};
}

}  // namespace

glm::dquat rotation_of(UpAxis up, const std::array<double, 3>& turn) {
  glm::dquat rotation = turn_to_z(up);
  for (int axis = 0; axis < 3; ++axis) {
    const double degrees = turn[static_cast<std::size_t>(axis)];
    if (degrees == 0) continue;
    glm::dvec3 about(0.0);
    about[axis] = 1;
    rotation = glm::angleAxis(glm::radians(degrees), about) * rotation;
  }
  return rotation;
}

namespace {

/// Of a model after its rotation, in the unit of [-1,1].
struct TurnedBox {
  glm::dvec3 least{1e9};
  glm::dvec3 greatest{-1e9};

  void add(const glm::dvec3& point) {
    least = glm::min(least, point);
    greatest = glm::max(greatest, point);
  }
};

/// Does each axis become an axis? Then the box of the source, which is exact, stays a box.
bool keeps_boxes(const glm::dmat3& turn) {
  constexpr double kRounding = 1e-9;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double size = std::fabs(turn[i][k]);
      if (size > kRounding && size < 1 - kRounding) return false;
    }
  }
  return true;
}

/// Of the vertices of a model's finest level, in a pose. Chunks, Levels: of a bundle that is
/// written or read.
template <class Chunks, class Levels>
TurnedBox box_of_vertices(const ModelRecord& model, const LayoutRecord& layout,
                          const Chunks& chunks, const Levels& levels,
                          std::span<const std::byte> bytes, const ModelPose& pose,
                          const glm::dmat3& turn) {
  TurnedBox box;
  const VertexDecoder decoder(layout);
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = chunks[model.first_chunk + c];
    const LevelRecord& level = levels[chunk.first_level];
    for (std::uint32_t v = 0; v < level.vertex_count; ++v) {
      const std::byte* vertex =
          bytes.data() + level.vertex_offset + std::size_t{v} * decoder.stride();
      box.add(turn * pose.place(layout, decoder, chunk, vertex));
    }
  }
  return box;
}

/// Whether a model has triangles, but hardly any that is drawn for those who look down on the
/// pattern from in front of it.
template <class Chunks, class Levels, class Materials>
bool shows_backs(const SceneRecord& scene, const ModelRecord& model, const LayoutRecord& layout,
                 const Chunks& chunks, const Levels& levels, const Materials& materials,
                 std::span<const std::byte> vertices, std::span<const std::byte> indices) {
  constexpr float kTransparent = 0.004f;
  constexpr std::uint32_t kFew = 100;  // a hundredth of the triangles may be faults of the model
  const glm::dvec3 eyes[] = {{0, -0.87, 0.5}, {0, -0.71, 0.71}, {0, -0.5, 0.87}};
  const glm::dquat turn(scene.rotation[3], scene.rotation[0], scene.rotation[1], scene.rotation[2]);
  const VertexDecoder decoder(layout);
  const ModelPose still;
  std::uint64_t triangles = 0;
  std::uint64_t seen = 0;
  for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
    const ChunkRecord& chunk = chunks[c];
    const MaterialRecord& material = materials[chunk.material];
    const LevelRecord& level = levels[chunk.first_level];
    if ((material.flags & kMaterialOccluder) != 0) continue;
    triangles += level.index_count / 3;
    if (material.opacity < kTransparent) continue;
    if ((material.flags & kMaterialTwoSided) != 0) return false;
    for (std::uint32_t i = 0; i + 2 < level.index_count; i += 3) {
      std::array<std::uint16_t, 3> corners{};
      std::memcpy(corners.data(), indices.data() + level.index_offset + 2 * std::uint64_t{i}, 6);
      std::array<glm::dvec3, 3> p;
      ranges::transform(corners, p.begin(), [&](std::uint16_t corner) {
        return still.place(
            layout, decoder, chunk,
            vertices.data() + level.vertex_offset + std::uint64_t{corner} * decoder.stride());
      });
      const glm::dvec3 normal = turn * glm::cross(p[1] - p[0], p[2] - p[0]);
      seen += ranges::any_of(eyes, [&](const auto& eye) { return glm::dot(normal, eye) > 0; });
      if (seen * kFew > model.triangle_count) return false;
    }
  }
  return triangles > 0;
}

/// As the scene's clip begins.
TurnedBox turned_box(const BundleContent& content, const PlacedModel& model,
                     const std::string& clip_name, const glm::dmat3& turn) {
  const std::uint32_t clip = clip_named(content, model.index, clip_name);
  const double largest = *std::max_element(model.sides.begin(), model.sides.end());
  TurnedBox box;
  if (!(largest > 0)) {
    box.add(glm::dvec3(0.0));
  } else if (keeps_boxes(turn) && clip == kNone) {
    const glm::dvec3 half(model.sides[0] / largest, model.sides[1] / largest,
                          model.sides[2] / largest);
    glm::dvec3 turned(0.0);
    for (int from = 0; from < 3; ++from) {
      for (int to = 0; to < 3; ++to)
        turned[to] += std::round(std::fabs(turn[from][to])) * half[from];
    }
    box.add(-turned);
    box.add(turned);
  } else {
    const ModelRecord& record = content.models[model.index];
    box = box_of_vertices(record, content.layouts[record.layout], content.chunks, content.levels,
                          content.vertices, pose_at(content, clip, 0), turn);
  }
  return box;
}

/// Of the model as its clip begins; without a clip 2.
glm::dvec3 clip_sides(const BundleContent& content, const PlacedModel& model,
                      const std::string& clip) {
  if (clip_named(content, model.index, clip) == kNone) return glm::dvec3(2.0);
  const TurnedBox box = turned_box(content, model, clip, glm::dmat3(1.0));
  return box.greatest - box.least;
}

TurnedBox box_of_mesh(const TriMesh& mesh, const glm::dmat3& turn) {
  TurnedBox box;
  for (const glm::dvec3& position : mesh.positions) box.add(turn * position);
  return box;
}

/// Millimetres in a unit of the pattern's plane (half of its largest side); 0: unknown.
double millimetres_in_unit(const PatternRecord& pattern) {
  const double width = 2 * static_cast<double>(pattern.half_width);
  return width > 0 ? pattern.width_mm / width : 0;
}

tl::unexpected<Error> scene_error(const char* code, const SceneRequest& request,
                                  const std::string& cause, const std::string& cure) {
  return fail(ExitCode::kUsage, code, "scene " + request.pattern + "=" + request.model, cause,
              cure);
}

/// What the requested size is the size of, in the unit of [-1,1]. Errors: "scene.flat".
Result<double> extent_of(const SceneRequest& request, const TurnedBox& box) {
  const glm::dvec3 sides = box.greatest - box.least;
  const bool height = request.size.kind == SceneSize::Kind::kHeight;
  const double extent = height ? sides.z : sides.x;
  if (extent > kFlatShare * std::max({sides.x, sides.y, sides.z})) return extent;
  const std::string name = height ? "height" : "width";
  return scene_error(
      "scene.flat", request,
      "a " + name + " is requested, but the model is flat and has no " + name + " in that pose",
      std::string("give its ") + (height ? "width=" : "height=") +
          " or use scale=, or place it with another up= or turn=");
}

/// value, or 0 where a float would be next to zero: the checker takes such floats for damage.
float stored_float(double value) {
  const auto rounded = static_cast<float>(value);
  return std::fpclassify(rounded) == FP_SUBNORMAL ? 0.0f : rounded;
}

}  // namespace

Result<void> check_extent(const SceneRequest& request, const TriMesh& mesh, UpAxis up) {
  if (request.size.kind == SceneSize::Kind::kScale) return {};
  const glm::dquat rotation = rotation_of(request.up.value_or(up), request.turn);
  MODAR_TRY(extent_of(request, box_of_mesh(mesh, glm::mat3_cast(rotation))));
  return {};
}

bool needs_width(const SceneRequest& request) {
  return request.size.kind != SceneSize::Kind::kScale ||
         request.offset.unit == SceneOffset::Unit::kMillimetres;
}

tl::unexpected<Error> no_width(const SceneRequest& request) {
  return scene_error(
      "scene.no-width", request,
      "it gives a length, but the printed width of '" + request.pattern + "' is unknown",
      "give the picture's width (--pattern FILE:210mm, in modar.toml width = \"210mm\"), or use "
      "scale instead");
}

Result<SceneRequest> resolve_scene(const SceneRequest& request, const BundleContent& content,
                                   std::uint32_t pattern, const PlacedModel& model) {
  SceneRequest resolved = request;
  resolved.up = request.up.value_or(model.up);
  const double unit_mm = millimetres_in_unit(content.patterns[pattern]);
  if (needs_width(request) && !(unit_mm > 0)) {
    return no_width(request);
  }
  if (request.size.kind != SceneSize::Kind::kScale) {
    const glm::dmat3 turn = glm::mat3_cast(rotation_of(*resolved.up, request.turn));
    MODAR_ASSIGN(const double extent,
                 extent_of(request, turned_box(content, model, request.clip, turn)));
    resolved.size = {SceneSize::Kind::kScale, request.size.value / unit_mm / extent};
    if (!(resolved.size.value >= kLeastScale && resolved.size.value <= kMostScale)) {
      return scene_error("scene.size", request,
                         "the model would be " + rough_number_text(resolved.size.value) +
                             " times as large as the pattern",
                         "compare the length with the printed width of '" + request.pattern +
                             "', and their units");
    }
  }
  if (request.size.usual && request.size.kind == SceneSize::Kind::kScale) {
    const glm::dvec3 sides = clip_sides(content, model, request.clip);
    const double factor = 2 / std::max({sides.x, sides.y, sides.z});
    if (std::fabs(factor - 1) > kSameSize && std::isfinite(factor)) resolved.size.value = factor;
    resolved.size.usual = false;
  }
  const bool in_mm = request.offset.unit == SceneOffset::Unit::kMillimetres ||
                     (request.offset.unit == SceneOffset::Unit::kUsual && unit_mm > 0);
  resolved.offset.unit = SceneOffset::Unit::kSide;
  // A side is two units of the plane.
  if (in_mm) {
    for (double& value : resolved.offset.value) value /= 2 * unit_mm;
  }
  return resolved;
}

SceneRecord place_scene(const SceneRequest& resolved, const BundleContent& content,
                        std::uint32_t pattern, const PlacedModel& model) {
  const glm::dquat rotation = rotation_of(resolved.up.value_or(model.up), resolved.turn);
  const double scale = resolved.size.value;
  SceneRecord scene{};
  scene.pattern = pattern;
  scene.model = model.index;
  scene.scale = stored_float(scale);
  std::array<double, 3> offset = resolved.offset.value;
  for (double& value : offset) value *= 2;  // sides to units of the plane
  if (!resolved.centred) {
    offset[2] -=
        scale * turned_box(content, model, resolved.clip, glm::mat3_cast(rotation)).least.z;
  }
  for (std::size_t i = 0; i < 3; ++i) scene.offset[i] = stored_float(offset[i]);
  scene.rotation[0] = stored_float(rotation.x);
  scene.rotation[1] = stored_float(rotation.y);
  scene.rotation[2] = stored_float(rotation.z);
  scene.rotation[3] = stored_float(rotation.w);
  return scene;
}

bool draws_nothing(const BundleContent& content, const SceneRecord& scene) {
  const ModelRecord& model = content.models[scene.model];
  return ranges::count(content.clips, scene.model, &ClipRecord::model) == 0 &&
         shows_backs(scene, model, content.layouts[model.layout], content.chunks, content.levels,
                     content.materials, content.vertices, content.indices);
}

bool draws_nothing(const BundleView& bundle, const SceneRecord& scene) {
  for (const ClipRecord& clip : bundle.clips()) {
    if (clip.model == scene.model) return false;
  }
  const ModelRecord& model = bundle.models()[scene.model];
  return shows_backs(scene, model, bundle.layouts()[model.layout], bundle.chunks(), bundle.levels(),
                     bundle.materials(), bundle.vertices(), bundle.indices());
}

std::vector<Diagnostic> doubtful_scenes(const BundleContent& content) {
  std::vector<Diagnostic> found;
  const auto name_of = [&](NameRef name) { return content.names.substr(name.offset, name.length); };
  const auto doubt = [&](const char* code, const SceneRecord& scene, const char* cause,
                         const char* cure) {
    const std::string file = name_of(content.patterns[scene.pattern].name) + "=" +
                             name_of(content.models[scene.model].name);
    found.push_back({code, DiagnosticSeverity::kWarning, file, 0, cause, cure});
  };
  for (std::size_t i = 0; i < content.scenes.size(); ++i) {
    const SceneRecord& scene = content.scenes[i];
    if (draws_nothing(content, scene)) {
      doubt("scene.unseen", scene,
            "nothing of the model is drawn for those who look at its pattern from the front",
            "turn it (turn=180, or turn=180:0:0), or make its materials two-sided or opaque");
    }
    const auto repeats = [&](const SceneRecord& other) {
      return scene.pattern == other.pattern && scene.model == other.model &&
             scene.scale == other.scale &&
             std::equal(scene.offset, scene.offset + 3, other.offset) &&
             std::equal(scene.rotation, scene.rotation + 4, other.rotation);
    };
    const auto earlier = std::span(content.scenes).first(i);
    if (content.nodes.empty() && content.scene_clips.empty() && ranges::any_of(earlier, repeats)) {
      doubt("scene.twice", scene, "another scene has the same model at the same place",
            "leave one of the two out");
    }
  }
  return found;
}

double scene_height_mm(const BundleView& bundle, std::uint32_t index) {
  const SceneRecord& scene = bundle.scenes()[index];
  const ModelRecord& model = bundle.models()[scene.model];
  const glm::dquat rotation(scene.rotation[3], scene.rotation[0], scene.rotation[1],
                            scene.rotation[2]);
  const TurnedBox box =
      box_of_vertices(model, bundle.layouts()[model.layout], bundle.chunks(), bundle.levels(),
                      bundle.vertices(), scene_pose(bundle, index), glm::mat3_cast(rotation));
  return static_cast<double>(scene.scale) * (box.greatest.z - box.least.z) *
         millimetres_in_unit(bundle.patterns()[scene.pattern]);
}

}  // namespace modar
