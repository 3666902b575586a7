// org.modar.Native over the C API: camera frames in, matrices out, drawing on GLSurfaceView's
// thread. A frame costs no copy, no allocation and no reference that outlives the call.
#include "runtime/extensions/android/bridge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/base/utf8.hpp"
#include "modar/camera.hpp"
#include "modar/pose_floats.hpp"

namespace modar::android {

namespace {

/// Share of the focal length below which its spread makes it worth keeping for the next start, as
/// on the page.
constexpr double kKnownFocal = 0.03;

/// A caller's mistake, exit code 1.
void misuse(JNIEnv* env, const char* code, const char* where, const char* cause, const char* cure) {
  throw_error(env, 1, code, where, cause, cure);
}

// --- Sessions ---

/// A picture of the visitor's own, after the bundle's patterns.
using OwnRecord = std::unique_ptr<modar_record, decltype(&modar_record_close)>;

/// A bundle with the objects made from it. The camera's thread tracks while GL's thread draws.
struct Session {
  std::mutex tracking;  ///< holds tracker
  std::mutex drawing;   ///< holds renderer, surfaces, screen, events, items
  // Both guards to write, either to read:
  modar_bundle* bundle = nullptr;  ///< null once it is closed
  std::vector<OwnRecord> own;
  std::uint32_t copies = 1;                            ///< most of a pattern
  modar_camera camera = modar::sized<modar_camera>();  ///< width 0: not known yet
  modar_tracker* tracker = nullptr;
  modar_renderer* renderer = nullptr;
  modar_surface surface = modar::sized<modar_surface>();
  modar_surface drawn_surface =
      modar::sized<modar_surface>();  ///< the places of the items on the screen,
  modar_camera drawn_camera = modar::sized<modar_camera>();  ///< width 0: nothing drawn yet
  modar_screen* screen = nullptr;
  std::vector<modar_event> events;  ///< taps since the last frame, then its detections
  std::vector<modar_item> items;
  std::size_t item_count = 0;  ///< that were drawn last
  int reason = 0;              ///< of the newest frame, as modar_tracker_reason()
  double brightness = 0;       ///< of it
  bool alone = true;           ///< nothing but the renderer draws in GLSurfaceView's context
  std::vector<float> poses;    ///< on which these stand, as org.modar.Poses has them

  /// The bundle's patterns, then the visitor's own.
  [[nodiscard]] std::uint32_t patterns() const {
    return modar_pattern_count(bundle) + static_cast<std::uint32_t>(own.size());
  }
  /// Those of the patterns, then of their second copies, and so on.
  [[nodiscard]] std::uint32_t pose_count() const { return copies * patterns(); }
};

/// Java holds numbers that are never given twice: a closed one is found nowhere.
struct Sessions {
  struct Entry {
    jlong number = 0;
    std::shared_ptr<Session> session;
  };
  std::mutex guard;
  jlong last = 0;
  std::vector<Entry> entries;

  jlong add(std::shared_ptr<Session> session) {
    const std::lock_guard lock(guard);
    entries.push_back({++last, std::move(session)});
    return last;
  }

  std::shared_ptr<Session> find(jlong number) {
    const std::lock_guard lock(guard);
    for (const Entry& entry : entries) {
      if (entry.number == number) return entry.session;
    }
    return nullptr;
  }

  std::shared_ptr<Session> take(jlong number) {
    const std::lock_guard lock(guard);
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (entries[i].number != number) continue;
      std::shared_ptr<Session> session = std::move(entries[i].session);
      entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(i));
      return session;
    }
    return nullptr;
  }
};

Sessions& sessions() {
  static Sessions all;
  return all;
}

/// A session that nobody closes while this lives, with one of its guards held. Where the number
/// names none, it is empty and Java has an exception.
class Use {
 public:
  Use(JNIEnv* env, jlong number, std::mutex Session::*guard) : session_(sessions().find(number)) {
    if (session_) {
      lock_ = std::unique_lock(session_.get()->*guard);
      if (session_->bundle != nullptr) return;
      lock_.unlock();
      session_.reset();
    }
    misuse(env, "android.closed", "session", "it was closed, or never opened",
           "open the bundle again");
  }

  explicit operator bool() const { return session_ != nullptr; }
  Session* operator->() const { return session_.get(); }
  Session& operator*() const { return *session_; }

 private:
  std::shared_ptr<Session> session_;
  std::unique_lock<std::mutex> lock_;
};

jlong opened(JNIEnv* env, modar_bundle* bundle, const modar_error& error) {
  if (bundle == nullptr) {
    throw_error(env, error);
    return 0;
  }
  auto session = std::make_shared<Session>();
  session->bundle = bundle;
  session->screen = modar_screen_create(bundle, nullptr);
  auto media = modar::sized<modar_media>();
  session->alone = modar_media_at(bundle, 0, &media) == 0;
  for (std::uint32_t p = 0; p < modar_pattern_count(bundle); ++p)
    session->copies = std::max(session->copies, modar_pattern_copies(bundle, p));
  session->items.resize(
      session->copies * (modar_scene_count(bundle) + modar_node_count(bundle)) + 1,
      modar::sized<modar_item>());
  return sessions().add(std::move(session));
}

/// UTF-8 as a Java string. JNI's own function takes another encoding, without emoji.
jstring java_text(JNIEnv* env, std::string_view text) {
  std::u16string utf16;
  while (!text.empty()) {
    const std::size_t size = modar::utf8_character(text);
    std::uint32_t point = static_cast<unsigned char>(text[0]);
    if (size == 0) point = 0xFFFD;
    if (size > 1) point &= 0x7Fu >> size;
    for (std::size_t i = 1; i < size; ++i) {
      point = point << 6 | (static_cast<unsigned char>(text[i]) & 0x3Fu);
    }
    if (point >= 0x10000) {
      utf16 += static_cast<char16_t>(0xD7C0 + (point >> 10));
      point = 0xDC00 + (point & 0x3FF);
    }
    utf16 += static_cast<char16_t>(point);
    text.remove_prefix(size == 0 ? 1 : size);
  }
  return env->NewString(reinterpret_cast<const jchar*>(utf16.data()),
                        static_cast<jsize>(utf16.size()));
}

/// The name of an index, by strlcpy's contract.
jstring name_of(JNIEnv* env, jlong number, jint index,
                size_t (*name)(const modar_bundle*, uint32_t, char*, size_t)) {
  const Use session(env, number, &Session::tracking);
  std::array<char, 256> text{};
  if (!session) return nullptr;
  if (index < 0 ||
      name(session->bundle, static_cast<std::uint32_t>(index), text.data(), text.size()) == 0) {
    misuse(env, "android.index", "index", "the bundle has nothing with that number", "count first");
    return nullptr;
  }
  return java_text(env, text.data());
}

// --- Pixels and poses ---

using modar::kPoseFloats;
constexpr std::size_t kView = offsetof(modar::PoseFloats, view) / sizeof(float);
constexpr std::size_t kShown = offsetof(modar::PoseFloats, shown) / sizeof(float);

/// A direct buffer of at least `size` bytes, or null and an exception.
void* direct(JNIEnv* env, jobject buffer, std::size_t size, const char* what) {
  void* const address = buffer == nullptr ? nullptr : env->GetDirectBufferAddress(buffer);
  if (address == nullptr) {
    misuse(env, "android.buffer", what, "it is not a direct buffer",
           "use ByteBuffer.allocateDirect");
    return nullptr;
  }
  const jlong capacity = env->GetDirectBufferCapacity(buffer);
  if (capacity < 0 || static_cast<std::uint64_t>(capacity) < size) {
    misuse(env, "android.buffer", what, "it is too small", "see the sizes in Native.java");
    return nullptr;
  }
  return address;
}

float* pose_buffer(JNIEnv* env, const Session& session, jobject buffer) {
  const std::size_t size = session.pose_count() * kPoseFloats * sizeof(float);
  auto* floats = static_cast<float*>(direct(env, buffer, size, "poses"));
  if (reinterpret_cast<std::uintptr_t>(floats) % alignof(float) == 0) return floats;
  misuse(env, "android.buffer", "poses", "it is not aligned", "use the whole of a direct buffer");
  return nullptr;
}

/// The bytes of a Java array while this lives. ART and Dalvik hand out arrays as large as frames in
/// place; a VM that moves them copies.
class ArrayBytes {
 public:
  ArrayBytes(JNIEnv* env, jbyteArray array, std::size_t size) : env_(env), array_(array) {
    if (array == nullptr || static_cast<std::size_t>(env->GetArrayLength(array)) < size) {
      misuse(env, "android.buffer", "nv21", array == nullptr ? "it is null" : "it is too small",
             "pass width * height * 3 / 2 bytes");
      return;
    }
    bytes_ = env->GetByteArrayElements(array, nullptr);
  }
  ArrayBytes(const ArrayBytes&) = delete;
  ArrayBytes& operator=(const ArrayBytes&) = delete;
  ~ArrayBytes() {
    if (bytes_ != nullptr) env_->ReleaseByteArrayElements(array_, bytes_, JNI_ABORT);
  }
  [[nodiscard]] const std::uint8_t* get() const {
    return reinterpret_cast<const std::uint8_t*>(bytes_);
  }

 private:
  JNIEnv* env_;
  jbyteArray array_;
  jbyte* bytes_ = nullptr;
};

/// False and an exception where setCamera() was not called.
bool has_camera(JNIEnv* env, const Session& session) {
  if (session.camera.width > 0) return true;
  misuse(env, "android.camera", "session", "the size of the camera's frames is not known",
         "call setCamera first");
  return false;
}

std::size_t luma_bytes(const modar_camera& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

/// Bytes that rows of `width` take, the last one without its padding.
std::size_t plane_bytes(int stride, int width, int height) {
  return static_cast<std::size_t>(stride) * static_cast<std::size_t>(height - 1) +
         static_cast<std::size_t>(width);
}

/// A vector in the axes of Android's sensors (x right and y up on the phone in its natural
/// orientation, z towards the viewer) in those of a camera (x right, y down, z forward) whose
/// frames are upright there when they are turned clockwise by `degrees`. front: on the screen's
/// side, not mirrored.
std::array<double, 3> frame_axes(const std::array<double, 3>& phone, int degrees, bool front) {
  const double right = front ? -phone[0] : phone[0];
  const double down = -phone[1];
  const double forward = front ? phone[2] : -phone[2];
  switch (degrees) {
    case 90:
      return {down, -right, forward};
    case 180:
      return {-right, -down, forward};
    case 270:
      return {-down, right, forward};
    default:
      return {right, down, forward};
  }
}

/// Tracks a frame and writes the poses of all patterns; answers how many are visible.
jint track(JNIEnv* env, Session& session, const std::uint8_t* luma, std::size_t stride,
           double time_s, float* poses) {
  auto error = modar::sized<modar_error>();
  if (modar_tracker_step(session.tracker, luma, stride, time_s, &error) != 0) {
    throw_error(env, error);
    return 0;
  }
  {
    const std::lock_guard drawing(session.drawing);
    modar_tracker_camera(session.tracker, &session.camera);
    session.reason = modar_tracker_reason(session.tracker);
    session.brightness =
        modar_brightness(luma, stride, session.camera.width, session.camera.height);
  }
  jint visible = 0;
  const std::uint32_t patterns = session.patterns();
  for (std::uint32_t i = 0; i < session.pose_count(); ++i, poses += kPoseFloats) {
    auto pose = modar::sized<modar_pose>();
    visible += modar_tracker_copy(session.tracker, i % patterns, i / patterns, &pose);
    const modar::PoseFloats floats = modar::pose_floats(pose);
    std::memcpy(poses, &floats, sizeof floats);
  }
  return visible;
}

jintArray java_words(JNIEnv* env, const std::vector<jint>& words) {
  const auto size = static_cast<jsize>(words.size());
  const jintArray array = env->NewIntArray(size);
  if (array != nullptr) env->SetIntArrayRegion(array, 0, size, words.data());
  return array;
}

void add_event(JNIEnv* env, jlong number, int kind, jint node) {
  const Use session(env, number, &Session::drawing);
  if (!session) return;
  session->events.push_back({sizeof(modar_event), kind, static_cast<std::uint32_t>(node), 0, 0});
}

/// Runs the bundle's actions; answers how many commands they give.
std::size_t act(Session& session, double time_s, const float* poses) {
  std::uint32_t first = 0;
  for (std::uint32_t p = session.pose_count(); p-- > 0;) {
    if (poses[p * kPoseFloats + kShown] == 0) continue;
    session.events.push_back(modar::sized<modar_event>());
    session.events.back().subject = p % session.patterns();
    first = session.events.back().subject + 1;
  }
  modar_screen_follow(session.screen, time_s, first, session.reason, session.brightness);
  const std::size_t commands =
      modar_screen_step(session.screen, time_s, session.events.data(), session.events.size());
  session.events.clear();
  return commands;
}

/// A text of the bundle by strlcpy's contract, or null. copy(bundle, text, size): answers its
/// length.
template <class Copy>
jstring text_or_null(JNIEnv* env, jlong number, const Copy& copy) {
  const Use session(env, number, &Session::tracking);
  const std::size_t size = session ? copy(session->bundle, nullptr, std::size_t{0}) : 0;
  if (size == 0) return nullptr;
  std::string text(size + 1, '\0');
  copy(session->bundle, text.data(), text.size());
  return java_text(env, text.c_str());
}

/// The content of the patterns that are shown.
void place_items(Session& session, const float* poses) {
  session.item_count = 0;
  session.poses.assign(poses, poses + session.pose_count() * kPoseFloats);
  for (std::uint32_t p = 0; p < session.pose_count(); ++p, poses += kPoseFloats) {
    if (poses[kShown] == 0) continue;
    session.item_count += modar_screen_items(session.screen, p % session.patterns(), poses + kView,
                                             session.items.data() + session.item_count,
                                             session.items.size() - session.item_count);
  }
}

/// The first `count` items of the last drawing.
modar_drawing drawing_of(const Session& session, std::size_t count) {
  return {sizeof(modar_drawing), &session.drawn_camera, nullptr, session.items.data(), count};
}

void draw_items(Session& session, const modar_surface& surface, const modar_camera& camera,
                const modar_picture* picture) {
  session.drawn_surface = surface;
  session.drawn_camera = camera;
  const modar_drawing drawing = drawing_of(session, session.item_count);
  modar_renderer_draw(session.renderer, &surface, picture, &drawing);
}

void draw(Session& session, const modar_picture* picture, const float* poses) {
  place_items(session, poses);
  draw_items(session, session.surface, session.camera, picture);
}

/// The content of a pattern, from an eye that fingers move around it.
void draw_orbit(Session& session, std::uint32_t pattern, double time_s) {
  auto surface = session.surface;
  surface.rotation = surface.mirror = 0;
  auto camera = modar::sized<modar_camera>();
  camera.width = surface.width;
  camera.height = surface.height;
  auto from = modar::sized<modar_turntable>();
  auto pose = modar::sized<modar_pose>();
  if (modar_screen_turntable(session.screen, time_s, &from) == 0) return;
  if (modar_orbit(session.bundle, pattern, &from, &camera, &pose) == 0) return;
  std::vector<float> poses(session.pose_count() * kPoseFloats, 0.0f);
  poses[pattern * kPoseFloats + kShown] = 1;
  modar_view(&pose, poses.data() + pattern * kPoseFloats + kView);
  place_items(session, poses.data());
  draw_items(session, surface, camera, nullptr);
}

/// A pixel of the frame that was drawn last to one of the screen, from its top left.
std::array<float, 2> on_screen(const Session& session, double x, double y) {
  std::array<double, 6> at{};  // the screen's pixels (0, 0), (1, 0) and (0, 1) in the frame
  for (std::size_t i = 0; i < 3; ++i) {
    modar_surface_to_frame(&session.drawn_surface, &session.drawn_camera, i == 1 ? 1.0 : 0.0,
                           i == 2 ? 1.0 : 0.0, &at[2 * i], &at[2 * i + 1]);
  }
  const double xx = at[2] - at[0];
  const double yx = at[3] - at[1];
  const double xy = at[4] - at[0];
  const double yy = at[5] - at[1];
  const double area = xx * yy - xy * yx;
  x -= at[0];
  y -= at[1];
  return {static_cast<float>((yy * x - xy * y) / area),
          static_cast<float>((xx * y - yx * x) / area)};
}

void set_options(const Session& session) {
  auto options = modar::sized<modar_render_options>();
  modar_render_options_default(&options);
  options.exclusive = session.alone ? 1 : 0;
  modar_renderer_set_options(session.renderer, &options);
}

/// False and an exception where there is no renderer or no surface yet.
bool can_draw(JNIEnv* env, const Session& session) {
  if (session.renderer != nullptr && session.surface.width > 0) return true;
  misuse(env, "android.surface", "session", "there is nothing to draw on yet",
         "call onSurfaceCreated and onSurfaceChanged first");
  return false;
}

/// The chroma of an Image in YUV_420_888. False and an exception where the planes are too small.
bool chroma_planes(JNIEnv* env, modar_picture& picture, jobject u_buffer, jobject v_buffer,
                   jint stride, jint pixel_stride) {
  const int width = picture.width / 2;
  const int height = picture.height / 2;
  if ((pixel_stride != 1 && pixel_stride != 2) || stride < width * pixel_stride) {
    misuse(env, "android.planes", "chroma", "these strides are invalid for YUV_420_888",
           "pass those of the Image's planes");
    return false;
  }
  const std::size_t size = plane_bytes(stride, (width - 1) * pixel_stride + 1, height);
  const auto* u = static_cast<const std::uint8_t*>(direct(env, u_buffer, size, "u"));
  if (u == nullptr) return false;
  const auto* v = static_cast<const std::uint8_t*>(direct(env, v_buffer, size, "v"));
  if (v == nullptr) return false;
  picture.strides[1] = picture.strides[2] = stride;
  picture.format = MODAR_YUV_420_888;
  picture.planes[1] = u;
  picture.planes[2] = v;
  picture.chroma_step = pixel_stride;
  return true;
}

}  // namespace
}  // namespace modar::android

// --- org.modar.Native ---

using namespace modar::android;

#define MODAR_NATIVE(type, name) extern "C" JNIEXPORT type JNICALL Java_org_modar_Native_##name

MODAR_NATIVE(jint, version)(JNIEnv*, jclass) {
  return static_cast<jint>(modar_version());
}

MODAR_NATIVE(jlong, openFd)(JNIEnv* env, jclass, jint fd, jlong offset, jlong length) {
  auto error = modar::sized<modar_error>();
  return opened(env, modar_bundle_open_fd(fd, offset, length, &error), error);
}

MODAR_NATIVE(jlong, openFile)(JNIEnv* env, jclass, jstring path) {
  auto error = modar::sized<modar_error>();
  return opened(env, modar_bundle_open(text_of(env, path).c_str(), &error), error);
}

MODAR_NATIVE(void, close)(JNIEnv*, jclass, jlong number) {
  const std::shared_ptr<Session> session = sessions().take(number);
  if (!session) return;  // closing twice is fine
  const std::scoped_lock both(session->tracking, session->drawing);
  modar_tracker_destroy(std::exchange(session->tracker, nullptr));
  modar_renderer_destroy(std::exchange(session->renderer, nullptr));
  modar_screen_destroy(std::exchange(session->screen, nullptr));
  modar_bundle_close(std::exchange(session->bundle, nullptr));
}

MODAR_NATIVE(void, verify)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  auto error = modar::sized<modar_error>();
  if (session && modar_bundle_verify(session->bundle, &error) != 0) throw_error(env, error);
}

MODAR_NATIVE(jint, patternCount)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  return session ? static_cast<jint>(session->patterns()) : 0;
}

MODAR_NATIVE(jint, poseCount)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  return session ? static_cast<jint>(session->pose_count()) : 0;
}

MODAR_NATIVE(jstring, patternName)(JNIEnv* env, jclass, jlong number, jint index) {
  return name_of(env, number, index, modar_pattern_name);
}

MODAR_NATIVE(jstring, modelName)(JNIEnv* env, jclass, jlong number, jint index) {
  return name_of(env, number, index, modar_model_name);
}

MODAR_NATIVE(jstring, language)(JNIEnv* env, jclass, jlong number, jint index) {
  return text_or_null(env, number, [&](const auto* bundle, char* text, std::size_t size) {
    return modar_language(bundle, static_cast<std::uint32_t>(index), text, size);
  });
}

MODAR_NATIVE(jstring, patternText)
(JNIEnv* env, jclass, jlong number, jint pattern, jboolean alternative, jstring language) {
  const std::string tag = text_of(env, language);
  const int kind = alternative != 0 ? MODAR_ALT_TEXT : MODAR_TEXT;
  return text_or_null(env, number, [&](const auto* bundle, char* text, std::size_t size) {
    const auto index = static_cast<std::uint32_t>(pattern);
    return modar_pattern_text(bundle, index, kind, tag.c_str(), text, size);
  });
}

MODAR_NATIVE(void, setCamera)
(JNIEnv* env, jclass, jlong number, jint width, jint height, jstring file, jdouble focal,
 jboolean search_apart, jboolean extended) {
  const std::string path = text_of(env, file);
  const Use session(env, number, &Session::tracking);
  if (!session) return;
  auto error = modar::sized<modar_error>();
  auto camera = modar::sized<modar_camera>();
  modar_camera_default(width, height, &camera);
  if (focal > 0.0) camera.fx = camera.fy = focal * std::max(width, height);
  if (!path.empty()) {
    if (modar_camera_read(path.c_str(), &camera, &error) != 0) return throw_error(env, error);
    modar::Camera lens{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, {}};
    if (lens.width > 0 && lens.height > 0 && width > 0 && height > 0) {
      lens = modar::scaled_camera(lens, width, height);
    }
    camera.width = width;
    camera.height = height;
    camera.fx = lens.fx;
    camera.fy = lens.fy;
    camera.cx = lens.cx;
    camera.cy = lens.cy;
  }
  auto options = modar::sized<modar_tracker_options>();
  options.async_search = search_apart ? 1 : 0;
  options.extended = extended ? 1 : 0;
  options.estimate_camera = path.empty() ? 1 : 0;
  modar_tracker* tracker = modar_tracker_create(session->bundle, &camera, &options, &error);
  if (tracker == nullptr) return throw_error(env, error);
  modar_tracker_destroy(std::exchange(session->tracker, tracker));
  for (const OwnRecord& own : session->own) {
    if (modar_tracker_add_pattern(tracker, own.get(), nullptr, &error) != 0) {
      return throw_error(env, error);
    }
  }
  const std::lock_guard drawing(session->drawing);
  session->camera = camera;
}

MODAR_NATIVE(void, addPattern)
(JNIEnv* env, jclass, jlong number, jbyteArray bytes, jint scene) {
  const Use session(env, number, &Session::tracking);
  if (!session) return;
  const ArrayBytes record(env, bytes, 1);
  if (record.get() == nullptr) return;
  auto error = modar::sized<modar_error>();
  auto asked = modar::sized<modar_scene>();
  if (scene < 0 ||
      modar_scene_at(session->bundle, static_cast<std::uint32_t>(scene), &asked) == 0) {
    return misuse(env, "android.index", "scene", "the bundle has nothing with that number",
                  "count first");
  }
  OwnRecord own{
      modar_record_open(record.get(), static_cast<std::size_t>(env->GetArrayLength(bytes)), &error),
      modar_record_close};
  if (own == nullptr) return throw_error(env, error);
  const std::lock_guard drawing(session->drawing);
  // Made anew by setCamera(), with this one.
  modar_tracker_destroy(std::exchange(session->tracker, nullptr));
  session->camera = modar::sized<modar_camera>();
  session->own.push_back(std::move(own));
  modar_screen_add_pattern(session->screen, static_cast<std::uint32_t>(scene));
  session->items.emplace_back(modar::sized<modar_item>());
}

MODAR_NATIVE(jint, sceneModel)(JNIEnv* env, jclass, jlong number, jint index) {
  const Use session(env, number, &Session::tracking);
  auto scene = modar::sized<modar_scene>();
  if (!session || index < 0 ||
      modar_scene_at(session->bundle, static_cast<std::uint32_t>(index), &scene) == 0) {
    return -1;
  }
  return static_cast<jint>(scene.model);
}

MODAR_NATIVE(jdouble, focal)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  if (!session || session->tracker == nullptr) return 0;
  auto camera = modar::sized<modar_camera>();
  const double sigma = modar_tracker_camera(session->tracker, &camera);
  if (sigma <= 0.0 || sigma >= kKnownFocal * camera.fx) return 0;
  return camera.fx / std::max(camera.width, camera.height);
}

MODAR_NATIVE(void, onTurn)
(JNIEnv* env, jclass, jlong number, jdouble x, jdouble y, jdouble z, jint degrees, jboolean front) {
  const Use session(env, number, &Session::tracking);
  if (!session || !has_camera(env, *session)) return;
  const std::array<double, 3> rotation = frame_axes({x, y, z}, degrees, front != 0);
  modar_tracker_turn(session->tracker, rotation.data());
}

MODAR_NATIVE(jint, onCameraFrame)
(JNIEnv* env, jclass, jlong number, jbyteArray nv21, jdouble time_s, jobject poses) {
  const Use session(env, number, &Session::tracking);
  if (!session || !has_camera(env, *session)) return 0;
  float* const out = pose_buffer(env, *session, poses);
  if (out == nullptr) return 0;
  const ArrayBytes frame(env, nv21, luma_bytes(session->camera));
  if (frame.get() == nullptr) return 0;
  return track(env, *session, frame.get(), static_cast<std::size_t>(session->camera.width), time_s,
               out);
}

MODAR_NATIVE(jint, onCameraPlane)
(JNIEnv* env, jclass, jlong number, jobject luma, jint stride, jdouble time_s, jobject poses) {
  const Use session(env, number, &Session::tracking);
  if (!session || !has_camera(env, *session)) return 0;
  float* const out = pose_buffer(env, *session, poses);
  if (out == nullptr) return 0;
  const modar_camera& camera = session->camera;
  if (stride < camera.width) {
    misuse(env, "android.planes", "luma", "its rows are shorter than the frame",
           "pass the plane's own stride");
    return 0;
  }
  const auto* bytes = static_cast<const std::uint8_t*>(
      direct(env, luma, plane_bytes(stride, camera.width, camera.height), "luma"));
  if (bytes == nullptr) return 0;
  return track(env, *session, bytes, static_cast<std::size_t>(stride), time_s, out);
}

MODAR_NATIVE(jstring, reason)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  if (!session || !has_camera(env, *session)) return nullptr;
  return env->NewStringUTF(modar_reason_text(modar_tracker_reason(session->tracker)));
}

MODAR_NATIVE(void, reset)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  if (session && session->tracker != nullptr) modar_tracker_reset(session->tracker);
}

MODAR_NATIVE(void, trim)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::tracking);
  if (session) modar_tracker_destroy(std::exchange(session->tracker, nullptr));
}

MODAR_NATIVE(void, projection)
(JNIEnv* env, jclass, jlong number, jdouble near_plane, jdouble far_plane, jobject matrix) {
  const Use session(env, number, &Session::tracking);
  if (!session || !has_camera(env, *session)) return;
  std::array<float, 16> projection{};
  void* const out = direct(env, matrix, sizeof projection, "matrix");
  if (out == nullptr) return;
  modar_projection(&session->camera, near_plane, far_plane, projection.data());
  std::memcpy(out, projection.data(), sizeof projection);
}

MODAR_NATIVE(void, onSurfaceCreated)
(JNIEnv* env, jclass, jlong number, jstring device) {
  const std::string profile = text_of(env, device);
  const Use session(env, number, &Session::drawing);
  if (!session) return;
  auto error = modar::sized<modar_error>();
  if (session->renderer != nullptr) {
    // A second surface means that the context was lost with all that was in it.
    if (modar_renderer_restore(session->renderer, &error) != 0) throw_error(env, error);
    return;
  }
  session->renderer = modar_renderer_create(session->bundle,
                                            profile.empty() ? nullptr : profile.c_str(), 0, &error);
  if (session->renderer == nullptr) return throw_error(env, error);
  set_options(*session);
}

MODAR_NATIVE(void, onSurfaceChanged)
(JNIEnv* env, jclass, jlong number, jint width, jint height, jint rotation, jboolean mirror) {
  const Use session(env, number, &Session::drawing);
  if (!session) return;
  auto surface = modar::sized<modar_surface>();
  surface.width = width;
  surface.height = height;
  surface.rotation = rotation;
  surface.mirror = mirror ? 1 : 0;
  surface.cover = 1;
  session->surface = surface;
}

MODAR_NATIVE(jint, touch)
(JNIEnv* env, jclass, jlong number, jint kind, jint finger, jfloat x, jfloat y) {
  const Use session(env, number, &Session::drawing);
  if (!session) return MODAR_NOTHING;
  const modar_touch touch = {sizeof touch,
                             kind,
                             finger,
                             double{x},
                             double{y},
                             static_cast<double>(session->surface.width),
                             static_cast<double>(session->surface.height)};
  return modar_screen_touch(session->screen, &touch);
}

MODAR_NATIVE(void, press)(JNIEnv* env, jclass, jlong number, jint button) {
  const Use session(env, number, &Session::drawing);
  if (session) modar_screen_press(session->screen, button, 1);
}

MODAR_NATIVE(jintArray, status)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::drawing);
  if (!session) return nullptr;
  auto status = modar::sized<modar_status>();
  modar_screen_status(session->screen, &status);
  return java_words(env, {status.state, status.hint, static_cast<jint>(status.pattern) - 1,
                          status.sound, status.paused, status.captions});
}

MODAR_NATIVE(void, lookAround)
(JNIEnv* env, jclass, jlong number, jint pattern, jdouble time_s, jboolean present) {
  const Use session(env, number, &Session::drawing);
  if (!session) return;
  session->events.clear();
  modar_screen_look_around(session->screen, static_cast<std::uint32_t>(pattern), time_s, present);
}

MODAR_NATIVE(jboolean, waiting)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::drawing);
  return session && modar_screen_waiting(session->screen) != 0 ? JNI_TRUE : JNI_FALSE;
}

MODAR_NATIVE(jint, clipModel)(JNIEnv* env, jclass, jlong number, jint clip) {
  const Use session(env, number, &Session::tracking);
  auto found = modar::sized<modar_clip>();
  if (!session || modar_clip_at(session->bundle, static_cast<std::uint32_t>(clip), &found) == 0) {
    return -1;
  }
  return static_cast<jint>(found.model);
}

MODAR_NATIVE(jstring, clipName)(JNIEnv* env, jclass, jlong number, jint clip) {
  return name_of(env, number, clip, modar_clip_name);
}

MODAR_NATIVE(jboolean, playClip)
(JNIEnv* env, jclass, jlong number, jint scene, jint clip, jboolean loops, jdouble blend_s) {
  const Use session(env, number, &Session::drawing);
  if (!session) return JNI_FALSE;
  const int plays =
      modar_clip_play(session->screen, static_cast<std::uint32_t>(scene),
                      static_cast<std::uint32_t>(clip), loops != JNI_FALSE ? 1 : 0, blend_s);
  return plays != 0 ? JNI_TRUE : JNI_FALSE;
}

MODAR_NATIVE(void, stopClip)(JNIEnv* env, jclass, jlong number, jint scene) {
  const Use session(env, number, &Session::drawing);
  if (session) modar_clip_stop(session->screen, static_cast<std::uint32_t>(scene));
}

MODAR_NATIVE(jint, clipPlaying)(JNIEnv* env, jclass, jlong number, jint scene) {
  const Use session(env, number, &Session::drawing);
  if (!session) return -1;
  const auto index = static_cast<std::uint32_t>(scene);
  return static_cast<jint>(modar_clip_playing(session->screen, index)) - 1;
}

MODAR_NATIVE(void, onDrawFrame)
(JNIEnv* env, jclass, jlong number, jbyteArray nv21, jobject poses, jboolean again) {
  const Use session(env, number, &Session::drawing);
  if (!session || !has_camera(env, *session) || !can_draw(env, *session)) return;
  const float* const from = pose_buffer(env, *session, poses);
  if (from == nullptr) return;
  const modar_camera& camera = session->camera;
  const std::size_t luma = luma_bytes(camera);
  const ArrayBytes frame(env, nv21, luma / 2 * 3);
  if (frame.get() == nullptr) return;
  auto picture = modar::sized<modar_picture>();
  picture.format = MODAR_NV21;
  picture.width = camera.width;
  picture.height = camera.height;
  picture.planes[0] = frame.get();
  picture.planes[1] = frame.get() + luma;
  picture.strides[0] = picture.strides[1] = camera.width;
  picture.full_range = 1;
  picture.row_count = again ? -1 : 0;
  draw(*session, &picture, from);
}

MODAR_NATIVE(void, onDrawPlanes)
(JNIEnv* env, jclass, jlong number, jobject y, jint y_stride, jobject u, jobject v, jint uv_stride,
 jint uv_pixel_stride, jobject poses, jboolean again) {
  const Use session(env, number, &Session::drawing);
  if (!session || !has_camera(env, *session) || !can_draw(env, *session)) return;
  const float* const from = pose_buffer(env, *session, poses);
  if (from == nullptr) return;
  const modar_camera& camera = session->camera;
  auto picture = modar::sized<modar_picture>();
  picture.width = camera.width;
  picture.height = camera.height;
  picture.full_range = 1;
  picture.row_count = again ? -1 : 0;
  picture.strides[0] = y_stride;
  if (y_stride < camera.width) {
    return misuse(env, "android.planes", "luma", "its rows are shorter than the frame",
                  "pass the plane's own stride");
  }
  picture.planes[0] = static_cast<const std::uint8_t*>(
      direct(env, y, plane_bytes(y_stride, camera.width, camera.height), "luma"));
  if (picture.planes[0] == nullptr) return;
  if (!chroma_planes(env, picture, u, v, uv_stride, uv_pixel_stride)) return;
  draw(*session, &picture, from);
}

MODAR_NATIVE(void, onDrawOrbit)
(JNIEnv* env, jclass, jlong number, jint pattern, jdouble time_s) {
  const Use session(env, number, &Session::drawing);
  if (!session || !can_draw(env, *session) || pattern < 0) return;
  draw_orbit(*session, static_cast<std::uint32_t>(pattern), time_s);
}

MODAR_NATIVE(jint, pick)(JNIEnv* env, jclass, jlong number, jfloat x, jfloat y) {
  const Use session(env, number, &Session::drawing);
  if (!session || !can_draw(env, *session) || session->drawn_camera.width == 0) return -1;
  double frame_x = 0;
  double frame_y = 0;
  modar_surface_to_frame(&session->drawn_surface, &session->drawn_camera, double{x}, double{y},
                         &frame_x, &frame_y);
  auto hit = modar::sized<modar_hit>();
  const modar_drawing drawing = drawing_of(*session, session->item_count);
  if (modar_pick(session->bundle, &drawing, frame_x, frame_y, &hit) == 0) return -1;
  const modar_item& item = session->items[hit.item];
  if (item.node != 0) {
    session->events.push_back({sizeof(modar_event), MODAR_TAP, item.node - 1, hit.material, 0});
  }
  return static_cast<jint>(item.model);
}

MODAR_NATIVE(void, tapNode)(JNIEnv* env, jclass, jlong number, jint node) {
  add_event(env, number, MODAR_TAP, node);
}

MODAR_NATIVE(jboolean, label)
(JNIEnv* env, jclass, jlong number, jint index, jboolean look, jfloatArray place) {
  const Use session(env, number, &Session::drawing);
  auto node = modar::sized<modar_node>();
  const auto wanted = static_cast<std::uint32_t>(index);
  if (!session || modar_node_at(session->bundle, wanted, &node) == 0) return JNI_FALSE;
  const std::size_t from = node.pattern * kPoseFloats;
  if (from >= session->poses.size() || session->poses[from + kShown] == 0) return JNI_FALSE;
  auto label = modar::sized<modar_label>();
  const modar_drawing drawing = drawing_of(*session, look ? session->item_count : 0);
  const float* const view = session->poses.data() + from + kView;
  if (modar_label_project(session->screen, wanted, &drawing, view, &label) == 0) {
    return JNI_FALSE;
  }
  const auto [x, y] = on_screen(*session, double{label.x}, double{label.y});
  const std::array<jfloat, 3> words = {x, y, static_cast<jfloat>(label.covered)};
  env->SetFloatArrayRegion(place, 0, static_cast<jsize>(words.size()), words.data());
  return JNI_TRUE;
}

MODAR_NATIVE(jstring, mark)(JNIEnv* env, jclass, jlong number, jint index) {
  return text_or_null(env, number, [&](const auto* bundle, char* text, std::size_t size) {
    return modar_node_mark(bundle, static_cast<std::uint32_t>(index), text, size);
  });
}

MODAR_NATIVE(jintArray, act)
(JNIEnv* env, jclass, jlong number, jdouble time_s, jobject poses) {
  const Use session(env, number, &Session::drawing);
  if (!session) return nullptr;
  const float* const from = pose_buffer(env, *session, poses);
  if (from == nullptr) return nullptr;
  const std::size_t count = act(*session, time_s, from);
  if (count == 0) return nullptr;
  std::vector<jint> words;
  for (std::size_t i = 0; i < count; ++i) {
    auto command = modar::sized<modar_command>();
    modar_screen_command(session->screen, i, &command);
    for (const std::uint32_t word :
         {static_cast<std::uint32_t>(command.kind), command.node, command.action}) {
      words.push_back(static_cast<jint>(word));
    }
  }
  return java_words(env, words);
}

MODAR_NATIVE(void, ended)(JNIEnv* env, jclass, jlong number, jint node) {
  add_event(env, number, MODAR_ENDED, node);
}

MODAR_NATIVE(void, resetActions)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::drawing);
  if (!session) return;
  session->events.clear();
  modar_screen_reset(session->screen);
}

MODAR_NATIVE(jintArray, node)(JNIEnv* env, jclass, jlong number, jint index) {
  const Use session(env, number, &Session::tracking);
  auto node = modar::sized<modar_node>();
  if (!session || modar_node_at(session->bundle, static_cast<std::uint32_t>(index), &node) == 0) {
    return nullptr;
  }
  auto media = modar::sized<modar_media>();
  if (node.media != 0) modar_media_at(session->bundle, node.media - 1, &media);
  return java_words(env, {node.kind, static_cast<jint>(node.pattern), node.loops, media.width,
                          media.height, media.sound});
}

MODAR_NATIVE(jobject, media)(JNIEnv* env, jclass, jlong number, jint index) {
  const Use session(env, number, &Session::tracking);
  auto node = modar::sized<modar_node>();
  auto media = modar::sized<modar_media>();
  if (!session || modar_node_at(session->bundle, static_cast<std::uint32_t>(index), &node) == 0 ||
      node.media == 0 || modar_media_at(session->bundle, node.media - 1, &media) == 0) {
    return nullptr;
  }
  // Java's buffers know no constants; what gets this one reads it.
  return env->NewDirectByteBuffer(const_cast<std::uint8_t*>(media.bytes),
                                  static_cast<jlong>(media.byte_count));
}

MODAR_NATIVE(jstring, nodeText)
(JNIEnv* env, jclass, jlong number, jint index, jboolean title, jstring language) {
  const std::string tag = text_of(env, language);
  return text_or_null(env, number, [&](const auto* bundle, char* text, std::size_t size) {
    return modar_node_text(bundle, static_cast<std::uint32_t>(index),
                           title != 0 ? MODAR_TITLE : MODAR_TEXT, tag.c_str(), text, size);
  });
}

MODAR_NATIVE(jstring, caption)
(JNIEnv* env, jclass, jlong number, jint index, jstring language, jdouble seconds) {
  const std::string tag = text_of(env, language);
  return text_or_null(env, number, [&](const auto* bundle, char* text, std::size_t size) {
    return modar_node_caption(bundle, static_cast<std::uint32_t>(index), tag.c_str(), seconds, text,
                              size);
  });
}

MODAR_NATIVE(jstring, address)(JNIEnv* env, jclass, jlong number, jint action) {
  return text_or_null(env, number, [&](const auto* bundle, char* text, std::size_t size) {
    return modar_action_address(bundle, static_cast<std::uint32_t>(action), text, size);
  });
}

MODAR_NATIVE(void, setVideo)(JNIEnv* env, jclass, jlong number, jint node, jint texture) {
  const Use session(env, number, &Session::drawing);
  if (!session || session->renderer == nullptr) return;
  modar_renderer_set_video(session->renderer, static_cast<std::uint32_t>(node),
                           static_cast<std::uint32_t>(texture));
}

MODAR_NATIVE(void, share)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::drawing);
  if (!session) return;
  session->alone = false;
  if (session->renderer != nullptr) set_options(*session);
}

MODAR_NATIVE(jlong, gpuBytes)(JNIEnv* env, jclass, jlong number) {
  const Use session(env, number, &Session::drawing);
  if (!session || session->renderer == nullptr) return 0;
  return static_cast<jlong>(modar_renderer_gpu_bytes(session->renderer));
}
