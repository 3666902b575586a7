// Rules on indices and vertices: the only ones that read every byte of a model.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "formats/check_rules.hpp"
#include "formats/quantise.hpp"
#include "formats/validate.hpp"
#include "formats/vertex_scan.hpp"

namespace modar {
namespace {

template <class T>
T load(const std::byte* place) {
  T value;
  std::memcpy(&value, place, sizeof(T));
  return value;
}

/// A component as OpenGL ES 2.0 hands it to a shader (bundle.md, Decoding).
double component(const std::byte* place, std::uint8_t type, bool normalised) {
  switch (static_cast<ComponentType>(type)) {
    case ComponentType::kHalf:
      return static_cast<double>(half_to_float(load<std::uint16_t>(place)));
    case ComponentType::kF32:
      return static_cast<double>(load<float>(place));
    case ComponentType::kI16: {
      const double c = load<std::int16_t>(place);
      return normalised ? (2.0 * c + 1.0) / 65535.0 : c;
    }
    case ComponentType::kU16: {
      const double c = load<std::uint16_t>(place);
      return normalised ? c / 65535.0 : c;
    }
    case ComponentType::kI8: {
      const double c = load<std::int8_t>(place);
      return normalised ? (2.0 * c + 1.0) / 255.0 : c;
    }
    case ComponentType::kU8: {
      const double c = load<std::uint8_t>(place);
      return normalised ? c / 255.0 : c;
    }
  }
  return 0.0;
}

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
    if (surely_good(layout, scan, chunk, level)) return;
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
  }

 private:
  /// A quick look at all indices and at all vertices, used or not. Levels that use few of many
  /// vertices are left to the slow look, which takes no longer than their indices.
  [[nodiscard]] bool surely_good(const LayoutRecord& layout, const VertexScan& scan,
                                 const ChunkRecord& chunk, const LevelRecord& level) const {
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
    return extent.finite && extent.unit_normals && extent.clean_padding &&
           inside(chunk, {extent.low[0], extent.low[1], extent.low[2], 0.0}) &&
           inside(chunk, {extent.high[0], extent.high[1], extent.high[2], 0.0});
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
        value[c] = component(place + c * size, attribute.type, attribute.normalised != 0);
        finite = finite && std::isfinite(value[c]);
      }
      if (!finite) {
        not_finite_.hit(offset_of(parts_, place));
      } else if (attribute.semantic == static_cast<std::uint8_t>(Semantic::kPosition)) {
        if (!inside(chunk, value)) outside_.hit(offset_of(parts_, place));
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

  static bool inside(const ChunkRecord& chunk, const std::array<double, 4>& attribute) {
    constexpr double kSlack = 1e-6;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double position = static_cast<double>(chunk.position_offset[axis]) +
                              static_cast<double>(chunk.position_step) * attribute[axis];
      // Written so that NaN fails.
      if (!(position >= static_cast<double>(chunk.bounds_min[axis]) - kSlack &&
            position <= static_cast<double>(chunk.bounds_max[axis]) + kSlack)) {
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
      for (std::uint32_t k = 0; k < chunk.level_count; ++k) {
        const LevelRecord& level = parts.levels[chunk.first_level + k];
        check.check_level(layout, scan, chunk, level, [&] {
          return label(parts, "model", model.name) + ", chunk " + std::to_string(j) + ", level " +
                 std::to_string(k);
        });
        statement.level(chunk.first_level + k, layout.stride);
        // Hashed while the caches still hold it.
        hashes.vertices.read_to(level.vertex_offset +
                                std::uint64_t{level.vertex_count} * layout.stride);
        hashes.indices.read_to(level.index_offset + 2ull * level.index_count);
      }
    }
  }
}

}  // namespace modar
