// Draws a bundle's models with OpenGL ES 2.0, straight from its mapped bytes. Usable without the AR
// half: any program with a current context can draw models with matrices of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/gl_context.hpp"
#include "modar/image.hpp"

namespace modar {

/// A model to draw. to_eye takes the model's decoded [-1,1] space to GL eye space (x right, y up, z
/// backward); see scene_matrix().
struct DrawItem {
  std::uint32_t model = 0;
  glm::mat4 to_eye{1.0f};
};

enum class PictureFormat : std::uint8_t {
  kRgb,   ///< one plane, 3 bytes a pixel
  kNv21,  ///< luma, and pairs of V and U for every 2x2 pixels: what Android's cameras give
  kNv12,  ///< luma, and pairs of U and V
  kI420,  ///< luma, U, V: what Y4M files have
};

/// A camera's frame, top row first; its planes stay the caller's. Sides are even where chroma is
/// shared by 2x2 pixels.
struct CameraPicture {
  PictureFormat format = PictureFormat::kRgb;
  int width = 0;  ///< pixels
  int height = 0;
  std::array<const std::uint8_t*, 3> planes{};
  std::array<std::ptrdiff_t, 3> strides{};  ///< bytes from row to row of each plane
  bool full_range =
      true;  ///< luma spans 0-255, as cameras have it; false: 16-235, as videos have it
  /// Rows that differ from the picture before, where that had the same size and format; the rest is
  /// not sent again.
  int first_row = 0;
  int row_count = 1 << 30;
};

/// Counted over the last render() call.
struct RenderStats {
  int draw_calls = 0;
  int state_changes = 0;  ///< program, buffer, texture, attribute and switch set-ups
  int chunks_drawn = 0;
  int chunks_culled = 0;
  int chunks_skipped = 0;  ///< visible, but the GPU budget had no room left
  std::uint64_t triangles = 0;
  std::uint64_t bytes_uploaded = 0;  ///< background, uniforms and streamed buffers of this frame
  std::uint64_t evictions = 0;       ///< buffers that made room in this frame
};

/// What lies in GL memory for the bundle.
struct GpuMemory {
  std::uint64_t geometry = 0;  ///< bytes
  std::uint64_t textures = 0;  ///< bytes
  std::uint64_t batches = 0;   ///< bytes; copies of small meshes that share draw calls
  std::uint64_t uploaded = 0;  ///< bytes sent since create()
};

/// How to draw. May change from frame to frame.
struct RenderOptions {
  glm::vec3 light{0.25f, 0.45f, 0.85f};  ///< direction to the light in eye space, any length > 0
  float light_strength = 0.7f;           ///< times a material's diffuse and specular colour
  float ambient_strength = 0.3f;         ///< times its ambient colour
  glm::vec4 clear_colour{0.0f, 0.0f, 0.0f, 1.0f};
  /// Nobody else draws in the context between frames: what is set then stays set.
  bool exclusive_context = false;
  /// Vertices and indices are handed in from the mapped bytes in every draw call, without GL
  /// buffers: what benchmarks compare with. Only where the layouts need no rewriting and all
  /// geometry fits.
  bool client_arrays = false;
  bool instancing = true;   ///< items of one mesh or material share draw calls
  float lod_pixels = 1.0f;  ///< a level of detail may be off by so much on the screen
};

/// Pattern-plane matrix of a scene: its offset, rotation and scale on the default placement (the
/// model's largest side equals the pattern's largest side).
glm::mat4 scene_matrix(const SceneRecord& scene);

/// Depth limits that enclose the items' models as tightly as depth precision needs (ModAR 3.4: from
/// the scene, not from fixed planes). Answers {near, far}, 0 < near < far.
struct DepthRange {
  double near_plane = 0.1;
  double far_plane = 100.0;
};
DepthRange depth_range(const BundleView& bundle, std::span<const DrawItem> items);

class Renderer {
 public:
  /// Uploads the bundle's merged buffers and textures from the mapped bytes into the current
  /// context. Where a caps flag is missing, floats instead of halves and decoded RGB instead of
  /// ETC1 are uploaded. Where caps.gpu_memory is not 0, no more than so many bytes are kept in GL:
  /// textures drop their finest levels, and chunks come when they are seen, nearest first, and go
  /// when they were not seen for longest. The bundle's bytes must outlive the renderer. Errors:
  /// kUnsupported "gl.*".
  static Result<std::unique_ptr<Renderer>> create(const BundleView& bundle, const GlCaps& caps);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  ~Renderer();

  /// Size of the picture in pixels. Creates or resizes the off-screen framebuffer.
  /// Errors: kUnsupported "gl.framebuffer".
  Result<void> resize(int width, int height);

  /// Draws the background (may be empty: clear colour) and the items over it. projection: of GL,
  /// see gl_projection(). Allocates nothing after the first frame of a size.
  void render(const RgbImage& background, const glm::mat4& projection,
              std::span<const DrawItem> items);

  void render(const CameraPicture& background, const glm::mat4& projection,
              std::span<const DrawItem> items);

  /// The context was lost, and another one is current: makes everything anew in it from the
  /// bundle's bytes, at the same size and with the same options. Nothing of the lost context is
  /// touched. Errors: as create() and resize().
  Result<void> restore(const GlCaps& caps);

  /// Copies the picture, top row first, 4 bytes a pixel (RGBA). rgba.size() == width * height * 4.
  void read_pixels(std::span<std::uint8_t> rgba);
  /// Puts the off-screen picture on the window's framebuffer (0).
  void blit_to_window(int window_width, int window_height);

  void set_options(const RenderOptions& options);
  [[nodiscard]] const RenderStats& stats() const;
  [[nodiscard]] GpuMemory gpu_memory() const;

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
