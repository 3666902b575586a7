// modar.h: contexts and the renderer. Nothing of the tracker: programs may draw alone.
#include <algorithm>
#include <memory>
#include <vector>

#include "modar/renderer.hpp"
#include "runtime/capi/handles.hpp"
#include "runtime/capi/picture.hpp"

static_assert(MODAR_NV21 == static_cast<int>(modar::PictureFormat::kNv21));
static_assert(MODAR_NV12 == static_cast<int>(modar::PictureFormat::kNv12));
static_assert(MODAR_I420 == static_cast<int>(modar::PictureFormat::kI420));
static_assert(MODAR_RGBA == static_cast<int>(modar::PictureFormat::kRgba));

struct modar_context {
  std::unique_ptr<modar::GlContext> context;
};

struct modar_renderer {
  const modar_bundle* bundle;
  modar::BundleView view;
  std::string device;
  std::uint64_t gpu_bytes = 0;
  std::unique_ptr<modar::Renderer> renderer;
  std::vector<modar::DrawItem> items = {};
  std::size_t picture_bytes = 0;
  std::vector<std::uint8_t> chroma = {};  ///< of a frame whose chroma no format of the renderer has
};

namespace {

modar::Result<modar::GlCaps> caps_for(const std::string& device, std::uint64_t gpu_bytes) {
  modar::GlCaps caps = modar::probe_gl_caps();
  if (!device.empty()) {
    MODAR_ASSIGN(caps, modar::mask_gl_caps(caps, device));
  }
  if (gpu_bytes > 0) caps.gpu_memory = gpu_bytes;
  return caps;
}

/// Planes U and V side by side in `chroma`, as I420 has them.
void pack_chroma(const modar_picture& picture, modar::CameraPicture& ours,
                 std::vector<std::uint8_t>& chroma) {
  const auto width = static_cast<std::size_t>(picture.width / 2);
  const auto height = static_cast<std::size_t>(picture.height / 2);
  chroma.resize(2 * width * height);
  std::uint8_t* out = chroma.data();
  for (std::size_t plane = 1; plane <= 2; ++plane) {
    ours.planes[plane] = out;
    ours.strides[plane] = static_cast<std::ptrdiff_t>(width);
    for (std::size_t y = 0; y < height; ++y) {
      const std::uint8_t* row =
          picture.planes[plane] + picture.strides[plane] * static_cast<std::ptrdiff_t>(y);
      for (std::size_t x = 0; x < width; ++x)
        *out++ = row[x * static_cast<std::size_t>(picture.chroma_step)];
    }
  }
}

/// Android's planes as the format that they are: their chroma is one plane of pairs on most phones.
void set_planes(const modar_picture& picture, modar::CameraPicture& ours,
                std::vector<std::uint8_t>& chroma) {
  const std::uint8_t* const u = picture.planes[1];
  const std::uint8_t* const v = picture.planes[2];
  ours.format = modar::PictureFormat::kI420;
  if (picture.chroma_step == 1) return;
  if (picture.strides[1] != picture.strides[2] || (v + 1 != u && u + 1 != v)) {
    return pack_chroma(picture, ours, chroma);
  }
  ours.format = v + 1 == u ? modar::PictureFormat::kNv21 : modar::PictureFormat::kNv12;
  ours.planes[1] = std::min(u, v);
}

/// A picture that check_picture() refuses has no size: nothing of it is drawn.
modar::CameraPicture picture_of(const modar_picture& theirs, std::vector<std::uint8_t>& chroma) {
  const modar_picture picture = modar::grown(theirs);
  modar::CameraPicture ours;
  if (!modar::check_picture(picture)) return ours;
  ours.format = static_cast<modar::PictureFormat>(picture.format);
  ours.width = picture.width;
  ours.height = picture.height;
  std::copy_n(picture.planes, ours.planes.size(), ours.planes.begin());
  std::copy_n(picture.strides, ours.strides.size(), ours.strides.begin());
  ours.full_range = picture.full_range != 0;
  if (picture.row_count != 0) {
    ours.first_row = picture.first_row;
    ours.row_count = picture.row_count;
  }
  if (picture.format == MODAR_YUV_420_888) set_planes(picture, ours, chroma);
  return ours;
}

modar::SurfaceView surface_of(const modar_surface& surface) {
  const modar_surface asked = modar::grown(surface);
  return {asked.x,        asked.y,           asked.width,      asked.height,
          asked.rotation, asked.mirror != 0, asked.cover != 0, asked.keep_depth == 0};
}

/// A neutral room with its key light there; zeros: each scene's own light.
void set_key(modar::RenderOptions& options, const float* direction) {
  const glm::vec3 to_light = glm::make_vec3(direction);
  if (to_light == glm::vec3(0.0f) || !modar::usable(direction, 3)) return;
  options.light = modar::neutral_room();
  options.light->direction = to_light;
}

/// The caller's floats are matrices.
const modar::BoneMatrix* bones_of(const modar_item& item) {
  static_assert(sizeof(modar::BoneMatrix) == 12 * sizeof(float));
  return reinterpret_cast<const modar::BoneMatrix*>(item.bones);
}

/// The items of models that there are and whose numbers are usable, into the renderer's own list.
void take_items(modar_renderer& renderer, const modar_drawing& drawing) {
  renderer.items.clear();
  const size_t count = modar::item_count(drawing.items, drawing.item_count);
  for (size_t i = 0; i < count; ++i) {
    const modar_item asked = modar::item_at(drawing.items, i);
    if (!modar::usable(asked)) continue;
    const bool picture = modar::is_picture(renderer.view, asked.node - 1);
    if (!picture && asked.model >= renderer.view.models().size()) continue;
    modar::DrawItem item{picture ? modar::kNone : asked.model, glm::make_mat4(asked.to_eye),
                         asked.scene - 1};
    item.node = asked.node - 1;
    const glm::mat4 world = glm::make_mat4(asked.world_to_eye);
    if (world != glm::mat4(0.0f)) item.world_to_eye = world;
    if (asked.opacity > 0.0f && asked.opacity < 1.0f) item.opacity = asked.opacity;
    item.bones = bones_of(asked);
    renderer.items.push_back(item);
  }
}

/// The caller's, or the camera's with depth limits that enclose the items.
glm::mat4 projection_of(const modar_renderer& renderer, const modar_drawing& drawing) {
  if (drawing.projection != nullptr) return glm::make_mat4(drawing.projection);
  if (drawing.camera == nullptr || renderer.items.empty()) return glm::mat4(1.0f);
  const modar::DepthRange range = modar::depth_range(renderer.view, renderer.items);
  return modar::gl_projection(modar::camera_of(*drawing.camera), range.near_plane, range.far_plane);
}

modar_drawing drawing_of(const modar_drawing* drawing) {
  return drawing == nullptr ? modar_drawing{} : modar::grown(*drawing);
}

/// Without a picture, the camera's size alone.
modar::CameraPicture frame_of(modar_renderer& renderer, const modar_picture* picture,
                              const modar_camera* camera) {
  if (picture != nullptr) return picture_of(*picture, renderer.chroma);
  modar::CameraPicture frame;
  if (camera != nullptr) {
    const modar_camera asked = modar::grown(*camera);
    frame.width = asked.width;
    frame.height = asked.height;
  }
  return frame;
}

}  // namespace

modar_context* modar_context_create(modar_error* error) {
  auto context = modar::GlContext::create_offscreen();
  if (!context) return modar::fail_null(context.error(), error);
  return new modar_context{std::move(*context)};
}

void modar_context_destroy(modar_context* context) {
  delete context;
}

modar_renderer* modar_renderer_create(const modar_bundle* bundle, const char* device,
                                      uint64_t gpu_bytes, modar_error* error) {
  if (bundle == nullptr) return modar::fail_null(modar::missing("bundle"), error);
  const std::string masked = device == nullptr ? "" : device;
  const auto caps = caps_for(masked, gpu_bytes);
  if (!caps) return modar::fail_null(caps.error(), error);
  auto renderer = bundle->file.settle(modar::Renderer::create(bundle->view, *caps));
  if (!renderer) return modar::fail_null(renderer.error(), error);
  return new modar_renderer{bundle, bundle->view, masked, gpu_bytes, std::move(*renderer)};
}

modar_renderer* modar_renderer_create_part(const modar_bundle* bundle, int part, uint64_t gpu_bytes,
                                           modar_error* error) {
  if (bundle == nullptr) return modar::fail_null(modar::missing("bundle"), error);
  modar::GlCaps caps = modar::probe_gl_caps();
  caps.gpu_memory = gpu_bytes;
  auto renderer =
      modar::Renderer::create_part(bundle->view, caps, static_cast<modar::Renderer::Part>(part));
  if (!renderer) return modar::fail_null(renderer.error(), error);
  return new modar_renderer{bundle, bundle->view, "", 0, std::move(*renderer)};
}

uint32_t modar_renderer_open_wanted(modar_renderer* renderer, uint64_t* offset,
                                    uint64_t* byte_count) {
  if (renderer == nullptr) return 0;
  const modar::Renderer::StreamRequest wanted = renderer->renderer->open_wanted();
  *offset = wanted.offset;
  *byte_count = wanted.size;
  return wanted.number + 1;
}

void modar_renderer_have(modar_renderer* renderer, uint32_t number) {
  if (renderer == nullptr || number == 0) return;
  renderer->renderer->have(number - 1);
}

void modar_renderer_put(modar_renderer* renderer, uint64_t offset, const void* bytes, size_t size) {
  if (renderer == nullptr || bytes == nullptr) return;
  renderer->renderer->put(offset, {static_cast<const std::byte*>(bytes), size});
}

void modar_renderer_destroy(modar_renderer* renderer) {
  delete renderer;
}

int modar_renderer_restore(modar_renderer* renderer, modar_error* error) {
  if (renderer == nullptr) return modar::set_error(modar::missing("renderer"), error);
  const auto caps = caps_for(renderer->device, renderer->gpu_bytes);
  if (!caps) return modar::set_error(caps.error(), error);
  return modar::set_error(renderer->bundle->file.settle(renderer->renderer->restore(*caps)), error);
}

int modar_renderer_resize(modar_renderer* renderer, int width, int height, modar_error* error) {
  if (renderer == nullptr) return modar::set_error(modar::missing("renderer"), error);
  const auto done = renderer->renderer->resize(width, height);
  if (!done) return modar::set_error(done, error);
  renderer->picture_bytes =
      std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  return 0;
}

void modar_renderer_render(modar_renderer* renderer, const modar_picture* picture,
                           const modar_drawing* drawing) {
  const modar_drawing asked = drawing_of(drawing);
  if (renderer == nullptr || !modar::usable(asked)) return;
  take_items(*renderer, asked);
  renderer->renderer->render(frame_of(*renderer, picture, asked.camera),
                             projection_of(*renderer, asked), renderer->items);
}

void modar_renderer_draw(modar_renderer* renderer, const modar_surface* surface,
                         const modar_picture* picture, const modar_drawing* drawing) {
  const modar_drawing asked = drawing_of(drawing);
  if (renderer == nullptr || surface == nullptr || !modar::usable(asked)) return;
  take_items(*renderer, asked);
  renderer->renderer->draw(surface_of(*surface), frame_of(*renderer, picture, asked.camera),
                           projection_of(*renderer, asked), renderer->items);
}

void modar_renderer_observe(modar_renderer* renderer, const modar_picture* picture,
                            const modar_drawing* drawing) {
  modar_drawing asked = drawing_of(drawing);
  asked.projection = nullptr;
  if (renderer == nullptr || picture == nullptr || !modar::usable(asked)) return;
  const modar::CameraPicture frame = picture_of(*picture, renderer->chroma);
  if (frame.width == 0) return;
  take_items(*renderer, asked);
  renderer->renderer->observe(frame, projection_of(*renderer, asked), renderer->items);
}

void modar_surface_to_frame(const modar_surface* surface, const modar_camera* camera, double x,
                            double y, double* frame_x, double* frame_y) {
  if (surface == nullptr || camera == nullptr || !modar::usable(x) || !modar::usable(y)) return;
  const modar_camera asked = modar::grown(*camera);
  const glm::dvec2 pixel =
      modar::frame_pixel(surface_of(*surface), asked.width, asked.height, {x, y});
  if (frame_x != nullptr) *frame_x = pixel.x;
  if (frame_y != nullptr) *frame_y = pixel.y;
}

int modar_pick(const modar_bundle* bundle, const modar_drawing* drawing, double frame_x,
               double frame_y, modar_hit* hit) {
  const modar_drawing drawn = drawing_of(drawing);
  if (bundle == nullptr || drawn.camera == nullptr || !modar::usable(*drawn.camera)) return 0;
  if (!modar::usable(frame_x) || !modar::usable(frame_y)) return 0;
  std::vector<modar::DrawItem> ours;
  const size_t count = modar::item_count(drawn.items, drawn.item_count);
  for (size_t i = 0; i < count; ++i) {
    const modar_item asked = modar::item_at(drawn.items, i);
    if (!modar::usable(asked)) return 0;
    ours.push_back({asked.model, glm::make_mat4(asked.to_eye), modar::kNone, {}});
    ours.back().node = asked.node - 1;
    ours.back().bones = bones_of(asked);
  }
  const auto found =
      modar::pick(bundle->view, modar::camera_of(*drawn.camera), {frame_x, frame_y}, ours);
  if (!found) return 0;
  modar::give({0,
               found->item,
               {found->point.x, found->point.y, found->point.z},
               found->distance,
               found->material + 1,
               0},
              hit);
  return 1;
}

void modar_render_options_default(modar_render_options* options) {
  if (options == nullptr) return;
  const modar::RenderOptions ours;
  const glm::vec4& clear = ours.clear_colour;
  const modar_render_options filled{0,
                                    {0.0f, 0.0f, 0.0f},
                                    ours.light_strength,
                                    ours.ambient_strength,
                                    {clear.r, clear.g, clear.b, clear.a},
                                    ours.lod_pixels,
                                    ours.exclusive_context ? 1 : 0,
                                    ours.estimate_light ? 0 : 1,
                                    ours.samples,
                                    0};
  modar::give(filled, options);
}

void modar_renderer_set_options(modar_renderer* renderer, const modar_render_options* options) {
  if (renderer == nullptr || options == nullptr) return;
  const modar_render_options asked = modar::grown(*options);
  const float numbers[] = {asked.light_strength, asked.ambient_strength, asked.lod_pixels};
  if (!modar::usable(asked.light, 3) || !modar::usable(asked.clear_colour, 4) ||
      !modar::usable(numbers, 3)) {
    return;
  }
  modar::RenderOptions ours;
  set_key(ours, asked.light);
  ours.light_strength = asked.light_strength;
  ours.ambient_strength = asked.ambient_strength;
  ours.clear_colour = glm::make_vec4(asked.clear_colour);
  ours.lod_pixels = asked.lod_pixels;
  ours.exclusive_context = asked.exclusive != 0;
  ours.estimate_light = asked.fixed_light == 0;
  ours.samples = asked.samples;
  renderer->renderer->set_options(ours);
}

void modar_renderer_set_video(modar_renderer* renderer, uint32_t node, uint32_t texture) {
  if (renderer != nullptr) renderer->renderer->set_video(node, texture);
}

uint64_t modar_renderer_gpu_bytes(const modar_renderer* renderer) {
  if (renderer == nullptr) return 0;
  const modar::GpuMemory memory = renderer->renderer->gpu_memory();
  return memory.geometry + memory.textures + memory.batches;
}

void modar_renderer_show(modar_renderer* renderer, int window_width, int window_height) {
  if (renderer != nullptr) renderer->renderer->blit_to_window(window_width, window_height);
}

void modar_renderer_read_rgba(modar_renderer* renderer, uint8_t* rgba) {
  if (renderer != nullptr) renderer->renderer->read_pixels({rgba, renderer->picture_bytes});
}

void modar_renderer_stats(const modar_renderer* renderer, modar_render_stats* stats) {
  if (renderer == nullptr) return;
  const modar::RenderStats& ours = renderer->renderer->stats();
  modar::give({0, ours.draw_calls, ours.state_changes, ours.chunks_drawn, ours.chunks_culled,
               ours.triangles, ours.bytes_uploaded},
              stats);
}
