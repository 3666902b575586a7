// Rules on indices and vertices: the only ones that read every byte of a model.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "formats/check_rules.hpp"
#include "formats/component.hpp"
#include "formats/validate.hpp"
#include "formats/vertex_scan.hpp"

namespace modar {
namespace {

double length_tolerance(std::uint8_t type) {
  const std::uint32_t bytes = component_bytes(type);
  return bytes == 1 ? 0.02 : (bytes == 2 ? 2e-3 : 1e-4);
}

/// Of the cut-off: writers round positions, normals and axes in their own ways (bundle.md,
/// CHUNK_CONE).
constexpr double kConeSlack = 1e-3;

using Floats [[gnu::vector_size(16)]] = float;
using Doubles [[gnu::vector_size(32)]] = double;
using Words32 [[gnu::vector_size(16)]] = std::uint32_t;

/// The four half floats at `bytes`, which are finite. The bits of a half, in the place of a
/// float's, are its value times 2^-112; subnormal ones, too.
Floats load_halves(const std::byte* bytes) {
  using Halves [[gnu::vector_size(8)]] = std::uint16_t;
  Halves halves;
  std::memcpy(&halves, bytes, sizeof halves);
  const Words32 wide = __builtin_convertvector(halves, Words32);
  const Words32 bits = (wide & 0x7FFF) << 13;
  Floats values;
  std::memcpy(&values, &bits, sizeof values);
  values *= 0x1p112f;
  Words32 signs;
  std::memcpy(&signs, &values, sizeof signs);
  signs |= (wide & 0x8000) << 16;
  std::memcpy(&values, &signs, sizeof values);
  return values;
}

/// Tests the normals of triangles against their chunk's cone, from decoded positions.
class ConeCheck {
 public:
  struct Outside {
    std::uint64_t count = 0;
    std::uint32_t first = 0;  ///< index of the first of them
  };
  /// How many triangles of the level face out of their chunk's cone; 0 where the chunk is never
  /// culled. range: of the level's indices, which are below vertex_count. Positions are finite.
  Outside count_outside(const BundleParts& parts, const LayoutRecord& layout,
                        const ChunkRecord& chunk, const LevelRecord& level, IndexScan range);

 private:
  void decode(const BundleParts& parts, const LayoutRecord& layout, const ChunkRecord& chunk,
              const LevelRecord& level, IndexScan range);
  void load_corners(const std::uint16_t* indices, std::array<Doubles, 9>& corners) const;

  /// x, y, z and one unused, of the vertices from base_ on; at most 65535: it does not grow with
  /// the bundle.
  std::vector<Floats> positions_;
  std::uint16_t base_ = 0;
};

/// Positions as a shader has them, rounded to f32.
void ConeCheck::decode(const BundleParts& parts, const LayoutRecord& layout,
                       const ChunkRecord& chunk, const LevelRecord& level, IndexScan range) {
  const AttributeRecord& position = *find_attribute(layout, Semantic::kPosition);
  const auto step = static_cast<double>(chunk.position_step);
  const float* const o = chunk.position_offset;
  const Doubles offset = {static_cast<double>(o[0]), static_cast<double>(o[1]),
                          static_cast<double>(o[2]), 0.0};
  base_ = range.least;
  const std::size_t count = std::size_t{range.greatest} - range.least + 1;
  positions_.resize(count);
  const auto bytes = parts.vertices.subspan(static_cast<std::size_t>(level.vertex_offset) +
                                            std::size_t{range.least} * layout.stride);
  const auto put = [&](std::size_t v, const Doubles& value) {
    positions_[v] = __builtin_convertvector(offset + step * value, Floats);
  };
  std::size_t v = 0;
  constexpr std::size_t kLoaded = 8;  // bytes that load_halves() reads
  if (static_cast<ComponentType>(position.type) == ComponentType::kHalf) {
    for (std::size_t at = position.offset; v < count && at + kLoaded <= bytes.size();
         ++v, at += layout.stride) {
      put(v, __builtin_convertvector(load_halves(bytes.data() + at), Doubles));
    }
  }
  for (; v < count; ++v) {
    const std::byte* vertex = bytes.data() + v * layout.stride;
    put(v, Doubles{decode_component(position, vertex, 0), decode_component(position, vertex, 1),
                   decode_component(position, vertex, 2), 0.0});
  }
}

/// corners[3 * k + axis]: corner k of four triangles, one a lane.
void ConeCheck::load_corners(const std::uint16_t* indices, std::array<Doubles, 9>& corners) const {
  for (std::size_t k = 0; k < 3; ++k) {
    std::array<Floats, 4> p{};
    for (std::size_t t = 0; t < 4; ++t) {
      p[t] = positions_[static_cast<std::size_t>(indices[3 * t + k] - base_)];
    }
    const Floats xy01 = __builtin_shufflevector(p[0], p[1], 0, 4, 1, 5);
    const Floats xy23 = __builtin_shufflevector(p[2], p[3], 0, 4, 1, 5);
    const Floats z01 = __builtin_shufflevector(p[0], p[1], 2, 6, 3, 7);
    const Floats z23 = __builtin_shufflevector(p[2], p[3], 2, 6, 3, 7);
    const Floats x = __builtin_shufflevector(xy01, xy23, 0, 1, 4, 5);
    const Floats y = __builtin_shufflevector(xy01, xy23, 2, 3, 6, 7);
    const Floats z = __builtin_shufflevector(z01, z23, 0, 1, 4, 5);
    corners[3 * k] = __builtin_convertvector(x, Doubles);
    corners[3 * k + 1] = __builtin_convertvector(y, Doubles);
    corners[3 * k + 2] = __builtin_convertvector(z, Doubles);
  }
}

ConeCheck::Outside ConeCheck::count_outside(const BundleParts& parts, const LayoutRecord& layout,
                                            const ChunkRecord& chunk, const LevelRecord& level,
                                            IndexScan range) {
  Outside outside;
  if (chunk.cone_cutoff > 1.0f || level.index_count == 0) return outside;
  decode(parts, layout, chunk, level, range);
  const auto* indices =
      reinterpret_cast<const std::uint16_t*>(parts.indices.data() + level.index_offset);
  const double axis[] = {static_cast<double>(chunk.cone_axis[0]),
                         static_cast<double>(chunk.cone_axis[1]),
                         static_cast<double>(chunk.cone_axis[2])};
  const double sine = static_cast<double>(chunk.cone_cutoff) + kConeSlack;
  // Lengths stay squared: no root, no division, and triangles without area pass.
  const double least = std::max(0.0, 1.0 - sine * sine) *
                       (axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  std::array<Doubles, 9> p;
  for (std::uint32_t i = 0; i < level.index_count; i += 12) {
    const std::uint32_t count = std::min(4u, (level.index_count - i) / 3);
    const std::uint16_t* four = indices + i;
    std::array<std::uint16_t, 12> last;
    if (count < 4) {
      last.fill(*four);  // lanes without a triangle get one without area
      std::copy_n(four, 3 * count, last.begin());
      four = last.data();
    }
    load_corners(four, p);
    const Doubles ux = p[3] - p[0], uy = p[4] - p[1], uz = p[5] - p[2];
    const Doubles vx = p[6] - p[0], vy = p[7] - p[1], vz = p[8] - p[2];
    const Doubles nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const Doubles along = nx * axis[0] + ny * axis[1] + nz * axis[2];
    const Doubles square = nx * nx + ny * ny + nz * nz;
    const auto inside = (along >= 0.0) & (along * along >= least * square);
    if ((inside[0] & inside[1] & inside[2] & inside[3]) != 0) continue;
    for (std::uint32_t t = 0; t < count; ++t) {
      if (inside[t] == 0 && outside.count++ == 0) outside.first = i + 3 * t;
    }
  }
  return outside;
}

/// Checks level after level with one set of marks.
class GeometryCheck {
 public:
  GeometryCheck(FaultLog& log, const BundleParts& parts) : log_(log), parts_(parts) {}

  /// used: the byte of its vertices that holds occlusion, or kNone.
  void start_model(std::uint32_t used) { occlusion_byte_ = used; }

  /// `where()` makes the words for "model, chunk, level" if they are needed.
  template <class Where>
  void check_level(const LayoutRecord& layout, const VertexScan& scan, const ChunkRecord& chunk,
                   const LevelRecord& level, Where where) {
    const auto* indices =
        reinterpret_cast<const std::uint16_t*>(parts_.indices.data() + level.index_offset);
    const IndexScan range = scan_indices({indices, level.index_count});
    if (valid_at_a_glance(layout, scan, chunk, level, range)) {
      return check_cone(layout, chunk, level, range, where);
    }
    wrong_index_ = degenerate_ = not_finite_ = normal_ = outside_ = padding_ = occlusion_ = Tally();
    for (std::uint32_t i = 0; i < level.index_count; ++i) {
      const std::uint16_t index = indices[i];
      if (index >= level.vertex_count) {
        wrong_index_.hit(offset_of(parts_, indices + i));
      } else if (mark(index)) {
        check_vertex(
            layout, chunk,
            parts_.vertices.data() + level.vertex_offset + std::size_t{index} * layout.stride);
      }
    }
    for (std::uint32_t i = 0; i < level.index_count; i += 3) {
      if (indices[i] == indices[i + 1] || indices[i + 1] == indices[i + 2] ||
          indices[i] == indices[i + 2]) {
        degenerate_.hit(offset_of(parts_, indices + i));
      }
    }
    // Marks are taken back one by one: clearing all would let tiny levels cost as much as great
    // ones.
    for (std::uint32_t i = 0; i < level.index_count; ++i) marks_[indices[i] / 64] = 0;
    tell(Rule::kIndexRange, wrong_index_, where, "indices are too great");
    tell(Rule::kNotFinite, not_finite_, where, "vertices are not finite");
    tell(Rule::kNormalLength, normal_, where, "normals are not of unit length");
    tell(Rule::kChunkBounds, outside_, where, "vertices are outside the chunk's box");
    tell(Rule::kVertexPadding, padding_, where, "vertices have padding that is not zero");
    tell(Rule::kVertexOcclusion, occlusion_, where, "vertices have an occlusion above 127");
    tell(Rule::kDegenerateTriangles, degenerate_, where, "triangles use a vertex twice");
    if (wrong_index_.count + not_finite_.count > 0) {
      extent_.broken = true;
    } else {
      check_cone(layout, chunk, level, range, where);
    }
  }

  /// The bones that vertices name: of those without a part the first alone.
  template <class Where>
  void check_bones(const LayoutRecord& layout, const ChunkRecord& chunk, const LevelRecord& level,
                   Where where) {
    const AttributeRecord* joints = find_attribute(layout, Semantic::kJoints);
    const AttributeRecord* weights = find_attribute(layout, Semantic::kWeights);
    if (joints == nullptr || weights == nullptr) return;
    std::uint32_t bones = 1;
    for (const PartRecord& part : parts_.parts) {
      if (part.material == chunk.material) bones = part.bone_count;
    }
    Tally wrong;
    const auto* indices =
        reinterpret_cast<const std::uint16_t*>(parts_.indices.data() + level.index_offset);
    for (std::uint32_t i = 0; i < level.index_count; ++i) {
      if (indices[i] >= level.vertex_count) continue;  // told by check_level()
      const std::byte* vertex =
          parts_.vertices.data() + level.vertex_offset + std::size_t{indices[i]} * layout.stride;
      std::uint32_t sum = 0;
      bool good = true;
      for (std::size_t k = 0; k < 4; ++k) {
        sum += std::to_integer<std::uint32_t>(vertex[weights->offset + k]);
        good = good && std::to_integer<std::uint32_t>(vertex[joints->offset + k]) < bones;
      }
      if (!good || sum != 255) wrong.hit(offset_of(parts_, vertex + joints->offset));
    }
    tell(Rule::kVertexBones, wrong, where, "corners name wrong bones or weights");
  }

  /// After all levels of a chunk: its box is no larger than what they hold.
  template <class Where>
  void finish_chunk(const ChunkRecord& chunk, Where where) {
    const Extent extent = std::exchange(extent_, Extent());
    if (extent.broken || extent.low[0] > extent.high[0]) return;
    bool tight = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      tight = tight && static_cast<double>(chunk.bounds_min[axis]) >= extent.low[axis] - kSlack &&
              static_cast<double>(chunk.bounds_max[axis]) <= extent.high[axis] + kSlack;
    }
    if (tight) return;
    log_.add(Rule::kChunkLoose, offset_of(parts_, &chunk), where(),
             "its vertices reach from " + text(extent.low) + " to " + text(extent.high));
  }

 private:
  /// Of boxes: f32 rounds what f64 has decoded.
  static constexpr double kSlack = 1e-6;
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  /// Of the decoded positions of a chunk's levels.
  struct Extent {
    std::array<double, 3> low = {kFar, kFar, kFar};
    std::array<double, 3> high = {-kFar, -kFar, -kFar};
    bool broken = false;  ///< some vertex has no place
  };

  static std::string text(const std::array<double, 3>& point) {
    return number_text(point[0]) + " " + number_text(point[1]) + " " + number_text(point[2]);
  }

  template <class Where>
  void check_cone(const LayoutRecord& layout, const ChunkRecord& chunk, const LevelRecord& level,
                  IndexScan range, Where where) {
    const ConeCheck::Outside outside = cones_.count_outside(parts_, layout, chunk, level, range);
    if (outside.count == 0) return;
    log_.add(Rule::kChunkCone,
             offset_of(parts_, parts_.indices.data() + level.index_offset + 2ull * outside.first),
             where(), "{} triangles face out of the cone", {outside.count});
  }

  /// A fast scan of all indices and of all vertices between the least and the greatest, used or
  /// not. False where one has to be checked by itself, or where few of many vertices are used: the
  /// time taken follows the indices.
  [[nodiscard]] bool valid_at_a_glance(const LayoutRecord& layout, const VertexScan& scan,
                                       const ChunkRecord& chunk, const LevelRecord& level,
                                       IndexScan range) {
    if (!scan.possible() || level.index_count == 0 || range.degenerate ||
        range.greatest >= level.vertex_count) {
      return false;
    }
    const std::size_t count = std::size_t{range.greatest} - range.least + 1;
    if (count > level.index_count) return false;
    const VertexScan::Extent extent = scan.scan(parts_.vertices.subspan(
        static_cast<std::size_t>(level.vertex_offset) + std::size_t{range.least} * layout.stride,
        count * layout.stride));
    const auto low = place(chunk, {extent.low[0], extent.low[1], extent.low[2], 0.0});
    const auto high = place(chunk, {extent.high[0], extent.high[1], extent.high[2], 0.0});
    const bool good = extent.finite && extent.unit_normals && extent.clean_padding &&
                      inside(chunk, low) && inside(chunk, high);
    if (good) {
      widen(low);
      widen(high);
    }
    return good;
  }

  /// True the first time.
  bool mark(std::uint16_t index) {
    std::uint64_t& word = marks_[index / 64];
    const std::uint64_t bit = std::uint64_t{1} << (index % 64);
    const bool fresh = (word & bit) == 0;
    word |= bit;
    return fresh;
  }

  void check_vertex(const LayoutRecord& layout, const ChunkRecord& chunk, const std::byte* vertex) {
    std::array<bool, kMaxVertexStride> owned{};
    if (occlusion_byte_ < layout.stride) {
      owned[occlusion_byte_] = true;
      const std::byte* place = vertex + occlusion_byte_;
      if (*place > std::byte{kMaxOcclusion}) occlusion_.hit(offset_of(parts_, place));
    }
    for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
      const AttributeRecord& attribute = layout.attributes[i];
      const std::uint32_t size = component_bytes(attribute.type);
      const std::byte* place = vertex + attribute.offset;
      std::fill_n(owned.begin() + attribute.offset, size * attribute.components, true);
      std::array<double, 4> value{};
      bool finite = true;
      for (std::uint32_t c = 0; c < attribute.components; ++c) {
        value[c] = decode_component(attribute, vertex, c);
        finite = finite && std::isfinite(value[c]);
      }
      if (!finite) {
        not_finite_.hit(offset_of(parts_, place));
      } else if (attribute.semantic == static_cast<std::uint8_t>(Semantic::kPosition)) {
        const auto position = this->place(chunk, value);
        widen(position);
        if (!inside(chunk, position)) outside_.hit(offset_of(parts_, place));
      } else if (attribute.semantic == static_cast<std::uint8_t>(Semantic::kNormal)) {
        const double square = value[0] * value[0] + value[1] * value[1] + value[2] * value[2];
        if (std::fabs(std::sqrt(square) - 1.0) > length_tolerance(attribute.type)) {
          normal_.hit(offset_of(parts_, place));
        }
      }
    }
    for (std::uint32_t i = 0; i < layout.stride; ++i) {
      if (!owned[i] && vertex[i] != std::byte{0})
        return padding_.hit(offset_of(parts_, vertex + i));
    }
  }

  /// The attribute in model space.
  static std::array<double, 3> place(const ChunkRecord& chunk,
                                     const std::array<double, 4>& attribute) {
    std::array<double, 3> position{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position[axis] = static_cast<double>(chunk.position_offset[axis]) +
                       static_cast<double>(chunk.position_step) * attribute[axis];
    }
    return position;
  }

  void widen(const std::array<double, 3>& position) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      extent_.low[axis] = std::min(extent_.low[axis], position[axis]);
      extent_.high[axis] = std::max(extent_.high[axis], position[axis]);
    }
  }

  static bool inside(const ChunkRecord& chunk, const std::array<double, 3>& position) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Written so that NaN fails.
      if (!(position[axis] >= static_cast<double>(chunk.bounds_min[axis]) - kSlack &&
            position[axis] <= static_cast<double>(chunk.bounds_max[axis]) + kSlack)) {
        return false;
      }
    }
    return true;
  }

  template <class Where>
  void tell(Rule rule, const Tally& tally, Where where, const char* what) {
    if (tally.count > 0)
      log_.add(rule, tally.first, where(), std::to_string(tally.count) + " " + what);
  }

  FaultLog& log_;
  const BundleParts& parts_;
  std::array<std::uint64_t, 1024> marks_{};  // a bit for every possible index
  std::uint32_t occlusion_byte_ = kNone;
  Tally wrong_index_;
  Tally degenerate_;
  Tally not_finite_;
  Tally normal_;
  Tally outside_;
  Tally padding_;
  Tally occlusion_;
  Extent extent_;
  ConeCheck cones_;
};

}  // namespace

void check_geometry(FaultLog& log, const BundleParts& parts, BufferHashes& hashes) {
  GeometryCheck check(log, parts);
  for (std::uint32_t i = 0; i < parts.chunk_groups(); ++i) {
    const ChunkGroup group = parts.chunk_group(i);
    const ModelRecord& model = parts.models[group.model];
    const LayoutRecord& layout = parts.layouts[model.layout];
    const std::uint32_t used = occlusion_byte(parts.occlusion, model.layout);
    const VertexScan scan(layout, used);
    check.start_model(used);
    for (std::uint32_t j = 0; j < group.chunk_count; ++j) {
      const ChunkRecord& chunk = parts.chunks[group.first_chunk + j];
      const auto where = [&] { return group_label(parts, i) + ", chunk " + std::to_string(j); };
      for (std::uint32_t k = 0; k < chunk.level_count; ++k) {
        const LevelRecord& level = parts.levels[chunk.first_level + k];
        check.check_bones(layout, chunk, level,
                          [&] { return where() + ", level " + std::to_string(k); });
        check.check_level(layout, scan, chunk, level,
                          [&] { return where() + ", level " + std::to_string(k); });
        // Hashed while the caches still hold it.
        hashes.vertices.read_to(level.vertex_offset +
                                std::uint64_t{level.vertex_count} * layout.stride);
        hashes.indices.read_to(level.index_offset + 2ull * level.index_count);
      }
      check.finish_chunk(chunk, where);
    }
  }
}

}  // namespace modar
