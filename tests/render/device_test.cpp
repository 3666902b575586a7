// Device profiles: masks, and the same picture whatever is masked.
#include <glm/gtc/matrix_transform.hpp>

#include "modar/device_profile.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

TEST(DeviceProfiles, AreSortedAndNamed) {
  ASSERT_EQ(device_profiles().size(), 6u);
  std::string_view last;
  for (const DeviceProfile& profile : device_profiles()) {
    EXPECT_LT(last, profile.name);
    last = profile.name;
    EXPECT_GE(profile.max_vertex_uniform_vectors, 128) << profile.name;
    EXPECT_GE(profile.max_vertex_attributes, 8) << profile.name;
    EXPECT_GT(profile.gpu_memory_mib, 0u) << profile.name;
  }
  EXPECT_EQ(find_device_profile("nothing"), nullptr);
  ASSERT_NE(find_device_profile("ace2"), nullptr);
  EXPECT_TRUE(find_device_profile("ace2")->has_extension("GL_OES_compressed_ETC1_RGB8_texture"));
  EXPECT_FALSE(find_device_profile("ace2")->has_extension("GL_OES_compressed_ETC1_RGB8"));
}

TEST(DeviceProfiles, MasksOnlyEverTakeAway) {
  GlCaps all;
  all.texture_formats = 1 << static_cast<unsigned>(TextureFormat::kEtc1Rgb);
  all.half_float_vertices = all.etc1_sub_texture = all.npot_mipmaps = true;
  all.depth24 = all.debug_groups = all.instanced_arrays = true;
  all.max_texture_size = 16384;
  all.max_vertex_uniform_vectors = 4096;
  const Result<GlCaps> ace2 = mask_gl_caps(all, "ace2");
  ASSERT_TRUE(ace2.has_value());
  EXPECT_TRUE(ace2->half_float_vertices);
  EXPECT_TRUE(ace2->reads(TextureFormat::kEtc1Rgb));
  EXPECT_FALSE(ace2->etc1_sub_texture);
  EXPECT_FALSE(ace2->instanced_arrays);
  EXPECT_EQ(ace2->max_vertex_uniform_vectors, 128);
  const Result<GlCaps> none = mask_gl_caps(GlCaps(), "desktop");
  ASSERT_TRUE(none.has_value());
  EXPECT_FALSE(none->reads(TextureFormat::kEtc1Rgb));
  EXPECT_EQ(none->max_texture_size, 64);
  const Result<GlCaps> unknown = mask_gl_caps(all, "toaster");
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error().exit, ExitCode::kUsage);
  EXPECT_EQ(unknown.error().code, "device.unknown");
  EXPECT_NE(unknown.error().cure.find("mali400"), std::string::npos);
}

class DeviceTest : public GlTest {};

TEST_F(DeviceTest, EveryProfileDrawsTheSamePicture) {
  SceneMaker maker;
  std::vector<Triangle> triangles;
  for (int i = 0; i < 20; ++i) {
    Triangle triangle;
    const double x = on_half_grid(i / 10.0 - 1.0);
    triangle.corners = {glm::dvec3(x, -0.9, x * 0.5), {x + 0.25, -0.5, 0}, {x, 0.875, -x * 0.25}};
    triangle.normal = glm::normalize(glm::dvec3(x, 0.3, 1.0));
    triangle.colour = {static_cast<std::uint8_t>(12 * i), 200,
                       static_cast<std::uint8_t>(255 - 12 * i)};
    triangles.push_back(triangle);
  }
  maker.add_plain_model(Layout::kHalfLit, triangles);
  const MappedBundle bundle(maker.content);
  const Camera camera = default_camera(96, 72);
  const DrawItem item{0, glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -2.5f))};
  std::vector<std::uint8_t> reference;
  for (const DeviceProfile& profile : device_profiles()) {
    const Result<GlCaps> caps = mask_gl_caps(probe_gl_caps(), std::string(profile.name));
    ASSERT_TRUE(caps.has_value());
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, *caps);
    ASSERT_TRUE(renderer);
    const std::vector<std::uint8_t> pixels = draw(*renderer, camera, {&item, 1});
    if (reference.empty()) reference = pixels;
    int off = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      off += std::abs(static_cast<int>(pixels[i]) - static_cast<int>(reference[i])) > 1;
    }
    EXPECT_EQ(off, 0) << profile.name;
  }
}

TEST(ContextLoss, ANewContextShowsTheSameFromTheSameBytes) {
  Result<std::unique_ptr<GlContext>> first = GlContext::create_offscreen();
  if (!first) GTEST_SKIP() << "no OpenGL ES 2.0 context here";
  SceneMaker maker;
  Triangle triangle;
  triangle.corners = {glm::dvec3(-1, -1, 0), {1, -1, 0}, {0, 1, 0}};
  triangle.colour = {10, 250, 30};
  maker.add_plain_model(Layout::kHalfColoured, {triangle});
  const MappedBundle bundle(maker.content);
  std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const Camera camera = default_camera(64, 48);
  const glm::mat4 near_by = glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -3.0f));
  const std::vector<DrawItem> items = {{0, near_by}, {0, glm::translate(near_by, glm::vec3(0.5f))}};
  const std::vector<std::uint8_t> before = draw(*renderer, camera, items);
  first->reset();
  const Result<std::unique_ptr<GlContext>> second = GlContext::create_offscreen();
  ASSERT_TRUE(second.has_value());
  // The new context may offer less.
  GlCaps caps = probe_gl_caps();
  caps.half_float_vertices = false;
  ASSERT_TRUE(renderer->restore(caps).has_value());
  renderer->render(RgbImage{}, gl_projection(camera, 0.1, 100.0), items);
  std::vector<std::uint8_t> after(before.size());
  renderer->read_pixels(after);
  EXPECT_TRUE(before == after);
  renderer.reset();
}

}  // namespace
}  // namespace modar
