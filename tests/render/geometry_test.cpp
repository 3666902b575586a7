// Vertices and indices straight from mapped bytes land where projection says, in every layout.
#include <cstring>
#include <functional>
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "runtime/render/vertex_format.hpp"
#include "tests/render/reference.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

Camera small_camera() {
  Camera camera = default_camera(160, 120);
  // Off-centre and with unequal focal lengths: nothing may cancel out.
  camera.fx = 150.0;
  camera.fy = 141.0;
  camera.cx = 71.3;
  camera.cy = 63.9;
  return camera;
}

/// Random triangles with a colour of their own each.
std::vector<Triangle> random_triangles(std::uint32_t seed, int count) {
  std::mt19937 random(seed);
  const auto coordinate = [&] {
    return on_half_grid(static_cast<double>(random() % 2001) / 1000.0 - 1.0);
  };
  std::vector<Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    Triangle triangle;
    const glm::dvec3 base(coordinate() * 0.7, coordinate() * 0.7, coordinate() * 0.7);
    for (glm::dvec3& corner : triangle.corners) {
      for (int axis = 0; axis < 3; ++axis) {
        corner[axis] = on_half_grid(base[axis] + coordinate() * 0.3);
      }
    }
    for (std::uint8_t& channel : triangle.colour) channel = static_cast<std::uint8_t>(random());
    triangles.push_back(triangle);
  }
  return triangles;
}

glm::dmat4 some_view() {
  glm::dmat4 view = glm::translate(glm::dmat4(1.0), glm::dvec3(0.1, -0.05, -2.6));
  return glm::rotate(view, 0.7, glm::normalize(glm::dvec3(0.3, 1.0, 0.2)));
}

/// What the triangle of a hit shows there, of 255.
using ColourAt = std::function<glm::dvec3(const Hit&)>;

/// Every pixel that the rays are certain of shows that, within `tolerance`.
void expect_picture(const std::vector<std::uint8_t>& pixels, const std::vector<Hit>& hits,
                    const ColourAt& shown, int tolerance) {
  int compared = 0;
  int covered = 0;
  int wrong = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].certain) continue;
    ++compared;
    const glm::dvec3 expected = hits[i].triangle < 0 ? glm::dvec3(0.0) : shown(hits[i]);
    covered += hits[i].triangle >= 0;
    for (int c = 0; c < 3; ++c) {
      const auto pixel = static_cast<long>(pixels[i * 4 + static_cast<std::size_t>(c)]);
      if (std::abs(pixel - std::lround(expected[c])) > tolerance) {
        ++wrong;
        break;
      }
    }
  }
  EXPECT_EQ(wrong, 0) << "of " << compared << " pixels";
  EXPECT_GT(covered, 1500);
  EXPECT_GT(compared, static_cast<int>(hits.size()) * 3 / 4);
}

/// The same where each triangle has one colour.
void expect_picture(const std::vector<std::uint8_t>& pixels, const std::vector<Hit>& hits,
                    std::span<const Triangle> triangles, int tolerance) {
  const auto colour = [&](const Hit& hit) {
    const Rgb& c = triangles[static_cast<std::size_t>(hit.triangle)].colour;
    return glm::dvec3(c[0], c[1], c[2]);
  };
  expect_picture(pixels, hits, colour, tolerance);
}

class GeometryTest : public GlTest {
 protected:
  void check_layout(Layout layout, const GlCaps& caps, const glm::dmat4& view, bool two_sided) {
    const std::vector<Triangle> triangles = random_triangles(7, 60);
    SceneMaker maker;
    maker.add_plain_model(layout, triangles);
    if (!two_sided) maker.content.materials[0].flags = 0;
    const MappedBundle bundle(maker.content);
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    const DrawItem item{0, glm::mat4(view)};
    const Camera camera = small_camera();
    const std::vector<std::uint8_t> pixels = draw(*renderer, camera, {&item, 1});
    const auto eye = to_eye_space(triangles, glm::dmat4(item.to_eye), two_sided);
    expect_picture(pixels, cast_rays(camera, eye), triangles, 1);
    EXPECT_EQ(renderer->stats().draw_calls, 1);
    EXPECT_EQ(renderer->stats().triangles, 60u);
  }
};

TEST_F(GeometryTest, HalfFloatsDrawStraightFromTheMapping) {
  if (!probe_gl_caps().half_float_vertices) GTEST_SKIP() << "this driver has no half floats";
  check_layout(Layout::kHalfColoured, probe_gl_caps(), some_view(), true);
}

/// GL need not bound what a draw call reads.
TEST_F(GeometryTest, IndicesBeyondTheirLevelAreNotUploaded) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, random_triangles(7, 60));
  const auto beyond = static_cast<std::uint16_t>(maker.content.levels[0].vertex_count);
  std::memcpy(maker.content.indices.data() + maker.content.levels[0].index_offset, &beyond,
              sizeof beyond);
  const MappedBundle bundle(maker.content);
  GlCaps caps = probe_gl_caps();
  const auto refused = Renderer::create(*bundle.view, caps);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "level.index");
  // With a budget, levels are uploaded when they are drawn: this one never is.
  caps.gpu_memory = 2;
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(renderer);
  const DrawItem item{0, glm::mat4(some_view())};
  draw(*renderer, small_camera(), {&item, 1});
  EXPECT_EQ(renderer->stats().draw_calls, 0);
}

TEST_F(GeometryTest, HalfFloatsWidenedDrawTheSame) {
  GlCaps caps = probe_gl_caps();
  caps.half_float_vertices = false;
  check_layout(Layout::kHalfColoured, caps, some_view(), true);
}

/// Vulkan and Direct3D read no three components of two bytes, and copy such vertices.
TEST(VertexFormatTest, PositionsReadTheirPadding) {
  constexpr GLenum kHalf = 0x140B;
  LayoutRecord layout{};
  layout.stride = 12;
  layout.attribute_count = 2;
  layout.attributes[0] = {1, 1, 3, 0, 0, 0};  // position, half float
  layout.attributes[1] = {2, 4, 3, 1, 8, 0};  // normal, i8
  const auto components = [&](GLenum half, std::uint32_t occlusion) {
    return vertex_format(layout, half, occlusion).attributes[kAttributePosition].components;
  };
  EXPECT_EQ(components(kHalf, kNone), 4);
  EXPECT_EQ(components(kHalf, 11), 4);
  EXPECT_EQ(components(kHalf, 7), 3) << "occlusion is there";
  EXPECT_EQ(components(0, kNone), 3) << "floats are written";
  layout.attributes[1].offset = 6;
  EXPECT_EQ(components(kHalf, kNone), 3) << "the normal is there";
  layout.attributes[1].offset = 0;
  layout.attributes[0].offset = 6;
  EXPECT_EQ(components(kHalf, kNone), 3) << "the vertex ends there";
}

TEST_F(GeometryTest, SixteenBitIntegersDecodeByStepAndOffset) {
  check_layout(Layout::kI16Coloured, probe_gl_caps(), some_view(), true);
}

TEST_F(GeometryTest, FloatsDraw) {
  check_layout(Layout::kF32Coloured, probe_gl_caps(), some_view(), true);
}

TEST_F(GeometryTest, BacksOfOneSidedMaterialsAreCulled) {
  check_layout(Layout::kHalfColoured, probe_gl_caps(), some_view(), false);
}

TEST_F(GeometryTest, BothUploadsOfAMixedBundleFindTheirVertices) {
  // Two models of different strides share the merged buffers.
  const std::vector<Triangle> first = random_triangles(3, 30);
  const std::vector<Triangle> second = random_triangles(4, 30);
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, first);
  maker.add_plain_model(Layout::kF32Coloured, second);
  const MappedBundle bundle(maker.content);
  std::vector<Triangle> all = first;
  all.insert(all.end(), second.begin(), second.end());
  const Camera camera = small_camera();
  for (const bool halves : {true, false}) {
    GlCaps caps = probe_gl_caps();
    caps.half_float_vertices = caps.half_float_vertices && halves;
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    const DrawItem items[] = {{0, glm::mat4(some_view())}, {1, glm::mat4(some_view())}};
    const std::vector<std::uint8_t> pixels = draw(*renderer, camera, items);
    const auto eye = to_eye_space(all, glm::dmat4(items[0].to_eye), true);
    expect_picture(pixels, cast_rays(camera, eye), all, 1);
    EXPECT_EQ(renderer->stats().draw_calls, 2);
  }
}

std::array<glm::vec3, 9> room_of_all_terms() {
  std::array<glm::vec3, 9> sky;
  for (std::size_t i = 0; i < sky.size(); ++i) {
    const float sign = i % 2 == 0 ? 1.0f : -1.0f;
    sky[i] = i == 0 ? glm::vec3(0.30f, 0.35f, 0.40f)
                    : sign * glm::vec3(0.02f, 0.03f, 0.01f) * (1.0f + 0.2f * static_cast<float>(i));
  }
  return sky;
}

/// The irradiance that renderer.hpp defines, one channel, in the world's axes.
double light_on(const RoomLight& light, const glm::dvec3& n, std::size_t c) {
  const int channel = static_cast<int>(c);
  const double terms[9] = {
      1, n.y, n.z, n.x, n.x * n.y, n.y * n.z, 3 * n.z * n.z - 1, n.z * n.x, n.x * n.x - n.y * n.y};
  double sum = 0;
  for (std::size_t i = 0; i < 9; ++i) sum += terms[i] * static_cast<double>(light.sky[i][channel]);
  const double cosine = glm::dot(n, glm::normalize(glm::dvec3(light.direction)));
  return std::max(sum, 0.0) + std::max(cosine, 0.0) * static_cast<double>(light.key[channel]);
}

/// What model.vert says of its approximation: colour times factor.
std::uint8_t lit_channel(std::uint8_t colour, double light) {
  const double factor = 1.05 * std::sqrt(light) - 0.05 * light;
  return static_cast<std::uint8_t>(std::lround(std::min(255.0, colour * factor)));
}

/// A material next to the colour of its vertices.
struct Finish {
  double colour = 1;  ///< as stored
  double shininess = 0;
  double reflectance = 0;
  double metalness = 0;
};

glm::dvec3 seen_by_ggx(const RoomLight& light, const glm::dvec3& n, const glm::dvec3& ray,
                       double shininess);
double ggx(const glm::dvec3& n, const glm::dvec3& eye, const glm::dvec3& to_light,
           double shininess);

/// The part of the light from around that GGX lobes mirror: Karis, "Physically Based Shading on
/// Mobile", 2014; with what bounces between metal's facets: Fdez-Aguera, "A Multiple-Scattering
/// Microfacet Model for Real-Time Image-based Lighting", 2019.
double mirrored_part(double reflectance, double roughness, double cosine, bool metal) {
  const double x = 1 - roughness;
  const double a = std::min(x * x, std::exp2(-9.28 * cosine)) * x + 0.0425 - 0.0275 * roughness;
  const double colour = 1.04 - 0.572 * roughness - 1.04 * a;
  const double white = 1.04 * a + 0.022 * roughness - 0.04;
  const double once = reflectance * colour + white;
  if (!metal) return once;
  const double mean = reflectance + (1 - reflectance) / 21;
  const double lost = 1 - colour - white;
  return once + once * mean / (1 - lost * mean) * lost;
}

/// White of that finish, of 255: what it scatters, and what it mirrors.
glm::dvec3 mirroring_colour(const Finish& finish, const RoomLight& light, const glm::dvec3& n,
                            const glm::dvec3& ray) {
  const auto linear = [](double x) { return std::pow((x + 0.055) / 1.055, 2.4); };
  const glm::dvec3 seen = glm::max(seen_by_ggx(light, n, ray, finish.shininess), 0.0);
  const double roughness = std::pow(2 / (finish.shininess + 2), 0.25);
  const double cosine = std::abs(glm::dot(n, ray));
  const double base = linear(finish.colour);
  const glm::dvec3 to_key = glm::normalize(glm::dvec3(light.direction));
  const double lobe = ggx(n, -ray, to_key, finish.shininess);
  glm::dvec3 colour;
  for (int c = 0; c < 3; ++c) {
    double sum = base * light_on(light, n, static_cast<std::size_t>(c));
    if (finish.reflectance > 0)
      sum += seen[c] * mirrored_part(finish.reflectance, roughness, cosine, false);
    if (finish.metalness > 0) {
      sum = seen[c] * mirrored_part(base, roughness, cosine, true) +
            base * static_cast<double>(light.key[c]) * M_PI * lobe;
    }
    colour[c] = 255 * std::clamp(1.055 * std::pow(sum, 1 / 2.4) - 0.055, 0.0, 1.0);
  }
  return colour;
}

/// Draws triangles of normals of their own in a turned, stretched view and a turned world.
void expect_lit(Renderer& renderer, const std::vector<Triangle>& triangles, const RoomLight& light,
                const glm::dvec3& stretch, int most, const Finish* finish = nullptr) {
  glm::dmat4 view = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, -2.5));
  view = glm::rotate(view, 0.4, glm::dvec3(1.0, 0.0, 0.0));
  view = glm::scale(view, stretch);
  // Light stays where the world is, whichever way the camera looks.
  const glm::dmat4 world = glm::rotate(glm::dmat4(1.0), 1.1, glm::dvec3(0.3, -0.5, 0.8));
  const DrawItem item{0, glm::mat4(view), kNone, glm::mat4(world)};
  const Camera camera = small_camera();
  const std::vector<std::uint8_t> pixels = draw(renderer, camera, {&item, 1});
  const glm::dmat3 normals = glm::transpose(glm::inverse(glm::dmat3(view)));
  const glm::dmat3 to_world = glm::transpose(glm::dmat3(world));
  // Light is summed at corners, and mixed between them.
  std::vector<std::array<glm::dvec3, 3>> expected(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Triangle& triangle = triangles[t];
      const glm::dvec4 at(triangle.corners[corner], 1.0);
      const glm::dvec3 ray = glm::normalize(glm::dvec3(view * at));
      // A two-sided surface looks at the camera.
      glm::dvec3 n = glm::normalize(normals * triangle.normal);
      if (glm::dot(n, ray) > 0) n = -n;
      glm::dvec3& colour = expected[t][corner];
      for (std::size_t c = 0; c < 3; ++c)
        colour[static_cast<int>(c)] =
            lit_channel(triangle.colour[c], light_on(light, to_world * n, c));
      if (finish != nullptr)
        colour = mirroring_colour(*finish, light, to_world * n, to_world * ray);
    }
  }
  const auto shown = [&](const Hit& hit) {
    const auto& corners = expected[static_cast<std::size_t>(hit.triangle)];
    return hit.weights.x * corners[0] + hit.weights.y * corners[1] + hit.weights.z * corners[2];
  };
  const auto eye = to_eye_space(triangles, view, true);
  // Octahedral 8-bit normals are off by up to 1.2 degrees.
  expect_picture(pixels, cast_rays(camera, eye), shown, most);
}

/// Squares of twice `half` that are tilted the more the less `height` is, none so steep that
/// corners of one disagree on which side they show.
std::vector<Triangle> tilted_squares(double height, double half) {
  std::vector<Triangle> triangles;
  std::mt19937 random(11);
  for (int i = 0; i < 36; ++i) {
    const double x = on_half_grid((i % 6 - 2.5) / 3.0);
    const double y = on_half_grid((i / 6 - 2.5) / 3.0);
    glm::dvec3 normal(static_cast<double>(random() % 200) / 100.0 - 1.0,
                      static_cast<double>(random() % 200) / 100.0 - 1.0, height);
    normal = glm::normalize(normal);
    const double s = on_half_grid(half);
    for (const bool upper : {false, true}) {
      Triangle triangle;
      triangle.normal = normal;
      triangle.colour = {200, 100, 50};
      triangle.corners = {glm::dvec3(x - s, y - s, 0), {x + s, y + s, 0}, {x - s, y + s, 0}};
      if (!upper)
        triangle.corners = {glm::dvec3(x - s, y - s, 0), {x + s, y - s, 0}, {x + s, y + s, 0}};
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

TEST_F(GeometryTest, NormalsAreLitAsLambertSays) {
  for (const Layout layout : {Layout::kHalfLit, Layout::kOctLit, Layout::kI16OctLit}) {
    const std::vector<Triangle> triangles = tilted_squares(3.0, 0.12);
    SceneMaker maker;
    maker.add_plain_model(layout, triangles);
    const MappedBundle bundle(maker.content);
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
    ASSERT_TRUE(renderer);
    RenderOptions options = flat_light();
    options.light->direction = {0.3f, 0.2f, 0.9f};
    options.light->sky = room_of_all_terms();
    renderer->set_options(options);
    // Normals must not follow the stretch of positions; light comes another way where none is.
    for (const glm::dvec3& stretch :
         {glm::dvec3(1, 1, 2.5), glm::dvec3(0.9), glm::dvec3(-1, 1, 1)}) {
      expect_lit(*renderer, triangles, *options.light, stretch, layout == Layout::kHalfLit ? 3 : 5);
    }
  }
}

/// Of stored colours lit half from all around and half by the key light, straight on.
int half_and_half(double ambient, double diffuse) {
  const auto linear = [](double c) {
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  const double light = 0.5 * linear(ambient) + 0.5 * linear(diffuse);
  const double stored =
      light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * stored));
}

TEST_F(GeometryTest, AmbientLightHasAColourOfItsOwn) {
  struct Case {
    std::array<float, 3> ambient, diffuse, shown;  // shown: under the light from all around
  };
  // As bright as diffuse at most; 0, 0.2 and 1 mean nothing; what ambient leaves is diffuse's.
  const std::array<Case, 6> cases = {
      {{{1, 0.25f, 0}, {0.8f, 0.8f, 0.8f}, {0.8f, 0.2f, 0}},
       {{0, 0, 0}, {0.8f, 0.4f, 0.1f}, {0.8f, 0.4f, 0.1f}},
       {{1, 1, 1}, {0.8f, 0.4f, 0.1f}, {0.8f, 0.4f, 0.1f}},
       {{0.1f, 0, 0}, {0.6f, 0.6f, 0.6f}, {0.6f, 0.5f, 0.5f}},
       {{0.1f, 0.05f, 0.01f}, {0.8f, 0.4f, 0.08f}, {0.8f, 0.4f, 0.08f}},
       {{0, 0.6f, 0.3f}, {0, 0, 0}, {0, 0.6f, 0.3f}}}};
  SceneMaker maker;
  std::vector<SceneMaker::Chunk> chunks;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    MaterialRecord material = flat_material();
    std::copy_n(cases[i].ambient.begin(), 3, material.ambient);
    std::copy_n(cases[i].diffuse.begin(), 3, material.diffuse);
    const double x = 0.25 * static_cast<double>(i) - 0.75;
    Triangle strip;
    strip.corners = {glm::dvec3(x, -1, 0), {x + 0.25, -1, 0}, {x, 1, 0}};
    chunks.push_back({{{strip}}, {0.0f}, maker.add_material(material), {}});
  }
  maker.add_model(maker.add_layout(Layout::kHalfLit), chunks);
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  RenderOptions options = flat_light();
  options.light->direction = {0, 0, 1};
  options.light->key = options.light->sky[0] = glm::vec3(0.5f);
  renderer->set_options(options);
  const DrawItem item{0, glm::translate(glm::mat4(1.0f), glm::vec3(0, 0, -4)), kNone,
                      glm::mat4(1.0f)};
  const auto pixels = draw(*renderer, camera_above(128), {&item, 1});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::size_t column = 16 + 16 * i + 4;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(pixels[4 * (96 * 128 + column) + c],
                  half_and_half(cases[i].shown[c], cases[i].diffuse[c]), 7)
          << "case " << i << " channel " << c;
    }
  }
}

/// GGX's lobe with Smith's masking (correlated), times the cosine to the light; alpha by shininess.
double ggx(const glm::dvec3& n, const glm::dvec3& eye, const glm::dvec3& to_light,
           double shininess) {
  const double square = 2 / (shininess + 2);
  const double to = glm::dot(n, to_light);
  const double from = glm::dot(n, eye);
  if (to <= 0 || from <= 0) return 0;
  const double half = glm::dot(n, glm::normalize(eye + to_light));
  const double spread = half * half * (square - 1) + 1;
  const auto masked = [&](double cosine) {
    return std::sqrt(square + (1 - square) * cosine * cosine);
  };
  return square / (M_PI * spread * spread) * 0.5 / (to * masked(from) + from * masked(to)) * to;
}

/// What GGX's lobe sees of the room whose irradiance the coefficients are: a sum over the sphere.
glm::dvec3 seen_by_ggx(const RoomLight& light, const glm::dvec3& n, const glm::dvec3& ray,
                       double shininess) {
  constexpr int kSteps = 48;
  glm::dvec3 sum(0.0);
  double weights = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < 2 * kSteps; ++k) {
      const double z = (i + 0.5) * 2.0 / kSteps - 1.0;
      const double turn = M_PI * (k + 0.5) / kSteps;
      const double side = std::sqrt(1 - z * z);
      const double x = side * std::cos(turn);
      const double y = side * std::sin(turn);
      const double weight = ggx(n, -ray, {x, y, z}, shininess);
      if (weight <= 0) continue;
      // A cosine lobe keeps 2/3 of the part linear in the direction and 1/4 of the quadratic part.
      const double terms[9] = {1,
                               1.5 * y,
                               1.5 * z,
                               1.5 * x,
                               4 * x * y,
                               4 * y * z,
                               4 * (3 * z * z - 1),
                               4 * z * x,
                               4 * (x * x - y * y)};
      glm::dvec3 radiance(0.0);
      for (std::size_t j = 0; j < 9; ++j) radiance += terms[j] * glm::dvec3(light.sky[j]);
      sum += weight * radiance;
      weights += weight;
    }
  }
  return sum / weights;
}

TEST_F(GeometryTest, BlackPlasticAndMetalMirrorTheRoom) {
  std::vector<Triangle> triangles = tilted_squares(1.5, 0.08);
  for (Triangle& triangle : triangles) triangle.colour = {255, 255, 255};
  RenderOptions options = flat_light();
  options.light->direction = {0.3f, 0.2f, 0.9f};
  for (std::size_t k = 0; k < 9; ++k) options.light->sky[k] = 0.5f * room_of_all_terms()[k];
  // The room is looked up once for a whole lobe: smooth ones are off by 7, in the steep view by 14.
  const struct {
    float colour, shininess, key;
    std::uint32_t flags;
    double reflectance, metalness;
    int most;
  } cases[] = {{0.1f, 30.0f, 0.0f, 51u << 16, 0.2, 0.0, 12},
               {0.8f, 30.0f, 0.0f, 0xFFu << 8, 0.0, 1.0, 14},
               {0.8f, 30.0f, 0.2f, 0xFFu << 8, 0.0, 1.0, 12},
               {0.8f, 6.0f, 0.4f, 0xFFu << 8, 0.0, 1.0, 8},
               {0.8f, 0.1f, 0.6f, 0xFFu << 8, 0.0, 1.0, 6}};
  for (const auto& expected : cases) {
    SceneMaker maker;
    maker.add_plain_model(Layout::kHalfLit, triangles);
    MaterialRecord& material = maker.content.materials[0];
    std::fill_n(material.diffuse, 3, expected.colour);
    material.shininess = expected.shininess;
    // The highlight where all directions are one, as stored.
    const double peak = (static_cast<double>(expected.shininess) + 2) / 8;
    std::fill_n(material.specular, 3, static_cast<float>(1.055 * std::pow(peak, 1 / 2.4) - 0.055));
    material.flags |= expected.flags;
    options.light->key = glm::vec3(expected.key);
    const MappedBundle bundle(maker.content);
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
    ASSERT_TRUE(renderer);
    renderer->set_options(options);
    const Finish finish = {static_cast<double>(expected.colour),
                           static_cast<double>(expected.shininess), expected.reflectance,
                           expected.metalness};
    for (const glm::dvec3& stretch : {glm::dvec3(0.9), glm::dvec3(1, 1, 1.5)}) {
      SCOPED_TRACE(expected.shininess);
      expect_lit(*renderer, triangles, *options.light, stretch, expected.most, &finish);
    }
  }
}

// Metal reflects by its colour: red metal has a red highlight, not a white one.
TEST_F(GeometryTest, TheHighlightOfMetalHasTheColourOfItsVertices) {
  std::vector<Triangle> triangles = tilted_squares(3.0, 0.12);
  for (Triangle& triangle : triangles) triangle.colour = {200, 0, 0};
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfLit, triangles);
  MaterialRecord& material = maker.content.materials[0];
  std::fill_n(material.specular, 3, 1.0f);
  material.shininess = 2.0f;
  material.flags |= 0xFFu << 8;
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  RenderOptions options = flat_light();
  options.light->sky = {};
  options.light->direction = {0.0f, 0.0f, 1.0f};
  options.light->key = glm::vec3(1.0f);
  renderer->set_options(options);
  glm::dmat4 view = glm::translate(glm::dmat4(1.0), glm::dvec3(0.0, 0.0, -2.5));
  const DrawItem item{0, glm::mat4(view)};
  const std::vector<std::uint8_t> pixels = draw(*renderer, small_camera(), {&item, 1});
  std::uint8_t most_red = 0;
  for (std::size_t at = 0; at < pixels.size(); at += 4) {
    if (pixels[at] == pixels[at + 1]) continue;  // nothing drawn
    most_red = std::max(most_red, pixels[at]);
    EXPECT_EQ(pixels[at + 1], 0) << at;
  }
  EXPECT_GT(most_red, 100);
}

TEST_F(GeometryTest, MirroredMatricesShowTheSameFrontFaces) {
  const glm::dmat4 mirrored = glm::scale(some_view(), glm::dvec3(-1.0, 1.0, 1.0));
  const std::vector<Triangle> triangles = random_triangles(7, 60);
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, triangles);
  maker.content.materials[0].flags = 0;
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const DrawItem item{0, glm::mat4(mirrored)};
  const Camera camera = small_camera();
  const std::vector<std::uint8_t> pixels = draw(*renderer, camera, {&item, 1});
  // A front face of the model is one in the mirror too: its corners turn round in eye space.
  std::vector<EyeTriangle> eye = to_eye_space(triangles, glm::dmat4(item.to_eye), false);
  for (EyeTriangle& triangle : eye) std::swap(triangle.corners[1], triangle.corners[2]);
  expect_picture(pixels, cast_rays(camera, eye), triangles, 1);
}

// Colours between vertices are mixed in linear light, as glTF and three.js mix them.
TEST_F(GeometryTest, ColoursBetweenVerticesAreMixedInLinearLight) {
  SceneMaker maker;
  Triangle triangle;
  triangle.corners = {glm::dvec3(-4, -4, 0), {4, -4, 0}, {-4, 4, 0}};
  maker.add_plain_model(Layout::kHalfColoured, {triangle});
  // The second corner is black: half of the light remains on the way to it.
  // Of 12 bytes: four halves, and the colour.
  std::fill_n(maker.content.vertices.begin() + 12 + 8, 3, std::byte{0});
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const DrawItem item{0, glm::translate(glm::mat4(1.0f), glm::vec3(0, 0, -4))};
  const Camera camera = camera_above(128);
  const std::vector<std::uint8_t> pixels = draw(*renderer, camera, {&item, 1});
  // sRGB of 1/2 is 188; stored colours would give 128.
  EXPECT_NEAR(pixels[4 * (80 * 128 + 64)], 188, 10);
}

}  // namespace
}  // namespace modar
