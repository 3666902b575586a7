// Draws the commands of a list: pieces, programs, uniforms, attributes, draw calls.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/draw_order.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/batch_store.hpp"
#include "runtime/render/draw_list.hpp"
#include "runtime/render/geometry_store.hpp"
#include "runtime/render/gl.hpp"
#include "runtime/render/light.hpp"
#include "runtime/render/plane_painter.hpp"
#include "runtime/render/program.hpp"
#include "runtime/render/texture_store.hpp"
#include "runtime/render/vertex_format.hpp"

namespace modar {

/// Four vectors of a shader's slot: three rows of attribute space to eye space, and the uv map.
using Slot = std::array<glm::vec4, 4>;
Slot make_slot(const glm::mat4& to_eye, const ChunkRecord& chunk);

/// What one frame is drawn with; all of it outlives the call.
struct PaintJob {
  DrawList& list;
  std::span<const DrawItem> items;
  const glm::mat4& projection;
  const RenderOptions& options;
  GeometryStore& geometry;
  const TextureStore& textures;
  GlState& gl;
  RenderStats& stats;
  PlanePainter& planes;  ///< transparent, to draw before the blended chunks in front of them
  const PlanePainter::Job& pictures;
  const LightEstimator* estimator = nullptr;  ///< null: light is as stated
};

class ModelPainter {
 public:
  /// batch_budget: bytes of GL memory for batches.
  ModelPainter(const BundleView& bundle, std::span<const VertexFormat> formats,
               std::uint64_t batch_budget);

  /// Links a program for each kind of layout and material that the bundle's chunks have.
  /// Errors: kUnsupported "gl.shader", "gl.program".
  Result<void> create(const TextureStore& textures, const GlExtensions& extensions,
                      const GlCaps& caps);
  void release(GlState& gl);

  /// One a chunk of the bundle.
  [[nodiscard]] std::span<const ChunkSetup> setups() const { return setups_; }
  /// Copies of small meshes never share draw calls: their bytes may be missing.
  void make_no_batches() { batches_.make_none(); }
  [[nodiscard]] std::uint64_t batch_bytes() const { return batches_.bytes(); }

  /// Draws in the list's order, and triangles of chunks with a draw order from far to near. What
  /// follows on in the index buffer with the same state is one piece; pieces of several items with
  /// the same state are drawn together.
  void draw(const PaintJob& job);

 private:
  /// What a program's uniforms were last set to.
  struct ProgramState {
    ModelProgram program;
    std::uint64_t frame = 0;      ///< projection is of this frame
    std::uint32_t light = kNone;  ///< or the item whose light it is: see set_light()
    std::uint32_t material = kNone;
    TurnedLight turned;     ///< that light, before the material colours it
    bool coloured = false;  ///< the uniforms have a material's ambient colour
    float opacity = 1.0f;   ///< the item's
    std::uint32_t item = kNone;
    std::uint32_t chunk = kNone;  ///< the one whose decoding is set
  };
  /// The same surface, with the three ways to hand in matrices. The last two are linked when they
  /// are first asked for.
  struct ProgramSet {
    std::array<ProgramState, 3> by_slots;
    std::array<bool, 3> failed{};
  };
  /// Triangles of one item that one call draws.
  struct Piece {
    std::uint32_t item = 0;
    std::uint32_t chunk = 0;
    std::uint32_t program = 0;
    std::uint32_t material = 0;
    std::uint32_t layout = 0;
    std::uint32_t light = 0;
    MeshRange mesh;
    int chunks = 0;
    bool blended = false;
    bool mirrored = false;
  };

  void find_equals();
  void find_orders();
  Result<std::uint32_t> program_of(const ProgramKey& key);
  ProgramState* program(std::uint32_t index, SlotKind slots, GlState& gl);
  [[nodiscard]] bool same_decoding(std::uint32_t a, std::uint32_t b) const;

  void draw_behind(const PaintJob& job, const Piece& piece);
  void make_pieces(const PaintJob& job);
  [[nodiscard]] bool continues(const Piece& piece, const DrawCommand& next) const;
  void draw_group(const PaintJob& job, std::span<Piece> group);
  void draw_piece(const PaintJob& job, const Piece& piece);
  ProgramState& single_state(const PaintJob& job, const Piece& piece);
  [[nodiscard]] std::span<const DrawOrderRecord> order_of(std::uint32_t chunk,
                                                          std::uint32_t level) const;
  void send_in_order(const PaintJob& job, const Piece& piece,
                     std::span<const DrawOrderRecord> order);
  bool draw_instances(const PaintJob& job, std::span<const Piece> pieces);
  bool draw_batches(const PaintJob& job, std::span<const Piece> pieces);
  bool draw_batch(const PaintJob& job, ProgramState& state, std::span<const Piece> pieces);
  void draw_runs(const PaintJob& job, const Batch& batch);

  void set_surface(const PaintJob& job, ProgramState& state, const Piece& piece);
  void set_frame(const PaintJob& job, ProgramState& state);
  void set_light(const PaintJob& job, ProgramState& state, const Piece& piece);
  void set_material(const PaintJob& job, ProgramState& state, const Piece& piece);
  static glm::vec3 set_ambient(const PaintJob& job, ProgramState& state,
                               const MaterialRecord& record);
  void set_slot(const PaintJob& job, ProgramState& state, const Piece& piece);
  void set_bones(const PaintJob& job, const ProgramState& state, const Piece& piece);
  void set_attributes(std::uint32_t layout, GLuint buffer, std::uintptr_t offset,
                      std::uint32_t more, GlState& gl, bool moving = false) const;
  [[nodiscard]] bool skinned(const Piece& piece) const {
    return programs_[piece.program].by_slots[0].program.key.skinned;
  }
  [[nodiscard]] const glm::mat4& matrix(const PaintJob& job, const Piece& piece) const {
    return job.items[piece.item].to_eye;
  }

  const BundleView& bundle_;
  std::span<const VertexFormat> formats_;
  GlExtensions extensions_;
  BatchStore batches_;
  std::vector<ProgramSet> programs_;
  std::vector<ChunkSetup> setups_;
  std::vector<std::uint32_t> chunk_layouts_;
  std::vector<std::uint32_t> equal_material_;  ///< the first material with the same values
  std::vector<std::uint32_t> equal_layout_;    ///< the first layout with the same values
  std::vector<std::span<const DrawOrderRecord>> orders_;  ///< one a chunk, or none at all
  std::vector<DrawOrderRange> waiting_;
  std::vector<std::uint16_t> sorted_;  ///< indices of one piece
  GLuint sorted_buffer_ = 0;
  LightList lights_;
  std::vector<Piece> pieces_;
  std::vector<BatchPart> parts_;
  std::vector<Slot> slots_;
  std::vector<glm::vec4> rows_;
  GLuint row_buffer_ = 0;
  int slot_count_ = 1;
  std::uint64_t frame_ = 0;
};

}  // namespace modar
