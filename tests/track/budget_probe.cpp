// What scripts/foreign.sh budget counts the instructions of, under qemu with a counting plugin:
// each measured step is between two writes to stdout. Frames are rendered from the bundle's own
// pattern, so that nothing but the bundle is needed.
// Usage: budget_probe track|copies|search|clutter|sliced|extended|render|clips|open|memory BUNDLE
// [WIDTH HEIGHT [FRAMES [BUDGET]]] copies: four of the pattern are tracked; search: frames that
// show the pattern; clutter: frames without it; sliced: both, within a budget of some million
// instructions a frame; extended: before a wall, which alone the last quarter of the frames shows;
// render: by null_gl.cpp; memory: tracks and draws, and prints what memory the process holds after
// each stage; clips: two clips of 60 bones blend, of a bundle of its own. track-default,
// search-default: while the camera is a guess, as apps have it that give none.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/tracker_record.hpp"
#include "modar/clip_player.hpp"
#include "modar/mapped_file.hpp"
#include "modar/pose_loop.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

int give_up(const std::string& why) {
  std::fprintf(stderr, "budget_probe: %s\n", why.c_str());
  return 1;
}

/// A write that the plugin sees; nothing is buffered.
void mark(const std::string& line) {
  if (::write(1, line.data(), line.size()) < 0) std::abort();
}

/// The same numbers on every platform.
struct Numbers {
  std::uint32_t state = 1;
  int next(int below) {
    state = state * 1664525u + 1013904223u;
    return static_cast<int>((state >> 16) % static_cast<std::uint32_t>(below));
  }
};

struct Frame {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayImage view() const { return {pixels.data(), width, height, width}; }
};

/// Overlapping discs and boxes of many sizes, the statistics of natural scenes: Lee, Mumford &
/// Huang, "Occlusion models for natural images" (2001).
Frame clutter(int width, int height, std::uint32_t seed) {
  Frame frame{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height))};
  Numbers numbers{seed};
  for (int i = 0; i < 6000; ++i) {
    const int radius = std::min(120, 2 + 1000 / (4 + numbers.next(250)));
    const int x0 = numbers.next(width);
    const int y0 = numbers.next(height);
    const bool round = numbers.next(2) == 0;
    const int gray = 20 + numbers.next(216);
    for (int y = std::max(0, y0 - radius); y < std::min(height, y0 + radius); ++y) {
      for (int x = std::max(0, x0 - radius); x < std::min(width, x0 + radius); ++x) {
        const int dx = x - x0;
        const int dy = y - y0;
        if (round && dx * dx + dy * dy > radius * radius) continue;
        frame.pixels[static_cast<std::size_t>(y * width + x)] = static_cast<std::uint8_t>(gray);
      }
    }
  }
  return frame;
}

/// The pattern's image at a pose, over a background, with noise of three gray values if it is the
/// last of the frame.
void draw(const GrayImage& pattern, const Camera& camera, const Pose& pose, Numbers& numbers,
          Frame& frame, bool last = true) {
  const double longest = std::max(pattern.width, pattern.height);
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const glm::dvec3 ray{(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0};
      const glm::dvec3 normal = pose.rotation[2];
      const double depth = glm::dot(normal, pose.translation) / glm::dot(normal, ray);
      const glm::dvec3 at = ray * depth - pose.translation;
      const double u = (glm::dot(pose.rotation[0], at) * longest + pattern.width - 1.0) * 0.5;
      const double v = (pattern.height - 1.0 - glm::dot(pose.rotation[1], at) * longest) * 0.5;
      std::uint8_t& out = frame.pixels[static_cast<std::size_t>(y * frame.width + x)];
      double gray = out;
      if (u >= 0 && v >= 0 && u < pattern.width - 1 && v < pattern.height - 1) {
        const int column = static_cast<int>(u);
        const int row = static_cast<int>(v);
        const std::uint8_t* p = pattern.pixels + row * pattern.stride + column;
        const double top = p[0] + (u - column) * (p[1] - p[0]);
        const double bottom =
            p[pattern.stride] + (u - column) * (p[pattern.stride + 1] - p[pattern.stride]);
        gray = top + (v - row) * (bottom - top);
      }
      const int noise = last ? numbers.next(5) + numbers.next(5) + numbers.next(5) - 6 : 0;
      out = static_cast<std::uint8_t>(std::clamp(gray + noise, 0.0, 255.0));
    }
  }
}

/// A calm hand before a pattern that fills about half of the frame.
Pose pose_at(double time) {
  Pose pose;
  const glm::dmat3 flip(glm::dvec3{1, 0, 0}, glm::dvec3{0, -1, 0}, glm::dvec3{0, 0, -1});
  pose.rotation = rotation_matrix({0.35 + 0.10 * std::sin(1.3 * time), 0.25 * std::cos(time),
                                   0.15 * std::sin(0.7 * time)}) *
                  flip;
  pose.translation = {0.10 * std::sin(0.9 * time), 0.08 * std::cos(1.1 * time),
                      2.4 + 0.2 * std::sin(0.5 * time)};
  return pose;
}

/// One of four copies, twice as far away.
Pose copy_at(const Pose& pose, int copy) {
  const glm::dvec3 apart{copy % 2 == 0 ? -1.1 : 1.1, copy < 2 ? -0.9 : 0.9, 2.4};
  return {pose.rotation, pose.translation + apart};
}

/// The pose of a picture eight times as large as the pattern, on a wall behind it.
Pose behind(const Pose& pose) {
  constexpr double kSize = 8;
  constexpr double kDistance = 0.6;
  return {pose.rotation, (pose.translation - kDistance * pose.rotation[2]) / kSize};
}

int run_frames(const std::string& what, const BundleView& bundle, int width, int height, int frames,
               int budget) {
  TrackerRecordView record;
  const auto bytes = bundle.section(SectionType::kTrackerRecord, 0);
  if (bytes.empty() || view_tracker_record(bytes, record)) return give_up("no tracker record");
  const GrayImage pattern{record.pixels.data(), static_cast<int>(record.header.width),
                          static_cast<int>(record.header.height),
                          static_cast<std::ptrdiff_t>(record.header.width)};
  const Camera camera = default_camera(width, height);
  PoseLoopOptions options;
  options.extended = what == "extended";
  options.estimate_camera = what == "track-default" || what == "search-default";
  options.max_instances = what == "copies" ? 4 : 1;
  options.track = what == "track" || what == "track-default" || what == "sliced" ||
                  what == "copies" || options.extended;
  if (what == "sliced") options.budget = budget;
  const auto loop = PoseLoop::create(bundle, camera, options);
  if (!loop) return give_up(to_line(loop.error()));
  const Frame background = clutter(width, height, 7);
  Frame frame = background;
  Numbers numbers{11};
  TrackResult result;
  for (int i = 0; i < frames; ++i) {
    frame = options.track ? background : clutter(width, height, static_cast<std::uint32_t>(50 + i));
    const Pose pose = pose_at(i / 30.0);
    if (options.extended) draw(background.view(), camera, behind(pose), numbers, frame);
    const bool covered = options.extended && 4 * i >= 3 * frames;
    for (int k = 0; k < 4 && what == "copies"; ++k)
      draw(pattern, camera, copy_at(pose, k), numbers, frame, k == 3);
    if (what != "clutter" && what != "copies" && !covered)
      draw(pattern, camera, pose, numbers, frame);
    mark("begin\n");
    const auto done = (*loop)->step(frame.view(), result);
    mark("end\n");
    if (!done) return give_up(to_line(done.error()));
    std::fprintf(stderr, "%s: %d features, %zu visible, %s\n", what.c_str(), result.features,
                 result.visible.size(), to_string(result.reason));
  }
  return 0;
}

/// A context as most phones have it.
GlCaps phone_caps() {
  GlCaps caps;
  caps.half_float_vertices = true;
  caps.texture_formats = 1u << static_cast<unsigned>(TextureFormat::kEtc1Rgb);
  caps.max_texture_size = 4096;
  return caps;
}

int run_render(const BundleView& bundle, int width, int height, int frames) {
  const auto renderer = Renderer::create(bundle, phone_caps());
  if (!renderer) return give_up(to_line(renderer.error()));
  if (const auto done = (*renderer)->resize(width, height); !done) {
    return give_up(to_line(done.error()));
  }
  const Camera camera = default_camera(width, height);
  const std::vector<std::uint8_t> picture(static_cast<std::size_t>(3 * width * height), 90);
  std::vector<DrawItem> items;
  for (int i = 0; i < frames; ++i) {
    mark("begin\n");
    const glm::mat4 view = gl_view(pose_at(i / 30.0));
    items.clear();
    for (std::uint32_t k = 0; k < bundle.scenes().size(); ++k) {
      const SceneRecord& scene = bundle.scenes()[k];
      items.push_back({scene.model, view * scene_matrix(scene)});
    }
    const DepthRange depth = depth_range(bundle, items);
    (*renderer)->render(RgbImage{picture.data(), width, height, 3 * width},
                        gl_projection(camera, depth.near_plane, depth.far_plane), items);
    mark("end\n");
  }
  std::fprintf(stderr, "render: %d draw calls\n", (*renderer)->stats().draw_calls);
  return 0;
}

template <class T>
void put(std::vector<std::byte>& bytes, const T& value) {
  const auto* from = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof value);
}

constexpr std::uint32_t kChainJoints = 60;

/// Each joint turns and moves, by nine keys in two seconds.
std::vector<std::byte> chain_tracks(double size) {
  constexpr std::uint16_t kKeys = 9;
  constexpr std::uint32_t kSamples = 2 * kClipRate + 1;
  std::vector<std::byte> bytes;
  std::vector<std::byte> keys;
  put(bytes, ClipTracksHeader{2 * kChainJoints, kSamples, {}});
  const std::size_t first = sizeof(ClipTracksHeader) + 2 * kChainJoints * sizeof(TrackRecord);
  for (std::uint32_t j = 0; j < kChainJoints; ++j) {
    for (const TrackPath path : {TrackPath::kTranslation, TrackPath::kRotation}) {
      TrackRecord track{};
      track.joint = j;
      track.path = static_cast<std::uint8_t>(path);
      track.key_count = kKeys;
      track.keys = static_cast<std::uint32_t>(first + keys.size());
      if (path == TrackPath::kTranslation) std::fill_n(track.step, 3, 1e-6f);
      put(bytes, track);
      for (std::uint32_t k = 0; k < kKeys; ++k)
        put(keys, static_cast<std::uint16_t>(k * (kSamples - 1) / (kKeys - 1)));
      for (std::uint32_t k = 0; k < kKeys; ++k) {
        const double angle = size * std::sin(k + 0.1 * j);
        std::array<std::uint16_t, 3> words = {static_cast<std::uint16_t>(1000 * k), 2000, 3000};
        if (path == TrackPath::kRotation)
          words = pack_rotation({std::sin(angle) * 0.6, 0, std::sin(angle) * 0.8, std::cos(angle)});
        put(keys, words);
      }
    }
  }
  bytes.insert(bytes.end(), keys.begin(), keys.end());
  return bytes;
}

void set_identity(float (&rows)[12]) {
  for (int i = 0; i < 3; ++i) rows[5 * i] = 1.0f;
}

/// A model of nothing but joints in a row, and the two parts that a skin of 60 bones is split into.
BundleContent chain_content() {
  BundleContent content;
  content.meta = "{}";
  LayoutRecord layout{};
  layout.stride = 20;
  const auto add = [&](Semantic semantic, ComponentType type, std::uint8_t components,
                       std::uint8_t normalised, std::uint16_t offset) {
    layout.attributes[layout.attribute_count++] = {static_cast<std::uint8_t>(semantic),
                                                   static_cast<std::uint8_t>(type),
                                                   components,
                                                   normalised,
                                                   offset,
                                                   0};
  };
  add(Semantic::kPosition, ComponentType::kF32, 3, 0, 0);
  add(Semantic::kJoints, ComponentType::kU8, 4, 0, 12);
  add(Semantic::kWeights, ComponentType::kU8, 4, 1, 16);
  content.layouts.push_back(layout);
  ModelRecord model{};
  model.name = content.intern("chain");
  model.scale = 1;
  model.material_count = 2;
  content.models.push_back(model);
  for (std::uint32_t m = 0; m < 2; ++m) {
    MaterialRecord material{};
    material.name = content.intern("part");
    material.opacity = 1;
    material.texture = kNone;
    content.materials.push_back(material);
    content.parts.push_back(
        {m, m * kChainJoints / 2, kChainJoints / 2, 0, {-1, -1, -1}, {1, 1, 1}});
  }
  for (std::uint32_t j = 0; j < kChainJoints; ++j) {
    JointRecord joint{};
    joint.parent = j == 0 ? kNone : j - 1;
    set_identity(joint.before);
    joint.rotation[3] = 1;
    std::fill_n(joint.scale, 3, 1.0f);
    content.joints.push_back(joint);
    BoneRecord bone{};
    bone.joint = j;
    set_identity(bone.inverse);
    content.bones.push_back(bone);
  }
  for (std::uint32_t c = 0; c < 2; ++c) {
    content.clips.push_back({content.intern(c == 0 ? "walk" : "run"), 0, c, 2.0f, 0.0f, {}});
    content.clip_tracks.push_back(chain_tracks(0.1 + 0.1 * c));
  }
  return content;
}

int run_clips(int frames) {
  const auto bytes = encode_bundle(chain_content());
  if (!bytes) return give_up(to_line(bytes.error()));
  const auto bundle = BundleView::open(*bytes);
  if (!bundle) return give_up(to_line(bundle.error()));
  ClipPlayer player(*bundle, 0);
  player.play(0, true, 0);
  player.advance(0.5);
  player.play(1, true, frames / 30.0);
  for (int i = 0; i < frames; ++i) {
    mark("begin\n");
    player.advance(1 / 30.0);
    player.pose();
    mark("end\n");
  }
  const BoneMatrix& last = player.bones().back();
  std::fprintf(stderr, "clips: %zu bones, the last one at %.4f %.4f %.4f\n", player.bones().size(),
               static_cast<double>(last[0].w), static_cast<double>(last[1].w),
               static_cast<double>(last[2].w));
  return 0;
}

/// What the process has mapped and what of it is resident, in MB of 10^6 bytes (proc(5)).
void print_memory(const char* stage) {
  std::FILE* status = std::fopen("/proc/self/status", "r");
  if (status == nullptr) return;
  char line[128];
  long mapped = 0;
  long anonymous = 0;
  long of_files = 0;
  while (std::fgets(line, sizeof line, status) != nullptr) {
    std::sscanf(line, "VmSize: %ld", &mapped);
    std::sscanf(line, "RssAnon: %ld", &anonymous);
    std::sscanf(line, "RssFile: %ld", &of_files);
  }
  std::fclose(status);
  std::fprintf(stderr, "%-12s %6.1f MB mapped, resident %6.1f own and %6.1f of files\n", stage,
               static_cast<double>(mapped) * 1.024e-3, static_cast<double>(anonymous) * 1.024e-3,
               static_cast<double>(of_files) * 1.024e-3);
}

int run_memory(const BundleView& bundle, int width, int height, int frames) {
  print_memory("opened");
  if (const int failed = run_frames("search", bundle, width, height, 2, 0)) return failed;
  print_memory("searched");
  if (const int failed = run_frames("track", bundle, width, height, frames, 0)) return failed;
  print_memory("tracked");
  if (const int failed = run_render(bundle, width, height, frames)) return failed;
  print_memory("drawn");
  return 0;
}

int run(int count, char** words) {
  if (count < 3)
    return give_up("give track|copies|search|clutter|sliced|render|open|memory and a bundle");
  const std::string what = words[1];
  mark("begin\n");
  auto file = MappedFile::open(words[2]);
  if (!file) return give_up(to_line(file.error()));
  const auto bundle = BundleView::open(file->bytes());
  mark("end\n");
  if (!bundle) return give_up(to_line(bundle.error()));
  if (what == "open") return 0;
  const int width = count > 4 ? std::atoi(words[3]) : 640;
  const int height = count > 4 ? std::atoi(words[4]) : 480;
  const int frames = count > 5 ? std::atoi(words[5]) : 30;
  if (what == "memory") return run_memory(*bundle, width, height, frames);
  if (what == "clips") return run_clips(frames);
  if (what == "render") return run_render(*bundle, width, height, frames);
  return run_frames(what, *bundle, width, height, frames, count > 6 ? std::atoi(words[6]) : 12);
}

}  // namespace
}  // namespace modar

int main(int count, char** words) {
  return modar::run(count, words);
}
