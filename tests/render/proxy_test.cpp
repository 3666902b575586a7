// Whole models as one coarse level: drawn from afar in place of all chunks, never next to one.
#include <set>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "runtime/render/draw_list.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

constexpr Rgb kRed{255, 0, 0};
constexpr Rgb kGreen{0, 255, 0};
constexpr Rgb kBlue{0, 0, 255};

/// A rectangle of two triangles that faces the viewer.
std::vector<Triangle> rectangle(double left, double right, const Rgb& colour) {
  const glm::dvec3 a(left, -0.5, 0), b(right, -0.5, 0), c(right, 0.5, 0), d(left, 0.5, 0);
  return {{{a, b, c}, {}, colour}, {{a, c, d}, {}, colour}};
}

/// Makes the last model of a content a proxy of another one.
void proxy_for(BundleContent& content, std::uint32_t model, float error) {
  const ModelRecord last = content.models.back();
  content.models.pop_back();
  content.proxies.push_back(
      {model, static_cast<std::uint32_t>(content.proxy_chunks.size()), last.chunk_count, 0});
  for (std::uint32_t c = last.first_chunk; c < last.first_chunk + last.chunk_count; ++c) {
    ChunkRecord chunk = content.chunks[c];
    LevelRecord level = content.levels[chunk.first_level];
    level.error = error;
    chunk.first_level = static_cast<std::uint32_t>(content.proxy_levels.size());
    chunk.material = content.models[model].first_material;
    content.proxy_levels.push_back(level);
    content.proxy_chunks.push_back(chunk);
  }
  content.levels.resize(content.chunks[last.first_chunk].first_level);
  content.chunks.resize(last.first_chunk);
}

/// Model 0 is a blue rectangle without proxies, model 1 two red chunks next to each other, with a
/// finer proxy in two green chunks and a coarser one in one blue chunk.
BundleContent two_models(float coarse = 0.1f, float fine = 0.01f) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, rectangle(-0.5, 0.5, kBlue));
  const std::uint32_t material = maker.add_material(flat_material());
  const auto add = [&](const std::vector<std::vector<Triangle>>& chunks) {
    std::vector<SceneMaker::Chunk> list;
    for (const auto& triangles : chunks) list.push_back({{triangles}, {0.0f}, material, {}});
    maker.add_model(0, list);
  };
  std::vector<Triangle> left = rectangle(-0.5, 0.0, kRed);
  left.insert(left.end(), left.begin(), left.begin() + 2);  // more to draw than its proxy
  add({left, rectangle(0.0, 0.5, kRed)});
  add({rectangle(-0.5, 0.0, kGreen), rectangle(0.0, 0.5, kGreen)});
  proxy_for(maker.content, 1, fine);
  add({rectangle(-0.5, 0.5, kBlue)});
  proxy_for(maker.content, 1, coarse);
  return maker.content;
}

class ProxyTest : public GlTest {
 protected:
  /// The drawing of model 1 at a distance, pixel by pixel: of which colours any.
  std::set<Rgb> colours(Renderer& renderer, double distance, double aside = 0.0) {
    const DrawItem item{1, glm::mat4(glm::translate(glm::dmat4(1.0), {aside, 0.0, -distance}))};
    const std::vector<std::uint8_t> pixels = draw(renderer, default_camera(160, 120), {&item, 1});
    std::set<Rgb> found;
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
      const Rgb pixel{pixels[i], pixels[i + 1], pixels[i + 2]};
      if (pixel == kRed || pixel == kGreen || pixel == kBlue) found.insert(pixel);
    }
    return found;
  }
};

TEST_F(ProxyTest, TheCoarsestOfSmallEnoughErrorIsDrawnAlone) {
  const MappedBundle bundle(two_models());
  ASSERT_TRUE(bundle.view);
  const std::uint64_t all = bundle.view->vertices().size() + bundle.view->indices().size();
  for (const std::uint64_t memory : {std::uint64_t{0}, all * 2 / 3}) {
    GlCaps caps = probe_gl_caps();
    caps.gpu_memory = memory;  // so little that levels are uploaded when they are drawn
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    // An error e is a pixel wide at the focal length, 160 pixels, times e: 1.6 and 16.
    EXPECT_EQ(colours(*renderer, 1.2), std::set<Rgb>{kRed});
    EXPECT_EQ(renderer->stats().triangles, 6u);
    EXPECT_EQ(colours(*renderer, 2.5), std::set<Rgb>{kGreen});
    EXPECT_EQ(colours(*renderer, 14.0), std::set<Rgb>{kGreen});
    EXPECT_EQ(renderer->stats().triangles, 4u);
    EXPECT_EQ(colours(*renderer, 20.0), std::set<Rgb>{kBlue});
    EXPECT_EQ(renderer->stats().triangles, 2u);
    EXPECT_EQ(renderer->stats().draw_calls, 1);
  }
}

TEST_F(ProxyTest, IsNotDrawnWhereTheChunksThatAreSeenAreLess) {
  const MappedBundle bundle(two_models());
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  // The left half is outside of the picture: one red chunk of two triangles is left, and one green.
  EXPECT_EQ(colours(*renderer, 2.5, -1.25 - 0.05), std::set<Rgb>{kGreen});
  // Never of a level that is off by more than is allowed.
  RenderOptions options = flat_light();
  options.lod_pixels = 0.0f;
  renderer->set_options(options);
  EXPECT_EQ(colours(*renderer, 20.0), std::set<Rgb>{kRed});
}

/// So little memory that the chunks do not fit, and a proxy does: no hole.
TEST_F(ProxyTest, TakesThePlaceOfChunksThatDoNotFitTheMemory) {
  const MappedBundle bundle(two_models());
  GlCaps caps = probe_gl_caps();
  const std::uint64_t stride = bundle.view->layouts()[0].stride;
  caps.gpu_memory = 14 * (stride + 2);  // chunks have 12 and 6 vertices, a green half has 6
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(renderer);
  EXPECT_EQ(colours(*renderer, 1.2), std::set<Rgb>{kGreen});
  EXPECT_EQ(renderer->stats().chunks_skipped, 0);
  // No picture is worth a form of a quarter of the screen: the nearest chunk alone.
  caps.gpu_memory = 7 * (stride + 2);
  const std::unique_ptr<Renderer> poor = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(poor);
  EXPECT_EQ(colours(*poor, 1.2), std::set<Rgb>{kBlue});
}

/// Of proxies whose errors differ little, the finest that fits, not the coarsest.
TEST_F(ProxyTest, TheFinestThatFitsTakesTheirPlace) {
  const MappedBundle bundle(two_models(0.02f));
  GlCaps caps = probe_gl_caps();
  caps.gpu_memory = 14 * (bundle.view->layouts()[0].stride + 2u);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(renderer);
  EXPECT_EQ(colours(*renderer, 1.2), std::set<Rgb>{kGreen});
}

/// A scan of a building states an error in shading of thousands of pixels, and its chunks have
/// millions of triangles: neither they nor parts of them are a picture that an old GPU draws.
TEST_F(ProxyTest, WhateverItsErrorItIsDrawnWhereChunksAreTooMany) {
  BundleContent content = two_models(100.0f, 10.0f);
  LevelRecord& level = content.levels[content.chunks[content.models[1].first_chunk].first_level];
  const std::vector<std::byte> once(
      content.indices.begin() + static_cast<std::ptrdiff_t>(level.index_offset),
      content.indices.begin() +
          static_cast<std::ptrdiff_t>(level.index_offset + 2 * level.index_count));
  constexpr std::uint32_t kTimes = 40'000;  // of four triangles
  content.models[1].triangle_count += (kTimes - 1) * level.index_count / 3;
  level.index_offset = content.indices.size();
  level.index_count *= kTimes;
  for (std::uint32_t i = 0; i < kTimes; ++i) {
    content.indices.insert(content.indices.end(), once.begin(), once.end());
  }
  const MappedBundle bundle(content);
  ASSERT_TRUE(bundle.view);
  GlCaps caps = probe_gl_caps();
  caps.es3 = false;
  for (const std::uint64_t memory : {std::uint64_t{0}, std::uint64_t{2 * level.index_count}}) {
    caps.gpu_memory = memory;
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    EXPECT_EQ(colours(*renderer, 1.2), std::set<Rgb>{kGreen}) << memory;
    EXPECT_EQ(renderer->stats().triangles, 4u) << memory;
  }
}

TEST_F(ProxyTest, ItemsOfOtherModelsStayAsTheyAre) {
  const MappedBundle bundle(two_models());
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const auto at = [](double x, double distance) {
    return glm::mat4(glm::translate(glm::dmat4(1.0), {x, 0.0, -distance}));
  };
  const DrawItem items[] = {{0, at(-5, 20)}, {1, at(5, 20)}, {1, at(0, 1.2)}, {0, at(0, 30)}};
  draw(*renderer, default_camera(160, 120), items);
  EXPECT_EQ(renderer->stats().triangles, 2u + 2u + 6u + 2u);
  EXPECT_EQ(choose_proxy(*bundle.view, {}, 0, 1e6f), kNone);
}

}  // namespace
}  // namespace modar
