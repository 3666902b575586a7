// How vertices are stored: the choice of position format, packing with measured errors, decoding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/mesh/pack/chunk.hpp"
#include "formats/component.hpp"
#include "formats/layout.hpp"

namespace modar {

enum class PositionKind : std::uint8_t {
  kHalf,   ///< half floats in the model's [-1,1]
  kInt16,  ///< 16-bit integers, counted from a point of each chunk, on one grid for all chunks
  kFloat,  ///< floats in the model's [-1,1], where no grid is exact enough
};

/// What the user asks for.
struct PositionRequest {
  /// Unset: half floats where they are exact enough and lose no triangle, else 16-bit integers,
  /// else floats.
  std::optional<PositionKind> kind;
  double max_error = 0.0;  ///< source units; 0: no limit
};

struct PositionPlan {
  PositionKind kind = PositionKind::kHalf;
  double max_side = 0.0;      ///< model space: longest side that a chunk may have; 0: no limit
  double mean_edge = 0.0;     ///< model space; of every sixteenth triangle
  double half_error = 0.0;    ///< the same, of half floats; where it decides
  std::size_t half_loss = 0;  ///< triangles that half floats would lose; the same
};

/// Errors: kUnsupported "model.max-error" where no layout, or not the requested one, is exact
/// enough.
Result<PositionPlan> plan_positions(const TriMesh& mesh, const PositionRequest& request);

/// Greatest error of half floats in [-1,1] for these positions, model space.
double half_error(const TriMesh& mesh);

/// A chunk's part of the grid: position = step * (middle + c) with c in [-32767, 32767].
struct ChunkGrid {
  glm::ivec3 middle{0};
  double step = 1.0;
};

/// One grid for all chunks, so that a vertex of two chunks decodes to one point from both: its step
/// is the smallest power of two with which 16 bits span the largest chunk, but no finer than what a
/// float holds exactly in [-1,1]. For the other kinds the grid of every chunk is the whole.
std::vector<ChunkGrid> make_grids(const ChunkedMesh& chunked, PositionKind kind);

/// The point of the grid nearest to a coordinate, in steps.
int grid_index(double coordinate, double step);

/// What a position decodes to, in model space.
glm::dvec3 decoded_position(const glm::dvec3& position, PositionKind kind, const ChunkGrid& grid);

/// Byte offsets of the attributes; 0 if there is only the position.
struct VertexOffsets {
  std::uint16_t normal = 0;
  std::uint16_t normal_components = 3;  ///< 2: octahedral
  std::uint16_t uv = 0;
  std::uint16_t colour = 0;
  std::uint16_t occlusion = 0;
  std::uint16_t bones = 0;  ///< weights follow
  std::uint16_t morphs = 0;
  std::uint8_t targets = 0;  ///< of them
  std::uint16_t stride = 0;
};

/// Half floats: 3 halves, 2 bytes of padding, 3 x i8 normal, 1 of occlusion (or padding). 16-bit
/// integers: the same, or without occlusion 3 of them and an octahedral normal of 2 x i8. Floats: 3
/// of them, 3 x i8 normal, 1 of occlusion (or padding). Then, where the mesh has them, uv as 2 x
/// u16, colour as 4 x u8, bones of a part and weights as 4 x u8 each, morph targets as 3 x i16.
LayoutRecord make_layout(const TriMesh& mesh, PositionKind kind, VertexOffsets& offsets);

/// uv = shift + offset + scale * attribute; shift holds whole numbers, which are not stored.
struct UvRange {
  glm::dvec2 shift{0.0};
  glm::vec2 offset{0.0f};
  glm::vec2 scale{1.0f};
};

/// repeats: TextureFlags of the chunk's texture. Where it repeats, whole numbers may be subtracted.
UvRange uv_range(const TriMesh& mesh, const Chunk& chunk, std::uint32_t repeats);

/// Greatest and summed squares of one kind of error.
struct ErrorTally {
  double greatest = 0;
  double squares = 0;
  std::uint64_t count = 0;

  void add(double error) {
    greatest = error > greatest ? error : greatest;
    squares += error * error;
    ++count;
  }
  void add(const ErrorTally& other) {
    greatest = other.greatest > greatest ? other.greatest : greatest;
    squares += other.squares;
    count += other.count;
  }
  [[nodiscard]] double rms() const;
};

/// Measured quantisation error: model space, degrees, texels.
struct PackErrors {
  ErrorTally position;
  ErrorTally normal;
  ErrorTally uv;

  void add(const PackErrors& other);
  /// In source units, degrees and texels.
  void write(double scale, ModelRecord& record) const;
};

/// Writes vertices and measures the error of what their bytes decode to.
class VertexPacker {
 public:
  VertexPacker(const TriMesh& mesh, const VertexOffsets& offsets, PositionKind kind)
      : mesh_(mesh), offsets_(offsets), kind_(kind) {}

  /// bytes: a stride a vertex, zeroed. texture_side: in pixels, for uv errors; 0: no
  /// texture. decoded: filled with the positions that the bytes decode to, in model space.
  void pack(const Chunk& chunk, const ChunkGrid& grid, const UvRange& uv,
            std::uint32_t texture_side, std::byte* bytes, std::vector<glm::vec3>& decoded);

  /// Of the last call to pack().
  [[nodiscard]] const PackErrors& errors() const { return errors_; }

 private:
  static glm::vec3 put_float(const glm::dvec3& p, std::byte* bytes);
  glm::vec3 put_half(const glm::dvec3& p, std::byte* bytes);
  glm::vec3 put_int16(const glm::dvec3& p, const ChunkGrid& grid, std::byte* bytes);
  /// These two return what the bytes decode to, not normalised.
  static glm::dvec3 put_normal(const glm::dvec3& n, std::byte* bytes);
  static glm::dvec3 put_oct(const glm::dvec3& n, std::byte* bytes);
  void add_normal_error(const glm::dvec3& decoded, const glm::dvec3& n);
  void put_uv(const glm::dvec2& uv, const UvRange& range, std::uint32_t texture_side,
              std::byte* bytes);

  const TriMesh& mesh_;
  VertexOffsets offsets_;
  PositionKind kind_;
  PackErrors errors_;
};

/// The direction, not normalised, of octahedral coordinates in [-1,1].
glm::dvec3 oct_to_normal(double x, double y);

/// Decodes attributes of one layout. The caller keeps indices inside the bytes.
class VertexDecoder {
 public:
  explicit VertexDecoder(const LayoutRecord& layout);

  [[nodiscard]] bool has(Semantic semantic) const {
    return find_attribute(layout_, semantic) != nullptr;
  }
  [[nodiscard]] std::uint32_t stride() const { return layout_.stride; }
  /// Model space, in [-1,1].
  [[nodiscard]] glm::dvec3 position(const std::byte* vertex, const ChunkRecord& chunk) const;
  /// Unit length; (0, 0, 1) if none.
  [[nodiscard]] glm::dvec3 normal(const std::byte* vertex) const;
  /// v down.
  [[nodiscard]] glm::dvec2 uv(const std::byte* vertex, const ChunkRecord& chunk) const;
  /// RGBA in [0,1].
  [[nodiscard]] glm::dvec4 colour(const std::byte* vertex) const;

 private:
  LayoutRecord layout_;
};

}  // namespace modar
