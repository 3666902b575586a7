// An OpenGL ES 2.0 context without a window (EGL pbuffer). Programs with a window use their own.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// What the current context supports, or less if a device profile masks it.
struct GlCaps {
  std::string vendor;
  std::string renderer;
  std::string version;
  bool half_float_vertices = false;        ///< GL_OES_vertex_half_float, or the core of WebGL 2
  std::uint32_t half_float_type = 0x8D61;  ///< GL_HALF_FLOAT_OES; 0x140B (GL_HALF_FLOAT) in WebGL 2
  std::uint32_t texture_formats = 0;       ///< bit n: reads the blocks of the TextureFormat n
  std::uint32_t etc1_format =
      0x8D64;  ///< GL_ETC1_RGB8_OES; 0x9274 (ETC2, which reads ETC1's blocks) in some WebGL
  bool etc1_sub_texture = false;       ///< GL_EXT_compressed_ETC1_RGB8_sub_texture, or ETC2
  bool npot_mipmaps = false;           ///< GL_OES_texture_npot
  bool depth24 = false;                ///< GL_OES_depth24
  bool debug_groups = false;           ///< GL_KHR_debug or GL_EXT_debug_marker
  bool instanced_arrays = false;       ///< GL_EXT/ANGLE_instanced_arrays, or the core of ES 3
  bool vertex_arrays = false;          ///< GL_OES_vertex_array_object, or the core of ES 3
  bool es3 = false;                    ///< also has the state of ES 3
  bool multisampled_textures = false;  ///< GL_EXT_multisampled_render_to_texture
  int max_samples = 1;                 ///< of an off-screen framebuffer; 1: no antialiasing
  int max_texture_size = 64;
  int max_vertex_uniform_vectors = 128;
  int max_vertex_attributes = 8;
  std::uint64_t gpu_memory = 0;  ///< bytes that models and textures may take; 0: no limit

  [[nodiscard]] bool reads(TextureFormat format) const {
    return (texture_formats >> static_cast<std::uint32_t>(format) & 1) != 0;
  }
};

/// Reads the caps of the context that is current on this thread.
GlCaps probe_gl_caps();

/// Lowers `caps` to the device profile of that name (assets/devices). Errors: kUsage
/// "device.unknown" that lists the names.
Result<GlCaps> mask_gl_caps(const GlCaps& caps, const std::string& device);

class GlContext {
 public:
  /// Creates an off-screen ES 2.0 context and makes it current on this thread. Tries a display of
  /// the system, then Mesa's surfaceless platform. Errors: kUnsupported "gl.context".
  static Result<std::unique_ptr<GlContext>> create_offscreen();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  ~GlContext();

 private:
  struct Handles;
  explicit GlContext(std::unique_ptr<Handles> handles);
  std::unique_ptr<Handles> handles_;
};

}  // namespace modar
