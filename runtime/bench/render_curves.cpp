// Draws copies frame by frame, with the driver and with one that draws nothing.
#include "runtime/bench/render_curves.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <span>

#include <GLES2/gl2.h>
#include <glm/gtc/matrix_transform.hpp>

#include "modar/camera.hpp"

namespace modar {
namespace {

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
  const Result<void> sized = (*renderer)->resize(options.width, options.height);
  if (!sized) return tl::unexpected<Error>(sized.error());
  return renderer;
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

}  // namespace

double clock_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Result<BenchStage> open_stage(const std::string& path, const RenderBenchOptions& options) {
  Result<MappedFile> file = MappedFile::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  const Result<BundleView> bundle = BundleView::open(file->bytes());
  if (!bundle) return tl::unexpected<Error>(bundle.error());
  Result<std::unique_ptr<GlContext>> context = GlContext::create_offscreen();
  if (!context) return tl::unexpected<Error>(context.error());
  GlCaps caps = probe_gl_caps();
  if (!options.device.empty()) {
    const Result<GlCaps> masked = mask_gl_caps(caps, options.device);
    if (!masked) return tl::unexpected<Error>(masked.error());
    caps = *masked;
  }
  // Every buffer stays, whatever the profile's memory: the ways are compared, not the eviction.
  caps.gpu_memory = 0;
  return BenchStage{std::move(*file), std::move(*context), caps, *bundle};
}

std::vector<std::uint32_t> curve_models(const BundleView& bundle,
                                        const RenderBenchOptions& options) {
  std::vector<std::uint32_t> models;
  for (std::uint32_t i = 0; i < bundle.models().size(); ++i) {
    if (bundle.models()[i].triangle_count <= options.most_triangles) models.push_back(i);
  }
  return models;
}

Result<std::vector<CurvePoint>> measure_curves(const BenchStage& stage,
                                               const RenderBenchOptions& options) {
  const std::vector<std::uint32_t> models = curve_models(stage.bundle, options);
  std::vector<CurvePoint> points;
  if (models.empty()) return points;
  const auto plain = renderer_of(stage, false, options);
  if (!plain) return tl::unexpected<Error>(plain.error());
  const auto instanced = renderer_of(stage, true, options);
  if (!instanced) return tl::unexpected<Error>(instanced.error());
  const std::size_t all = models.size() * kWays * static_cast<std::size_t>(options.most_copies);
  for (const std::uint32_t model : models) {
    for (std::size_t way = 0; way < kWays; ++way) {
      const bool extension = way == kInstancedArrays;
      Renderer& renderer = extension ? **instanced : **plain;
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

}  // namespace modar
