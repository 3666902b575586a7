// The rows of `modar bench render`: curves, the article's gains, loading and culling.
#include "modar/render_bench.hpp"

#include <algorithm>
#include <cstring>
#include <ctime>
#include <span>
#include <string_view>

#include <GLES2/gl2.h>

#include "runtime/bench/cull_bench.hpp"
#include "runtime/bench/render_curves.hpp"

namespace modar {
namespace {

/// The article's times for ten copies, its Tables 11 (low end) and 12 (mid range), in its units; in
/// the order of `Way`, whose last one it does not have.
struct PaperTimes {
  const char* model;
  double low_end[4];
  double mid_range[4];
};
constexpr PaperTimes kPaperTimes[] = {
    {"pottery", {82.46, 21.68, 28.87, 18.52}, {43.95, 17.99, 20.04, 12.56}},
    {"statue", {156.23, 49.60, 49.15, 22.88}, {78.12, 24.18, 36.30, 13.92}}};
constexpr int kPaperCopies = 10;

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
    for (std::size_t way = kIndexVbo; way <= kInstancingVbo; ++way) {
      const std::string head = curves.name + " x10 " + kWayNames[way];
      const double ours = time(kIndexArrays) / time(way);
      rows.add(head + " gain_low_end", ours, paper.low_end[kIndexArrays] / paper.low_end[way]);
      rows.add(head + " gain_mid_range", ours,
               paper.mid_range[kIndexArrays] / paper.mid_range[way]);
    }
  }
}

/// The GPU's part of a bundle: what is uploaded, and what is copied to compare.
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

/// CPU time of bringing the whole bundle into GL against copying its payload once, both to memory
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
  for (int i = 0; i < 5; ++i) {
    double start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    const Result<MappedFile> file = MappedFile::open(path);
    const bool opened = file && BundleView::open(file->bytes());
    if (opened) opens.push_back(clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start);
    start = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    const Result<std::unique_ptr<Renderer>> renderer = Renderer::create(stage.bundle, stage.caps);
    if (!renderer) return tl::unexpected<Error>(renderer.error());
    glFinish();
    loads.push_back(clock_ms(CLOCK_PROCESS_CPUTIME_ID) - start);
    memory = (*renderer)->gpu_memory();
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
  rows.add(path + " gl_geometry_bytes", static_cast<double>(memory.geometry),
           static_cast<double>(stage.bundle.vertices().size() + stage.bundle.indices().size()));
  rows.add(
      path + " gl_texture_bytes", static_cast<double>(memory.textures),
      static_cast<double>(size - stage.bundle.vertices().size() - stage.bundle.indices().size()));
  return {};
}

/// All rows of one bundle.
Result<void> add_bundle(const std::string& path, std::span<const CurvePoint> idle,
                        const RenderBenchOptions& options, Rows& rows) {
  const Result<BenchStage> stage = open_stage(path, options);
  if (!stage) return tl::unexpected<Error>(stage.error());
  const Result<std::vector<CurvePoint>> drawn = measure_curves(*stage, options);
  if (!drawn) return tl::unexpected<Error>(drawn.error());
  const std::size_t copies = static_cast<std::size_t>(options.most_copies);
  std::size_t first = 0;
  const auto name = [&](std::uint32_t model) {
    return std::string(stage->bundle.name(stage->bundle.models()[model].name));
  };
  for (const std::uint32_t model : curve_models(stage->bundle, options)) {
    Curves curves{name(model), std::span(*drawn).subspan(first, kWays * copies), {}, copies};
    if (idle.size() == drawn->size()) curves.idle = idle.subspan(first, kWays * copies);
    for (std::size_t way = kIndexVbo; way < kWays; ++way) add_curve(curves, way, rows);
    add_paper_gains(curves, rows);
    first += kWays * copies;
  }
  if (auto loaded = add_load(*stage, path, rows); !loaded) return loaded;
  for (std::uint32_t model = 0; model < stage->bundle.models().size(); ++model) {
    const CullCounts counts = count_culling(stage->bundle, model);
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
    const Result<void> added = add_bundle(bundle_paths[i], idle[i], options, rows);
    if (!added) return tl::unexpected<Error>(added.error());
  }
  return result;
}

}  // namespace modar
