// Rules on indices and vertices: the only ones that read every byte of a model.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "formats/check_rules.hpp"
#include "formats/component.hpp"
#include "formats/cone_check.hpp"
#include "formats/validate.hpp"
#include "formats/vertex_scan.hpp"

namespace modar {
namespace {

double length_tolerance(std::uint8_t type) {
  const std::uint32_t bytes = component_bytes(type);
  return bytes == 1 ? 0.02 : (bytes == 2 ? 2e-3 : 1e-4);
}

/// Checks level after level with one set of marks.
class GeometryCheck {
 public:
  GeometryCheck(FaultLog& log, const BundleParts& parts) : log_(log), parts_(parts) {}

  /// `where()` makes the words for "model, chunk, level" if they are needed.
  template <class Where>
  void check_level(const LayoutRecord& layout, const VertexScan& scan, const ChunkRecord& chunk,
                   const LevelRecord& level, Where where) {
    if (surely_good(layout, scan, chunk, level)) return check_cone(layout, chunk, level, where);
    const auto* indices =
        reinterpret_cast<const std::uint16_t*>(parts_.indices.data() + level.index_offset);
    wrong_index_ = degenerate_ = not_finite_ = normal_ = outside_ = padding_ = Tally();
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
    tell(Rule::kChunkBounds, outside_, where, "vertices lie outside of the chunk's box");
    tell(Rule::kVertexPadding, padding_, where, "vertices have padding that is not zero");
    tell(Rule::kDegenerateTriangles, degenerate_, where, "triangles use a vertex twice");
    if (wrong_index_.count + not_finite_.count > 0) {
      extent_.broken = true;
    } else {
      check_cone(layout, chunk, level, where);
    }
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
                  Where where) {
    const ConeCheck::Outside outside = cones_.look(parts_, layout, chunk, level);
    if (outside.count == 0) return;
    log_.add(Rule::kChunkCone,
             offset_of(parts_, parts_.indices.data() + level.index_offset + 2ull * outside.first),
             where(), std::to_string(outside.count) + " triangles face out of the cone");
  }

  /// A quick look at all indices and at all vertices, used or not. Levels that use few of many
  /// vertices are left to the slow look, which takes no longer than their indices.
  [[nodiscard]] bool surely_good(const LayoutRecord& layout, const VertexScan& scan,
                                 const ChunkRecord& chunk, const LevelRecord& level) {
    if (!scan.possible() || level.vertex_count == 0 || level.vertex_count > level.index_count) {
      return false;
    }
    const IndexScan indices = scan_indices(
        {reinterpret_cast<const std::uint16_t*>(parts_.indices.data() + level.index_offset),
         level.index_count});
    if (indices.degenerate || indices.greatest >= level.vertex_count) return false;
    const VertexScan::Extent extent =
        scan.scan(parts_.vertices.subspan(static_cast<std::size_t>(level.vertex_offset),
                                          std::size_t{level.vertex_count} * layout.stride));
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
  Tally wrong_index_;
  Tally degenerate_;
  Tally not_finite_;
  Tally normal_;
  Tally outside_;
  Tally padding_;
  Extent extent_;
  ConeCheck cones_;
};

}  // namespace

void check_geometry(FaultLog& log, const BundleParts& parts, BufferHashes& hashes,
                    StatementCheck& statement) {
  GeometryCheck check(log, parts);
  for (std::uint32_t i = 0; i < parts.models.size(); ++i) {
    const ModelRecord& model = parts.models[i];
    const LayoutRecord& layout = parts.layouts[model.layout];
    const VertexScan scan(layout);
    for (std::uint32_t j = 0; j < model.chunk_count; ++j) {
      const ChunkRecord& chunk = parts.chunks[model.first_chunk + j];
      const auto where = [&] {
        return label(parts, "model", model.name) + ", chunk " + std::to_string(j);
      };
      for (std::uint32_t k = 0; k < chunk.level_count; ++k) {
        const LevelRecord& level = parts.levels[chunk.first_level + k];
        check.check_level(layout, scan, chunk, level,
                          [&] { return where() + ", level " + std::to_string(k); });
        statement.level(chunk.first_level + k, layout.stride);
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
