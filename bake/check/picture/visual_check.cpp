// Twelve views, two renderers, two measures.
#include "bake/check/picture/visual_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/check/picture/reference_renderer.hpp"
#include "bake/check/verdict.hpp"
#include "bake/image/difference.hpp"
#include "bake/import/read_model.hpp"
#include "bake/mesh/clip/movement.hpp"
#include "bake/mesh/repair/repair.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "bake/texture/relief/relief.hpp"
#include "formats/base/ranges.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

/// The part of both images that shows something, so that empty surroundings earn nothing.
struct Crop {
  std::uint32_t left = 0;
  std::uint32_t top = 0;
  std::uint32_t right = 0;  ///< behind the last
  std::uint32_t bottom = 0;
};

bool is_clear(const std::uint8_t* pixel, const std::array<std::uint8_t, 3>& clear) {
  return std::equal(clear.begin(), clear.end(), pixel);
}

Crop shown_part(const RgbaImage& a, const RgbaImage& b, const std::array<std::uint8_t, 3>& clear) {
  Crop crop{a.width, a.height, 0, 0};
  for (std::uint32_t y = 0; y < a.height; ++y) {
    for (std::uint32_t x = 0; x < a.width; ++x) {
      const std::size_t at = 4 * (std::size_t{y} * a.width + x);
      if (is_clear(&a.pixels[at], clear) && is_clear(&b.pixels[at], clear)) continue;
      crop = {std::min(crop.left, x), std::min(crop.top, y), std::max(crop.right, x + 1),
              std::max(crop.bottom, y + 1)};
    }
  }
  return crop;
}

std::size_t shown_pixels(const RgbaImage& image, const std::array<std::uint8_t, 3>& clear) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    count += is_clear(&image.pixels[i], clear) ? 0U : 1U;
  }
  return count;
}

/// Share of the fullest view's pixels. Smaller views see a sheet from its edge, which two renderers
/// round differently.
constexpr double kLeastShown = 0.02;
constexpr std::size_t kClipTimes = 3;  ///< each in the middle of a third

RgbaImage cut(const RgbaImage& image, const Crop& crop) {
  RgbaImage out{crop.right - crop.left, crop.bottom - crop.top, {}};
  for (std::uint32_t y = crop.top; y < crop.bottom; ++y) {
    const auto row = image.pixels.begin() +
                     static_cast<std::ptrdiff_t>(4 * (std::size_t{y} * image.width + crop.left));
    out.pixels.insert(out.pixels.end(), row, row + static_cast<std::ptrdiff_t>(4 * out.width));
  }
  return out;
}

/// Is a part drawn half through? Pictures with alpha are, but for those that are there or not.
bool translucent(const TriMesh& mesh, const BundleView& bundle, const ModelRecord& model) {
  for (std::uint32_t m = 0; m < model.material_count; ++m) {
    const MaterialRecord& material = bundle.materials()[model.first_material + m];
    if (material.opacity < 1.0f) return true;  // also of a picture of one colour
    if (material.texture == kNone) continue;
    const std::uint32_t flags = bundle.textures()[material.texture].flags;
    if ((flags & kTextureAlpha) != 0 && (flags & kTextureCutOut) == 0) return true;
  }
  return std::any_of(mesh.materials.begin(), mesh.materials.end(), [](const SourceMaterial& m) {
    return m.opacity < 1.0f || !m.alpha_map.empty();
  });
}

/// The bytes of a bundle whose vertices all get all of the light from around: a source says nothing
/// of occlusion, and the reference has none.
std::vector<std::byte> without_occlusion(const BundleView& bundle) {
  constexpr auto kAllLight = std::byte{127};
  std::vector<std::byte> bytes(bundle.bytes().begin(), bundle.bytes().end());
  std::byte* vertices = bytes.data() + (bundle.vertices().data() - bundle.bytes().data());
  for (std::uint32_t g = 0; g < bundle.chunk_groups(); ++g) {
    const ChunkGroup group = bundle.chunk_group(g);
    const std::uint32_t layout = bundle.models()[group.model].layout;
    const std::uint32_t offset = occlusion_byte(bundle.occlusion(), layout);
    if (offset == kNone) continue;
    const std::size_t stride = bundle.layouts()[layout].stride;
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[group.first_chunk + c];
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        const LevelRecord& level = bundle.levels()[chunk.first_level + l];
        for (std::size_t v = 0; v < level.vertex_count; ++v) {
          vertices[level.vertex_offset + v * stride + offset] = kAllLight;
        }
      }
    }
  }
  return bytes;
}

class VisualComparer {
 public:
  VisualComparer(const BundleView& bundle, const VisualOptions& options, const IssueSink& sink)
      : bundle_(bundle), options_(options), sink_(sink) {
    render_.clear_colour = {0.5f, 0.5f, 0.5f, 1.0f};
    clear_ = {128, 128, 128};
    camera_ = default_camera(options.side, options.side);
  }

  /// Before look(): the models as the reference is lit.
  Result<void> light_evenly() {
    MODAR_ASSIGN(context_, GlContext::create_offscreen());
    plain_bytes_ = without_occlusion(bundle_);
    MODAR_ASSIGN(const BundleView plain, BundleView::open(plain_bytes_));
    MODAR_ASSIGN(renderer_, Renderer::create(plain, probe_gl_caps()));
    renderer_->set_options(render_);
    return renderer_->resize(options_.side, options_.side);
  }

  /// Between the last look() and the first levels_of(): the unchanged models.
  Result<void> light_as_baked() {
    renderer_.reset();
    plain_bytes_ = {};
    MODAR_ASSIGN(renderer_, Renderer::create(bundle_, probe_gl_caps()));
    return {};
  }

  Result<std::vector<LevelLook>> levels_of(std::uint32_t index) {
    return look_at_levels(bundle_, *renderer_, index, {});
  }

  Result<ModelLook> look(std::uint32_t index, const ModelRequest& asked) {
    Report quiet;
    MODAR_ASSIGN(SourceModel source, read_model(asked.path, {options_.jobs, asked.own_picture}));
    if (options_.repair) repair_model(source, options_.repair_support, quiet);
    const SourceMovement movement = std::move(source.movement);
    MODAR_ASSIGN(TriMesh mesh, weld(std::move(source), quiet, {options_.jobs, options_.crease}));
    const auto upright = stated_upright(bundle_, index);
    ReliefOptions relief;
    relief.stands = rotation_of(upright ? upright->axis : UpAxis::kZ, {});
    relief.max_side = kMaxImageSide;
    relief.jobs = options_.jobs;
    MODAR_TRY(draw_relief(mesh, relief, quiet));
    ModelLook look;
    look.name = bundle_.name(bundle_.models()[index].name);
    look.judged = !translucent(mesh, bundle_, bundle_.models()[index]);
    if (!look.judged) return look;
    MODAR_ASSIGN(const std::vector<SoftTexture> textures, load_textures(mesh, options_.jobs));
    worst_ssim_ = 2;
    static_cast<ViewsLook&>(look) = compare({index, mesh, textures}, 0, 1);
    for (std::uint32_t c = 0; c < bundle_.clips().size(); ++c) {
      if (bundle_.clips()[c].model != index) continue;
      const auto clip =
          ranges::find(movement.clips, bundle_.name(bundle_.clips()[c].name), &SourceClip::name);
      if (clip != movement.clips.end())
        look.clips.push_back(clip_look({index, mesh, textures}, movement, *clip, c));
    }
    if (!options_.picture_folder.empty()) {
      look.picture =
          (std::filesystem::path(options_.picture_folder) / (look.name + ".png")).string();
      MODAR_TRY(write_png(worst_, look.picture));
    }
    judge(index, look);
    return look;
  }

 private:
  struct Subject {
    std::uint32_t model = 0;
    const TriMesh& mesh;
    const std::vector<SoftTexture>& textures;
    const BoneMatrix* bones = nullptr;
  };

  ClipLook clip_look(const Subject& rest, const SourceMovement& movement, const SourceClip& clip,
                     std::uint32_t number) {
    ClipLook look;
    look.name = clip.name;
    look.ssim_mean = 0;
    for (std::size_t i = 0; i < kClipTimes; ++i) {
      const double time = clip.duration * (2.0 * static_cast<double>(i) + 1) / (2 * kClipTimes);
      ClipPlayer player(bundle_, rest.model);
      player.play(number, false, 0);
      player.advance(time);
      player.pose();
      const ViewsLook views = compare({rest.model, moved_mesh(rest.mesh, movement, clip, time),
                                       rest.textures, player.bones().data()},
                                      i, kClipTimes);
      look.ssim_mean += views.ssim_mean / kClipTimes;
      look.delta_e_mean += views.delta_e_mean / kClipTimes;
      look.delta_e_worst = std::max(look.delta_e_worst, views.delta_e_worst);
      if (i > 0 && views.ssim_worst >= look.ssim_worst) continue;
      look.ssim_worst = views.ssim_worst;
      look.worst_view = views.worst_view;
      look.worst_s = time;
    }
    return look;
  }

  /// Every `step`th view.
  ViewsLook compare(const Subject& subject, std::size_t first, std::size_t step) {
    double radius = 0;
    for (const glm::dvec3& p : subject.mesh.positions) radius = std::max(radius, glm::length(p));
    // The sphere around the model fills the view; of one that comes too close, what fits.
    radius = std::min(radius, 0.9 * kViewDistance);
    camera_.fx = camera_.fy =
        0.49 * options_.side * std::sqrt(kViewDistance * kViewDistance / (radius * radius) - 1);
    ViewsLook look{0, 2, 0, 0, 0};
    const auto views = view_directions();
    std::vector<RgbaImage> drawn;
    std::size_t most_shown = 0;
    for (std::size_t view = first; view < kViews; view += step) {
      drawn.push_back(draw(subject, view_from(views[view])));
      most_shown = std::max(most_shown, shown_pixels(drawn.back(), clear_));
    }
    double shown_views = 0;
    for (std::size_t view = first; view < kViews; view += step) {
      const RgbaImage wanted = render_reference(subject.mesh, subject.textures, camera_,
                                                view_from(views[view]), render_);
      const RgbaImage& shown = drawn[(view - first) / step];
      const std::size_t pixels =
          std::max(shown_pixels(wanted, clear_), shown_pixels(shown, clear_));
      if (kLeastShown * static_cast<double>(most_shown) > static_cast<double>(pixels)) continue;
      const Crop crop = shown_part(wanted, shown, clear_);
      if (crop.right <= crop.left) continue;
      const double similar = ssim(cut(wanted, crop), cut(shown, crop));
      const double off = mean_delta_e(wanted, shown, clear_);
      look.ssim_mean += similar;
      look.delta_e_mean += off;
      ++shown_views;
      look.delta_e_worst = std::max(look.delta_e_worst, off);
      if (similar < look.ssim_worst) {
        look.ssim_worst = similar;
        look.worst_view = static_cast<int>(view);
      }
      if (similar < worst_ssim_) {
        worst_ssim_ = similar;
        worst_ = quality_picture(wanted, shown);
      }
      if (options_.progress) {
        options_.progress((subject.model + static_cast<double>(view + 1) / kViews) /
                          bundle_.models().size());
      }
    }
    // A sheet shows nothing from behind.
    if (shown_views == 0) return {};
    look.ssim_mean /= shown_views;
    look.delta_e_mean /= shown_views;
    return look;
  }

  RgbaImage draw(const Subject& subject, const glm::dmat4& to_eye) {
    DrawItem item{subject.model, glm::mat4(to_eye)};
    item.bones = subject.bones;
    const DepthRange range = depth_range(bundle_, {&item, 1});
    renderer_->render(RgbImage{}, gl_projection(camera_, range.near_plane, range.far_plane),
                      {&item, 1});
    RgbaImage image{
        static_cast<std::uint32_t>(options_.side), static_cast<std::uint32_t>(options_.side), {}};
    image.pixels.resize(4 * std::size_t{image.width} * image.height);
    renderer_->read_pixels(image.pixels);
    return image;
  }

  void judge(std::uint32_t index, const ModelLook& look) {
    judge(index, look, "model '" + look.name + "'", "in the worst of 12 views");
    for (const ClipLook& clip : look.clips) {
      judge(index, clip, "model '" + look.name + "', clip '" + clip.name + "'",
            "at " + std::to_string(clip.worst_s) + " s");
    }
  }

  void judge(std::uint32_t index, const ViewsLook& look, const std::string& what,
             const std::string& when) {
    if (look.ssim_worst >= options_.least_ssim && look.delta_e_worst <= options_.greatest_delta_e)
      return;
    const ModelRecord& model = bundle_.models()[index];
    sink_(Issue{&workstation_issue_kind(WorkstationRule::kVisualDiffers), what,
                static_cast<std::uint64_t>(reinterpret_cast<const std::byte*>(&model) -
                                           bundle_.bytes().data()),
                when + " SSIM is " + std::to_string(look.ssim_worst) + " (at least " +
                    std::to_string(options_.least_ssim) + "), the colour is off by " +
                    std::to_string(look.delta_e_worst) + " (at most " +
                    std::to_string(options_.greatest_delta_e) + ")"});
  }

  const BundleView& bundle_;
  const VisualOptions& options_;
  const IssueSink& sink_;
  RenderOptions render_;
  std::array<std::uint8_t, 3> clear_{};
  Camera camera_;
  std::unique_ptr<GlContext> context_;
  std::vector<std::byte> plain_bytes_;  ///< the bundle as the reference is lit
  std::unique_ptr<Renderer> renderer_;  ///< of these, then of the bundle
  double worst_ssim_ = 2;               ///< of a model, at rest and in its clips
  RgbaImage worst_;                     ///< that view
};

}  // namespace

glm::dvec3 lab_of(const std::uint8_t* pixel) {
  static const std::vector<double> table = [] {
    std::vector<double> values;
    for (int i = 0; i < 256; ++i) values.push_back(srgb_to_linear(glm::dvec3(i / 255.0)).x);
    return values;
  }();
  const double r = table[pixel[0]];
  const double g = table[pixel[1]];
  const double b = table[pixel[2]];
  const auto f = [](double t) {
    return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  };
  const double x = f((0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047);
  const double y = f(0.2126729 * r + 0.7151522 * g + 0.0721750 * b);
  const double z = f((0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

double ciede2000(const glm::dvec3& a, const glm::dvec3& b) {
  constexpr double kDegree = 0.017453292519943295;
  const auto seventh = [](double x) { return std::pow(x, 7.0); };
  const double mean_chroma = (std::hypot(a.y, a.z) + std::hypot(b.y, b.z)) / 2;
  const double stretch =
      1.5 - 0.5 * std::sqrt(seventh(mean_chroma) / (seventh(mean_chroma) + seventh(25.0)));
  const glm::dvec2 p(a.y * stretch, a.z);
  const glm::dvec2 q(b.y * stretch, b.z);
  const double c1 = glm::length(p);
  const double c2 = glm::length(q);
  const auto hue = [](const glm::dvec2& v) {
    const double angle = v.x == 0 && v.y == 0 ? 0.0 : std::atan2(v.y, v.x) / kDegree;
    return angle < 0 ? angle + 360 : angle;
  };
  const double h1 = hue(p);
  const double h2 = hue(q);
  const bool gray = c1 * c2 == 0;
  double turn = gray ? 0.0 : h2 - h1;
  if (turn > 180) turn -= 360;
  if (turn < -180) turn += 360;
  double h = gray ? h1 + h2 : (h1 + h2) / 2;
  if (!gray && std::fabs(h1 - h2) > 180) h += h1 + h2 < 360 ? 180 : -180;
  const double l = (a.x + b.x) / 2 - 50;
  const double c = (c1 + c2) / 2;
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.20 * std::cos((4 * h - 63) * kDegree);
  const double of_l = (b.x - a.x) / (1 + 0.015 * l * l / std::sqrt(20 + l * l));
  const double of_c = (c2 - c1) / (1 + 0.045 * c);
  const double of_h = 2 * std::sqrt(c1 * c2) * std::sin(turn / 2 * kDegree) / (1 + 0.015 * c * t);
  const double bend = 60 * std::exp(-std::pow((h - 275) / 25, 2)) * kDegree;
  const double rotate = -2 * std::sqrt(seventh(c) / (seventh(c) + seventh(25.0))) * std::sin(bend);
  return std::sqrt(of_l * of_l + of_c * of_c + of_h * of_h + rotate * of_c * of_h);
}

double mean_delta_e(const RgbaImage& a, const RgbaImage& b,
                    const std::array<std::uint8_t, 3>& clear) {
  // In w, whether both show something there.
  std::vector<std::array<glm::dvec4, 2>> colours(a.pixels.size() / 4);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const std::uint8_t* const p = &a.pixels[4 * i];
    const std::uint8_t* const q = &b.pixels[4 * i];
    if (is_clear(p, clear) || is_clear(q, clear)) continue;
    colours[i] = {glm::dvec4(lab_of(p), 1), glm::dvec4(lab_of(q), 1)};
  }
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (colours[i][0].w == 0) continue;
    std::array<glm::dvec4, 2> means{};
    const std::size_t x = i % a.width;
    const std::size_t y = i / a.width;
    for (std::size_t v = std::max<std::size_t>(y, 1) - 1; v < std::min(y + 2, a.height + 0UL);
         ++v) {
      for (std::size_t u = std::max<std::size_t>(x, 1) - 1; u < std::min(x + 2, a.width + 0UL);
           ++u) {
        for (std::size_t k = 0; k < 2; ++k) means[k] += colours[v * a.width + u][k];
      }
    }
    sum += ciede2000(glm::dvec3(means[0]) / means[0].w, glm::dvec3(means[1]) / means[1].w);
    ++count;
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

Result<std::vector<ModelLook>> check_looks(const BundleView& bundle, const VisualOptions& options,
                                           const IssueSink& sink) {
  std::vector<ModelLook> looks;
  if (bundle.models().empty()) return looks;
  VisualComparer looker(bundle, options, sink);
  MODAR_TRY(looker.light_evenly());
  std::vector<std::uint32_t> models;  // of the looks
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const ModelRecord& model = bundle.models()[m];
    const auto path = ranges::find(options.models, bundle.name(model.name), &ModelRequest::name);
    if (path == options.models.end()) continue;  // SOURCE_MISSING reports it
    MODAR_ASSIGN(ModelLook look, looker.look(m, *path));
    looks.push_back(std::move(look));
    models.push_back(m);
  }
  MODAR_TRY(looker.light_as_baked());
  for (std::size_t i = 0; i < looks.size(); ++i) {
    if (!looks[i].judged) continue;
    MODAR_ASSIGN(looks[i].levels, looker.levels_of(models[i]));
  }
  return looks;
}

}  // namespace modar
