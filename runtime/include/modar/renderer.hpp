// Draws a bundle's models with OpenGL ES 2.0, directly from its mapped bytes. Usable without the
// tracker: any program with a current context can draw models with its own matrices.
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

#include "formats/action_machine.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/camera.hpp"
#include "modar/clip_player.hpp"
#include "modar/gl_context.hpp"
#include "modar/image.hpp"

namespace modar {

/// A model to draw. to_eye takes the model's decoded [-1,1] space to GL eye space (x right, y up, z
/// backward); see scene_matrix().
struct DrawItem {
  std::uint32_t model = 0;
  glm::mat4 to_eye{1.0f};
  std::uint32_t scene = kNone;  ///< whose light to use; kNone: a neutral room's
  /// The space to which the light is fixed (a pattern's: x right, y up, z towards the viewer and
  /// the ceiling) to eye space; see gl_view(). Default: the world of a camera that is held level.
  glm::mat4 world_to_eye{1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  float opacity = 1.0f;  ///< factor on that of its materials; below 1, the background shows through
  std::uint32_t node = kNone;  ///< whose item it is. Of a picture: it is drawn in place of a model,
                               ///< to_eye takes the square [-1,1] of z = 0 to eye space
  const BoneMatrix* bones = nullptr;  ///< of the model: ClipPlayer::bones(); null: the rest pose
};

/// Light in a space whose z points up to the ceiling. Linear; 1: a white surface in this light is
/// as bright as the picture's white.
struct RoomLight {
  /// Ambient light on a white surface of unit normal (x, y, z): the sum of each coefficient times
  /// its polynomial 1, y, z, x, xy, yz, 3 z^2 - 1, zx, x^2 - y^2. These are spherical harmonics
  /// without their factors.
  std::array<glm::vec3, 9> sky{};
  glm::vec3 direction{0.0f, 0.0f, 1.0f};  ///< to the key light, any length > 0
  glm::vec3 key{0.0f};                    ///< the key light on a white surface that faces it

  bool operator==(const RoomLight&) const = default;
};
/// Largest exponent of materials: with lighting per vertex, narrower highlights flicker. Chosen by
/// eye on pictures.
inline constexpr float kMostShininess = 40.0f;

/// What a surface mirrors of RoomLight::sky along the mirrored ray: factors on its linear and its
/// quadratic part, as the surface blurs them; the share straight on, and the increase times (1 -
/// cosine)^5 of the angle of sight. Metal mirrors by its colour in addition.
glm::vec4 mirror_factors(float shininess, float reflectance, float metalness);

/// A neutral room, lit from above: the default light.
RoomLight neutral_room();
RoomLight light_of_record(const LightRecord& record);
/// The light of a scene of the bundle, or neutral_room() if it has none. scene: any number.
RoomLight scene_light(const BundleView& bundle, std::uint32_t scene);

enum class PictureFormat : std::uint8_t {
  kRgb,   ///< one plane, 3 bytes a pixel
  kNv21,  ///< luma, and pairs of V and U for every 2x2 pixels: the format of Android's cameras
  kNv12,  ///< luma, and pairs of U and V
  kI420,  ///< luma, U, V: the format of Y4M files
  kRgba,  ///< one plane, 4 bytes a pixel; alpha is not looked at
};

/// A camera frame, top row first; the caller owns its planes. Sides must be even if chroma is
/// shared by 2x2 pixels.
struct CameraPicture {
  PictureFormat format = PictureFormat::kRgb;
  int width = 0;  ///< pixels
  int height = 0;
  std::array<const std::uint8_t*, 3> planes{};
  std::array<std::ptrdiff_t, 3> strides{};  ///< bytes from row to row of each plane
  bool full_range =
      true;  ///< luma spans 0-255, as cameras have it; false: 16-235, as videos have it
  /// Rows that differ from the previous picture of the same size and format; only they are
  /// uploaded.
  int first_row = 0;
  int row_count = 1 << 30;
};

/// The viewport of a camera frame and its models on the app's surface: pixels of the bound
/// framebuffer, whose (0, 0) is at the bottom left. The frame is turned clockwise by `rotation` to
/// be upright there: usually 90 for the back camera of a phone held upright, and 270 with `mirror`
/// for its front camera.
struct SurfaceView {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  int rotation = 0;     ///< degrees: a multiple of 90
  bool mirror = false;  ///< swap left and right after the rotation, as for a front camera
  bool cover = false;   ///< fill the viewport and crop the frame; false: show the whole frame,
                        ///< centred
  bool clear_depth =
      true;  ///< false: to draw a second renderer's models among those of a first, same projection
};

/// Converts a touch (pixels from the viewport's top left, y down) to a pixel of the frame (centre
/// of the top-left one: 0, 0).
glm::dvec2 frame_pixel(const SurfaceView& surface, int frame_width, int frame_height,
                       glm::dvec2 point);

/// Counted over the last render() or draw() call.
struct RenderStats {
  int draw_calls = 0;
  int state_changes = 0;  ///< program, buffer, texture, attribute and switch set-ups
  int chunks_drawn = 0;
  int chunks_culled = 0;
  int chunks_skipped = 0;  ///< visible, but beyond the GPU budget
  std::uint64_t triangles = 0;
  std::uint64_t bytes_uploaded = 0;  ///< background, uniforms and streamed buffers of this frame
  std::uint64_t bytes_same = 0;      ///< of the background: rows that GL has from the one before
  std::uint64_t evictions = 0;       ///< buffers that were evicted in this frame
};

/// GL memory of the bundle.
struct GpuMemory {
  std::uint64_t geometry = 0;  ///< bytes
  std::uint64_t textures = 0;  ///< bytes
  std::uint64_t batches = 0;   ///< bytes; copies of small meshes that share draw calls
  std::uint64_t uploaded = 0;  ///< bytes sent since create()
  std::uint64_t kept = 0;      ///< bytes in memory, not in GL: of textures that have come in part
};

/// How to draw. May change from frame to frame.
struct RenderOptions {
  std::optional<RoomLight> light;  ///< for all items; empty: each scene's own
  float light_strength = 1.0f;     ///< factor on the key light
  float ambient_strength = 1.0f;   ///< factor on ambient light
  /// Adapt the light of scenes to the camera's picture of their patterns, if the bundle has the
  /// patterns' colours: brightness, colour, and how both change across the pattern.
  bool estimate_light = true;
  bool plane_hides = false;  ///< the patterns of items' scenes hide everything below their planes
  glm::vec4 clear_colour{0.0f, 0.0f, 0.0f, 1.0f};
  /// True: nothing else draws in the context between frames, and only the framebuffer binding is
  /// restored. False: every call restores the context's state (framebuffer, vertex array object,
  /// program, buffers, textures and samplers of units 0 to 2, blending, depth, culling, masks,
  /// pixel store), except that attributes 0 to 7 of the default vertex array object end up
  /// disabled.
  bool exclusive_context = false;
  /// Pass vertices and indices from the mapped bytes in every draw call, without GL buffers: a
  /// reference for benchmarks. Requires layouts that need no conversion, and that all geometry
  /// fits.
  bool client_arrays = false;
  /// Samples per pixel of render(), for smooth edges; limited by the driver. Takes effect at the
  /// next resize(). draw() uses those of the app's surface.
  int samples = 1;
  bool instancing = true;  ///< items of one mesh or material share draw calls
  /// Largest error of a level of detail on the screen, in pixels. More where a frame would have
  /// more than a million triangles, or 100,000 where there is no ES 3.
  float lod_pixels = 1.0f;
};

/// A rectangle: a picture or a video. False for a node that does not exist.
bool is_picture(const BundleView& bundle, std::uint32_t node);

/// Appends what of a pattern's scenes and nodes is shown: models, then pictures, each turned as its
/// actions say, as an eye at the origin of the pattern's space sees it. Allocates nothing once
/// `items` has its room.
void add_items(const BundleView& bundle, const ActionMachine& machine, std::uint32_t pattern,
               std::vector<DrawItem>& items);

/// Pattern-plane matrix of a scene: its offset, rotation and scale on the default placement (the
/// model's largest side equals the pattern's largest side).
glm::mat4 scene_matrix(const SceneRecord& scene);

/// Depth limits that enclose the items' models tightly, for depth precision (ModAR 3.4: from the
/// scene, not from fixed planes). 0 < near < far.
struct DepthRange {
  double near_plane = 0.1;
  double far_plane = 100.0;
};
DepthRange depth_range(const BundleView& bundle, std::span<const DrawItem> items);

/// The first surface that a ray through a pixel hits.
struct Pick {
  std::size_t item = 0;            ///< index into the items
  glm::vec3 point{0.0f};           ///< in the item's model space
  float distance = 0.0f;           ///< from the eye, in eye space
  std::uint32_t material = kNone;  ///< that is there; kNone: a picture's
};

/// Casts a ray through a pixel of the frame (an ideal pinhole's, as models are drawn) against the
/// finest level of the items' models, both sides of each triangle. Reads the triangles from the
/// bundle's bytes: meant for taps, not for every frame. Pictures are hit where they are seen
/// through, too. Empty if nothing is hit or a model does not exist. camera: see validate().
std::optional<Pick> pick(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                         std::span<const DrawItem> items);

class Renderer {
 public:
  /// Uploads the bundle's merged buffers and textures from the mapped bytes into the current
  /// context. If a caps flag is missing, floats are uploaded instead of halves, and decoded RGB
  /// instead of ETC1. caps.gpu_memory other than 0 limits the bytes kept in GL: textures drop their
  /// finest levels, and chunks are loaded when they are visible, nearest first, and evicted when
  /// least recently visible. The bundle's bytes must outlive the renderer. Errors:
  /// kUnsupported "gl.*".
  static Result<std::unique_ptr<Renderer>> create(const BundleView& bundle, const GlCaps& caps);
  /// The present parts of an incomplete bundle.
  enum class Part : std::uint8_t {
    /// The coarsest of everything, and the bundle's tables say so (show_coarsest() of
    /// formats/transport/stages.hpp): drawn levels are uploaded then.
    kCoarsest,
    /// put() uploads vertices, indices and texture blocks, which are not read from the bundle's
    /// bytes, except what kept_ranges() names there. To be drawn with when all of them have come.
    kComes,
    /// What kept_ranges() names, and more comes when a view needs it: for bundles that exceed the
    /// memory. Each picture shows the finest that is there, of a model one proxy or all chunks
    /// that are seen, and decides what open_wanted() asks for: the coarsest of what it lacks, the
    /// nearest first. What no picture shows any more makes room, the longest unseen first.
    /// caps.gpu_memory: bytes, not 0; a view wants two thirds of it, so that what it shows
    /// meanwhile has the rest.
    kWanted,
  };
  /// A renderer of a part of a bundle. Nothing checks that indices which come are below their
  /// level's vertex count, which contexts that bound what a draw call reads (WebGL) need not have.
  /// Errors: as create(), and kUnsupported "gl.halves" where vertices that come would have to be
  /// rewritten, "gl.levels" for kWanted without ES 3.
  static Result<std::unique_ptr<Renderer>> create_part(const BundleView& bundle, const GlCaps& caps,
                                                       Part part);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  ~Renderer();

  /// Size of the picture in pixels. Creates or resizes the off-screen framebuffer.
  /// Errors: kUnsupported "gl.framebuffer".
  Result<void> resize(int width, int height);

  /// Draws the background (may be empty: clear colour) and the items over it. projection: of GL,
  /// see gl_projection(). Allocates nothing after the first frame of a size. Before resize(), this
  /// function and those that read or show the picture have no effect.
  void render(const RgbImage& background, const glm::mat4& projection,
              std::span<const DrawItem> items);

  /// A background without planes gives only the frame's size; the clear colour replaces its
  /// picture.
  void render(const CameraPicture& background, const glm::mat4& projection,
              std::span<const DrawItem> items);

  /// Draws into the bound framebuffer, which needs a depth buffer; resize() is not needed. Draws
  /// the frame's picture, if it has planes, and the items over it. Without planes, `frame` gives
  /// only its size, and the models are drawn over the framebuffer's contents. The resulting alpha
  /// is the coverage, and colours are premultiplied with it where the framebuffer was transparent.
  /// Nothing outside the viewport is changed. projection: for the frame, see gl_projection().
  /// Allocates nothing after the first frame of a size.
  void draw(const SurfaceView& surface, const CameraPicture& frame, const glm::mat4& projection,
            std::span<const DrawItem> items);

  /// Estimates the light from a frame that the app draws itself, for later draws without planes, as
  /// render() and draw() do for the frames that they get. Every fourth frame and a smaller copy of
  /// the whole frame are enough. projection, items: of that frame. Makes no GL calls.
  void observe(const CameraPicture& frame, const glm::mat4& projection,
               std::span<const DrawItem> items);

  /// After the context was lost and a new one is current: recreates everything from the bundle's
  /// bytes, at the same size and with the same options. Does not touch objects of the lost
  /// context. Errors: as create() and resize().
  Result<void> restore(const GlCaps& caps);

  /// Of create_part(): bytes of the bundle from `offset` on, which are uploaded and not kept.
  /// Each byte once; those of a texture in their order.
  void put(std::uint64_t offset, std::span<const std::byte> bytes);

  /// Of Part::kWanted: bytes of the bundle that the last view lacks.
  struct StreamRequest {
    std::uint32_t number = kNone;  ///< for have(); kNone: it lacks nothing that there is room for
    std::uint64_t offset = 0;      ///< in the bundle
    std::uint64_t size = 0;
  };
  /// The next one, from now on open: put() takes its bytes, each once.
  StreamRequest open_wanted();
  /// All bytes of an open one were put().
  void have(std::uint32_t number);

  /// Copies the picture, top row first, 4 bytes a pixel (RGBA). rgba.size() == width * height * 4.
  void read_pixels(std::span<std::uint8_t> rgba);
  /// Copies the off-screen picture to the bound framebuffer, for example that of a window.
  void blit_to_window(int window_width, int window_height);

  /// What a video shows from now on: a 2D texture of this context, its first row on top, which
  /// outlives its use here; 0: its poster. node: any number.
  void set_video(std::uint32_t node, std::uint32_t texture);

  void set_options(const RenderOptions& options);
  [[nodiscard]] const RenderStats& stats() const;
  [[nodiscard]] GpuMemory gpu_memory() const;

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
