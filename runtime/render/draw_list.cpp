// Frustum, back-facing cone, level of detail, order; where a scene's model stands and how deep a
// view has to be.
#include "runtime/render/draw_list.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "runtime/render/geometry_store.hpp"

namespace modar {
namespace {

/// Relative slack for some 80 float roundings. Larger draws chunks just outside the picture.
constexpr float kRoundingSlack = 1e-5f;
/// Squares of lengths and products of sides that differ by less, relative to a length's square,
/// turn a normal by less than a thousandth of a radian.
constexpr double kSameShape = 1e-3;

/// Triangles that take as long as a draw call: of 10 million a second, those of 20 us, which it
/// takes a slow CPU.
constexpr std::uint64_t kCallTriangles = 200;

glm::vec3 corner(const ChunkRecord& chunk, unsigned which) {
  return {(which & 1) != 0 ? chunk.bounds_max[0] : chunk.bounds_min[0],
          (which & 2) != 0 ? chunk.bounds_max[1] : chunk.bounds_min[1],
          (which & 4) != 0 ? chunk.bounds_max[2] : chunk.bounds_min[2]};
}

}  // namespace

ModelView model_view(const glm::mat4& projection, const glm::mat4& to_eye, int height) {
  ModelView view;
  const glm::dmat4 clip = glm::transpose(glm::dmat4(projection) * glm::dmat4(to_eye));
  // A row of the transposed matrix is a clip coordinate as a function of the point.
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t i = static_cast<std::size_t>(axis) * 2;
    view.planes[i] = glm::vec4(clip[3] + clip[axis]);
    view.planes[i + 1] = glm::vec4(clip[3] - clip[axis]);
  }
  const glm::dmat3 linear(to_eye);
  view.eye = glm::vec3(-(glm::inverse(linear) * glm::dvec3(to_eye[3])));
  view.perspective = std::abs(projection[2][3]) > 0.0f;
  // A projection that mirrors the picture (a front camera) turns the winding as well.
  const glm::mat4& p = projection;
  const bool flips = p[0][0] * p[1][1] - p[1][0] * p[0][1] < 0.0f;
  view.mirrored = (glm::determinant(linear) < 0.0) != flips;
  view.scale = static_cast<float>(
      std::sqrt(std::max({glm::dot(linear[0], linear[0]), glm::dot(linear[1], linear[1]),
                          glm::dot(linear[2], linear[2])})));
  const double least = std::min({glm::dot(linear[0], linear[0]), glm::dot(linear[1], linear[1]),
                                 glm::dot(linear[2], linear[2])});
  const double greatest = static_cast<double>(view.scale) * static_cast<double>(view.scale);
  const double skew =
      std::max({std::abs(glm::dot(linear[0], linear[1])), std::abs(glm::dot(linear[1], linear[2])),
                std::abs(glm::dot(linear[2], linear[0]))});
  view.keeps_angles = greatest - least <= kSameShape * greatest && skew <= kSameShape * greatest;
  // The row's length: a picture that is turned by 90 degrees has its scale in the other column.
  view.pixels = 0.5f * static_cast<float>(height) * std::hypot(p[0][1], p[1][1]);
  return view;
}

bool outside_frustum(const ModelView& view, const ChunkRecord& chunk) {
  for (const glm::vec4& plane : view.planes) {
    float reach = plane.w;
    float size = std::abs(plane.w);
    for (int axis = 0; axis < 3; ++axis) {
      const float far_side = plane[axis] >= 0.0f ? chunk.bounds_max[axis] : chunk.bounds_min[axis];
      reach += plane[axis] * far_side;
      size += std::abs(plane[axis] * far_side);
    }
    if (reach < -kRoundingSlack * size) return true;
  }
  return false;
}

bool faces_away(const ModelView& view, const ChunkRecord& chunk) {
  // For cutoffs in [0, 1], the directions that see only backs are a convex cone: a box with all
  // eight corners in it is inside as a whole.
  if (!view.perspective || !(chunk.cone_cutoff >= 0.0f) || chunk.cone_cutoff > 1.0f) return false;
  const glm::vec3 axis(chunk.cone_axis[0], chunk.cone_axis[1], chunk.cone_axis[2]);
  for (unsigned i = 0; i < 8; ++i) {
    const glm::vec3 ray = corner(chunk, i) - view.eye;
    const float length = glm::length(ray);
    if (glm::dot(ray, axis) < (chunk.cone_cutoff + kRoundingSlack) * length || length == 0.0f)
      return false;
  }
  return true;
}

float eye_distance(const ModelView& view, const ChunkRecord& chunk) {
  if (!view.perspective) return 0.0f;
  glm::vec3 gap(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    gap[axis] = std::max(
        {chunk.bounds_min[axis] - view.eye[axis], view.eye[axis] - chunk.bounds_max[axis], 0.0f});
  }
  return glm::length(gap) * view.scale;
}

std::uint32_t choose_level(const ModelView& view, const ChunkRecord& chunk,
                           const Table<LevelRecord>& levels, float pixels) {
  // With parallel rays, one unit has the same size at every distance.
  const float distance = view.perspective ? eye_distance(view, chunk) : 1.0f;
  std::uint32_t level = 0;
  while (level + 1 < chunk.level_count &&
         levels[chunk.first_level + level + 1].error * view.scale * view.pixels <=
             pixels * distance) {
    ++level;
  }
  return level;
}

std::uint32_t choose_proxy(const BundleView& bundle, const ModelView& view, std::uint32_t model,
                           float pixels) {
  const std::uint32_t models = bundle.models().size();
  // From the coarsest of the model on; proxies are in the order of models.
  std::uint32_t low = 0;
  std::uint32_t end = bundle.proxies().size();
  while (low < end) {
    const std::uint32_t middle = low + (end - low) / 2;
    if (bundle.proxies()[middle].model <= model) {
      low = middle + 1;
    } else {
      end = middle;
    }
  }
  for (; end > 0 && bundle.proxies()[end - 1].model == model; --end) {
    const ChunkGroup group = bundle.chunk_group(models + end - 1);
    float distance = view.perspective ? std::numeric_limits<float>::infinity() : 1.0f;
    for (std::uint32_t c = 0; view.perspective && c < group.chunk_count; ++c) {
      distance = std::min(distance, eye_distance(view, bundle.chunks()[group.first_chunk + c]));
    }
    const ChunkRecord& first = bundle.chunks()[group.first_chunk];
    const float error = bundle.levels()[first.first_level].error;
    if (error * view.scale * view.pixels <= pixels * distance) return models + end - 1;
  }
  return kNone;
}

void DrawList::build(const BundleView& bundle, std::span<const ChunkSetup> setups,
                     const glm::mat4& projection, int height, std::span<const DrawItem> items,
                     float lod_pixels) {
  begin(bundle, projection, height, items);
  const Request request{bundle, setups, items, lod_pixels};
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    if (items[i].model < bundle.models().size()) add_item(request, i);
  }
}

void DrawList::begin(const BundleView& bundle, const glm::mat4& projection, int height,
                     std::span<const DrawItem> items) {
  commands_.clear();
  views_.clear();
  culled_ = 0;
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    const bool drawn = items[i].model < bundle.models().size() || i >= whole_;
    views_.push_back(drawn ? model_view(projection, items[i].to_eye, height) : ModelView{});
  }
}

std::span<const DrawItem> DrawList::pose(const BundleView& bundle,
                                         std::span<const DrawItem> items) {
  whole_ = items.size();
  const auto rests = [&](const DrawItem& item) {
    return item.bones == nullptr || item.model >= bundle.models().size();
  };
  if (bundle.moving_parts().empty() || std::all_of(items.begin(), items.end(), rests)) return items;
  posed_.clear();
  first_parts_.clear();
  for (const DrawItem& item : items) posed_.push_back(item);
  for (const DrawItem& item : items) {
    first_parts_.push_back(0);
    if (rests(item)) continue;
    const RecordRange parts = parts_of(bundle, item.model);
    const std::uint32_t first_bone = bones_of(bundle, item.model).first;
    first_parts_.back() = static_cast<std::uint32_t>(posed_.size()) - parts.first;
    for (std::uint32_t p = parts.first; p < parts.first + parts.count; ++p) {
      const PartRecord& part = bundle.moving_parts()[p];
      posed_.push_back(item);
      DrawItem& moved = posed_.back();
      moved.model = moved.node = kNone;
      moved.bones += part.first_bone - first_bone;
      if (!part.rigid()) continue;
      const BoneMatrix& bone = *moved.bones;
      for (int c = 0; c < 4; ++c)
        moved.to_eye[c] = item.to_eye * glm::vec4(bone[0][c], bone[1][c], bone[2][c], c / 3);
      moved.bones = nullptr;
    }
  }
  return posed_;
}

/// All chunks of the model, or of a proxy: never some of both, whose borders do not meet.
void DrawList::add_item(const Request& request, std::uint32_t item) {
  const std::uint32_t model = request.items[item].model;
  const std::size_t first = commands_.size();
  int culled = add_group(request, item, model);
  const std::uint32_t proxy = choose_proxy(request.bundle, views_[item], model, request.lod_pixels);
  if (proxy != kNone) {
    const std::size_t second = commands_.size();
    const int other = add_group(request, item, proxy);
    const bool less =
        cost(request.bundle, second, commands_.size()) <= cost(request.bundle, first, second);
    const auto at = [this](std::size_t i) {
      return commands_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    if (less) {
      commands_.erase(at(first), at(second));
      culled = other;
    } else {
      commands_.resize(second);
    }
  }
  culled_ += culled;
}

void DrawList::build_of(const GeometryStore& geometry, const BundleView& bundle,
                        std::span<const ChunkSetup> setups, const glm::mat4& projection, int height,
                        std::span<const DrawItem> items, float lod_pixels) {
  begin(bundle, projection, height, items);
  const Request request{bundle, setups, items, lod_pixels};
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    if (items[i].model < bundle.models().size()) add_there(request, i, geometry);
  }
}

void DrawList::add_there(const Request& request, std::uint32_t item,
                         const GeometryStore& geometry) {
  const BundleView& bundle = request.bundle;
  const std::uint32_t model = request.items[item].model;
  const std::size_t first = commands_.size();
  int culled = add_group(request, item, model);
  for (std::uint32_t s = 0; !use_there(bundle, first, geometry); ++s) {
    commands_.resize(first);
    culled = 0;
    while (s < bundle.proxies().size() && bundle.proxies()[s].model != model) ++s;
    if (s >= bundle.proxies().size()) break;
    culled = add_group(request, item, bundle.models().size() + s);
  }
  culled_ += culled;
}

/// Moves the commands from `first` on to levels that are there, finer ones where one is: an eye
/// that moves away sees no worse meanwhile. False if a chunk has none.
bool DrawList::use_there(const BundleView& bundle, std::size_t first,
                         const GeometryStore& geometry) {
  for (std::size_t i = first; i < commands_.size(); ++i) {
    DrawCommand& command = commands_[i];
    const ChunkRecord& chunk = bundle.chunks()[command.chunk];
    const std::uint32_t end = chunk.first_level + chunk.level_count;
    const std::uint32_t chosen = command.level;
    const auto missing = [&] { return !geometry.there({&command.level, 1}); };
    while (missing() && command.level > chunk.first_level) --command.level;
    if (missing()) command.level = chosen;
    while (missing()) {
      if (++command.level == end) return false;
    }
  }
  return true;
}

ChunkRecord boxed(const ChunkRecord& chunk, const PartRecord& part, const BoneMatrix* bones) {
  ChunkRecord moved = chunk;
  moved.cone_cutoff = 2.0f;
  float away = 0;  // by morph targets
  for (std::uint32_t t = 0; t < part.target_count; ++t)
    away += std::abs(bones[part.bone_count + t][0].w);
  for (int row = 0; row < 3; ++row) {
    moved.bounds_min[row] = std::numeric_limits<float>::infinity();
    moved.bounds_max[row] = -std::numeric_limits<float>::infinity();
    for (std::uint32_t b = 0; b < part.bone_count; ++b) {
      const glm::vec4& line = bones[b][row];
      float middle = line.w;
      float reach = 0;
      for (int axis = 0; axis < 3; ++axis) {
        middle += line[axis] * 0.5f * (chunk.bounds_min[axis] + chunk.bounds_max[axis]);
        reach += std::abs(line[axis]) *
                 (0.5f * (chunk.bounds_max[axis] - chunk.bounds_min[axis]) + away);
      }
      moved.bounds_min[row] = std::min(moved.bounds_min[row], middle - reach);
      moved.bounds_max[row] = std::max(moved.bounds_max[row], middle + reach);
    }
  }
  return moved;
}

/// Adds the visible chunks of a group; answers how many are not.
int DrawList::add_group(const Request& request, std::uint32_t item, std::uint32_t number) {
  const BundleView& bundle = request.bundle;
  const ChunkGroup group = bundle.chunk_group(number);
  const bool moves = request.items[item].bones != nullptr && whole_ < request.items.size();
  const Table<LevelRecord> levels = bundle.levels();
  int culled = 0;
  for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
    const std::uint32_t part = moves ? request.setups[c].part : kNone;
    const std::uint32_t drawn = part == kNone ? item : first_parts_[item] + part;
    const bool skinned = part != kNone && request.items[drawn].bones != nullptr;
    const ModelView& view = views_[drawn];
    const ChunkRecord& rest = bundle.chunks()[c];
    ChunkRecord box;
    const ChunkRecord& chunk =
        skinned ? (box = boxed(rest, bundle.moving_parts()[part], request.items[drawn].bones))
                : rest;
    const MaterialRecord& material = bundle.materials()[chunk.material];
    const bool two_sided = (material.flags & kMaterialTwoSided) != 0;
    if (outside_frustum(view, chunk) || (!two_sided && faces_away(view, chunk))) {
      ++culled;
      continue;
    }
    DrawCommand command;
    command.item = drawn;
    command.chunk = c;
    command.level = chunk.first_level + choose_level(view, chunk, levels, request.lod_pixels);
    command.program = skinned ? request.setups[c].skinned : request.setups[c].program;
    command.texture = material.texture;
    command.material = request.setups[c].material;
    // A matrix with a NaN must not upset the order.
    const float distance = eye_distance(view, chunk);
    command.distance = distance >= 0.0f ? distance : 0.0f;
    command.hides = request.setups[c].hides;
    command.blended =
        request.setups[c].blended || (request.items[item].opacity < 1.0f && !command.hides);
    if (levels[command.level].index_count > 0) commands_.push_back(command);
  }
  return culled;
}

std::uint64_t DrawList::cost(const BundleView& bundle, std::size_t begin, std::size_t end) const {
  std::uint64_t sum = kCallTriangles * (end - begin);
  for (std::size_t i = begin; i < end; ++i) {
    sum += bundle.levels()[commands_[i].level].index_count / 3;
  }
  return sum;
}

namespace {

/// Both orders in one, since each order of its own is a sort of its own: 2.5 KB of WebAssembly.
struct CommandOrder {
  const BundleView* by_state = nullptr;  ///< null: by distance

  bool operator()(const DrawCommand& a, const DrawCommand& b) const {
    if (by_state == nullptr)
      return std::tie(a.distance, a.item, a.chunk) < std::tie(b.distance, b.item, b.chunk);
    if (a.hides != b.hides) return a.hides;
    if (a.blended != b.blended) return b.blended;
    if (a.blended && a.distance != b.distance) return a.distance > b.distance;
    const std::uint64_t a_indices = by_state->levels()[a.level].index_offset;
    const std::uint64_t b_indices = by_state->levels()[b.level].index_offset;
    return std::tie(a.program, a.texture, a.material, a.item, a_indices, a.chunk) <
           std::tie(b.program, b.texture, b.material, b.item, b_indices, b.chunk);
  }
};

}  // namespace

void DrawList::sort_by_distance() {
  std::sort(commands_.begin(), commands_.end(), CommandOrder{});
}

void DrawList::sort_by_state(const BundleView& bundle) {
  std::sort(commands_.begin(), commands_.end(), CommandOrder{&bundle});
}

namespace {

struct Depths {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -std::numeric_limits<double>::infinity();
};

/// Depth in front of the eye is -z; over a box it spans its centre's, plus or minus its reach.
void add_box(const glm::dmat4& to_eye, const float (&least)[3], const float (&most)[3],
             Depths& depths) {
  double centre = -to_eye[3][2];
  double reach = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = static_cast<double>(least[axis]);
    const double high = static_cast<double>(most[axis]);
    centre -= to_eye[axis][2] * 0.5 * (low + high);
    reach += std::abs(to_eye[axis][2]) * 0.5 * (high - low);
  }
  depths.nearest = std::min(depths.nearest, centre - reach);
  depths.farthest = std::max(depths.farthest, centre + reach);
}

}  // namespace

glm::mat4 scene_matrix(const SceneRecord& scene) {
  const glm::quat rotation(scene.rotation[3], scene.rotation[0], scene.rotation[1],
                           scene.rotation[2]);
  glm::mat4 matrix = glm::mat4_cast(glm::normalize(rotation));
  // Decoded models and patterns both have a largest side of 2: the default placement scales by 1.
  for (int axis = 0; axis < 3; ++axis) matrix[axis] *= scene.scale;
  matrix[3] = glm::vec4(scene.offset[0], scene.offset[1], scene.offset[2], 1.0f);
  return matrix;
}

DepthRange depth_range(const BundleView& bundle, std::span<const DrawItem> items) {
  // Far over near. A 16-bit depth buffer still resolves distances of 1.5 % at the far end.
  constexpr double kGreatestRatio = 1000.0;
  constexpr double kMargin =
      0.01;  // keeps what touches a plane inside it, though half floats move it by 0.0002
  Depths depths;
  for (const DrawItem& item : items) {
    const glm::dmat4 to_eye(item.to_eye);
    if (is_picture(bundle, item.node)) add_box(to_eye, {-1, -1, 0}, {1, 1, 0}, depths);
    if (item.model >= bundle.models().size()) continue;
    const std::uint32_t first_bone = bones_of(bundle, item.model).first;
    const ChunkGroup group = bundle.chunk_group(item.model);
    for (std::uint32_t c = group.first_chunk; c < group.first_chunk + group.chunk_count; ++c) {
      const ChunkRecord& rest = bundle.chunks()[c];
      const std::uint32_t part = item.bones == nullptr ? kNone : part_of(bundle, rest.material);
      ChunkRecord box = rest;
      if (part != kNone) {
        const PartRecord& moving = bundle.moving_parts()[part];
        box = boxed(rest, moving, item.bones + (moving.first_bone - first_bone));
      }
      add_box(to_eye, box.bounds_min, box.bounds_max, depths);
    }
  }
  if (!(depths.farthest > 0.0) || !std::isfinite(depths.farthest)) return {};
  DepthRange range;
  range.far_plane = depths.farthest * (1.0 + kMargin);
  range.near_plane = std::max(depths.nearest * (1.0 - kMargin), range.far_plane / kGreatestRatio);
  return range;
}

}  // namespace modar
