// What a view shows of a bundle: which chunks of which items are drawn, at which level, in which
// order. Culling is conservative: a chunk with any visible part is never culled. Internal to
// runtime/render.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "formats/bundle_view.hpp"
#include "formats/layout.hpp"
#include "modar/renderer.hpp"

namespace modar {

class GeometryStore;

/// One view on one model, in the model's own space.
struct ModelView {
  std::array<glm::vec4, 6> planes;  ///< a point is inside where dot(plane, (p, 1)) >= 0
  glm::vec3 eye{0.0f};
  bool perspective = true;   ///< false: parallel rays, `eye` means nothing
  bool mirrored = false;     ///< the matrix turns the winding of triangles
  bool keeps_angles = true;  ///< the matrix turns, mirrors, scales and moves, no more
  float scale = 1.0f;        ///< greatest stretch of a length on its way to eye space
  float pixels = 0.0f;       ///< size in pixels of one eye-space unit at distance 1
};

/// projection: of GL. to_eye: an affine matrix that can be inverted. height: of the viewport,
/// pixels.
ModelView model_view(const glm::mat4& projection, const glm::mat4& to_eye, int height);

/// True only if no point of the chunk's box is inside the frustum.
bool outside_frustum(const ModelView& view, const ChunkRecord& chunk);

/// True only if every triangle of the chunk shows its back: see ChunkRecord::cone_cutoff.
bool faces_away(const ModelView& view, const ChunkRecord& chunk);

/// Least distance from the eye to the chunk's box in eye space; 0 inside it, or where rays are
/// parallel.
float eye_distance(const ModelView& view, const ChunkRecord& chunk);

/// The coarsest level whose error is at most `pixels` on the screen (0 to level_count - 1).
/// levels: of the bundle. The measure: a level's error times focal length over distance.
std::uint32_t choose_level(const ModelView& view, const ChunkRecord& chunk,
                           const Table<LevelRecord>& levels, float pixels);

/// The chunk with a box that holds it in any pose, and never culled by its cone. bones: the part's.
ChunkRecord boxed(const ChunkRecord& chunk, const PartRecord& part, const BoneMatrix* bones);

/// The coarsest proxy of a model whose error is at most `pixels` on the screen, as a chunk group
/// of the bundle; kNone: none exists.
std::uint32_t choose_proxy(const BundleView& bundle, const ModelView& view, std::uint32_t model,
                           float pixels);

struct DrawCommand {
  std::uint32_t item = 0;
  std::uint32_t chunk = 0;  ///< of the bundle
  std::uint32_t level = 0;  ///< of the bundle
  std::uint32_t program = 0;
  std::uint32_t texture = 0;  ///< kNone: none
  std::uint32_t material = 0;
  float distance = 0.0f;  ///< eye space
  bool hides = false;     ///< fills the depth buffer only
  bool blended = false;
};

/// What a chunk needs from the renderer's set-up.
struct ChunkSetup {
  std::uint32_t program = 0;
  std::uint32_t skinned = 0;   ///< the program that turns vertices with the part's bones
  std::uint32_t part = kNone;  ///< moving part of the bundle
  std::uint32_t material = 0;  ///< the first one of its values
  bool hides = false;
  bool blended = false;
};

class DrawList {
 public:
  /// The items, and behind them the moving parts of those that have bones: a part of one bone with
  /// its matrix, a skinned one with its bones. build() takes that; it lives until the next call.
  std::span<const DrawItem> pose(const BundleView& bundle, std::span<const DrawItem> items);
  /// Collects visible chunks: of each item its model's chunks, or a proxy where that is less to
  /// draw. setups: one a chunk of the bundle. Keeps its memory from call to call.
  void build(const BundleView& bundle, std::span<const ChunkSetup> setups,
             const glm::mat4& projection, int height, std::span<const DrawItem> items,
             float lod_pixels);
  /// The same of levels that are there: of each item all chunks that are seen, at their level or a
  /// coarser one, else the finest proxy, else nothing.
  void build_of(const GeometryStore& geometry, const BundleView& bundle,
                std::span<const ChunkSetup> setups, const glm::mat4& projection, int height,
                std::span<const DrawItem> items, float lod_pixels);
  /// Nearest first: the order in which GPU memory is given out.
  void sort_by_distance();
  /// What only hides, opaque ones by program, texture and material, then blended ones from far to
  /// near.
  void sort_by_state(const BundleView& bundle);

  [[nodiscard]] std::vector<DrawCommand>& commands() { return commands_; }
  [[nodiscard]] const ModelView& view(std::uint32_t item) const { return views_[item]; }
  [[nodiscard]] int culled() const { return culled_; }
  /// Of some commands, in triangles: a draw call counts as some, too.
  [[nodiscard]] std::uint64_t cost(const BundleView& bundle, std::size_t begin,
                                   std::size_t end) const;

 private:
  /// What a frame asks for.
  struct Request {
    const BundleView& bundle;
    std::span<const ChunkSetup> setups;
    std::span<const DrawItem> items;
    float lod_pixels = 0.0f;
  };
  void begin(const BundleView& bundle, const glm::mat4& projection, int height,
             std::span<const DrawItem> items);
  void add_item(const Request& request, std::uint32_t item);
  void add_there(const Request& request, std::uint32_t item, const GeometryStore& geometry);
  bool use_there(const BundleView& bundle, std::size_t first, const GeometryStore& geometry);
  int add_group(const Request& request, std::uint32_t item, std::uint32_t group);
  std::vector<DrawCommand> commands_;
  std::vector<ModelView> views_;  ///< one an item
  std::vector<DrawItem> posed_;
  std::vector<std::uint32_t> first_parts_;  ///< of an item: in posed_, less its model's first one
  std::size_t whole_ = ~std::size_t{0};     ///< items before the parts
  int culled_ = 0;
};

}  // namespace modar
