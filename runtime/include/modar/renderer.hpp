// Draws a bundle's models with OpenGL ES 2.0, straight from its mapped bytes. Usable without the AR
// half: any program with a current context can draw models with matrices of its own.
#pragma once

#if __cplusplus < 202002L
#error "modar's headers for C++ need C++20 (-std=c++20); <modar/modar.h> is C99"
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"
#include "modar/gl_context.hpp"
#include "modar/image.hpp"

namespace modar {

/// A model to draw. to_eye takes the model's decoded [-1,1] space to GL eye space (x right, y up, z
/// backward); see scene_matrix().
struct DrawItem {
  std::uint32_t model = 0;
  glm::mat4 to_eye{1.0f};
  std::uint32_t scene = kNone;  ///< whose light falls on it; kNone: a neutral room's
  /// The world that light is fixed to (a pattern's: x right, y up, z towards the viewer, which is
  /// where the ceiling is) to eye space; see gl_view(). Else the world of a camera held level.
  glm::mat4 world_to_eye{1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
};

/// Light in a world whose z points up to the ceiling. Linear light; 1: a white surface that gets so
/// much is as bright as the picture's white.
struct RoomLight {
  /// What a white surface of unit normal (x, y, z) gets from all around: the sum of each
  /// coefficient times its polynomial 1, y, z, x, xy, yz, 3 z^2 - 1, zx, x^2 - y^2. Those are
  /// spherical harmonics without their factors.
  std::array<glm::vec3, 9> sky{};
  glm::vec3 direction{0.0f, 0.0f, 1.0f};  ///< to the key light, any length > 0
  glm::vec3 key{0.0f};  ///< what the key light gives a white surface that faces it
};
/// Materials with a greater exponent have this one: lit by vertex, narrower highlights flicker. Set
/// by hand, on pictures.
inline constexpr float kMostShininess = 40.0f;

/// A neutral room, lit from above: what everything stands in that has no light of its own.
RoomLight neutral_room();
RoomLight light_of_record(const LightRecord& record);
/// What the bundle states of a scene's light, else neutral_room(). scene: any number.
RoomLight scene_light(const BundleView& bundle, std::uint32_t scene);

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

/// Where a camera's frame and its models go on a surface of the app's: pixels of the framebuffer
/// that is bound, whose (0, 0) is at the bottom left. What is upright on the surface is the frame
/// turned clockwise by `rotation`. A phone held upright whose back camera's sensor lies across has
/// 90; its front camera 270 and `mirror`, for the picture of a mirror.
struct SurfaceView {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  int rotation = 0;     ///< degrees: a multiple of 90
  bool mirror = false;  ///< left and right change places after the turn, as with a front camera
  bool cover = false;   ///< fills the viewport and crops the frame; false: shows the whole frame in
                        ///< its middle
  bool clear_depth =
      true;  ///< false: for a second renderer's models among those of a first, same projection
};

/// The frame's pixel (centre of the top-left one: 0, 0) under a point of the surface, as a touch
/// has it: pixels from the viewport's top left, y down.
glm::dvec2 frame_pixel(const SurfaceView& surface, int frame_width, int frame_height,
                       glm::dvec2 point);

/// Counted over the last render() or draw() call.
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
  std::optional<RoomLight> light;  ///< of all items; nothing: each scene's own
  float light_strength = 1.0f;     ///< factor on the key light
  float ambient_strength = 1.0f;   ///< factor on what comes from all around
  /// The light of items' scenes follows what frames with planes show of their patterns, where the
  /// bundle has the patterns' colours: brightness, colour, and how both change over the pattern.
  bool estimate_light = true;
  bool plane_hides = false;  ///< the patterns of items' scenes hide what lies under their planes
  glm::vec4 clear_colour{0.0f, 0.0f, 0.0f, 1.0f};
  /// Nobody else draws in the context between frames: what is set then stays set. False: every call
  /// leaves the context as it found it (framebuffer, vertex array object, program, buffers,
  /// textures and samplers of units 0 to 2, blending, depth, culling, masks, pixel store), but that
  /// the attributes 0 to 7 of the default vertex array object end disabled. True: only the
  /// framebuffer is left as found.
  bool exclusive_context = false;
  /// Vertices and indices are handed in from the mapped bytes in every draw call, without GL
  /// buffers: what benchmarks compare with. Only where the layouts need no rewriting and all
  /// geometry fits.
  bool client_arrays = false;
  /// Samples a pixel of what render() draws, so that edges are smooth; fewer where the driver has
  /// fewer. Holds from the next resize() on. draw() has those of the app's surface.
  int samples = 1;
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

/// What a ray through a pixel meets first.
struct Pick {
  std::size_t item = 0;   ///< index into the items
  glm::vec3 point{0.0f};  ///< in the item's model space
  float distance = 0.0f;  ///< from the eye, in eye space
};

/// Casts a ray through a pixel of the frame (an ideal pinhole's, as models are drawn) against the
/// finest level of the items' models, both sides of each triangle. Reads the triangles from the
/// bundle's bytes: for a tap, not for every frame. Nothing where no model is met, or a model does
/// not exist. camera: see validate().
std::optional<Pick> pick(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                         std::span<const DrawItem> items);

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
  /// see gl_projection(). Allocates nothing after the first frame of a size. Before resize(), this
  /// and what reads or shows the picture do nothing.
  void render(const RgbImage& background, const glm::mat4& projection,
              std::span<const DrawItem> items);

  /// A background without planes has the frame's size only: then the clear colour stands for its
  /// picture.
  void render(const CameraPicture& background, const glm::mat4& projection,
              std::span<const DrawItem> items);

  /// Draws into the framebuffer that is bound, which needs a depth buffer, and needs no resize():
  /// the frame's picture, where it has planes, and the items over it. Without planes, `frame` gives
  /// its size alone and the models go over what is in the framebuffer. Alpha ends as the coverage
  /// of what was drawn over what was there, and colours are premultiplied with it where that was
  /// transparent. Nothing outside the viewport is touched. projection: for the frame, see
  /// gl_projection(). Allocates nothing after the first frame of a size.
  void draw(const SurfaceView& surface, const CameraPicture& frame, const glm::mat4& projection,
            std::span<const DrawItem> items);

  /// The light of a frame that the app draws by itself: later draws without planes follow it, as
  /// render() and draw() do for frames that they are given. Every fourth frame is enough, and a
  /// smaller copy of the whole frame. projection, items: of that frame. No GL call.
  void observe(const CameraPicture& frame, const glm::mat4& projection,
               std::span<const DrawItem> items);

  /// The context was lost, and another one is current: makes everything anew in it from the
  /// bundle's bytes, at the same size and with the same options. Nothing of the lost context is
  /// touched. Errors: as create() and resize().
  Result<void> restore(const GlCaps& caps);

  /// Copies the picture, top row first, 4 bytes a pixel (RGBA). rgba.size() == width * height * 4.
  void read_pixels(std::span<std::uint8_t> rgba);
  /// Puts the off-screen picture on the framebuffer that is bound, a window's say.
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
