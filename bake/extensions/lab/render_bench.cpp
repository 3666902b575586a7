// `modar-lab bench render`: curves of the ModAR paper's ways to draw copies of a model, the paper's
// gains, loading, and how many triangles culling sends.
#include "bake/extensions/lab/render_bench.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <GLES2/gl2.h>
#include <glm/gtc/matrix_transform.hpp>

#include "bake/extensions/lab/heap.hpp"
#include "formats/bundle_view.hpp"
#include "formats/component.hpp"
#include "modar/camera.hpp"
#include "modar/mapped_file.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/draw_list.hpp"

namespace modar {
namespace {

/// Summed over views from the model's middle in the six directions of the axes and the eight
/// between.
struct CullCounts {
  std::uint64_t sent = 0;    ///< triangles of the level-0 chunks that frustum culling leaves
  std::uint64_t needed = 0;  ///< triangles whose own box meets the same frustum
};

enum Way : std::size_t {
  kIndexArrays,
  kIndexVbo,
  kInstancingArrays,
  kInstancingVbo,
  kInstancedArrays,
  kWays
};
inline constexpr std::array<const char*, kWays> kWayNames = {
    "index_arrays", "index_vbo", "instancing_arrays", "instancing_vbo", "instanced_arrays"};

/// One point of a curve; negative where it was not measured.
struct CurvePoint {
  double draw_calls = -1;
  double state_changes = -1;
  double bytes = -1;
  double wall_ms = -1;
  double cpu_ms = -1;
  double batch_bytes = -1;
};

/// Everything that one process draws with.
struct BenchStage {
  MappedFile file;
  std::unique_ptr<GlContext> context;
  GlCaps caps;
  BundleView bundle;
};

/// Boxes of the triangles of a chunk's level 0, as chunks of their own.
std::vector<ChunkRecord> triangle_boxes(const BundleView& bundle, const LayoutRecord& layout,
                                        const ChunkRecord& chunk) {
  const LevelRecord& level = bundle.levels()[chunk.first_level];
  const AttributeRecord* position = find_attribute(layout, Semantic::kPosition);
  if (position == nullptr) return {};
  std::vector<ChunkRecord> boxes(level.index_count / 3);
  for (std::uint32_t i = 0; i < level.index_count; ++i) {
    std::uint16_t index = 0;
    std::memcpy(&index, bundle.indices().data() + level.index_offset + 2 * std::uint64_t{i},
                sizeof index);
    if (index >= level.vertex_count) continue;
    const std::byte* vertex =
        bundle.vertices().data() + level.vertex_offset + std::uint64_t{index} * layout.stride;
    ChunkRecord& box = boxes[i / 3];
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const float value =
          chunk.position_offset[axis] +
          chunk.position_step * static_cast<float>(decode_component(*position, vertex, axis));
      box.bounds_min[axis] = i % 3 == 0 ? value : std::min(box.bounds_min[axis], value);
      box.bounds_max[axis] = i % 3 == 0 ? value : std::max(box.bounds_max[axis], value);
    }
  }
  return boxes;
}

std::vector<ModelView> views_from_inside() {
  std::vector<ModelView> views;
  const Camera camera = default_camera(480, 800);
  const glm::mat4 projection = gl_projection(camera, 0.01, 10.0);
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const int axes = x * x + y * y + z * z;
        if (axes != 1 && axes != 3) continue;
        const glm::vec3 up = x == 0 && y == 0 ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1);
        views.push_back(model_view(projection, glm::lookAt(glm::vec3(0.0f), glm::vec3(x, y, z), up),
                                   camera.height));
      }
    }
  }
  return views;
}

/// Reads every vertex position of level 0 from the bytes.
CullCounts count_culling(const BundleView& bundle, std::uint32_t model) {
  const std::vector<ModelView> views = views_from_inside();
  const ModelRecord& record = bundle.models()[model];
  CullCounts counts;
  for (std::uint32_t c = record.first_chunk; c < record.first_chunk + record.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    const std::vector<ChunkRecord> boxes =
        triangle_boxes(bundle, bundle.layouts()[record.layout], chunk);
    for (const ModelView& view : views) {
      if (!outside_frustum(view, chunk)) counts.sent += boxes.size();
      counts.needed += static_cast<std::uint64_t>(std::ranges::count_if(
          boxes, [&](const ChunkRecord& box) { return !outside_frustum(view, box); }));
    }
  }
  return counts;
}

/// Milliseconds of a clock of the system.
double clock_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// Of values in any order; they are shuffled.
double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Copies on a grid before the camera, a turn apart, all in view.
std::vector<DrawItem> grid(std::uint32_t model, int copies) {
  std::vector<DrawItem> items;
  for (int i = 0; i < copies; ++i) {
    const float x = static_cast<float>(i % 3 - 1) * 1.2f;
    const float y = static_cast<float>(i / 3 % 4) * 1.2f - 1.8f;
    const glm::mat4 place = glm::translate(glm::mat4(1.0f), glm::vec3(x, y, -8.0f));
    const glm::mat4 turned =
        glm::rotate(place, 0.5f * static_cast<float>(i), glm::vec3(0.0f, 1.0f, 0.0f));
    items.push_back({model, glm::scale(turned, glm::vec3(0.55f))});
  }
  return items;
}

RenderOptions options_of(Way way) {
  RenderOptions options;
  options.exclusive_context = true;
  options.client_arrays = way == kIndexArrays || way == kInstancingArrays;
  options.instancing = way != kIndexArrays && way != kIndexVbo;
  options.lod_pixels = 0.0f;
  return options;
}

CurvePoint measure(Renderer& renderer, Way way, std::span<const DrawItem> items,
                   const RenderBenchOptions& options) {
  const glm::mat4 projection =
      gl_projection(default_camera(options.width, options.height), 0.1, 100.0);
  renderer.set_options(options_of(way));
  const auto frame = [&] {
    renderer.render(RgbImage{}, projection, items);
    glFinish();
  };
  for (int i = 0; i < 3; ++i) frame();
  std::vector<double> walls;
  std::vector<double> cpus;
  for (int i = 0; i < options.frames; ++i) {
    const double wall = clock_ms(CLOCK_MONOTONIC);
    const double cpu = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    frame();
    cpus.push_back(clock_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu);
    walls.push_back(clock_ms(CLOCK_MONOTONIC) - wall);
  }
  const RenderStats& stats = renderer.stats();
  return {static_cast<double>(stats.draw_calls),
          static_cast<double>(stats.state_changes),
          static_cast<double>(stats.bytes_uploaded),
          median(walls),
          median(cpus),
          static_cast<double>(renderer.gpu_memory().batches)};
}

Result<std::unique_ptr<Renderer>> renderer_of(const BenchStage& stage, bool instanced_arrays,
                                              const RenderBenchOptions& options) {
  GlCaps caps = stage.caps;
  caps.instanced_arrays = caps.instanced_arrays && instanced_arrays;
  auto renderer = Renderer::create(stage.bundle, caps);
  if (!renderer) return renderer;
  MODAR_TRY((*renderer)->resize(options.width, options.height));
  return renderer;
}

Result<BenchStage> open_stage(const std::string& path, const RenderBenchOptions& options) {
  MODAR_ASSIGN(MappedFile file, MappedFile::open(path));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(file.bytes()));
  MODAR_ASSIGN(std::unique_ptr<GlContext> context, GlContext::create_offscreen());
  GlCaps caps = probe_gl_caps();
  if (!options.device.empty()) {
    MODAR_ASSIGN(const GlCaps masked, mask_gl_caps(caps, options.device));
    caps = masked;
  }
  // Every buffer stays, whatever the profile's memory: the ways are compared, not the eviction.
  caps.gpu_memory = 0;
  return BenchStage{std::move(file), std::move(context), caps, bundle};
}

/// The models of a bundle that have a curve.
std::vector<std::uint32_t> curve_models(const BundleView& bundle,
                                        const RenderBenchOptions& options) {
  std::vector<std::uint32_t> models;
  for (std::uint32_t i = 0; i < bundle.models().size(); ++i) {
    if (bundle.models()[i].triangle_count <= options.most_triangles) models.push_back(i);
  }
  return models;
}

/// Curves of these models, all ways and numbers of copies, in that order.
Result<std::vector<CurvePoint>> measure_curves(const BenchStage& stage,
                                               const RenderBenchOptions& options) {
  const std::vector<std::uint32_t> models = curve_models(stage.bundle, options);
  std::vector<CurvePoint> points;
  if (models.empty()) return points;
  MODAR_ASSIGN(const auto plain, renderer_of(stage, false, options));
  MODAR_ASSIGN(const auto instanced, renderer_of(stage, true, options));
  const std::size_t all = models.size() * kWays * static_cast<std::size_t>(options.most_copies);
  for (const std::uint32_t model : models) {
    for (std::size_t way = 0; way < kWays; ++way) {
      const bool extension = way == kInstancedArrays;
      Renderer& renderer = extension ? *instanced : *plain;
      for (int copies = 1; copies <= options.most_copies; ++copies) {
        const bool skip = extension && !stage.caps.instanced_arrays;
        points.push_back(
            skip ? CurvePoint()
                 : measure(renderer, static_cast<Way>(way), grid(model, copies), options));
        if (options.progress) options.progress(points.size(), all);
      }
    }
  }
  return points;
}

bool write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

/// The child's whole life: draws without a rasteriser, answers through the pipe.
[[noreturn]] void draw_idle(const std::string& path, RenderBenchOptions options, int answers) {
  ::setenv("GALLIUM_NOOP", "1", 1);
  options.frames = options.idle_frames;
  options.progress = nullptr;
  const Result<BenchStage> stage = open_stage(path, options);
  bool done = false;
  if (stage && stage->caps.version.find("Mesa") != std::string::npos) {
    const auto points = measure_curves(*stage, options);
    done = points && write_all(answers, std::as_bytes(std::span(*points)));
  }
  // Not exit(): what the parent registered to run at its end is not ours to run.
  ::_exit(done ? 0 : 1);
}

/// The same in a child process whose Mesa draws nothing; empty where that fails.
std::vector<CurvePoint> curves_without_drawing(const std::string& path,
                                               const RenderBenchOptions& options) {
  int ends[2] = {-1, -1};
  if (options.idle_frames < 1 || ::pipe(ends) != 0) return {};
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    draw_idle(path, options, ends[1]);
  }
  ::close(ends[1]);
  std::vector<std::byte> bytes;
  std::array<std::byte, 4096> part{};
  ssize_t count = 0;
  while (child > 0 && (count = ::read(ends[0], part.data(), part.size())) > 0) {
    bytes.insert(bytes.end(), part.begin(), part.begin() + count);
  }
  ::close(ends[0]);
  int status = 1;
  if (child > 0) ::waitpid(child, &status, 0);
  if (status != 0 || bytes.size() % sizeof(CurvePoint) != 0) return {};
  std::vector<CurvePoint> points(bytes.size() / sizeof(CurvePoint));
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(points)).begin());
  return points;
}

/// The ModAR paper's times for ten copies, its Tables 11 (low end) and 12 (mid range), in its
/// units; in the order of `Way`, whose last one it does not have.
struct PaperTimes {
  const char* model;
  double low_end[4];  ///< seconds of a session, by way
  double mid_range[4];
  double low_end_fps[4];
  double mid_range_fps[4];
  double speed_up_low_end_pct;  ///< Table 10
  double speed_up_mid_range_pct;
};
constexpr PaperTimes kPaperTimes[] = {{"pottery",
                                       {82.46, 21.68, 28.87, 18.52},
                                       {43.95, 17.99, 20.04, 12.56},
                                       {21, 39, 32, 43},
                                       {32, 46, 42, 53},
                                       278.44,
                                       220.15},
                                      {"statue",
                                       {156.23, 49.60, 49.15, 22.88},
                                       {78.12, 24.18, 36.30, 13.92},
                                       {12, 29, 19, 35},
                                       {27, 43, 40, 57},
                                       318.62,
                                       215.32}};
constexpr int kPaperCopies = 10;
/// Frames of a session. The paper does not state its number; this is half a minute at 60 a second.
constexpr double kSessionFrames = 1800;

class Rows {
 public:
  explicit Rows(std::vector<RenderBenchRow>& rows) : rows_(rows) {}
  void add(std::string measure, double ours, double reference) {
    if (ours >= 0) rows_.push_back({std::move(measure), ours, std::max(reference, 0.0)});
  }

 private:
  std::vector<RenderBenchRow>& rows_;
};

/// One model's curves: [way][copies - 1].
struct Curves {
  std::string name;
  std::span<const CurvePoint> drawn;
  std::span<const CurvePoint> idle;  ///< may be empty
  std::size_t copies = 0;
};

void add_curve(const Curves& curves, std::size_t way, Rows& rows) {
  for (std::size_t n = 0; n < curves.copies; ++n) {
    const CurvePoint& ours = curves.drawn[way * curves.copies + n];
    const CurvePoint& reference = curves.drawn[n];
    const std::string head =
        curves.name + " x" + std::to_string(n + 1) + " " + kWayNames[way] + " ";
    rows.add(head + "draw_calls", ours.draw_calls, reference.draw_calls);
    rows.add(head + "state_changes", ours.state_changes, reference.state_changes);
    rows.add(head + "bytes_per_frame", ours.bytes, reference.bytes);
    if (!curves.idle.empty()) {
      rows.add(head + "cpu_ms", curves.idle[way * curves.copies + n].cpu_ms, curves.idle[n].cpu_ms);
    }
    rows.add(head + "frame_ms", ours.wall_ms, reference.wall_ms);
    if (n + 1 == curves.copies) rows.add(head + "gl_batch_bytes", ours.batch_bytes, 0);
  }
}

void add_paper_gains(const Curves& curves, Rows& rows) {
  for (const PaperTimes& paper : kPaperTimes) {
    if (curves.name != paper.model || curves.copies != kPaperCopies) continue;
    const auto time = [&](std::size_t way) {
      return curves.drawn[(way + 1) * curves.copies - 1].wall_ms;
    };
    for (std::size_t way = kIndexArrays; way <= kInstancingVbo; ++way) {
      const std::string head = curves.name + " x10 " + kWayNames[way];
      const double fps = 1e3 / time(way);
      const double seconds = kSessionFrames / fps;
      rows.add(head + " table11_fps_low_end", fps, paper.low_end_fps[way]);
      rows.add(head + " table11_s_low_end", seconds, paper.low_end[way]);
      rows.add(head + " table12_fps_mid_range", fps, paper.mid_range_fps[way]);
      rows.add(head + " table12_s_mid_range", seconds, paper.mid_range[way]);
    }
    // Table 10, whose times for the statue are misprints: Tables 11 and 12 state the sums again.
    rows.add(curves.name + " x10 table10_speed_up_pct_low_end",
             100 * time(kIndexArrays) / time(kInstancingArrays), paper.speed_up_low_end_pct);
    rows.add(curves.name + " x10 table10_speed_up_pct_mid_range",
             100 * time(kIndexArrays) / time(kInstancingArrays), paper.speed_up_mid_range_pct);
    for (std::size_t way = kIndexVbo; way <= kInstancingVbo; ++way) {
      const std::string head = curves.name + " x10 " + kWayNames[way];
      const double ours = time(kIndexArrays) / time(way);
      rows.add(head + " gain_low_end", ours, paper.low_end[kIndexArrays] / paper.low_end[way]);
      rows.add(head + " gain_mid_range", ours,
               paper.mid_range[kIndexArrays] / paper.mid_range[way]);
    }
  }
}

/// The GPU's part of a bundle: the upload, and the copy to compare with.
std::vector<std::span<const std::byte>> payload(const BundleView& bundle) {
  std::vector<std::span<const std::byte>> parts = {bundle.vertices(), bundle.indices()};
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    parts.push_back(bundle.texture_data(t));
  }
  return parts;
}

/// CPU time of the driver alone for the same bytes, which no runtime can go under: Mesa's software
/// driver clears a buffer before it fills it.
double bare_upload_ms(std::span<const std::span<const std::byte>> parts) {
  const double start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
  std::vector<GLuint> names(parts.size());
  glGenBuffers(static_cast<GLsizei>(names.size()), names.data());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    glBindBuffer(GL_ARRAY_BUFFER, names[i]);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(parts[i].size()), parts[i].data(),
                 GL_STATIC_DRAW);
  }
  glFinish();
  const double spent = clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start;
  glDeleteBuffers(static_cast<GLsizei>(names.size()), names.data());
  return spent;
}

/// CPU time of uploading the whole bundle into GL against copying its payload once, both to memory
/// that is new to the process.
Result<void> add_load(const BenchStage& stage, const std::string& path, Rows& rows) {
  const std::vector<std::span<const std::byte>> parts = payload(stage.bundle);
  std::size_t size = 0;
  for (const auto& part : parts) size += part.size();
  std::vector<double> opens;
  std::vector<double> loads;
  std::vector<double> copies;
  std::vector<double> uploads;
  GpuMemory memory;
  double heap = 0;
  for (int i = 0; i < 5; ++i) {
    double start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    const Result<MappedFile> file = MappedFile::open(path);
    const bool opened = file && BundleView::open(file->bytes());
    if (opened) opens.push_back(clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start);
    heap = heap_bytes();
    start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    MODAR_ASSIGN(const std::unique_ptr<Renderer> renderer,
                 Renderer::create(stage.bundle, stage.caps));
    glFinish();
    loads.push_back(clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start);
    heap = heap_bytes() - heap;
    memory = renderer->gpu_memory();
    start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    std::vector<std::byte> copy;
    copy.reserve(size);
    for (const auto& part : parts) copy.insert(copy.end(), part.begin(), part.end());
    copies.push_back(clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start);
    uploads.push_back(bare_upload_ms(parts));
  }
  if (!opens.empty()) rows.add(path + " open_ms", median(opens), 0);
  rows.add(path + " load_cpu_ms", median(loads), median(copies));
  rows.add(path + " driver_cpu_ms", median(uploads), median(copies));
  rows.add(path + " heap_bytes Renderer and GL", heap, 0);
  rows.add(path + " gl_geometry_bytes", static_cast<double>(memory.geometry),
           static_cast<double>(stage.bundle.vertices().size() + stage.bundle.indices().size()));
  rows.add(
      path + " gl_texture_bytes", static_cast<double>(memory.textures),
      static_cast<double>(size - stage.bundle.vertices().size() - stage.bundle.indices().size()));
  return {};
}

/// A bundle that comes in pieces, its textures in place and, as the reference, level by level.
void add_arrival(const BenchStage& stage, const std::string& path,
                 const RenderBenchOptions& options, Rows& rows) {
  constexpr std::size_t kPiece = 65536;
  const std::vector<DrawItem> items = grid(0, 1);
  struct Figures {
    double bytes = -1, kept = -1, draw_calls = -1;
  };
  const auto measured = [&](bool in_place) -> Figures {
    GlCaps caps = stage.caps;
    caps.etc1_sub_texture = caps.etc1_sub_texture && in_place;
    const auto renderer = Renderer::create_part(stage.bundle, caps, Renderer::Part::kComes);
    if (!renderer || !(*renderer)->resize(options.width, options.height)) return {};
    double kept = 0;
    const auto bytes = stage.bundle.bytes();
    for (std::size_t at = 0; at < bytes.size(); at += kPiece) {
      (*renderer)->put(at, bytes.subspan(at, std::min(kPiece, bytes.size() - at)));
      kept = std::max(kept, static_cast<double>((*renderer)->gpu_memory().kept));
    }
    (*renderer)->render(RgbImage{},
                        gl_projection(default_camera(options.width, options.height), 0.1, 100.0),
                        items);
    return {static_cast<double>((*renderer)->gpu_memory().uploaded), kept,
            static_cast<double>((*renderer)->stats().draw_calls)};
  };
  const Figures ours = measured(true);
  const Figures whole = measured(false);
  rows.add(path + " arrival uploaded_bytes", ours.bytes, whole.bytes);
  rows.add(path + " arrival kept_bytes", ours.kept, whole.kept);
  rows.add(path + " arrival draw_calls", ours.draw_calls, whole.draw_calls);
}

/// A model as an app shows it: on its pattern where it is in a scene, the camera's picture behind
/// it.
struct ShownModel {
  DrawItem item;
  std::vector<std::uint8_t> picture;  ///< RGB
};

ShownModel shown_model(const BundleView& bundle, std::uint32_t model,
                       const RenderBenchOptions& options) {
  ShownModel shown;
  const glm::mat4 world = glm::lookAt(glm::vec3(0.8f, -2.4f, 2.0f), glm::vec3(0.0f, 0.0f, 0.3f),
                                      glm::vec3(0.0f, 0.0f, 1.0f));
  shown.item = {model, world, kNone, world};
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    if (bundle.scenes()[s].model != model) continue;
    shown.item.to_eye = world * scene_matrix(bundle.scenes()[s]);
    shown.item.scene = s;
  }
  const auto pixels =
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    shown.picture.push_back(static_cast<std::uint8_t>(i * 37 >> 5));
  }
  return shown;
}

/// CPU time of a frame, the driver's threads included, compared with plain shading without a
/// shadow; frame by frame in turn, so that both see the same machine.
Result<void> add_shading_cost(const BenchStage& stage, std::uint32_t model, const std::string& name,
                              const RenderBenchOptions& options, Rows& rows) {
  MODAR_ASSIGN(const auto ours, renderer_of(stage, true, options));
  std::unique_ptr<Renderer> plain;
  {
    const PlainShading plainly;
    MODAR_ASSIGN(plain, renderer_of(stage, true, options));
  }
  const ShownModel shown = shown_model(stage.bundle, model, options);
  const RgbImage picture{shown.picture.data(), options.width, options.height, 3L * options.width};
  DrawItem bare = shown.item;
  bare.scene = kNone;
  const DepthRange range = depth_range(stage.bundle, {&shown.item, 1});
  const glm::mat4 projection = gl_projection(default_camera(options.width, options.height),
                                             range.near_plane, range.far_plane);
  const auto spent = [&](Renderer& renderer, const DrawItem& item) {
    const double start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    renderer.render(picture, projection, {&item, 1});
    glFinish();
    return clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start;
  };
  std::vector<double> our_times;
  std::vector<double> plain_times;
  constexpr int kWarm = 3;  // frames that compile and upload
  for (int i = 0; i < 2 * options.frames + kWarm; ++i) {
    const double our_time = spent(*ours, shown.item);
    const double plain_time = spent(*plain, bare);
    if (i < kWarm) continue;
    our_times.push_back(our_time);
    plain_times.push_back(plain_time);
  }
  rows.add(name + " x1 shading_cpu_ms", median(our_times), median(plain_times));
  return {};
}

/// All rows of one bundle.
Result<void> add_bundle(const std::string& path, std::span<const CurvePoint> idle,
                        const RenderBenchOptions& options, Rows& rows) {
  MODAR_ASSIGN(const BenchStage stage, open_stage(path, options));
  MODAR_ASSIGN(const std::vector<CurvePoint> drawn, measure_curves(stage, options));
  const std::size_t copies = static_cast<std::size_t>(options.most_copies);
  std::size_t first = 0;
  const auto name = [&](std::uint32_t model) {
    return std::string(stage.bundle.name(stage.bundle.models()[model].name));
  };
  for (const std::uint32_t model : curve_models(stage.bundle, options)) {
    Curves curves{name(model), std::span(drawn).subspan(first, kWays * copies), {}, copies};
    if (idle.size() == drawn.size()) curves.idle = idle.subspan(first, kWays * copies);
    for (std::size_t way = kIndexArrays; way < kWays; ++way) add_curve(curves, way, rows);
    add_paper_gains(curves, rows);
    first += kWays * copies;
    MODAR_TRY(add_shading_cost(stage, model, curves.name, options, rows));
  }
  MODAR_TRY(add_load(stage, path, rows));
  if (!stage.bundle.models().empty()) add_arrival(stage, path, options, rows);
  for (std::uint32_t model = 0; model < stage.bundle.models().size(); ++model) {
    const CullCounts counts = count_culling(stage.bundle, model);
    rows.add(name(model) + " inside triangles_sent", static_cast<double>(counts.sent),
             static_cast<double>(counts.needed));
  }
  return {};
}

}  // namespace

Result<std::vector<RenderBenchRow>> bench_render(std::span<const std::string> bundle_paths,
                                                 const RenderBenchOptions& options) {
  // The children first: they must not inherit a context.
  std::vector<std::vector<CurvePoint>> idle;
  for (const std::string& path : bundle_paths) {
    idle.push_back(curves_without_drawing(path, options));
  }
  std::vector<RenderBenchRow> result;
  Rows rows(result);
  for (std::size_t i = 0; i < bundle_paths.size(); ++i) {
    MODAR_TRY(add_bundle(bundle_paths[i], idle[i], options, rows));
  }
  return result;
}

}  // namespace modar
