// The renderer: set-up, and the frame.
#include "modar/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>

#include "formats/memory_share.hpp"
#include "formats/transport/stages.hpp"
#include "runtime/render/draw_list.hpp"
#include "runtime/render/geometry_store.hpp"
#include "runtime/render/gl.hpp"
#include "runtime/render/ground.hpp"
#include "runtime/render/model_painter.hpp"
#include "runtime/render/picture.hpp"
#include "runtime/render/plane_painter.hpp"
#include "runtime/render/program.hpp"
#include "runtime/render/texture_store.hpp"

namespace modar {
namespace {

/// Steps by which the allowed error on the screen is multiplied by four when time or memory is
/// short. The last exceeds any stated error.
constexpr int kCoarser = 8;
/// The same for the first view that is downloaded. Beyond it, coarse levels on the way take more
/// bytes than the view needs.
constexpr int kCoarserBrought = 5;
/// Halvings of such a step in search of the best fit. Six leave 2 % of error.
constexpr int kFiner = 6;
/// The same for the next request: 9 %.
constexpr int kFinerNext = 4;
/// Margin of the requested view, relative to the picture. Larger requests bytes that may never be
/// seen, smaller leaves gaps on turns. [1, 1.5]
constexpr float kAround = 1.5f;
/// Triangles of a frame, each draw call counted as several (see DrawList::cost()). Higher is finer
/// near the eye and slower. Not measured on phones.
constexpr std::uint64_t kMostTriangles = 1'000'000;
/// The same for GPUs without ES 3, from before 2013.
constexpr std::uint64_t kFewTriangles = 104'000;

std::uint64_t all_texture_bytes(const BundleView& bundle, const GlCaps& caps) {
  std::uint64_t bytes = 0;
  for (std::uint32_t i = 0; i < bundle.textures().size(); ++i) {
    const auto format = static_cast<TextureFormat>(bundle.textures()[i].format);
    bytes += texture_bytes(bundle, i, caps.reads(format));
  }
  return bytes;
}

std::vector<VertexFormat> vertex_formats(const BundleView& bundle, const GlCaps& caps) {
  std::vector<VertexFormat> formats;
  for (std::uint32_t i = 0; i < bundle.layouts().size(); ++i) {
    formats.push_back(vertex_format(bundle.layouts()[i],
                                    caps.half_float_vertices ? caps.half_float_type : 0,
                                    occlusion_byte(bundle.occlusion(), i)));
  }
  return formats;
}

/// The largest rectangle of the picture's aspect in the middle of the target: the projection is
/// made for a viewport that shows the whole picture.
struct Viewport {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

Viewport fit(int picture_width, int picture_height, int width, int height) {
  if (picture_width < 1 || picture_height < 1) return {0, 0, width, height};
  const std::int64_t wide = std::int64_t{width} * picture_height;
  const std::int64_t high = std::int64_t{height} * picture_width;
  Viewport view{0, 0, width, height};
  if (wide > high) view.width = std::max(1, static_cast<int>(high / picture_height));
  if (wide < high) view.height = std::max(1, static_cast<int>(wide / picture_width));
  view.x = (width - view.width) / 2;
  view.y = (height - view.height) / 2;
  return view;
}

/// A frame on a surface: the viewport, and the frame's NDC (x right, y up) to the viewport's.
struct SurfaceMap {
  Viewport view;
  glm::mat2 turn{1.0f};
};

SurfaceMap map_frame(const SurfaceView& surface, int frame_width, int frame_height) {
  constexpr std::array<int, 4> kCosine = {1, 0, -1, 0};
  constexpr std::array<int, 4> kSine = {0, 1, 0, -1};
  SurfaceMap map;
  map.view = {surface.x, surface.y, surface.width, surface.height};
  if (frame_width < 1 || frame_height < 1) return map;
  const std::size_t quarter = static_cast<std::size_t>((surface.rotation / 90 % 4 + 4) % 4);
  const int width = quarter % 2 == 1 ? frame_height : frame_width;
  const int height = quarter % 2 == 1 ? frame_width : frame_height;
  glm::vec2 stretch(1.0f);
  if (surface.cover) {
    const glm::vec2 fills(static_cast<float>(surface.width) / static_cast<float>(width),
                          static_cast<float>(surface.height) / static_cast<float>(height));
    stretch = std::max(fills.x, fills.y) / fills;
  } else {
    map.view = fit(width, height, surface.width, surface.height);
    map.view.x += surface.x;
    map.view.y += surface.y;
  }
  const float cosine = static_cast<float>(kCosine[quarter]);
  const float sine = static_cast<float>(kSine[quarter]);
  if (surface.mirror) stretch.x = -stretch.x;
  // Clockwise: the top comes to the right.
  map.turn = {glm::vec2(cosine, -sine) * stretch, glm::vec2(sine, cosine) * stretch};
  return map;
}

TextureMap texture_map(const glm::mat2& turn) {
  const glm::mat2 back = glm::inverse(turn);
  const auto texel = [&](float x, float y) {
    const glm::vec2 ndc = back * glm::vec2(x, y);
    return glm::vec2(0.5f + 0.5f * ndc.x, 0.5f - 0.5f * ndc.y);
  };
  const glm::vec2 start = texel(-1.0f, -1.0f);
  const glm::vec2 across = texel(1.0f, -1.0f) - start;
  const glm::vec2 up = texel(-1.0f, 1.0f) - start;
  return {{across.x, across.y, up.x, up.y}, {start.x, start.y}};
}

}  // namespace

glm::dvec2 frame_pixel(const SurfaceView& surface, int frame_width, int frame_height,
                       glm::dvec2 point) {
  const SurfaceMap map = map_frame(surface, frame_width, frame_height);
  // From the surface's rows, which go down, to the viewport's NDC.
  const double x = point.x - (map.view.x - surface.x);
  const double y = surface.height - point.y - (map.view.y - surface.y);
  const glm::dvec2 ndc(2.0 * x / map.view.width - 1.0, 2.0 * y / map.view.height - 1.0);
  const glm::dvec2 frame = glm::inverse(glm::dmat2(map.turn)) * ndc;
  return {0.5 * (frame.x + 1.0) * frame_width - 0.5, 0.5 * (1.0 - frame.y) * frame_height - 0.5};
}

struct Renderer::State {
  State(const BundleView& view, const GlCaps& context_caps)
      : bundle(view),
        caps(context_caps),
        formats(vertex_formats(bundle, caps)),
        texture_total(all_texture_bytes(view, caps)),
        geometry(bundle, formats, geometry_share(texture_total, context_caps.gpu_memory)),
        textures(bundle, caps),
        painter(bundle, formats, batch_budget()) {
    estimator.create(bundle);
  }

  /// What geometry and textures leave; nothing where not even they fit.
  std::uint64_t batch_budget() const {
    if (caps.gpu_memory == 0) return ~std::uint64_t{0};
    const std::uint64_t used = geometry.total_bytes() + texture_total;
    return caps.gpu_memory - std::min(caps.gpu_memory, used);
  }

  Result<void> upload() {
    extensions = load_gl_extensions(caps);
    const SavedGlState saved(extensions, !options.exclusive_context);
    const DebugGroup group(extensions, "upload");
    MODAR_TRY(textures.upload(
        caps.gpu_memory == 0 ? 0 : std::max<std::uint64_t>(1, caps.gpu_memory / 2)));
    MODAR_TRY(geometry.upload());
    return finish_upload();
  }

  /// In place of upload(): what put() fills.
  Result<void> expect() {
    extensions = load_gl_extensions(caps);
    const SavedGlState saved(extensions, !options.exclusive_context);
    MODAR_TRY(textures.expect(0));
    MODAR_TRY(geometry.expect());
    // Batches are copied from the bundle's bytes.
    if (!bundle.proxies().empty()) painter.make_no_batches();
    return finish_upload();
  }

  /// In place of upload(): uploads by put() on request.
  Result<void> expect_wanted() {
    if (!caps.es3) {
      return fail(ExitCode::kUnsupported, "gl.levels", "textures",
                  "this context draws no texture without all of its levels",
                  "keep the whole bundle in memory");
    }
    extensions = load_gl_extensions(caps);
    const SavedGlState saved(extensions, !options.exclusive_context);
    MODAR_TRY(geometry.expect_wanted());
    MODAR_TRY(textures.expect_wanted(std::max<std::uint64_t>(1, caps.gpu_memory / 2)));
    painter.make_no_batches();
    draw_what_is_there = &State::use_what_is_there;
    return finish_upload();
  }

  Result<void> finish_upload() {
    MODAR_TRY(painter.create(textures, extensions, caps));
    MODAR_TRY(background.create());
    MODAR_TRY(ground.create(bundle));
    MODAR_TRY(planes.create(bundle));
    gl.reset();
    return {};
  }

  void begin_frame() {
    stats = RenderStats();
    if (!options.exclusive_context) gl.reset();
    gl.changes = 0;
    geometry.set_client_arrays(options.client_arrays);
    uploaded_before = geometry.uploaded_bytes();
    evicted_before = geometry.evictions();
  }

  void end_frame() {
    stats.state_changes = gl.changes;
    stats.bytes_uploaded += geometry.uploaded_bytes() - uploaded_before;
    stats.evictions = geometry.evictions() - evicted_before;
  }

  void draw_models(const glm::mat4& projection, int height, std::span<const DrawItem> items) {
    {
      const DebugGroup group(extensions, "shadows");
      ground.draw_shadows(bundle, projection, items, gl, stats);
    }
    const DebugGroup group(extensions, "models");
    const std::span<const DrawItem> posed = list.pose(bundle, items);
    build_list(projection, height, posed);
    stats.chunks_culled = list.culled();
    if (geometry.streams()) {
      list.sort_by_distance();
      stats.chunks_skipped = keep_resident();
    }
    list.sort_by_state(bundle);
    if (options.plane_hides) ground.hide_below(bundle, projection, items, gl, stats);
    const PlanePainter::Job pictures{bundle, projection, items, textures, gl, stats};
    planes.choose(pictures, false);
    planes.draw(pictures, nullptr);
    planes.choose(pictures, true);
    painter.draw({list, posed, projection, options, geometry, textures, gl, stats, planes, pictures,
                  options.estimate_light ? &estimator : nullptr});
    planes.draw(pictures, nullptr);
    gl.set_depth_writes(true);  // clearing obeys the masks
    gl.set_colour_writes(true);
  }

  /// What differs more takes the place of what a frame has no time or memory for.
  void build_list(const glm::mat4& projection, int height, std::span<const DrawItem> items) {
    const bool coarser =
        bundle.levels().size() > bundle.chunks().size() || !bundle.proxies().empty();
    float pixels = options.lod_pixels;
    const auto fits = [&](float some) {
      list.build(bundle, painter.setups(), projection, height, items, some);
      return list_fits();
    };
    const int most = geometry.arrives() ? kCoarserBrought : kCoarser;
    int step = coarser ? 0 : most + 1;
    for (; !fits(pixels) && step <= most; ++step) {
      pixels = step < most || !geometry.streams() ? 4.0f * pixels : options.lod_pixels;
    }
    if (step > 0 && step <= most) {
      // The finest of that step which fits: proxies of one model often are in one.
      float factor = 2.0f;
      for (int i = 0; i < kFiner; ++i, factor = std::sqrt(factor)) {
        if (fits(pixels / factor)) pixels /= factor;
      }
      fits(pixels);
    }
    if (draw_what_is_there != nullptr)
      (this->*draw_what_is_there)(projection, height, items, pixels);
  }

  /// The list has the final drawing, with all data. The largest difference is requested first, so
  /// that a view gets better step by step.
  void use_what_is_there(const glm::mat4& projection, int height, std::span<const DrawItem> items,
                         float pixels) {
    list_levels();
    if (geometry.there(levels)) {
      want_around(projection, height, items);
      return;
    }
    float listed = 0.0f;
    const auto lacks = [&](float some) {
      listed = some;
      list.build(bundle, painter.setups(), projection, height, items, some);
      list.sort_by_distance();
      list_levels();
      return !geometry.there(levels);
    };
    float coarse = 0.0f;
    float fine = pixels;
    for (int i = kCoarserBrought; i >= 0; --i) {
      fine = std::ldexp(pixels, 2 * i);
      if (lacks(fine)) break;
      coarse = fine;
    }
    // The coarsest of that step: proxies of one model often are in one.
    for (int i = 0; coarse > 0.0f && i < kFinerNext; ++i) {
      const float middle = std::sqrt(coarse * fine);
      (lacks(middle) ? fine : coarse) = middle;
    }
    if (listed != fine) lacks(fine);
    want_around(projection, height, items);
    list.build_of(geometry, bundle, painter.setups(), projection, height, items, pixels);
  }

  /// Requests the listed levels, then the coarsest of chunks around it that have no level yet:
  /// where one that comes into view is missing, the whole model is drawn by a proxy.
  void want_around(const glm::mat4& projection, int height, std::span<const DrawItem> items) {
    glm::mat4 wide = projection;
    for (int column = 0; column < 4; ++column) {
      wide[column][0] /= kAround;
      wide[column][1] /= kAround;
    }
    const std::size_t listed = levels.size();
    for (std::uint32_t i = 0; i < items.size(); ++i) {
      if (items[i].model == kNone) continue;
      const auto is_own = [&](const DrawCommand& command) {
        return command.item == i && command.chunk < bundle.chunks().own().size();
      };
      // A proxy is there as a whole.
      const bool poses = items[i].bones != nullptr;  // and has no proxy
      if (!poses && std::none_of(list.commands().begin(), list.commands().end(), is_own)) continue;
      const ModelView view = model_view(wide, items[i].to_eye, height);
      const ModelRecord& model = bundle.models()[items[i].model];
      for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
        const ChunkRecord& chunk = bundle.chunks()[c];
        const bool moves = poses && painter.setups()[c].part != kNone;
        const bool outside = !moves && outside_frustum(view, chunk);
        if (outside || some_there(chunk)) continue;
        levels.push_back(chunk.first_level + chunk.level_count - 1);
      }
    }
    if (!geometry.fits(levels)) levels.resize(listed);
    geometry.want(levels);
  }

  bool some_there(const ChunkRecord& chunk) const {
    std::uint32_t level = chunk.first_level;
    const std::uint32_t end = level + chunk.level_count;
    while (level < end && !geometry.there({&level, 1})) ++level;
    return level < end;
  }

  void list_levels() {
    levels.clear();
    for (const DrawCommand& command : list.commands()) levels.push_back(command.level);
  }

  bool list_fits() {
    const std::uint64_t most = caps.es3 ? kMostTriangles : kFewTriangles;
    if (list.cost(bundle, 0, list.commands().size()) > most) return false;
    if (!geometry.streams() || bundle.proxies().empty()) return true;
    list_levels();
    return geometry.fits(levels);
  }

  /// Gives GPU memory to the nearest chunks first, at a coarser level where there is little. Drops
  /// what has none; answers how many.
  int keep_resident() {
    geometry.begin_frame();
    std::size_t kept = 0;
    for (DrawCommand command : list.commands()) {
      const ChunkRecord& chunk = bundle.chunks()[command.chunk];
      const std::uint32_t end = chunk.first_level + chunk.level_count;
      LevelPlace place;
      while (command.level < end && !geometry.use(command.level, gl, place)) ++command.level;
      if (command.level < end) list.commands()[kept++] = command;
    }
    const int dropped = static_cast<int>(list.commands().size() - kept);
    list.commands().resize(kept);
    return dropped;
  }

  BundleView bundle;
  GlCaps caps;
  std::vector<VertexFormat> formats;
  GlExtensions extensions;
  GlState gl;
  std::uint64_t texture_total;  ///< bytes of all textures, were all their levels in GL
  GeometryStore geometry;
  TextureStore textures;
  ModelPainter painter;
  Background background;
  Ground ground;
  PlanePainter planes;
  LightEstimator estimator;
  Target target;
  DrawList list;
  std::vector<std::uint32_t> levels;  ///< of the list
  /// After expect_wanted(): use_what_is_there(), which programs of whole bundles do not link.
  void (State::*draw_what_is_there)(const glm::mat4&, int, std::span<const DrawItem>,
                                    float) = nullptr;
  RenderOptions options;
  RenderStats stats;
  std::uint64_t uploaded_before = 0;
  std::uint64_t evicted_before = 0;
};

Result<std::unique_ptr<Renderer>> Renderer::create(const BundleView& bundle, const GlCaps& caps) {
  std::unique_ptr<Renderer> renderer(new Renderer(std::make_unique<State>(bundle, caps)));
  MODAR_TRY(renderer->state_->upload());
  return renderer;
}

Result<std::unique_ptr<Renderer>> Renderer::create_part(const BundleView& bundle,
                                                        const GlCaps& caps, Part part) {
  std::unique_ptr<Renderer> renderer(new Renderer(std::make_unique<State>(bundle, caps)));
  State& state = *renderer->state_;
  if (part == Part::kCoarsest) state.geometry.upload_when_used();
  MODAR_TRY(part == Part::kCoarsest ? state.upload()
            : part == Part::kComes  ? state.expect()
                                    : state.expect_wanted());
  return renderer;
}

Renderer::StreamRequest Renderer::open_wanted() {
  State& s = *state_;
  const SavedGlState saved(s.extensions, !s.options.exclusive_context);
  StreamRequest wanted;
  std::span<const std::byte> section;
  wanted.number = s.textures.want(wanted.offset, wanted.size);
  if (wanted.number != kNone) {
    section = s.bundle.texture_data(wanted.number);
    wanted.number += s.bundle.levels().size() * 2;
  } else {
    bool indices = false;
    wanted.number = s.geometry.open_wanted(s.gl, indices, wanted.offset, wanted.size);
    section = indices ? s.bundle.indices() : s.bundle.vertices();
  }
  wanted.offset += static_cast<std::uint64_t>(section.data() - s.bundle.bytes().data());
  s.gl.reset();
  return wanted;
}

void Renderer::have(std::uint32_t number) {
  State& s = *state_;
  const SavedGlState saved(s.extensions, !s.options.exclusive_context);
  if (number < s.bundle.levels().size() * 2) {
    s.geometry.have(number);
  } else {
    s.textures.have();
  }
  s.gl.reset();
}

void Renderer::put(std::uint64_t offset, std::span<const std::byte> bytes) {
  State& s = *state_;
  // Another renderer draws while this one's bytes come; asking a browser for all of the state waits
  // for its GPU, which a frame has no time for.
  const bool alone = s.draw_what_is_there != nullptr && s.options.exclusive_context;
  const SavedGlState saved(s.extensions, !alone);
  const auto start = [&](std::span<const std::byte> section) {
    return static_cast<std::uint64_t>(section.data() - s.bundle.bytes().data());
  };
  for (const bool indices : {false, true}) {
    const auto section = indices ? s.bundle.indices() : s.bundle.vertices();
    const Overlap part = overlap(start(section), section.size(), offset, bytes);
    if (!part.bytes.empty()) s.geometry.put(indices, part.at, part.bytes);
  }
  for (std::uint32_t t = 0; t < s.bundle.textures().size(); ++t) {
    const auto section = s.bundle.texture_data(t);
    const Overlap part = overlap(start(section), section.size(), offset, bytes);
    if (!part.bytes.empty()) s.textures.put(t, part.at, part.bytes);
  }
  s.gl.reset();
}

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}

Renderer::~Renderer() {
  state_->geometry.release(state_->gl);
  state_->textures.release(state_->gl);
  state_->painter.release(state_->gl);
  state_->background.release(state_->gl);
  state_->ground.release(state_->gl);
  state_->planes.release(state_->gl);
  state_->target.release(state_->gl);
}

Result<void> Renderer::resize(int width, int height) {
  const SavedGlState saved(state_->extensions, !state_->options.exclusive_context);
  return state_->target.resize(width, height, state_->options.samples, state_->caps,
                               state_->extensions, state_->gl);
}

Result<void> Renderer::restore(const GlCaps& caps) {
  // The old state is dropped without a GL call: its names mean nothing in this context.
  auto state = std::make_unique<State>(state_->bundle, caps);
  state->options = state_->options;
  state->estimator = std::move(state_->estimator);  // the room's light stays unchanged
  const int width = state_->target.width();
  const int height = state_->target.height();
  state_ = std::move(state);
  const Result<void> uploaded = state_->upload();
  if (!uploaded || width == 0) return uploaded;
  return resize(width, height);
}

void Renderer::render(const RgbImage& background, const glm::mat4& projection,
                      std::span<const DrawItem> items) {
  CameraPicture picture;
  picture.width = background.width;
  picture.height = background.height;
  picture.planes[0] = background.pixels;
  picture.strides[0] = background.stride;
  render(picture, projection, items);
}

void Renderer::render(const CameraPicture& background, const glm::mat4& projection,
                      std::span<const DrawItem> items) {
  State& s = *state_;
  if (s.target.width() == 0) return;
  const SavedGlState saved(s.extensions, !s.options.exclusive_context);
  s.begin_frame();
  const bool shown =
      background.planes[0] != nullptr && background.width > 0 && background.height > 0;
  const Viewport view =
      fit(background.width, background.height, s.target.width(), s.target.height());
  s.target.begin();
  glViewport(view.x, view.y, view.width, view.height);
  const glm::vec4& clear = s.options.clear_colour;
  glClearColor(clear.r, clear.g, clear.b, clear.a);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  if (shown) {
    const DebugGroup group(s.extensions, "camera picture");
    const bool exact = view.width == background.width && view.height == background.height;
    s.background.upload(background, s.gl, s.stats);
    s.stats.draw_calls += s.background.draw(exact, {}, s.gl);
    if (s.options.estimate_light) s.estimator.observe(background, projection, items);
  }
  if (!items.empty()) s.draw_models(projection, view.height, items);
  s.target.finish(s.extensions);
  s.end_frame();
}

void Renderer::draw(const SurfaceView& surface, const CameraPicture& frame,
                    const glm::mat4& projection, std::span<const DrawItem> items) {
  State& s = *state_;
  const SavedGlState saved(s.extensions, !s.options.exclusive_context);
  s.begin_frame();
  const auto [view, turn] = map_frame(surface, frame.width, frame.height);
  glViewport(view.x, view.y, view.width, view.height);
  if (surface.clear_depth) {
    // The viewport's part alone: the rest of the surface is the app's.
    glEnable(GL_SCISSOR_TEST);
    glScissor(view.x, view.y, view.width, view.height);
    glClear(GL_DEPTH_BUFFER_BIT);
    glDisable(GL_SCISSOR_TEST);
  }
  if (frame.planes[0] != nullptr && frame.width > 0 && frame.height > 0) {
    const DebugGroup group(s.extensions, "camera picture");
    const bool exact =
        turn == glm::mat2(1.0f) && view.width == frame.width && view.height == frame.height;
    s.background.upload(frame, s.gl, s.stats);
    s.stats.draw_calls += s.background.draw(exact, texture_map(turn), s.gl);
    if (s.options.estimate_light) s.estimator.observe(frame, projection, items);
  }
  if (!items.empty()) {
    glm::mat4 turned(1.0f);
    turned[0] = glm::vec4(turn[0], 0.0f, 0.0f);
    turned[1] = glm::vec4(turn[1], 0.0f, 0.0f);
    s.draw_models(turned * projection, view.height, items);
  }
  s.end_frame();
}

void Renderer::observe(const CameraPicture& frame, const glm::mat4& projection,
                       std::span<const DrawItem> items) {
  if (frame.planes[0] == nullptr || frame.width < 1 || frame.height < 1) return;
  if (state_->options.estimate_light) {
    state_->estimator.observe(frame, projection, items, kLookPause);
  }
}

void Renderer::read_pixels(std::span<std::uint8_t> rgba) {
  if (state_->target.width() == 0) return;
  const SavedGlState saved(state_->extensions, !state_->options.exclusive_context);
  if (!state_->options.exclusive_context) state_->gl.reset();
  const int width = state_->target.width();
  const int height = state_->target.height();
  state_->target.bind();
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  // GL's first row is the bottom one.
  const std::size_t row = static_cast<std::size_t>(width) * 4;
  for (std::size_t low = 0, high = static_cast<std::size_t>(height) - 1; low < high;
       ++low, --high) {
    std::swap_ranges(rgba.begin() + static_cast<std::ptrdiff_t>(low * row),
                     rgba.begin() + static_cast<std::ptrdiff_t>((low + 1) * row),
                     rgba.begin() + static_cast<std::ptrdiff_t>(high * row));
  }
}

void Renderer::blit_to_window(int window_width, int window_height) {
  State& s = *state_;
  if (s.target.width() == 0) return;
  const SavedGlState saved(s.extensions, !s.options.exclusive_context);
  if (!s.options.exclusive_context) s.gl.reset();
  const DebugGroup group(s.extensions, "present");
  const Viewport view = fit(s.target.width(), s.target.height(), window_width, window_height);
  glViewport(0, 0, window_width, window_height);
  glClearColor(0.0f, 0.0f, 0.0f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  glViewport(view.x, view.y, view.width, view.height);
  s.background.draw_texture(s.target.texture(), s.gl);
  s.gl.bind_texture(0, 0);
}

void Renderer::set_video(std::uint32_t node, std::uint32_t texture) {
  state_->planes.set_video(node, texture);
}

void Renderer::set_options(const RenderOptions& options) {
  // The state that later frames build on: earlier uploads replaced the app's.
  if (options.exclusive_context && !state_->options.exclusive_context) state_->gl.reset();
  state_->options = options;
}

const RenderStats& Renderer::stats() const {
  return state_->stats;
}

GpuMemory Renderer::gpu_memory() const {
  return {state_->geometry.resident_bytes(), state_->textures.bytes(),
          state_->painter.batch_bytes(),
          state_->geometry.uploaded_bytes() + state_->textures.uploaded_bytes(),
          state_->textures.kept_bytes()};
}

}  // namespace modar
