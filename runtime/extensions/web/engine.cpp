// The engine of the page: modar.h for JavaScript, which reads numbers and texts but no structs.
// A worker tracks with one instance of this module, the page draws with another. An instance holds
// one bundle. Built by the preset `web` only.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <GLES2/gl2.h>
#include <emscripten.h>

#include "modar/arriving_bundle.hpp"
#include "modar/modar.h"
#include "modar/pose_floats.hpp"
#include "whole_number.hpp"

namespace {

using modar::PoseFloats;

/// Pictures of the visitor's own that a page tracks in addition to the bundle's.
constexpr uint32_t kMostOwn = 8;

/// The content of one of them: what a scene of the bundle has, at its place.
struct OwnPattern {
  modar_record* record = nullptr;  ///< of the tracker; null where this instance draws
  uint32_t scene = 0;
};

/// A tracker record that is unpacked while it comes.
struct PendingPiece {
  uint32_t index;
  const void* stored;
  modar::RecordUnpacker unpacker;
};

struct Engine {
  modar_error error = modar::sized<modar_error>();
  modar_bundle* bundle = nullptr;
  modar_tracker* tracker = nullptr;
  modar_renderer* renderer = nullptr;
  modar_renderer* coming = nullptr;                                     ///< that web_pass() fills
  modar_render_options options = modar::sized<modar_render_options>();  ///< of `renderer`
  bool in_memory = false;  ///< all of the bundle is, not what kept_ranges() names alone
  modar_camera camera = modar::sized<modar_camera>();
  double focal_sigma = 0;       ///< 0 where it is not estimated
  PoseFloats* poses = nullptr;  ///< one a pattern, with room for kMostOwn more, then of copies
  uint32_t copies = 1;          ///< most of a pattern
  OwnPattern own[kMostOwn];
  uint32_t own_count = 0;
  modar_item* items = nullptr;
  size_t item_count = 0;  ///< that were drawn last
  modar_screen* screen = nullptr;
  modar_event* events = nullptr;                    ///< one a pattern and one a tap
  GLuint* videos = nullptr;                         ///< a node's texture for its video; 0: none
  std::unique_ptr<modar::ArrivingBundle> arriving;  ///< of web_arrive()
  modar::RecipeView recipe;                         ///< of web_recipe()
  std::vector<std::byte> piece;                     ///< raw, of web_piece()
  std::optional<PendingPiece> begun;                ///< of web_begin_piece()
  char text[4096];
};
Engine engine;

/// Poses of first copies; those of the second ones follow, and so on.
uint32_t pose_row() {
  return modar_pattern_count(engine.bundle) + engine.own_count;
}

size_t item_room() {
  const uint32_t count = modar_scene_count(engine.bundle) + modar_node_count(engine.bundle);
  return engine.copies * (count + kMostOwn);
}

/// The content of the visible patterns, as items; answers how many.
size_t collect_items() {
  engine.item_count = 0;
  for (uint32_t p = 0; p < engine.copies * pose_row(); ++p) {
    if (engine.poses[p].shown == 0.0f) continue;
    engine.item_count +=
        modar_screen_items(engine.screen, p % pose_row(), engine.poses[p].view,
                           engine.items + engine.item_count, item_room() - engine.item_count);
  }
  return engine.item_count;
}

/// The bundle's pattern that has the content of one of the visitor's own, or itself.
uint32_t baked_pattern(uint32_t pattern) {
  const uint32_t patterns = modar_pattern_count(engine.bundle);
  if (pattern < patterns) return pattern;
  auto scene = modar::sized<modar_scene>();
  modar_scene_at(engine.bundle, engine.own[pattern - patterns].scene, &scene);
  return scene.pattern;
}

/// For web_error(); answers its status.
int failed(const modar::Error& error) {
  const auto write = [](auto& field, const std::string& text) {
    const std::size_t length = std::min(text.size(), sizeof field - 1);
    std::memcpy(field, text.data(), length);
    field[length] = '\0';
  };
  write(engine.error.code, error.code);
  write(engine.error.where, error.where);
  write(engine.error.cause, error.cause);
  write(engine.error.cure, error.cure);
  return engine.error.status = static_cast<int>(error.exit);
}

/// An invalid place or number of bytes.
int no_number(const char* where) {
  return failed({modar::ExitCode::kUsage, "capi.number", where,
                 "is not a number from 0 to 2^53 - 1", "pass a number of bytes"});
}

// / The begun part of a piece in this memory; null where nothing was.
modar::RecordUnpacker* begun_of(uint32_t index, const void* stored) {
  const bool same = engine.begun && engine.begun->index == index && engine.begun->stored == stored;
  return same ? &engine.begun->unpacker : nullptr;
}

/// The bundle's own tables, for as long as it lives.
struct AllShown {
  AllShown() : coarse(!engine.arriving->shows_all()) { engine.arriving->show_all(); }
  ~AllShown() {
    if (coarse) static_cast<void>(engine.arriving->show_coarsest());
  }
  AllShown(const AllShown&) = delete;
  AllShown& operator=(const AllShown&) = delete;
  bool coarse;
};

/// In place of the renderer before. fixed: 1 where its light does not follow web_look(). null: it
/// could not be made.
int use_renderer(modar_renderer* renderer, int fixed) {
  modar_renderer_destroy(std::exchange(engine.renderer, renderer));
  if (renderer == nullptr) return engine.error.status;
  modar_render_options_default(&engine.options);
  engine.options.exclusive = 1;
  engine.options.fixed_light = fixed;
  modar_renderer_set_options(renderer, &engine.options);
  return 0;
}

/// After another renderer has used the context: the set-up there is done again.
void take_context_back() {
  if (engine.renderer == nullptr) return;
  auto options = engine.options;
  options.exclusive = 0;
  modar_renderer_set_options(engine.renderer, &options);
  modar_renderer_set_options(engine.renderer, &engine.options);
}

/// For what reads triangles: of models whose own are on the GPU alone, those of proxies.
template <class Read>
auto with_triangles(const Read& read) {
  return engine.in_memory ? read() : engine.arriving->with_proxies(read);
}

/// Rows without gaps.
modar_picture rgba_picture(const uint8_t* pixels, int width, int height) {
  auto picture = modar::sized<modar_picture>();
  picture.format = MODAR_RGBA;
  picture.width = width;
  picture.height = height;
  picture.planes[0] = pixels;
  picture.strides[0] = 4 * static_cast<ptrdiff_t>(width);
  return picture;
}

/// The first `count` of the frame's items.
modar_drawing drawing_of(size_t count) {
  return {sizeof(modar_drawing), &engine.camera, nullptr, engine.items, count};
}

/// A canvas that a frame of web_camera() covers.
modar_surface surface_of(int width, int height, int mirror) {
  auto surface = modar::sized<modar_surface>();
  surface.width = width;
  surface.height = height;
  surface.mirror = mirror;
  surface.cover = 1;
  return surface;
}

}  // namespace

extern "C" {

/// EGL's look-up for the renderer: the few entry points that it asks for. Emscripten's own knows
/// every name of OpenGL ES and would link them all.
typedef void (*web_function)(void);
void glDrawElementsInstanced(GLenum mode, GLsizei count, GLenum type, const void* indices,
                             GLsizei instances);
void glVertexAttribDivisor(GLuint index, GLuint divisor);
void glCopyBufferSubData(GLenum from, GLenum to, GLintptr from_offset, GLintptr to_offset,
                         GLsizeiptr size);
web_function eglGetProcAddress(const char* name) {
  const auto is = [name](const char* other) {
    return std::strncmp(name, other, std::strlen(other)) == 0;
  };
  if (is("glDrawElementsInstanced")) return reinterpret_cast<web_function>(glDrawElementsInstanced);
  if (is("glVertexAttribDivisor")) return reinterpret_cast<web_function>(glVertexAttribDivisor);
  if (is("glCopyBufferSubData")) return reinterpret_cast<web_function>(glCopyBufferSubData);
  // The page's renderer has its context to itself: there is nobody's vertex array to leave.
  return nullptr;
}

/// Memory for a bundle or a frame, aligned to 8; 0 where the browser gives no more.
EMSCRIPTEN_KEEPALIVE void* web_reserve(double size) {
  const auto bytes = modar::whole_number(size, SIZE_MAX);
  return bytes ? std::malloc(static_cast<size_t>(*bytes)) : nullptr;
}
EMSCRIPTEN_KEEPALIVE void web_free(void* memory) {
  std::free(memory);
}

/// Takes the recipe of a packed bundle, whose bytes, of web_reserve(), stay in use.
EMSCRIPTEN_KEEPALIVE int web_recipe(const void* bytes, size_t size) {
  const auto recipe = modar::open_packed({static_cast<const std::byte*>(bytes), size});
  if (!recipe) return failed(recipe.error());
  engine.recipe = *recipe;
  return 0;
}
/// Unpacks the first `there` bytes of a piece that is a tracker record. stored: memory for all of
/// it, where web_piece() finds it.
EMSCRIPTEN_KEEPALIVE void web_begin_piece(uint32_t index, const void* stored, size_t there) {
  if (begun_of(index, stored) == nullptr) {
    const auto* const bytes = static_cast<const std::byte*>(stored);
    const size_t size = engine.recipe.pieces[index].stored_size;
    engine.begun.emplace(PendingPiece{index, stored, modar::RecordUnpacker({bytes, size})});
  }
  engine.begun->unpacker.go_on(there);
}
/// The bytes of a piece of the recipe as the bundle has them, until the next one; null for one that
/// is damaged.
/// stored: as long as the recipe says.
EMSCRIPTEN_KEEPALIVE const void* web_piece(uint32_t index, const void* stored) {
  const modar::PieceRecord& piece = engine.recipe.pieces[index];
  auto raw = modar::decode_own_piece(
      piece, {static_cast<const std::byte*>(stored), piece.stored_size}, begun_of(index, stored));
  engine.begun.reset();
  if (!raw) {
    failed(raw.error());
    return nullptr;
  }
  modar::add_index_base(piece, *raw);
  engine.piece = *std::move(raw);
  return engine.piece.data();
}
// / Memory for a bundle that comes in pieces, which JavaScript puts into it; null if none.
EMSCRIPTEN_KEEPALIVE void* web_arrive(double size) {
  const auto bytes = modar::whole_number(size, SIZE_MAX);
  if (!bytes) return nullptr;
  engine.arriving = modar::ArrivingBundle::create(static_cast<size_t>(*bytes));
  return engine.arriving == nullptr ? nullptr : engine.arriving->bytes().data();
}
/// Begins the last stage of the bundle, which web_pass() is given. in_order: 1 where its bytes come
/// as a file's do, from gpu_start() on; 0 where they are pieces, and the parts shown before them
/// are there.
EMSCRIPTEN_KEEPALIVE int web_begin_rest(int in_order) {
  const AllShown shown;
  const auto kept = engine.arriving->keep(in_order != 0);
  if (!kept) return failed(kept.error());
  modar_renderer_destroy(engine.coming);
  // Null where vertices have to be rewritten for this context: then all stays in memory.
  engine.coming = modar_renderer_create_part(engine.bundle, 1, 0, nullptr);
  take_context_back();
  if (in_order != 0) return 0;
  for (const modar::StageRange& range : engine.arriving->kept()) {
    modar_renderer_put(engine.coming, range.offset, engine.arriving->bytes().data() + range.offset,
                       static_cast<size_t>(range.size));
  }
  take_context_back();
  return 0;
}
/// Bytes of the last stage.
EMSCRIPTEN_KEEPALIVE int web_pass(double at, const void* bytes, size_t size) {
  const auto offset = modar::whole_number(at);
  if (!offset) return no_number("web_pass");
  const std::span some(static_cast<const std::byte*>(bytes), size);
  const AllShown shown;
  modar_renderer_put(engine.coming, *offset, bytes, size);
  take_context_back();
  if (engine.coming == nullptr) engine.arriving->put(*offset, some);
  const auto passed = engine.arriving->pass(*offset, some);
  return passed ? 0 : failed(passed.error());
}
/// What web_kept() names has to come before web_show_wanted().
EMSCRIPTEN_KEEPALIVE int web_keep() {
  const AllShown shown;
  const auto kept = engine.arriving->keep(false);
  return kept ? 0 : failed(kept.error());
}
/// Bytes of the bundle: the first one and how many; null: no more.
EMSCRIPTEN_KEEPALIVE const uint32_t* web_kept(uint32_t index) {
  static uint32_t range[2];
  const auto kept = engine.arriving->kept();
  if (index == kept.size()) return nullptr;
  range[0] = static_cast<uint32_t>(kept[index].offset);
  range[1] = static_cast<uint32_t>(kept[index].size);
  return range;
}
/// From now on the finest levels that web_open_wanted() has loaded are drawn, within this many
/// bytes of the GPU. fixed: see use_renderer().
EMSCRIPTEN_KEEPALIVE int web_show_wanted(double gpu_bytes, int fixed) {
  const auto bytes = modar::whole_number(gpu_bytes);
  if (!bytes) return no_number("maxBytes");
  engine.arriving->show_all();
  const auto verified = engine.arriving->verify();
  if (!verified) return failed(verified.error());
  return use_renderer(modar_renderer_create_part(engine.bundle, 2, *bytes, &engine.error), fixed);
}
/// Bytes of the bundle that the last picture lacks, which web_fill() is given: number, the first
/// byte, how many; null: none.
EMSCRIPTEN_KEEPALIVE const uint32_t* web_open_wanted() {
  static uint32_t wanted[3];
  uint64_t offset = 0;
  uint64_t size = 0;
  wanted[0] = modar_renderer_open_wanted(engine.renderer, &offset, &size);
  wanted[1] = static_cast<uint32_t>(offset);
  wanted[2] = static_cast<uint32_t>(size);
  return wanted[0] == 0 ? nullptr : wanted;
}
EMSCRIPTEN_KEEPALIVE int web_fill(double at, const void* bytes, size_t size) {
  const auto offset = modar::whole_number(at);
  if (!offset) return no_number("web_fill");
  modar_renderer_put(engine.renderer, *offset, bytes, size);
  static_cast<void>(engine.arriving->pass(*offset, {static_cast<const std::byte*>(bytes), size}));
  return 0;
}
/// All bytes of that number have been given.
EMSCRIPTEN_KEEPALIVE void web_have(uint32_t number) {
  modar_renderer_have(engine.renderer, number);
}
/// From now on the coarsest of everything is drawn, which has come. fixed: see use_renderer().
EMSCRIPTEN_KEEPALIVE int web_show_coarse(int fixed) {
  const auto shown = engine.arriving->show_coarsest();
  if (!shown) return failed(shown.error());
  return use_renderer(modar_renderer_create_part(engine.bundle, 0, 0, &engine.error), fixed);
}
/// From now on all of it is drawn, which has come.
EMSCRIPTEN_KEEPALIVE int web_show_all(int fixed) {
  {
    const AllShown shown;
    const auto verified = engine.arriving->verify();
    if (!verified) return failed(verified.error());
  }
  engine.arriving->show_all();
  engine.in_memory = engine.coming == nullptr;
  if (engine.in_memory)
    return use_renderer(modar_renderer_create(engine.bundle, nullptr, 0, &engine.error), fixed);
  return use_renderer(std::exchange(engine.coming, nullptr), fixed);
}

/// Opens the bundle of web_arrive(), of which as much is there as that needs. 0, or the status of
/// an error.
EMSCRIPTEN_KEEPALIVE int web_open() {
  const auto bytes = engine.arriving->bytes();
  engine.bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), &engine.error);
  if (engine.bundle == nullptr) return engine.error.status;
  for (uint32_t p = 0; p < modar_pattern_count(engine.bundle); ++p)
    engine.copies = std::max(engine.copies, modar_pattern_copies(engine.bundle, p));
  const uint32_t poses = engine.copies * (modar_pattern_count(engine.bundle) + kMostOwn);
  engine.poses = new PoseFloats[poses]();
  engine.items = new modar_item[item_room()]();
  for (uint32_t i = 0; i < item_room(); ++i) engine.items[i].size = sizeof(modar_item);
  engine.events = new modar_event[poses + 1]();
  engine.videos = new GLuint[modar_node_count(engine.bundle)]();
  engine.screen = modar_screen_create(engine.bundle, &engine.error);
  return engine.screen == nullptr ? engine.error.status : 0;
}

/// Of the last function that failed. field: 0 code, 1 where, 2 cause, 3 cure.
EMSCRIPTEN_KEEPALIVE const char* web_error(int field) {
  const char* const fields[] = {engine.error.code, engine.error.where, engine.error.cause,
                                engine.error.cure};
  return fields[field];
}

EMSCRIPTEN_KEEPALIVE uint32_t web_pattern_count() {
  return modar_pattern_count(engine.bundle);
}
EMSCRIPTEN_KEEPALIVE uint32_t web_scene_count() {
  return modar_scene_count(engine.bundle);
}
EMSCRIPTEN_KEEPALIVE const char* web_pattern_name(uint32_t index) {
  modar_pattern_name(engine.bundle, index, engine.text, sizeof engine.text);
  return engine.text;
}
EMSCRIPTEN_KEEPALIVE const char* web_model_name(uint32_t index) {
  modar_model_name(engine.bundle, index, engine.text, sizeof engine.text);
  return engine.text;
}
EMSCRIPTEN_KEEPALIVE double web_pattern_width_mm(uint32_t index) {
  return modar_pattern_width_mm(engine.bundle, index);
}
/// The box of a pattern's content, in its space: least x, y, z, then greatest; 0 where nothing
/// does.
EMSCRIPTEN_KEEPALIVE const float* web_bounds(uint32_t pattern) {
  static float bounds[6];
  return modar_pattern_bounds(engine.bundle, baked_pattern(pattern), bounds, bounds + 3) != 0
             ? bounds
             : nullptr;
}
/// Which models are on which patterns. part: 0 pattern, 1 model.
EMSCRIPTEN_KEEPALIVE uint32_t web_scene(uint32_t index, int part) {
  auto scene = modar::sized<modar_scene>();
  modar_scene_at(engine.bundle, index, &scene);
  return part == 0 ? scene.pattern : scene.model;
}

/// The camera's frames have this size. focal: pixels; 0: the longer side, as for every unknown
/// camera.
EMSCRIPTEN_KEEPALIVE void web_camera(int width, int height, double focal) {
  modar_camera_default(width, height, &engine.camera);
  if (focal > 0) engine.camera.fx = engine.camera.fy = focal;
}
EMSCRIPTEN_KEEPALIVE double web_focal() {
  return engine.camera.fx;
}
EMSCRIPTEN_KEEPALIVE double web_focal_sigma() {
  return engine.focal_sigma;
}

/// Gives a further pattern a scene's model; scene: an index. Its number is the patterns' before.
EMSCRIPTEN_KEEPALIVE int web_stand(uint32_t scene) {
  if (engine.own_count == kMostOwn) return 0;
  engine.own[engine.own_count++].scene = scene;
  return modar_screen_add_pattern(engine.screen, scene);
}

/// Takes a record as a further pattern: tracked by the trackers of web_track() from then on.
EMSCRIPTEN_KEEPALIVE int web_add_pattern(const void* bytes, size_t size) {
  if (engine.own_count == kMostOwn) return MODAR_USAGE;
  modar_record* const record = modar_record_open(bytes, size, &engine.error);
  if (record == nullptr) return engine.error.status;
  if (engine.tracker != nullptr) {
    const int failed = modar_tracker_add_pattern(engine.tracker, record, nullptr, &engine.error);
    if (failed != 0) {
      modar_record_close(record);
      return failed;
    }
  }
  engine.own[engine.own_count++].record = record;
  return 0;
}

/// Forgets all further patterns, and their tracker.
EMSCRIPTEN_KEEPALIVE void web_forget_patterns() {
  for (; engine.own_count > 0; --engine.own_count) {
    modar_record_close(engine.own[engine.own_count - 1].record);
    engine.own[engine.own_count - 1] = {};
  }
  modar_screen_forget_patterns(engine.screen);
  modar_tracker_destroy(engine.tracker);
  engine.tracker = nullptr;
}

/// A tracker for web_camera(), in place of the one before. estimate_camera: 1 to estimate the focal
/// length from there. budget: millions of ARM instructions a frame, 0: no limit. extended: 1 to
/// continue from a pattern's surroundings.
EMSCRIPTEN_KEEPALIVE int web_track(int estimate_camera, int budget, int extended) {
  modar_tracker_destroy(engine.tracker);
  auto options = modar::sized<modar_tracker_options>();
  options.budget = budget;
  options.extended = extended;
  options.estimate_camera = estimate_camera;
  engine.tracker = modar_tracker_create(engine.bundle, &engine.camera, &options, &engine.error);
  if (engine.tracker == nullptr) return engine.error.status;
  for (uint32_t i = 0; i < engine.own_count; ++i) {
    modar_tracker_add_pattern(engine.tracker, engine.own[i].record, nullptr, nullptr);
  }
  return 0;
}
EMSCRIPTEN_KEEPALIVE void web_reset() {
  modar_tracker_reset(engine.tracker);
}

/// How the camera turned up to the next frame, radians, in its own axes.
EMSCRIPTEN_KEEPALIVE void web_turn(double x, double y, double z) {
  const double rotation[] = {x, y, z};
  modar_tracker_turn(engine.tracker, rotation);
}

/// The poses of a frame's patterns, then in web_poses(). gray: of web_camera()'s size.
EMSCRIPTEN_KEEPALIVE int web_step(const uint8_t* gray, size_t stride, double time_s) {
  const int failed = modar_tracker_step(engine.tracker, gray, stride, time_s, &engine.error);
  if (failed != 0) return failed;
  engine.focal_sigma = modar_tracker_camera(engine.tracker, &engine.camera);
  for (uint32_t p = 0; p < engine.copies * pose_row(); ++p) {
    auto pose = modar::sized<modar_pose>();
    modar_tracker_copy(engine.tracker, p % pose_row(), p / pose_row(), &pose);
    engine.poses[p] = modar::pose_floats(pose);
  }
  return 0;
}
EMSCRIPTEN_KEEPALIVE PoseFloats* web_poses() {
  return engine.poses;
}
EMSCRIPTEN_KEEPALIVE uint32_t web_copies() {
  return engine.copies;
}
EMSCRIPTEN_KEEPALIVE const char* web_reason() {
  return modar_reason_text(modar_tracker_reason(engine.tracker));
}

/// Gray in place of RGBA.
EMSCRIPTEN_KEEPALIVE void web_gray_from_rgba(uint8_t* pixels, int width, int height) {
  const modar_picture picture = rgba_picture(pixels, width, height);
  modar_gray(&picture, pixels, nullptr);
}
/// A gray picture of `factor` times the size becomes width x height, in place.
EMSCRIPTEN_KEEPALIVE void web_shrink(uint8_t* gray, size_t stride, int width, int height,
                                     int factor) {
  modar_shrink(gray, stride, width * factor, height * factor, factor, gray);
}
/// Luma of video (16 to 235) scaled to 0 to 255, as the player does.
EMSCRIPTEN_KEEPALIVE void web_widen_luma(uint8_t* gray, size_t count) {
  static uint8_t full[256];
  if (full[255] == 0) {
    for (int i = 0; i < 256; ++i) {
      const int value = ((i - 16) * static_cast<int>(255.0 / 219.0 * 65536 + 0.5) + 32768) >> 16;
      full[i] = static_cast<uint8_t>(value < 0 ? 0 : value > 255 ? 255 : value);
    }
  }
  for (size_t i = 0; i < count; ++i) gray[i] = full[gray[i]];
}
EMSCRIPTEN_KEEPALIVE double web_brightness(const uint8_t* gray, size_t stride) {
  return modar_brightness(gray, stride, engine.camera.width, engine.camera.height);
}

/// As modar_screen_touch(), modar_screen_press() and modar_screen_look_around().
EMSCRIPTEN_KEEPALIVE int web_touch(int kind, int finger, double x, double y, double width,
                                   double height) {
  const modar_touch touch = {sizeof touch, kind, finger, x, y, width, height};
  return modar_screen_touch(engine.screen, &touch);
}
EMSCRIPTEN_KEEPALIVE void web_press(int button, double steps) {
  modar_screen_press(engine.screen, button, steps);
}
EMSCRIPTEN_KEEPALIVE void web_look_around(uint32_t pattern, double time_s, int present) {
  modar_screen_look_around(engine.screen, pattern, time_s, present);
}
/// A frame with the poses in web_poses(), of which the tracker says that.
EMSCRIPTEN_KEEPALIVE void web_follow(double time_s, const char* reason_text, double brightness) {
  int reason = MODAR_REASON_AT_THE_EDGE;
  while (reason > 0 && std::strcmp(modar_reason_text(reason), reason_text) != 0) --reason;
  uint32_t shown = 0;
  const uint32_t poses = engine.copies * pose_row();
  while (shown < poses && engine.poses[shown].shown == 0.0f) ++shown;
  modar_screen_follow(engine.screen, time_s, shown < poses ? shown % pose_row() + 1 : 0, reason,
                      brightness);
}
/// Six numbers, as modar_status has them.
EMSCRIPTEN_KEEPALIVE const int* web_status() {
  static auto status = modar::sized<modar_status>();
  modar_screen_status(engine.screen, &status);
  return &status.state;
}
/// The visitor's eye on a pattern, without a camera, as web_camera() and web_poses().
EMSCRIPTEN_KEEPALIVE void web_orbit(uint32_t pattern, int width, int height, double time_s) {
  auto from = modar::sized<modar_turntable>();
  auto pose = modar::sized<modar_pose>();
  modar_screen_turntable(engine.screen, time_s, &from);
  engine.camera.width = width;
  engine.camera.height = height;
  modar_orbit(engine.bundle, baked_pattern(pattern), &from, &engine.camera, &pose);
  for (uint32_t p = 0; p < engine.copies * pose_row(); ++p) engine.poses[p].shown = 0;
  engine.poses[pattern].shown = 1;
  modar_view(&pose, engine.poses[pattern].view);
}

/// Draws the models of the poses in web_poses() into the canvas, transparent elsewhere, for a frame
/// of web_camera() that covers the canvas.
EMSCRIPTEN_KEEPALIVE void web_draw(int width, int height, int mirror) {
  glViewport(0, 0, width, height);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  const modar_drawing drawing = drawing_of(collect_items());
  const modar_surface surface = surface_of(width, height, mirror);
  modar_renderer_draw(engine.renderer, &surface, nullptr, &drawing);
}
/// The light on the patterns of web_poses(), as a copy of their frame shows it: RGBA.
EMSCRIPTEN_KEEPALIVE void web_look(const uint8_t* pixels, int width, int height) {
  const modar_picture picture = rgba_picture(pixels, width, height);
  const modar_drawing drawing = drawing_of(collect_items());
  modar_renderer_observe(engine.renderer, &picture, &drawing);
}
/// Names, marks and words of nodes. kind: 0 text, 1 description, 2 title, 3 name, 4 mark.
EMSCRIPTEN_KEEPALIVE const char* web_node_text(uint32_t node, int kind, const char* language) {
  size_t length = 0;
  if (kind == 3) {
    length = modar_node_name(engine.bundle, node, engine.text, sizeof engine.text);
  } else if (kind == 4) {
    length = modar_node_mark(engine.bundle, node, engine.text, sizeof engine.text);
  } else {
    length = modar_node_text(engine.bundle, node, kind, language, engine.text, sizeof engine.text);
  }
  if (length == 0) engine.text[0] = '\0';
  return engine.text;
}
/// Of a video or sound: a WebVTT file, "" if none in the language.
EMSCRIPTEN_KEEPALIVE const char* web_captions(uint32_t node, const char* language) {
  static char* captions = nullptr;
  const size_t length = modar_node_text(engine.bundle, node, MODAR_CAPTIONS, language, nullptr, 0);
  std::free(captions);
  captions = static_cast<char*>(std::malloc(length + 1));
  if (captions == nullptr) return "";
  captions[0] = '\0';
  modar_node_text(engine.bundle, node, MODAR_CAPTIONS, language, captions, length + 1);
  return captions;
}
EMSCRIPTEN_KEEPALIVE const char* web_language(uint32_t index) {
  if (modar_language(engine.bundle, index, engine.text, sizeof engine.text) == 0) return nullptr;
  return engine.text;
}
EMSCRIPTEN_KEEPALIVE uint32_t web_node_count() {
  return modar_node_count(engine.bundle);
}
/// part: 0 pattern, 1 kind, 2 whether a video or sound loops, 3 number of its file.
EMSCRIPTEN_KEEPALIVE uint32_t web_node(uint32_t index, int part) {
  auto node = modar::sized<modar_node>();
  modar_node_at(engine.bundle, index, &node);
  const uint32_t parts[] = {node.pattern, static_cast<uint32_t>(node.kind),
                            static_cast<uint32_t>(node.loops), node.media};
  return parts[part];
}
/// The bytes of a video's or sound's file, and how many they are.
EMSCRIPTEN_KEEPALIVE const uint8_t* web_media(uint32_t node) {
  auto media = modar::sized<modar_media>();
  modar_media_at(engine.bundle, web_node(node, 3) - 1, &media);
  return media.bytes;
}
EMSCRIPTEN_KEEPALIVE size_t web_media_size(uint32_t node) {
  auto media = modar::sized<modar_media>();
  modar_media_at(engine.bundle, web_node(node, 3) - 1, &media);
  return media.byte_count;
}
/// A new texture that a video shows from now on; the page fills it.
EMSCRIPTEN_KEEPALIVE GLuint web_video_texture(uint32_t node) {
  glGenTextures(1, &engine.videos[node]);
  modar_renderer_set_video(engine.renderer, node, engine.videos[node]);
  return engine.videos[node];
}
EMSCRIPTEN_KEEPALIVE const char* web_address(uint32_t action) {
  modar_action_address(engine.bundle, action, engine.text, sizeof engine.text);
  return engine.text;
}

/// A step of the actions, for the poses in web_poses(). kind: MODAR_TAP or MODAR_ENDED of a node,
/// or -1; material: number of the tapped node, or 0. Answers how many commands web_command()
/// has.
EMSCRIPTEN_KEEPALIVE size_t web_act(double time_s, int kind, uint32_t node, uint32_t material) {
  size_t count = 0;
  engine.events[0].size = sizeof(modar_event);
  for (uint32_t p = 0; p < engine.copies * pose_row(); ++p) {
    if (engine.poses[p].shown == 0.0f) continue;
    engine.events[count++] = {sizeof(modar_event), MODAR_SEEN, p % pose_row(), 0, 0};
  }
  if (kind >= 0) engine.events[count++] = {sizeof(modar_event), kind, node, material, 0};
  return modar_screen_step(engine.screen, time_s, engine.events, count);
}
/// field: 0 kind, 1 node, 2 action.
EMSCRIPTEN_KEEPALIVE uint32_t web_command(size_t index, int field) {
  auto command = modar::sized<modar_command>();
  modar_screen_command(engine.screen, index, &command);
  return field == 0   ? static_cast<uint32_t>(command.kind)
         : field == 1 ? command.node
                      : command.action;
}
/// Of clips: a name, null: no more; seconds.
EMSCRIPTEN_KEEPALIVE const char* web_clip_name(uint32_t index) {
  if (modar_clip_name(engine.bundle, index, engine.text, sizeof engine.text) == 0) return nullptr;
  return engine.text;
}
EMSCRIPTEN_KEEPALIVE double web_clip_seconds(uint32_t index) {
  auto clip = modar::sized<modar_clip>();
  modar_clip_at(engine.bundle, index, &clip);
  return static_cast<double>(clip.seconds);
}
/// As modar_clip_play(), modar_clip_stop() and modar_clip_playing().
EMSCRIPTEN_KEEPALIVE void web_play(uint32_t scene, uint32_t clip, int loops, double blend_s) {
  modar_clip_play(engine.screen, scene, clip, loops, blend_s);
}
EMSCRIPTEN_KEEPALIVE void web_stop(uint32_t scene) {
  modar_clip_stop(engine.screen, scene);
}
EMSCRIPTEN_KEEPALIVE uint32_t web_playing(uint32_t scene) {
  return modar_clip_playing(engine.screen, scene);
}
EMSCRIPTEN_KEEPALIVE int web_acting() {
  return modar_screen_waiting(engine.screen);
}
/// Videos show their posters again.
EMSCRIPTEN_KEEPALIVE void web_forget_acts() {
  modar_screen_reset(engine.screen);
  for (uint32_t node = 0; node < modar_node_count(engine.bundle); ++node) {
    if (engine.videos[node] == 0) continue;
    modar_renderer_set_video(engine.renderer, node, 0);
    glDeleteTextures(1, &engine.videos[node]);
    engine.videos[node] = 0;
  }
}

/// The node under a pixel of the canvas, in the last drawing: node, and the number of the
/// material there; nullptr where no node does.
EMSCRIPTEN_KEEPALIVE const uint32_t* web_pick(int width, int height, int mirror, double x,
                                              double y) {
  static uint32_t found[2];
  const modar_surface surface = surface_of(width, height, mirror);
  modar_surface_to_frame(&surface, &engine.camera, x, y, &x, &y);
  auto hit = modar::sized<modar_hit>();
  const modar_drawing drawing = drawing_of(engine.item_count);
  const int met = with_triangles([&] { return modar_pick(engine.bundle, &drawing, x, y, &hit); });
  if (met == 0) return nullptr;
  if (engine.items[hit.item].node == 0) return nullptr;
  found[0] = engine.items[hit.item].node - 1;
  found[1] = hit.material;
  return found;
}

/// Where a label is on the canvas: x, y and whether something is before it (looked at where
/// `look` is 1); nullptr where it is not shown.
EMSCRIPTEN_KEEPALIVE const float* web_label(uint32_t node, int width, int height, int mirror,
                                            int look) {
  static float place[3];
  uint32_t at = web_node(node, 0);  // of the first copy that is shown
  while (engine.poses[at].shown == 0.0f && at + pose_row() < engine.copies * pose_row())
    at += pose_row();
  const PoseFloats& pose = engine.poses[at];
  auto label = modar::sized<modar_label>();
  const modar_drawing drawing = drawing_of(look != 0 ? engine.item_count : 0);
  if (pose.shown == 0.0f) return nullptr;
  const int seen = with_triangles(
      [&] { return modar_label_project(engine.screen, node, &drawing, pose.view, &label); });
  if (seen == 0) return nullptr;
  // The frame covers the canvas, its middle in the middle; pixels' centres are whole numbers.
  const double scale = std::fmax(static_cast<double>(width) / engine.camera.width,
                                 static_cast<double>(height) / engine.camera.height);
  const double across = (static_cast<double>(label.x) + 0.5 - engine.camera.width / 2.0) * scale;
  const double down = (static_cast<double>(label.y) + 0.5 - engine.camera.height / 2.0) * scale;
  place[0] = static_cast<float>(width / 2.0 + (mirror != 0 ? -across : across));
  place[1] = static_cast<float>(height / 2.0 + down);
  place[2] = static_cast<float>(label.covered);
  return place;
}

/// Of the last drawing.
EMSCRIPTEN_KEEPALIVE uint32_t web_triangles() {
  modar_render_stats stats{};
  stats.size = sizeof(stats);
  modar_renderer_stats(engine.renderer, &stats);
  return static_cast<uint32_t>(stats.triangles);
}
EMSCRIPTEN_KEEPALIVE double web_gpu_bytes() {
  return static_cast<double>(modar_renderer_gpu_bytes(engine.renderer));
}

}  // extern "C"
