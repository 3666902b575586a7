// Fast scans of a level's bytes, many vertices and indices at a time: their answer is "all of it is
// valid" or "check one by one". For the checker and the renderer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/layout.hpp"

namespace modar {

/// Properties of all indices of a level.
struct IndexScan {
  std::uint16_t least = 0xFFFF;
  std::uint16_t greatest = 0;
  bool degenerate = false;  ///< some triangle uses a vertex twice
};

/// indices.size() is a multiple of 3. One pass, a few bytes a cycle.
IndexScan scan_indices(std::span<const std::uint16_t> indices);

/// How vertices of one layout are scanned.
class VertexScan {
 public:
  /// used: a byte of a vertex that belongs to no attribute and may be 0 to 127 (OcclusionRecord),
  /// or kNone.
  explicit VertexScan(const LayoutRecord& layout, std::uint32_t used = kNone);

  /// False: the layout has attributes (32-bit floats, say) that have to be checked one by one.
  [[nodiscard]] bool possible() const { return possible_; }

  /// Properties of all vertices.
  struct Extent {
    bool finite = true;         ///< no infinity, no NaN
    bool unit_normals = true;   ///< lengths certainly within the tolerance of VERTEX_NORMAL
    bool clean_padding = true;  ///< bytes of no attribute are zero, the used one at most 127
    double low[3] = {};         ///< of the position attribute, as OpenGL ES 2.0 decodes it
    double high[3] = {};
  };
  /// bytes: whole vertices, at least one. Only where possible().
  [[nodiscard]] Extent scan(std::span<const std::byte> bytes) const;

 private:
  static constexpr std::size_t kMaxVectors = 4;
  using Lanes [[gnu::vector_size(16)]] = std::int16_t;
  struct Range {
    Lanes low[kMaxVectors];
    Lanes high[kMaxVectors];
    Lanes dirt[kMaxVectors];
  };

  void plan(const AttributeRecord& attribute);
  template <std::size_t kVectors>
  void scan_lanes(std::span<const std::byte> bytes, Range& range) const;
  [[nodiscard]] bool normals_good(std::span<const std::byte> bytes) const;

  bool possible_ = true;
  std::size_t stride_ = 0;
  std::size_t vectors_ = 0;
  AttributeRecord position_{};
  std::size_t normal_offset_ = kNone;  // of normals of 3 x i8
  std::uint32_t half_lanes_ = 0;       // a bit for each 16-bit lane that holds a half float
  Lanes half_[kMaxVectors] = {};       // 7FFF where a lane is a half float
  Lanes flip_[kMaxVectors] = {};       // 8000 where a lane is unsigned
  Lanes padding_[kMaxVectors] = {};    // bits that belong to no attribute
};

}  // namespace modar
