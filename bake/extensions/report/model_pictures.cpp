#include "bake/extensions/report/model_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/scene/scene_placement.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "formats/base/ranges.hpp"
#include "formats/tracker_record.hpp"
#include "modar/camera.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

constexpr std::array<std::uint8_t, 3> kBackdrop = {233, 236, 240};
constexpr double kDistance = 4.0;  // of the eye from the middle of a model in [-1,1]

/// Turns a model as its first scene does, so that z is up; one that is in none as the bundle states
/// its upright, else unchanged.
glm::dquat upright(const BundleView& bundle, std::uint32_t model) {
  for (const SceneRecord& scene : bundle.scenes()) {
    if (scene.model != model) continue;
    const float* r = scene.rotation;
    return {r[3], r[0], r[1], r[2]};
  }
  const auto stated = stated_upright(bundle, model);
  return rotation_of(stated ? stated->axis : UpAxis::kZ, {});
}

glm::dmat4 table_view() {
  return glm::lookAt(kDistance * glm::normalize(glm::dvec3(0.55, -1.0, 0.4)), glm::dvec3(0.0),
                     glm::dvec3(0, 0, 1));
}

glm::dmat4 model_view(const glm::dquat& rotation) {
  return table_view() * glm::mat4_cast(rotation);
}

/// Calls body(eye, chunk) for each vertex of the coarsest levels, in eye space.
template <class Body>
void for_coarse_vertices(const BundleView& bundle, const ModelRecord& model, const glm::dmat4& view,
                         const Body& body) {
  const VertexDecoder decoder(bundle.layouts()[model.layout]);
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    const LevelRecord& level = bundle.levels()[chunk.first_level + chunk.level_count - 1];
    for (std::uint32_t v = 0; v < level.vertex_count; ++v) {
      const std::byte* vertex =
          bundle.vertices().data() + level.vertex_offset + std::size_t{v} * decoder.stride();
      body(glm::dvec3(view * glm::dvec4(decoder.position(vertex, chunk), 1.0)));
    }
  }
}

/// Focal length at which points of eye space fill a picture of that size.
double fitting_focal(const std::vector<glm::dvec3>& eyes, double width, double height) {
  double reach = 1e-3;  // half of the picture's height over the focal length
  for (const glm::dvec3& eye : eyes) {
    reach = std::max({reach, std::fabs(eye.y / eye.z), std::fabs(eye.x / eye.z) * height / width});
  }
  return 0.46 * height / reach;
}

double model_focal(const BundleView& bundle, std::uint32_t index, const glm::dquat& rotation,
                   double width, double height) {
  std::vector<glm::dvec3> eyes;
  for_coarse_vertices(bundle, bundle.models()[index], model_view(rotation),
                      [&](const glm::dvec3& eye) { eyes.push_back(eye); });
  return fitting_focal(eyes, width, height);
}

/// A point of eye space on the picture.
glm::dvec2 project(const glm::dvec3& eye, double focal, double width, double height) {
  return {width / 2 + focal * eye.x / -eye.z, height / 2 - focal * eye.y / -eye.z};
}

}  // namespace

RgbaImage pattern_image(const BundleView& bundle, std::uint32_t pattern) {
  TrackerRecordView record;
  const auto bytes = bundle.section(SectionType::kTrackerRecord, pattern);
  if (bytes.empty() || view_tracker_record(bytes, record)) return {};
  RgbaImage image{record.header.width, record.header.height, {}};
  for (std::size_t i = 0; i < std::size_t{image.width} * image.height; ++i) {
    const std::uint8_t gray = record.pixels[i];
    image.pixels.insert(image.pixels.end(), {gray, gray, gray, 255});
  }
  return image;
}

struct ModelCamera::State {
  BundleView bundle;
  Camera camera;
  std::unique_ptr<GlContext> context;  // outlives the renderer
  std::unique_ptr<Renderer> renderer;

  RgbaImage shoot(const RgbImage& background, const DrawItem& item) {
    const DepthRange range = depth_range(bundle, {&item, 1});
    renderer->render(background, gl_projection(camera, range.near_plane, range.far_plane),
                     {&item, 1});
    RgbaImage image{
        static_cast<std::uint32_t>(camera.width), static_cast<std::uint32_t>(camera.height), {}};
    image.pixels.resize(4 * std::size_t{image.width} * image.height);
    renderer->read_pixels(image.pixels);
    return image;
  }
};

ModelCamera::ModelCamera(std::unique_ptr<State> state) : state_(std::move(state)) {}
ModelCamera::~ModelCamera() = default;

Result<std::unique_ptr<ModelCamera>> ModelCamera::create(const BundleView& bundle, int width,
                                                         int height) {
  auto state = std::make_unique<State>();
  state->bundle = bundle;
  state->camera = default_camera(width, height);
  MODAR_ASSIGN(state->context, GlContext::create_offscreen());
  MODAR_ASSIGN(state->renderer, Renderer::create(state->bundle, probe_gl_caps()));
  RenderOptions options;
  options.clear_colour = {kBackdrop[0] / 255.0f, kBackdrop[1] / 255.0f, kBackdrop[2] / 255.0f, 1};
  state->renderer->set_options(options);
  MODAR_TRY(state->renderer->resize(width, height));
  return std::unique_ptr<ModelCamera>(new ModelCamera(std::move(state)));
}

RgbaImage ModelCamera::model(std::uint32_t index) {
  return standing(index, upright(state_->bundle, index));
}

RgbaImage ModelCamera::turned(std::uint32_t index, double degrees) {
  return standing(index, glm::angleAxis(glm::radians(degrees), glm::dvec3(0, 0, 1)) *
                             upright(state_->bundle, index));
}

RgbaImage ModelCamera::standing(std::uint32_t index, const glm::dquat& rotation) {
  Camera& camera = state_->camera;
  camera.fx = camera.fy = model_focal(state_->bundle, index, rotation, camera.width, camera.height);
  return state_->shoot(RgbImage{},
                       {index, glm::mat4(model_view(rotation)), kNone, glm::mat4(table_view())});
}

RgbaImage ModelCamera::moving(std::uint32_t clip, double share) {
  const BundleView& bundle = state_->bundle;
  const ClipRecord& record = bundle.clips()[clip];
  const glm::dmat4 view = model_view(upright(bundle, record.model));
  std::vector<glm::dvec3> eyes;
  visit_boxes(bundle, bundle.models()[record.model], [&](const auto& least, const auto& most) {
    for (int i = 0; i < 8; ++i) {
      glm::dvec4 corner(0, 0, 0, 1);
      for (int axis = 0; axis < 3; ++axis)
        corner[axis] = static_cast<double>((i >> axis & 1) == 0 ? least[axis] : most[axis]);
      eyes.emplace_back(view * corner);
    }
  });
  Camera& camera = state_->camera;
  camera.fx = camera.fy = fitting_focal(eyes, camera.width, camera.height);
  ClipPlayer player(bundle, record.model);
  player.play(clip, false, 0);
  player.advance(share * static_cast<double>(record.seconds));
  player.pose();
  DrawItem item{record.model, glm::mat4(view), kNone, glm::mat4(table_view())};
  item.bones = player.bones().data();
  return state_->shoot(RgbImage{}, item);
}

RgbaImage ModelCamera::scene(std::uint32_t index) {
  const SceneRecord& scene = state_->bundle.scenes()[index];
  const PatternRecord& pattern = state_->bundle.patterns()[scene.pattern];
  std::vector<glm::dvec3> points;  // of the pattern's corners and the model, pattern space
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      points.emplace_back(x * static_cast<double>(pattern.half_width),
                          y * static_cast<double>(pattern.half_height), 0.0);
    }
  }
  for_coarse_vertices(state_->bundle, state_->bundle.models()[scene.model],
                      glm::dmat4(scene_matrix(scene)),
                      [&](const glm::dvec3& point) { points.push_back(point); });
  glm::dvec3 least = points[0];
  glm::dvec3 greatest = points[0];
  for (const glm::dvec3& point : points) {
    least = glm::min(least, point);
    greatest = glm::max(greatest, point);
  }
  const glm::dvec3 target = (least + greatest) / 2.0;
  const glm::dvec3 eye =
      target + 2.2 * glm::length(greatest - least) * glm::normalize(glm::dvec3(0.35, -0.95, 0.75));
  const glm::dmat4 view = glm::lookAt(eye, target, glm::dvec3(0, 0, 1));
  for (glm::dvec3& point : points) point = glm::dvec3(view * glm::dvec4(point, 1.0));
  Camera& camera = state_->camera;
  camera.fx = camera.fy = fitting_focal(points, camera.width, camera.height);
  const glm::dmat4 to_world = glm::inverse(view);
  const RgbaImage print = pattern_image(state_->bundle, scene.pattern);
  std::vector<std::uint8_t> background(3 * static_cast<std::size_t>(camera.width) *
                                       static_cast<std::size_t>(camera.height));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const glm::dvec3 ray(glm::dmat3(to_world) * glm::dvec3((x - camera.cx) / camera.fx,
                                                             -(y - camera.cy) / camera.fy, -1.0));
      const double reach = ray.z < 0 ? -eye.z / ray.z : 0;  // to the pattern's plane
      const double u = ((eye.x + reach * ray.x) / static_cast<double>(pattern.half_width) + 1) / 2;
      const double v = (1 - (eye.y + reach * ray.y) / static_cast<double>(pattern.half_height)) / 2;
      std::uint8_t* out =
          &background[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                           static_cast<std::size_t>(x))];
      std::copy(kBackdrop.begin(), kBackdrop.end(), out);
      if (reach <= 0 || u < 0 || u >= 1 || v < 0 || v >= 1 || print.width == 0) continue;
      const auto column = static_cast<std::size_t>(u * print.width);
      const auto row = static_cast<std::size_t>(v * print.height);
      std::copy_n(&print.pixels[4 * (row * print.width + column)], 3, out);
    }
  }
  const RgbImage picture{background.data(), camera.width, camera.height, 3L * camera.width};
  return state_->shoot(
      picture, {scene.model, glm::mat4(view) * scene_matrix(scene), index, glm::mat4(view)});
}

namespace {

struct DrawnTriangle {
  double depth = 0;
  std::array<glm::dvec2, 3> points;
  std::uint32_t chunk = 0;
  double light = 0;
};

/// Triangles of a level of detail, or of the coarsest that a chunk has.
std::size_t triangles_of(const BundleView& bundle, const ModelRecord& model, std::uint32_t level) {
  std::size_t count = 0;
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + c];
    count +=
        bundle.levels()[chunk.first_level + std::min(level, chunk.level_count - 1)].index_count / 3;
  }
  return count;
}

void add_chunk(const BundleView& bundle, const ModelRecord& model, std::uint32_t index,
               std::uint32_t level_index, double focal, const glm::dmat4& view,
               std::vector<DrawnTriangle>& triangles) {
  const ChunkRecord& chunk = bundle.chunks()[model.first_chunk + index];
  const LevelRecord& level =
      bundle.levels()[chunk.first_level + std::min(level_index, chunk.level_count - 1)];
  const VertexDecoder decoder(bundle.layouts()[model.layout]);
  std::vector<glm::dvec3> eyes;
  for (std::uint32_t v = 0; v < level.vertex_count; ++v) {
    const std::byte* vertex =
        bundle.vertices().data() + level.vertex_offset + std::size_t{v} * decoder.stride();
    eyes.emplace_back(view * glm::dvec4(decoder.position(vertex, chunk), 1.0));
  }
  const std::byte* indices = bundle.indices().data() + level.index_offset;
  for (std::uint32_t i = 0; i + 2 < level.index_count; i += 3) {
    std::array<glm::dvec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint16_t vertex = 0;
      std::memcpy(&vertex, indices + 2 * (i + k), 2);
      if (vertex >= eyes.size()) return;
      corner[k] = eyes[vertex];
    }
    const glm::dvec3 normal = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    if (glm::dot(normal, corner[0]) >= 0 || glm::length(normal) < 1e-12) continue;
    DrawnTriangle triangle;
    triangle.depth = corner[0].z + corner[1].z + corner[2].z;
    triangle.chunk = index;
    triangle.light =
        0.55 + 0.45 * glm::dot(glm::normalize(normal), glm::normalize(glm::dvec3(0.3, 0.6, 0.8)));
    for (std::size_t k = 0; k < 3; ++k) triangle.points[k] = project(corner[k], focal, 400, 300);
    triangles.push_back(triangle);
  }
}

}  // namespace

std::string wireframe_svg(const BundleView& bundle, std::uint32_t model_index, std::size_t most,
                          std::size_t& drawn) {
  const ModelRecord& model = bundle.models()[model_index];
  std::uint32_t level = 0;
  while (level + 1 < model.level_count && triangles_of(bundle, model, level) > most) ++level;
  std::vector<DrawnTriangle> triangles;
  const glm::dquat rotation = upright(bundle, model_index);
  const double focal = model_focal(bundle, model_index, rotation, 400, 300);
  for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
    add_chunk(bundle, model, c, level, focal, model_view(rotation), triangles);
  }
  ranges::sort(triangles, {}, &DrawnTriangle::depth);
  // Behind 20 times as many, nobody sees single triangles: the nearest represent all.
  if (triangles.size() > 20 * most) {
    triangles.erase(triangles.begin(), triangles.end() - static_cast<std::ptrdiff_t>(20 * most));
  }
  drawn = triangles.size();
  std::string svg;
  for (const DrawnTriangle& t : triangles) {
    // Hues a golden angle apart: neighbours in number differ most.
    const double hue = std::fmod(200 + 137.508 * t.chunk, 360.0);
    char text[160];
    std::snprintf(text, sizeof text,
                  "<path d='M%.1f %.1fL%.1f %.1fL%.1f %.1fZ' fill='hsl(%.0f,58%%,%.0f%%)'/>",
                  t.points[0].x, t.points[0].y, t.points[1].x, t.points[1].y, t.points[2].x,
                  t.points[2].y, hue, 36 + 34 * std::max(0.0, t.light));
    svg += text;
  }
  return svg;
}

}  // namespace modar
