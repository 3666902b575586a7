// One bundle of all models on one pattern; each drawn twice by the renderer and once by paths.
#include "bake/extensions/lab/light_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/picture/reference_renderer.hpp"
#include "bake/check/picture/visual_check.hpp"
#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/path_tracer.hpp"
#include "bake/extensions/lab/render_bench.hpp"
#include "bake/import/read_model.hpp"
#include "bake/io/output.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/process/process.hpp"
#include "formats/base/path.hpp"
#include "formats/bundle_writer.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

/// sRGB of the table around the pattern: light wood.
constexpr glm::dvec3 kTable(0.66, 0.58, 0.49);
/// Of the largest side of the pattern, so that shadows fall on it.
constexpr double kScale = 0.6;
/// Of a lamp in the evening: darker and warmer than what models are lit with by themselves.
constexpr glm::vec3 kEvening(0.50f, 0.38f, 0.24f);
/// A pixel belongs to the shadow where the reference differs by so much of the ground alone.
constexpr double kChange = 0.01;

struct Subject {
  std::string path;
  UpAxis up = UpAxis::kZ;
  std::string light;  ///< a panorama; empty: the neutral room
};

Subject subject_of(const std::string& argument) {
  const std::string suffix = ",up=y";
  if (!argument.ends_with(suffix)) return {argument, UpAxis::kZ, {}};
  return {argument.substr(0, argument.size() - suffix.size()), UpAxis::kY, {}};
}

/// A bundle of all subjects on the pattern; scene i is subject i's.
Result<std::vector<std::byte>> bake_scenes(const std::vector<Subject>& subjects,
                                           const LightBenchOptions& options) {
  BakeRequest request;
  request.patterns = {{options.pattern, 0.0}};
  request.parameters = {"none"};
  request.jobs = options.jobs;
  for (const Subject& subject : subjects) {
    request.models.push_back(subject.path);
    SceneRequest scene;
    scene.pattern = file_stem(options.pattern);
    scene.model = file_stem(subject.path);
    scene.size.value = kScale;
    scene.up = subject.up;
    scene.light = subject.light;
    request.scenes.push_back(scene);
  }
  Report report;
  MODAR_ASSIGN(const BundleContent content, build_bundle(request, report));
  return encode_bundle(content);
}

std::uint8_t byte_of(double stored) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(stored, 0.0, 1.0)));
}

RgbaImage stored_picture(const TracedPicture& traced) {
  RgbaImage image{
      static_cast<std::uint32_t>(traced.width), static_cast<std::uint32_t>(traced.height), {}};
  for (const glm::dvec3& pixel : traced.pixels) {
    const glm::dvec3 stored = linear_to_srgb(pixel);
    image.pixels.insert(image.pixels.end(),
                        {byte_of(stored.x), byte_of(stored.y), byte_of(stored.z), 255});
  }
  return image;
}

/// The pixels that count, and their mean difference.
struct Region {
  std::vector<std::size_t> pixels;
  [[nodiscard]] double difference(const RgbaImage& a, const RgbaImage& b) const {
    double sum = 0;
    for (const std::size_t i : pixels) {
      sum += ciede2000(lab_of(&a.pixels[4 * i]), lab_of(&b.pixels[4 * i]));
    }
    return pixels.empty() ? kNoFigure : sum / static_cast<double>(pixels.size());
  }
};

/// The drawing of one subject.
struct Pictures {
  RgbaImage camera;
  RgbaImage plain;
  RgbaImage ours;
  RgbaImage reference;
  RgbaImage halves[2];  ///< of the reference's paths
  Region model;
  Region ground;
  RgbaImage evening_follows;
  RgbaImage evening_fixed;
  RgbaImage evening_reference;
};

class LightStage {
 public:
  LightStage(const BundleView& bundle, const LightBenchOptions& options)
      : bundle_(bundle), options_(options) {
    camera_ = default_camera(options.width, options.height);
  }

  Result<void> set_up() {
    MODAR_ASSIGN(context_, GlContext::create_offscreen());
    MODAR_ASSIGN(ours_, Renderer::create(bundle_, probe_gl_caps()));
    {
      const PlainShading plainly;
      MODAR_ASSIGN(plain_, Renderer::create(bundle_, probe_gl_caps()));
    }
    MODAR_ASSIGN(follows_, Renderer::create(bundle_, probe_gl_caps()));
    RenderOptions fixed;
    fixed.estimate_light = false;
    fixed.samples = 4;
    ours_->set_options(fixed);
    RenderOptions follows;
    follows.samples = fixed.samples;
    follows_->set_options(follows);
    plain_->set_options(fixed);
    MODAR_TRY(ours_->resize(options_.width, options_.height));
    MODAR_TRY(follows_->resize(options_.width, options_.height));
    MODAR_TRY(plain_->resize(options_.width, options_.height));
    MODAR_ASSIGN(const RgbaImage print, read_image(options_.pattern));
    const PatternRecord& pattern = bundle_.patterns()[0];
    ground_.print.levels = mip_chain(print, {}, options_.jobs);
    ground_.half_width = static_cast<double>(pattern.half_width);
    ground_.half_height = static_cast<double>(pattern.half_height);
    ground_.table = srgb_to_linear(kTable);
    return {};
  }

  Result<Pictures> shoot(std::uint32_t index, const Subject& subject) {
    Report quiet;
    MODAR_ASSIGN(SourceModel source, read_model(subject.path, {options_.jobs}));
    MODAR_ASSIGN(const TriMesh mesh, weld(std::move(source), quiet, {options_.jobs}));
    MODAR_ASSIGN(const std::vector<SoftTexture> textures, load_textures(mesh, options_.jobs));
    const SceneRecord& record = bundle_.scenes()[index];
    TracedScene scene{mesh, textures, glm::dmat4(scene_matrix(record)), scene_light(bundle_, index),
                      ground_};
    LinearImage room;
    if (!subject.light.empty()) {
      MODAR_ASSIGN(room, read_linear_image(subject.light));
      scene.room = &room;
    }
    const glm::dmat4 view = view_of(scene);
    const PathTracer tracer(scene);
    const TracedPicture ground = tracer.draw_ground(camera_, view, options_.samples, options_.jobs);
    const int half = std::max(1, options_.samples / 2);
    const TracedPicture halves[2] = {tracer.draw(camera_, view, half, 1, options_.jobs),
                                     tracer.draw(camera_, view, half, 2, options_.jobs)};
    TracedPicture reference = halves[0];
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
      reference.pixels[i] = 0.5 * (halves[0].pixels[i] + halves[1].pixels[i]);
      reference.model[i] = 0.5 * (halves[0].model[i] + halves[1].model[i]);
    }
    Pictures pictures;
    pictures.camera = stored_picture(ground);
    pictures.reference = stored_picture(reference);
    for (std::size_t i = 0; i < 2; ++i) pictures.halves[i] = stored_picture(halves[i]);
    pictures.plain = draw(*plain_, pictures.camera, view, record, kNone);
    pictures.ours = draw(*ours_, pictures.camera, view, record, index);
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
      const glm::dvec3 change = glm::abs(reference.pixels[i] - ground.pixels[i]);
      const double bright = std::max(glm::dot(ground.pixels[i], glm::dvec3(1.0)), 1e-6);
      if (reference.model[i] > 0.5) {
        pictures.model.pixels.push_back(i);
      } else if (reference.model[i] == 0 && change.x + change.y + change.z > kChange * bright) {
        pictures.ground.pixels.push_back(i);
      }
    }
    add_evening(scene, view, index, pictures);
    return pictures;
  }

 private:
  /// The same in another light, of which the renderer knows the camera's picture alone.
  void add_evening(TracedScene scene, const glm::dmat4& view, std::uint32_t index,
                   Pictures& pictures) {
    for (glm::vec3& coefficient : scene.light.sky) coefficient *= kEvening;
    scene.light.key *= kEvening;
    const PathTracer tracer(scene);
    const int samples = std::max(1, options_.samples / 2);
    const RgbaImage camera =
        stored_picture(tracer.draw_ground(camera_, view, samples, options_.jobs));
    pictures.evening_reference =
        stored_picture(tracer.draw(camera_, view, samples, 3, options_.jobs));
    const SceneRecord& record = bundle_.scenes()[index];
    // A new scene of the same pattern: earlier light is followed away.
    for (int frame = 0; frame < 60; ++frame) {
      pictures.evening_follows = draw(*follows_, camera, view, record, index);
    }
    pictures.evening_fixed = draw(*ours_, camera, view, record, index);
  }

  /// From before and above, so near that the model and the pattern around it fill the picture.
  [[nodiscard]] glm::dmat4 view_of(const TracedScene& scene) const {
    std::vector<glm::dvec3> points;
    for (const glm::dvec3& p : scene.mesh.positions) {
      points.emplace_back(scene.place * glm::dvec4(p, 1.0));
    }
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        points.emplace_back(x * ground_.half_width, y * ground_.half_height, 0.0);
      }
    }
    glm::dvec3 low = points[0];
    glm::dvec3 high = points[0];
    for (const glm::dvec3& point : points) {
      low = glm::min(low, point);
      high = glm::max(high, point);
    }
    const glm::dvec3 target = 0.5 * (low + high);
    for (double distance = 1.0;; distance *= 1.03) {
      const glm::dmat4 view =
          glm::lookAt(target + distance * glm::normalize(glm::dvec3(0.35, -0.95, 0.7)), target,
                      glm::dvec3(0, 0, 1));
      const bool fits = std::ranges::all_of(points, [&](const glm::dvec3& point) {
        const glm::dvec3 eye(view * glm::dvec4(point, 1.0));
        return eye.z < -0.1 && std::fabs(eye.x) * camera_.fx < -0.48 * camera_.width * eye.z &&
               std::fabs(eye.y) * camera_.fy < -0.48 * camera_.height * eye.z;
      });
      if (fits || distance > 100) return view;
    }
  }

  RgbaImage draw(Renderer& renderer, const RgbaImage& camera_picture, const glm::dmat4& view,
                 const SceneRecord& record, std::uint32_t scene) {
    std::vector<std::uint8_t> rgb;
    for (std::size_t i = 0; i < camera_picture.pixels.size(); i += 4) {
      rgb.insert(rgb.end(), &camera_picture.pixels[i], &camera_picture.pixels[i] + 3);
    }
    const RgbImage background{rgb.data(), options_.width, options_.height, 3L * options_.width};
    const glm::mat4 world(view);
    const DrawItem item{record.model, world * scene_matrix(record), scene, world};
    const DepthRange range = depth_range(bundle_, {&item, 1});
    renderer.render(background, gl_projection(camera_, range.near_plane, range.far_plane),
                    {&item, 1});
    RgbaImage image{camera_picture.width, camera_picture.height,
                    std::vector<std::uint8_t>(camera_picture.pixels.size())};
    renderer.read_pixels(image.pixels);
    return image;
  }

  const BundleView& bundle_;
  const LightBenchOptions& options_;
  Camera camera_;
  TracedGround ground_;
  std::unique_ptr<GlContext> context_;  // outlives the renderers
  std::unique_ptr<Renderer> ours_;
  std::unique_ptr<Renderer> follows_;
  std::unique_ptr<Renderer> plain_;
};

/// Rows of one subject, and their sums.
class Rows {
 public:
  void add(const std::string& name, const Pictures& p) {
    add_region(name, "model", p.model, p);
    add_region(name, "ground", p.ground, p);
    const double follows = p.model.difference(p.evening_follows, p.evening_reference);
    const double fixed = p.model.difference(p.evening_fixed, p.evening_reference);
    rows_.push_back({name + " evening", follows, fixed, ratio(follows, fixed)});
    evenings_ = {evenings_.ours + follows, evenings_.plain + fixed, evenings_.count + 1};
    rows_.push_back(
        {name + " noise", p.model.difference(p.halves[0], p.halves[1]), kNoFigure, kNoFigure});
  }

  std::vector<BenchRow> finish() {
    for (const auto& [region, sum] : {std::pair{"mean model", models_},
                                      {"mean ground", grounds_},
                                      {"mean evening", evenings_}}) {
      if (sum.count == 0) continue;
      rows_.push_back(
          {region, sum.ours / sum.count, sum.plain / sum.count, ratio(sum.ours, sum.plain)});
    }
    return std::move(rows_);
  }

 private:
  struct Sum {
    double ours = 0;
    double plain = 0;
    int count = 0;
  };

  void add_region(const std::string& name, const std::string& what, const Region& region,
                  const Pictures& p) {
    if (region.pixels.empty()) return;
    const double ours = region.difference(p.ours, p.reference);
    const double plain = region.difference(p.plain, p.reference);
    rows_.push_back({name + " " + what, ours, plain, ratio(ours, plain)});
    Sum& sum = what == "model" ? models_ : grounds_;
    sum = {sum.ours + ours, sum.plain + plain, sum.count + 1};
  }

  std::vector<BenchRow> rows_;
  Sum models_;
  Sum grounds_;
  Sum evenings_;
};

}  // namespace

RgbaImage joined(const std::vector<RgbaImage>& images, bool across) {
  RgbaImage all;
  if (images.empty()) return all;
  for (const RgbaImage& image : images) {
    all.width = across ? all.width + image.width : image.width;
    all.height = across ? image.height : all.height + image.height;
  }
  if (!across) {
    for (const RgbaImage& image : images) {
      all.pixels.insert(all.pixels.end(), image.pixels.begin(), image.pixels.end());
    }
    return all;
  }
  for (std::uint32_t y = 0; y < all.height; ++y) {
    for (const RgbaImage& image : images) {
      const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(4 * y * image.width);
      all.pixels.insert(all.pixels.end(), row, row + static_cast<std::ptrdiff_t>(4 * image.width));
    }
  }
  return all;
}

Result<std::vector<BenchRow>> bench_light(const LightBenchOptions& options) {
  if (!options.folder.empty()) MODAR_TRY(make_output_folder(options.folder));
  const TemporaryFolder folder;
  std::vector<Subject> subjects;
  for (const std::string& argument : options.models) subjects.push_back(subject_of(argument));
  if (options.made) {
    MODAR_ASSIGN(const auto made, make_light_subjects(folder.path()));
    for (const std::string& path : made) subjects.push_back({path, UpAxis::kZ, {}});
    MODAR_ASSIGN(const auto reflecting, make_reflecting_subjects(folder.path()));
    const std::string& room = options.light.empty() ? reflecting[0] : options.light;
    for (std::size_t i = 1; i < reflecting.size(); ++i) {
      subjects.push_back({reflecting[i], UpAxis::kZ, room});
    }
  }
  MODAR_ASSIGN(const std::vector<std::byte> bytes, bake_scenes(subjects, options));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(bytes));
  LightStage stage(bundle, options);
  MODAR_TRY(stage.set_up());
  Rows rows;
  std::vector<RgbaImage> sheet;
  for (std::uint32_t i = 0; i < subjects.size(); ++i) {
    MODAR_ASSIGN(const Pictures pictures, stage.shoot(i, subjects[i]));
    const std::string name = file_stem(subjects[i].path);
    rows.add(name, pictures);
    sheet.push_back(
        joined({pictures.camera, pictures.plain, pictures.ours, pictures.reference,
                pictures.evening_fixed, pictures.evening_follows, pictures.evening_reference},
               true));
    if (!options.folder.empty()) {
      const std::filesystem::path into(options.folder);
      MODAR_TRY(write_png(sheet.back(), (into / (name + ".png")).string()));
    }
    if (options.progress) options.progress((i + 1.0) / static_cast<double>(subjects.size()));
  }
  if (!options.folder.empty()) {
    const std::filesystem::path into(options.folder);
    MODAR_TRY(write_png(joined(sheet, false), (into / "light.png").string()));
  }
  return rows.finish();
}

}  // namespace modar
