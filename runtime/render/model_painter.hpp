// Draws the commands of a list: programs, uniforms, attributes, draw calls.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/draw_list.hpp"
#include "runtime/render/geometry_store.hpp"
#include "runtime/render/gl_state.hpp"
#include "runtime/render/program.hpp"
#include "runtime/render/texture_store.hpp"
#include "runtime/render/vertex_format.hpp"

namespace modar {

/// Four vectors of a shader's slot: three rows of attribute space to eye space, and the uv map.
using Slot = std::array<glm::vec4, 4>;
Slot make_slot(const glm::mat4& to_eye, const ChunkRecord& chunk);

class ModelPainter {
 public:
  ModelPainter(const BundleView& bundle, std::span<const VertexFormat> formats);

  /// Links a program for each kind of layout and material that the bundle's chunks have.
  /// Errors: kUnsupported "gl.shader", "gl.program".
  Result<void> create(const TextureStore& textures);
  void release();
  void forget() { programs_.clear(); }

  /// One a chunk of the bundle.
  [[nodiscard]] std::span<const ChunkSetup> setups() const { return setups_; }

  /// Draws in the list's order; what follows on in the index buffer with the same state is one
  /// call.
  void draw(DrawList& list, std::span<const DrawItem> items, const glm::mat4& projection,
            const RenderOptions& options, GeometryStore& geometry, const TextureStore& textures,
            GlState& gl, RenderStats& stats);

 private:
  /// What a program's uniforms were last set to.
  struct ProgramState {
    ModelProgram program;
    std::uint64_t frame = 0;  ///< projection and light are of this frame
    std::uint32_t material = kNone;
    std::uint32_t item = kNone;
    std::uint32_t chunk = kNone;  ///< the one whose decoding is set
  };

  Result<std::uint32_t> program_of(const ProgramKey& key);
  void set_frame(ProgramState& state, const glm::mat4& projection, const RenderOptions& options,
                 RenderStats& stats);
  void set_material(ProgramState& state, std::uint32_t material, const RenderOptions& options,
                    RenderStats& stats);
  void set_slot(ProgramState& state, const DrawCommand& command, const glm::mat4& to_eye,
                RenderStats& stats);
  void set_attributes(const VertexFormat& format, const LevelPlace& place, GlState& gl) const;
  [[nodiscard]] bool same_decoding(std::uint32_t a, std::uint32_t b) const;
  [[nodiscard]] bool continues(const DrawCommand& last, const DrawCommand& next) const;

  const BundleView& bundle_;
  std::span<const VertexFormat> formats_;
  std::vector<ProgramState> programs_;
  std::vector<ChunkSetup> setups_;
  std::vector<std::uint32_t> chunk_layouts_;
  std::uint64_t frame_ = 0;
};

}  // namespace modar
