// `modar-lab bench light BUNDLE FRAME...`: a camera's frames with the bundle's models on their
// patterns, shaded plainly, in the scenes' own light, and in the light that the frames show.
#include <cmath>
#include <filesystem>
#include <memory>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/picture/reference_renderer.hpp"
#include "bake/check/picture/visual_check.hpp"
#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/light_bench.hpp"
#include "bake/extensions/lab/render_bench.hpp"
#include "bake/image/image.hpp"
#include "bake/process/process.hpp"
#include "formats/base/path.hpp"
#include "modar/gl_context.hpp"
#include "modar/mapped_file.hpp"
#include "modar/pose_loop.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

/// A frame as the loop and the renderer take it.
struct ColourFrame {
  std::vector<std::uint8_t> rgb;
  std::vector<std::uint8_t> gray;
  int width = 0;
  int height = 0;
};

Result<ColourFrame> read_frame(const std::string& path) {
  MODAR_ASSIGN(const RgbaImage image, read_image(path));
  ColourFrame frame;
  frame.width = static_cast<int>(image.width);
  frame.height = static_cast<int>(image.height);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const std::uint8_t* p = &image.pixels[i];
    frame.rgb.insert(frame.rgb.end(), p, p + 3);
    frame.gray.push_back(static_cast<std::uint8_t>((299 * p[0] + 587 * p[1] + 114 * p[2]) / 1000));
  }
  return frame;
}

/// The scenes of the patterns that a frame shows; each frame is searched anew.
Result<std::vector<DrawItem>> items_in(const BundleView& bundle, const ColourFrame& frame) {
  const Camera camera = default_camera(frame.width, frame.height);
  PoseLoopOptions options;
  options.track = false;
  MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, camera, options));
  MODAR_ASSIGN(const TrackResult seen,
               loop->step({frame.gray.data(), frame.width, frame.height, frame.width}));
  std::vector<DrawItem> items;
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    const SceneRecord& scene = bundle.scenes()[s];
    for (const Detection& detection : seen.visible) {
      if (detection.pattern != scene.pattern) continue;
      const glm::mat4 world = gl_view(detection.pose, detection.stretch);
      items.push_back({scene.model, world * scene_matrix(scene), s, world});
    }
  }
  return items;
}

class BeforeAfter {
 public:
  static Result<BeforeAfter> create(const BundleView& bundle) {
    BeforeAfter made(bundle);
    MODAR_ASSIGN(made.context_, GlContext::create_offscreen());
    for (std::size_t i = 0; i < made.renderers_.size(); ++i) {
      std::unique_ptr<PlainShading> plainly;
      if (i == 0) plainly = std::make_unique<PlainShading>();
      MODAR_ASSIGN(made.renderers_[i], Renderer::create(bundle, probe_gl_caps()));
      RenderOptions options;
      options.samples = 4;
      options.estimate_light = i == 2;
      made.renderers_[i]->set_options(options);
    }
    return made;
  }

  /// Plain, in fixed light, in the frame's light.
  Result<std::array<RgbaImage, 3>> shoot(const ColourFrame& frame) {
    MODAR_ASSIGN(std::vector<DrawItem> items, items_in(bundle_, frame));
    const Camera camera = default_camera(frame.width, frame.height);
    const DepthRange range = depth_range(bundle_, items);
    const glm::mat4 projection = gl_projection(camera, range.near_plane, range.far_plane);
    const RgbImage background{frame.rgb.data(), frame.width, frame.height, 3L * frame.width};
    std::array<RgbaImage, 3> images;
    // The last one first: plain shading knows no scene, and so no shadow.
    for (std::size_t i = images.size(); i-- > 0;) {
      if (i == 0) {
        for (DrawItem& item : items) item.scene = kNone;
      }
      MODAR_TRY(renderers_[i]->resize(frame.width, frame.height));
      renderers_[i]->render(background, projection, items);
      images[i] = {static_cast<std::uint32_t>(frame.width),
                   static_cast<std::uint32_t>(frame.height),
                   std::vector<std::uint8_t>(frame.gray.size() * 4)};
      renderers_[i]->read_pixels(images[i].pixels);
    }
    return images;
  }

 private:
  explicit BeforeAfter(const BundleView& bundle) : bundle_(bundle) {}

  BundleView bundle_;
  std::unique_ptr<GlContext> context_;  // outlives the renderers
  std::array<std::unique_ptr<Renderer>, 3> renderers_;
};

/// Mean CIEDE2000 over the pixels in which one of the three differs from another.
double change(const RgbaImage& a, const RgbaImage& b, const ColourFrame& frame) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.gray.size(); ++i) {
    const std::uint8_t* p = &a.pixels[4 * i];
    const std::uint8_t* q = &frame.rgb[3 * i];
    if (std::abs(p[0] - q[0]) + std::abs(p[1] - q[1]) + std::abs(p[2] - q[2]) < 12) continue;
    sum += ciede2000(lab_of(p), lab_of(&b.pixels[4 * i]));
    ++count;
  }
  return count == 0 ? kNoFigure : sum / static_cast<double>(count);
}

}  // namespace

Result<std::vector<BenchRow>> bench_before_after(const std::vector<std::string>& inputs,
                                                 const std::string& folder) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(inputs[0]));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(file.bytes()));
  MODAR_ASSIGN(BeforeAfter stage, BeforeAfter::create(bundle));
  std::vector<BenchRow> rows;
  std::array<std::vector<RgbaImage>, 3> columns;
  for (std::size_t i = 1; i < inputs.size(); ++i) {
    MODAR_ASSIGN(const ColourFrame frame, read_frame(inputs[i]));
    MODAR_ASSIGN(const auto images, stage.shoot(frame));
    const double follows = change(images[1], images[2], frame);
    const double plain = change(images[1], images[0], frame);
    rows.push_back({file_stem(inputs[i]) + " change", follows, plain, ratio(follows, plain)});
    for (std::size_t k = 0; k < images.size(); ++k) columns[k].push_back(images[k]);
  }
  if (folder.empty()) return rows;
  std::vector<RgbaImage> all;
  for (const auto& column : columns) all.push_back(joined(column, false));
  MODAR_TRY(
      write_png(joined(all, true), (std::filesystem::path(folder) / "before_after.png").string()));
  return rows;
}

}  // namespace modar
