// Draws bundles several times larger than a picture, averages, and compares.
#include "bake/extensions/lab/views_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include <glm/gtc/matrix_transform.hpp>

#include "bake/check/picture/level_look.hpp"
#include "formats/bundle_view.hpp"
#include "modar/camera.hpp"
#include "modar/mapped_file.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

constexpr int kSamplesASide = 8;          ///< samples of a pixel along a side
constexpr std::uint64_t kOneMoreOf = 32;  ///< triangles: one more is no difference
constexpr double kSeenMean = 1.5;         ///< of 255: a difference that people see
constexpr std::uint8_t kAround = 128;
constexpr int kScreen = 800;          ///< pixels, as devices without ES 3 have
constexpr float kFinely = 0.1f;       ///< pixels, of an error that the budget alone allows
constexpr double kMostDrawn = 104e3;  ///< triangles, as the renderer's kFewTriangles
constexpr std::array kViewSides = {16, 24, 32, 48, 64, 96, 128, 150, 200, 256, 384};

/// A bundle whose only model is drawn in the place of another one.
struct DrawnModel {
  MappedFile file;
  BundleView bundle;
  std::unique_ptr<Renderer> renderer;
  glm::dmat4 placed{1.0};  ///< to the finest one's model space
};

/// What a view of one model is.
struct Picture {
  std::vector<double> pixels;  ///< three a pixel, of 255
  std::vector<bool> covered;   ///< of each pixel: shows the model, if only in part
  RenderStats stats;
};

/// Means over the views.
struct ViewFigures {
  double difference = 0;
  double visible = 0;
  double triangles = 0;
  double calls = 0;
};

glm::dmat4 from_model(const ModelRecord& model) {
  const glm::dvec3 center(model.center[0], model.center[1], model.center[2]);
  return glm::scale(glm::translate(glm::dmat4(1.0), center), glm::dvec3(model.scale));
}

Result<DrawnModel> open_model(const std::string& path, const GlCaps& caps) {
  MODAR_ASSIGN(MappedFile file, MappedFile::open(path));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(file.bytes()));
  if (bundle.models().empty()) {
    return fail(ExitCode::kInvalidInput, "bench.inputs", path, "the bundle has no model",
                "bake one model into each bundle");
  }
  MODAR_ASSIGN(std::unique_ptr<Renderer> renderer, Renderer::create(bundle, caps));
  return DrawnModel{std::move(file), bundle, std::move(renderer)};
}

void draw(const DrawnModel& model, const glm::dvec3& direction, int side, float lod_pixels) {
  Camera camera = default_camera(side, side);
  // A sphere around the box of a model fills the picture.
  camera.fx = camera.fy = side * std::sqrt(kViewDistance * kViewDistance - 3) / 2 / std::sqrt(3.0);
  RenderOptions render;
  render.clear_colour = glm::vec4(glm::vec3(kAround / 255.0f), 0.0f);
  render.lod_pixels = lod_pixels;
  model.renderer->set_options(render);
  const DrawItem item{0, glm::mat4(view_from(direction) * model.placed)};
  const DepthRange range = depth_range(model.bundle, {&item, 1});
  model.renderer->render(RgbImage{}, gl_projection(camera, range.near_plane, range.far_plane),
                         {&item, 1});
}

Result<Picture> picture_of(const DrawnModel& model, const glm::dvec3& direction, int side,
                           float lod_pixels) {
  const int large = kSamplesASide * side;
  MODAR_TRY(model.renderer->resize(large, large));
  draw(model, direction, large, kSamplesASide * lod_pixels);
  std::vector<std::uint8_t> samples(4 * static_cast<std::size_t>(large) *
                                    static_cast<std::size_t>(large));
  model.renderer->read_pixels(samples);
  const auto pixels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
  Picture picture{std::vector<double>(3 * pixels), std::vector<bool>(pixels),
                  model.renderer->stats()};
  for (std::size_t s = 0; s < samples.size(); s += 4) {
    const std::size_t x = s / 4 % static_cast<std::size_t>(large) / kSamplesASide;
    const std::size_t y = s / 4 / static_cast<std::size_t>(large) / kSamplesASide;
    const std::size_t pixel = y * static_cast<std::size_t>(side) + x;
    for (std::size_t c = 0; c < 3; ++c) {
      picture.pixels[3 * pixel + c] += samples[s + c] / double{kSamplesASide * kSamplesASide};
      if (samples[s + c] != kAround) picture.covered[pixel] = true;
    }
  }
  return picture;
}

/// Mean over the pixels that either picture covers.
double difference(const Picture& a, const Picture& b) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < a.covered.size(); ++p) {
    if (!a.covered[p] && !b.covered[p]) continue;
    for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) sum += std::fabs(a.pixels[c] - b.pixels[c]) / 3;
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

/// The least allowed error of levels, in pixels, with which a view has no more triangles.
Result<float> pixels_for(const DrawnModel& model, const glm::dvec3& direction, int side,
                         std::uint64_t triangles) {
  MODAR_TRY(model.renderer->resize(side, side));
  float few = 1024.0f;
  float many = 0.0f;
  for (int i = 0; i < 24; ++i) {
    const float middle = i < 12 ? few / 4 : std::sqrt(few * many);
    draw(model, direction, side, middle);
    const bool fits = model.renderer->stats().triangles <= triangles + triangles / kOneMoreOf;
    (fits ? few : many) = middle;
    if (i < 12 && !fits) i = 11;
    if (i == 11 && many == 0.0f) break;
  }
  return few;
}

void count(const RenderStats& stats, ViewFigures& figures) {
  figures.triangles += static_cast<double>(stats.triangles) / kViews;
  figures.calls += static_cast<double>(stats.draw_calls) / kViews;
}

void add(const Picture& finest, const Picture& picture, ViewFigures& figures) {
  const double found = difference(finest, picture);
  figures.difference += found / kViews;
  figures.visible += (found > kSeenMean ? 1.0 : 0.0) / kViews;
  count(picture.stats, figures);
}

/// What a phone without ES 3 draws of a model that fills its screen, next to what it may.
Result<void> add_budget(const std::string& path, std::vector<BenchRow>& rows) {
  for (const std::string device : {"ace2", "mali400"}) {
    MODAR_ASSIGN(const GlCaps caps, mask_gl_caps(probe_gl_caps(), device));
    MODAR_ASSIGN(const DrawnModel model, open_model(path, caps));
    MODAR_TRY(model.renderer->resize(kScreen, kScreen));
    ViewFigures figures;
    for (const glm::dvec3& direction : view_directions()) {
      draw(model, direction, kScreen, kFinely);
      count(model.renderer->stats(), figures);
    }
    const double most =
        std::min(kMostDrawn, static_cast<double>(model.bundle.models()[0].triangle_count));
    rows.push_back({"triangles on " + device, figures.triangles, most, figures.triangles / most});
    rows.push_back({"draw calls on " + device, figures.calls, 20, figures.calls / 20});
  }
  return {};
}

/// The levels that a renderer chooses by itself, at several sizes, next to the finest.
Result<std::vector<BenchRow>> bench_switches(const std::string& path) {
  MODAR_ASSIGN(const DrawnModel model, open_model(path, probe_gl_caps()));
  std::vector<BenchRow> rows;
  for (const int side : kViewSides) {
    ViewFigures figures;
    double worst = 0;
    double all = 0;
    for (const glm::dvec3& direction : view_directions()) {
      MODAR_ASSIGN(const Picture finest, picture_of(model, direction, side, 0.0f));
      MODAR_ASSIGN(const Picture ours, picture_of(model, direction, side, 1.0f));
      add(finest, ours, figures);
      worst = std::max(worst, difference(finest, ours));
      all += static_cast<double>(finest.stats.triangles) / kViews;
    }
    const std::string at = " at " + std::to_string(side) + " px";
    rows.push_back({"triangles" + at, figures.triangles, all, figures.triangles / all});
    rows.push_back({"worst difference of 255" + at, worst, kSeenMean, worst / kSeenMean});
    rows.push_back(
        {"views that differ visibly" + at, figures.visible, 0.02, figures.visible / 0.02});
    rows.push_back({"draw calls" + at, figures.calls, 20, figures.calls / 20});
  }
  MODAR_TRY(add_budget(path, rows));
  return rows;
}

}  // namespace

Result<std::vector<BenchRow>> bench_views(const std::vector<std::string>& inputs) {
  MODAR_ASSIGN(const std::unique_ptr<GlContext> context, GlContext::create_offscreen());
  if (inputs.size() == 1) return bench_switches(inputs[0]);
  if (inputs.size() != 3) {
    return fail(ExitCode::kUsage, "bench.inputs", "", "one or three bundles are compared",
                "name the finest, ours and the reference");
  }
  std::vector<DrawnModel> models;
  for (const std::string& path : inputs) {
    MODAR_ASSIGN(DrawnModel model, open_model(path, probe_gl_caps()));
    models.push_back(std::move(model));
    models.back().placed = glm::inverse(from_model(models[0].bundle.models()[0])) *
                           from_model(models.back().bundle.models()[0]);
  }
  std::vector<BenchRow> rows;
  for (const int side : {50, 200}) {
    std::array<ViewFigures, 2> figures;
    for (const glm::dvec3& direction : view_directions()) {
      MODAR_ASSIGN(const Picture finest, picture_of(models[0], direction, side, 0.0f));
      MODAR_ASSIGN(const Picture reference, picture_of(models[2], direction, side, 0.0f));
      MODAR_ASSIGN(const float pixels,
                   pixels_for(models[1], direction, side, reference.stats.triangles));
      MODAR_ASSIGN(const Picture ours, picture_of(models[1], direction, side, pixels));
      add(finest, ours, figures[0]);
      add(finest, reference, figures[1]);
    }
    const std::string at = " at " + std::to_string(side) + " px";
    const auto row = [&](const std::string& measure, double ViewFigures::*figure) {
      const double other = figures[1].*figure;
      rows.push_back(
          {measure + at, figures[0].*figure, other, other != 0 ? figures[0].*figure / other : 0.0});
    };
    row("difference of 255", &ViewFigures::difference);
    row("views that differ visibly", &ViewFigures::visible);
    row("triangles", &ViewFigures::triangles);
    row("draw calls", &ViewFigures::calls);
  }
  return rows;
}

}  // namespace modar
