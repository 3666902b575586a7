// Items drawn together look as items drawn one by one, in as few calls as promised.
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "tests/render/reference.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

/// A small closed shape of eight triangles around the middle, coloured by `seed`.
std::vector<Triangle> diamond(int seed, double reach) {
  const double r = on_half_grid(reach);
  const glm::dvec3 top(0, 0, r);
  const glm::dvec3 bottom(0, 0, -r);
  const std::array<glm::dvec3, 4> ring = {glm::dvec3(r, 0, 0), {0, r, 0}, {-r, 0, 0}, {0, -r, 0}};
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < 4; ++i) {
    for (const bool upper : {true, false}) {
      Triangle triangle;
      const glm::dvec3& a = ring[i];
      const glm::dvec3& b = ring[(i + 1) % 4];
      triangle.corners = upper ? std::array{a, b, top} : std::array{b, a, bottom};
      triangle.colour = {static_cast<std::uint8_t>(60 * i + 10), static_cast<std::uint8_t>(seed),
                         static_cast<std::uint8_t>(upper ? 200 : 90)};
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

std::vector<DrawItem> scattered(int count, std::uint32_t models) {
  std::mt19937 random(23);
  const auto real = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() % 10000) / 10000.0f;
  };
  std::vector<DrawItem> items;
  for (int i = 0; i < count; ++i) {
    DrawItem item;
    item.model = static_cast<std::uint32_t>(i) % models;
    const glm::vec3 where(real(-2.0f, 2.0f), real(-1.5f, 1.5f), real(-7.0f, -4.0f));
    item.to_eye = glm::translate(glm::mat4(1.0f), where);
    item.to_eye = glm::rotate(item.to_eye, real(0.0f, 6.0f), glm::vec3(0.6f, 0.0f, 0.8f));
    items.push_back(item);
  }
  return items;
}

class InstanceTest : public GlTest {
 protected:
  /// One model a seed, all with equal materials of their own.
  static BundleContent models(int count, Layout layout = Layout::kHalfColoured) {
    SceneMaker maker;
    for (int i = 0; i < count; ++i)
      maker.add_plain_model(layout, diamond(40 * i + 7, 0.3 + 0.1 * i));
    return maker.content;
  }

  /// The picture without sharing, and the one with it, may not differ; stats of the second.
  RenderStats compare(const BundleContent& content, const GlCaps& caps,
                      std::span<const DrawItem> items) {
    const MappedBundle bundle(content);
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    if (!renderer) return {};
    const Camera camera = default_camera(160, 120);
    RenderOptions options = flat_light();
    options.instancing = false;
    renderer->set_options(options);
    const std::vector<std::uint8_t> apart = draw(*renderer, camera, items);
    EXPECT_EQ(renderer->stats().draw_calls, static_cast<int>(items.size()));
    triangles_ = renderer->stats().triangles;
    options.instancing = true;
    renderer->set_options(options);
    draw(*renderer, camera, items);
    const std::vector<std::uint8_t> together = draw(*renderer, camera, items);
    EXPECT_EQ(renderer->stats().triangles, triangles_);
    EXPECT_TRUE(apart == together) << "the pictures differ";
    return renderer->stats();
  }

  static GlCaps without_instances() {
    GlCaps caps = probe_gl_caps();
    caps.instanced_arrays = false;
    caps.max_vertex_uniform_vectors = 128;
    return caps;
  }

  std::uint64_t triangles_ = 0;
};

TEST_F(InstanceTest, TenCopiesAreOneCallByMatrixArray) {
  const RenderStats stats = compare(models(1), without_instances(), scattered(10, 1));
  EXPECT_EQ(stats.draw_calls, 1);
  EXPECT_EQ(stats.chunks_drawn, 10);
  // Ten slots of four vectors, the projection, nine of light, a colour and the opacity; no buffer.
  EXPECT_EQ(stats.bytes_uploaded, 10u * 64 + 64 + 9 * 16 + 16 + 4);
}

TEST_F(InstanceTest, TenCopiesAreOneCallByInstancedArrays) {
  if (!probe_gl_caps().instanced_arrays) GTEST_SKIP() << "no instanced arrays here";
  const RenderStats stats = compare(models(1), probe_gl_caps(), scattered(10, 1));
  EXPECT_EQ(stats.draw_calls, 1);
  EXPECT_EQ(stats.chunks_drawn, 10);
}

TEST_F(InstanceTest, TenCopiesLookAsTheRaysSay) {
  const std::vector<Triangle> shape = diamond(7, 0.3);
  const MappedBundle bundle(models(1));
  const std::vector<DrawItem> items = scattered(10, 1);
  std::vector<EyeTriangle> all;
  for (const DrawItem& item : items) {
    const auto eye = to_eye_space(shape, glm::dmat4(item.to_eye), true);
    all.insert(all.end(), eye.begin(), eye.end());
  }
  Camera camera = default_camera(120, 90);
  const std::vector<Hit> hits = cast_rays(camera, all);
  for (const GlCaps& caps : {probe_gl_caps(), without_instances()}) {
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    const std::vector<std::uint8_t> pixels = draw(*renderer, camera, items);
    int wrong = 0;
    int covered = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (!hits[i].certain || hits[i].triangle < 0) continue;
      ++covered;
      const Rgb& expected = shape[static_cast<std::size_t>(hits[i].triangle) % shape.size()].colour;
      wrong += std::abs(pixels[i * 4] - expected[0]) > 1 ||
               std::abs(pixels[i * 4 + 2] - expected[2]) > 1;
    }
    EXPECT_EQ(wrong, 0) << "of " << covered;
    EXPECT_GT(covered, 200);
  }
}

TEST_F(InstanceTest, CallsAreSplitByTheUniformLimit) {
  // 128 vectors less 17 for the rest: 27 slots of 4.
  EXPECT_EQ(compare(models(1), without_instances(), scattered(70, 1)).draw_calls, 3);
}

TEST_F(InstanceTest, DifferentMeshesOfEqualMaterialShareACall) {
  EXPECT_EQ(compare(models(3), without_instances(), scattered(12, 3)).draw_calls, 1);
}

TEST_F(InstanceTest, BatchesStayWhenItemsComeAndGo) {
  const MappedBundle bundle(models(3));
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, without_instances());
  ASSERT_TRUE(renderer);
  const Camera camera = default_camera(160, 120);
  const std::vector<DrawItem> items = scattered(12, 3);
  draw(*renderer, camera, items);
  const std::uint64_t uploaded = renderer->gpu_memory().batches;
  EXPECT_GT(uploaded, 0u);
  // Fewer copies of the middle mesh: what stands is drawn in two runs.
  std::vector<DrawItem> fewer = items;
  fewer.erase(fewer.begin() + 1);
  const std::vector<std::uint8_t> together = draw(*renderer, camera, fewer);
  EXPECT_EQ(renderer->stats().draw_calls, 2);
  EXPECT_EQ(renderer->gpu_memory().batches, uploaded);
  RenderOptions options = flat_light();
  options.instancing = false;
  renderer->set_options(options);
  EXPECT_TRUE(together == draw(*renderer, camera, fewer));
}

TEST_F(InstanceTest, WidenedVerticesAreBatchedToo) {
  GlCaps caps = without_instances();
  caps.half_float_vertices = false;
  EXPECT_EQ(compare(models(2), caps, scattered(8, 2)).draw_calls, 1);
}

TEST_F(InstanceTest, StepsAndOffsetsTravelWithTheSlot) {
  EXPECT_EQ(
      compare(models(2, Layout::kI16Coloured), without_instances(), scattered(8, 2)).draw_calls, 1);
}

TEST_F(InstanceTest, MirroredCopiesAreDrawnApart) {
  std::vector<DrawItem> items = scattered(6, 1);
  for (std::size_t i = 0; i < 3; ++i) items[i].to_eye[0] *= -1.0f;
  BundleContent content = models(1);
  content.materials[0].flags = 0;
  EXPECT_EQ(compare(content, without_instances(), items).draw_calls, 2);
}

TEST_F(InstanceTest, NoRoomForBatchesMeansOneCallEach) {
  const BundleContent content = models(1);
  GlCaps caps = without_instances();
  caps.gpu_memory = content.vertices.size() + content.indices.size() + 100;
  EXPECT_EQ(compare(content, caps, scattered(10, 1)).draw_calls, 10);
}

TEST_F(InstanceTest, ClientArraysDrawTheSameAndSendTheVerticesEachTime) {
  if (!probe_gl_caps().half_float_vertices) GTEST_SKIP() << "halves are rewritten here";
  const BundleContent content = models(1);
  const MappedBundle bundle(content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, without_instances());
  ASSERT_TRUE(renderer);
  const Camera camera = default_camera(160, 120);
  const std::vector<DrawItem> items = scattered(10, 1);
  const std::vector<std::uint8_t> expected = draw(*renderer, camera, items);
  const std::uint64_t mesh = content.vertices.size() + content.indices.size();
  for (const bool together : {false, true}) {
    RenderOptions options = flat_light();
    options.client_arrays = true;
    options.instancing = together;
    renderer->set_options(options);
    EXPECT_TRUE(expected == draw(*renderer, camera, items));
    EXPECT_EQ(renderer->stats().draw_calls, together ? 1 : 10);
    EXPECT_GT(renderer->stats().bytes_uploaded, 10 * mesh);
  }
}

}  // namespace
}  // namespace modar
