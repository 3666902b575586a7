// A bundle whose vertices, indices and blocks pass by on their way to the GPU: drawn as one in
// memory.
#include <cstring>
#include <optional>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "formats/transport/stages.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

/// A bundle's bytes, aligned, and a view of them.
struct Memory {
  explicit Memory(std::span<const std::byte> from)
      : words((from.size() + 7) / 8), size(from.size()) {
    std::memcpy(words.data(), from.data(), from.size());
    view = BundleView::open(bytes()).value();
  }
  [[nodiscard]] std::span<std::byte> bytes() {
    return std::as_writable_bytes(std::span(words)).first(size);
  }
  std::vector<std::uint64_t> words;
  std::size_t size;
  BundleView view;
};

std::vector<std::byte> blocks_of(std::uint32_t side, unsigned seed) {
  const std::size_t across = (side + 3) / 4;
  std::vector<std::byte> blocks(8 * across * across);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    // Bases of 4 bits and any modifiers: every such block has a meaning.
    blocks[i] = i % 8 == 3 ? std::byte{0x24} : static_cast<std::byte>(37 * i + 101 * seed);
  }
  return blocks;
}

/// Makes of the last model, of one chunk, a proxy of the one before.
void make_proxy(BundleContent& content, float error) {
  content.models.pop_back();
  const auto model = static_cast<std::uint32_t>(content.models.size() - 1);
  const auto number = static_cast<std::uint32_t>(content.proxies.size());
  content.proxies.push_back({model, number, 1, 0});
  content.proxy_chunks.push_back(content.chunks.back());
  content.proxy_levels.push_back(content.levels.back());
  content.proxy_chunks.back().first_level = number;
  content.proxy_levels.back().error = error;
  content.chunks.pop_back();
  content.levels.pop_back();
}

/// Two chunks with a proxy of one, and a textured square of levels with alpha, some texels
/// wide.
BundleContent two_kinds(std::uint32_t texels = 16) {
  SceneMaker maker;
  std::vector<std::vector<std::byte>> colour;
  std::vector<std::vector<std::byte>> alpha;
  for (std::uint32_t side = texels, seed = 1; side > 0; side /= 2, ++seed) {
    colour.push_back(blocks_of(side, seed));
    alpha.push_back(blocks_of(side, seed + 9));
  }
  const std::uint32_t texture = maker.add_texture(texels, colour, alpha, kTextureAlpha);
  MaterialRecord seen = flat_material();
  seen.texture = texture;
  const std::uint32_t material = maker.add_material(seen);
  const std::uint32_t layout = maker.add_layout(Layout::kHalfTextured);
  Triangle lower;
  lower.corners = {glm::dvec3(-1, -1, 0), {1, -1, 0}, {1, 1, 0}};
  lower.uvs = {glm::dvec2(0, 1), {1, 1}, {1, 0}};
  maker.add_model(layout, {{{{lower}}, {0.0f}, material, {}}});
  const auto strip = [](double left, double right, const Rgb& tint) {
    const glm::dvec3 a(left, -0.5, 0), b(right, -0.5, 0), c(right, 0.5, 0), d(left, 0.5, 0);
    return std::vector<Triangle>{{{a, b, c}, {}, tint}, {{a, c, d}, {}, tint}};
  };
  const std::uint32_t plain = maker.add_material(flat_material());
  const std::uint32_t coloured = maker.add_layout(Layout::kHalfColoured);
  maker.add_model(coloured, {{{strip(-0.5, 0, {255, 0, 0})}, {0.0f}, plain, {}},
                             {{strip(0, 0.5, {0, 255, 0})}, {0.0f}, plain, {}}});
  maker.add_model(coloured, {{{strip(-0.5, 0.5, {0, 0, 255})}, {0.0f}, plain, {}}});
  make_proxy(maker.content, 0.1f);
  return maker.content;
}

class ComingTest : public GlTest {
 protected:
  static std::vector<std::uint8_t> picture(Renderer& renderer) {
    renderer.set_options(flat_light());
    std::vector<DrawItem> items;
    for (std::uint32_t model : {0u, 1u}) {
      items.push_back(
          {model, glm::translate(glm::mat4(1.0f), {0.2f, 0.1f * static_cast<float>(model),
                                                   -2.0f - static_cast<float>(model)})});
    }
    return draw(renderer, default_camera(96, 72), items);
  }
};

TEST_F(ComingTest, IsDrawnAsIfItWereInMemory) {
  const MappedBundle bundle(two_kinds());
  ASSERT_TRUE(bundle.view);
  const auto whole = bundle.file.bytes();
  const std::unique_ptr<Renderer> usual = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(usual);
  const std::vector<std::uint8_t> wanted = picture(*usual);

  Memory memory(whole);
  const auto bytes = memory.bytes();
  const std::uint64_t start = gpu_start(memory.view);
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(start), bytes.end(), std::byte{0});
  for (const StageRange& range : kept_ranges(memory.view)) {
    std::copy_n(whole.begin() + static_cast<std::ptrdiff_t>(range.offset), range.size,
                bytes.begin() + static_cast<std::ptrdiff_t>(range.offset));
  }
  ASSERT_FALSE(std::equal(whole.begin(), whole.end(), bytes.begin())) << "something passes by";
  // Pieces that end within a vertex, a block, a level; and all of it at once.
  for (const std::size_t piece : {std::size_t{7}, std::size_t{101}, whole.size()}) {
    for (const bool in_place : {false, true}) {
      GlCaps caps = probe_gl_caps();
      caps.etc1_sub_texture = caps.etc1_sub_texture && in_place;
      auto renderer = Renderer::create_part(memory.view, caps, Renderer::Part::kComes);
      ASSERT_TRUE(renderer) << renderer.error().cause;
      for (std::size_t at = static_cast<std::size_t>(start); at < whole.size(); at += piece) {
        (*renderer)->put(at, whole.subspan(at, std::min(piece, whole.size() - at)));
      }
      EXPECT_TRUE(picture(**renderer) == wanted) << piece << ", in place " << in_place;
      EXPECT_EQ((*renderer)->gpu_memory().kept, 0u);
    }
  }
  auto empty = Renderer::create_part(memory.view, probe_gl_caps(), Renderer::Part::kComes);
  ASSERT_TRUE(empty);
  EXPECT_FALSE(picture(**empty) == wanted);
}

/// Blocks of a texture whose finest level the context is too small for, in pieces from the last to
/// the first: little is kept in memory meanwhile, and the picture is the same.
TEST_F(ComingTest, PartsOfATextureGoToTheirPlace) {
  if (!probe_gl_caps().etc1_sub_texture) GTEST_SKIP() << "the driver updates no part of ETC1";
  const MappedBundle bundle(two_kinds(256));
  const auto whole = bundle.file.bytes();
  Memory memory(whole);
  GlCaps caps = probe_gl_caps();
  constexpr std::uint64_t kLevel = 32 * 32 * 8;  // of 128 texels
  caps.max_texture_size = 128;
  const std::unique_ptr<Renderer> usual = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(usual);
  ASSERT_LT(usual->gpu_memory().textures, 4 * kLevel) << "without the finest level";
  const std::vector<std::uint8_t> wanted = picture(*usual);
  for (const bool in_place : {false, true}) {
    caps.etc1_sub_texture = in_place;
    auto renderer = Renderer::create_part(memory.view, caps, Renderer::Part::kComes);
    ASSERT_TRUE(renderer) << renderer.error().cause;
    constexpr std::size_t kPiece = 1001;
    std::uint64_t kept = 0;
    for (std::size_t at = whole.size() / kPiece * kPiece + kPiece; at > 0; at -= kPiece) {
      const std::size_t from = at - kPiece;
      if (from < whole.size())
        (*renderer)->put(from, whole.subspan(from).first(std::min(kPiece, whole.size() - from)));
      kept = std::max(kept, (*renderer)->gpu_memory().kept);
    }
    EXPECT_TRUE(picture(**renderer) == wanted) << "in place " << in_place;
    if (in_place) {
      EXPECT_LT(kept, kLevel / 2);
    } else {
      EXPECT_GE(kept, kLevel);
    }
  }
}

TEST_F(ComingTest, VerticesThatWouldBeRewrittenAreRefused) {
  const MappedBundle bundle(two_kinds());
  GlCaps caps = probe_gl_caps();
  caps.half_float_vertices = false;
  const auto refused = Renderer::create_part(*bundle.view, caps, Renderer::Part::kComes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "gl.halves");
}

/// What only a proxy is there of takes no more of the GPU than that.
TEST_F(ComingTest, TheCoarsestIsUploadedWhenItIsDrawn) {
  const MappedBundle bundle(two_kinds());
  Memory memory(bundle.file.bytes());
  show_coarsest(memory.bytes(), memory.view);
  auto renderer = Renderer::create_part(memory.view, probe_gl_caps(), Renderer::Part::kCoarsest);
  ASSERT_TRUE(renderer) << renderer.error().cause;
  EXPECT_EQ((*renderer)->gpu_memory().geometry, 0u);
  const auto pixels = picture(**renderer);
  EXPECT_GT((*renderer)->stats().triangles, 0u);
  EXPECT_LT((*renderer)->gpu_memory().geometry,
            bundle.view->vertices().size() + bundle.view->indices().size());
  int blue = 0;
  for (std::size_t i = 0; i < pixels.size(); i += 4) {
    EXPECT_FALSE(pixels[i] == 255 && pixels[i + 1] == 0) << "a chunk of model 1";
    blue += pixels[i + 2] == 255 && pixels[i] == 0 ? 1 : 0;
  }
  EXPECT_GT(blue, 0);
}

/// A bundle that is larger than what a view may have: little of it is there, the rest comes when it
/// is wanted.
class WantedTest : public ComingTest {
 protected:
  void SetUp() override {
    ComingTest::SetUp();
    if (IsSkipped()) return;
    if (!probe_gl_caps().es3) GTEST_SKIP() << "needs ES 3";
    hold(two_kinds(512));
  }

  /// In memory is only what kept_ranges() names.
  void hold(const BundleContent& content) {
    bundle.emplace(content);
    ASSERT_TRUE(bundle->view);
    whole = bundle->file.bytes();
    memory.emplace(whole);
    const auto bytes = memory->bytes();
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(gpu_start(memory->view)), bytes.end(),
              std::byte{0});
    for (const StageRange& range : kept_ranges(memory->view)) {
      std::copy_n(whole.begin() + static_cast<std::ptrdiff_t>(range.offset), range.size,
                  bytes.begin() + static_cast<std::ptrdiff_t>(range.offset));
    }
  }

  std::unique_ptr<Renderer> start(std::uint64_t budget) {
    GlCaps caps = probe_gl_caps();
    caps.gpu_memory = budget;
    auto renderer = Renderer::create_part(memory->view, caps, Renderer::Part::kWanted);
    EXPECT_TRUE(renderer) << renderer.error().cause;
    return renderer ? *std::move(renderer) : nullptr;
  }

  /// Uploads the requested ranges, the end of each first; answers the bytes.
  std::uint64_t bring(Renderer& renderer) {
    std::uint64_t bytes = 0;
    for (;;) {
      const Renderer::StreamRequest wanted = renderer.open_wanted();
      if (wanted.number == kNone) return bytes;
      EXPECT_LE(wanted.offset + wanted.size, whole.size());
      const std::uint64_t half = wanted.offset + wanted.size / 2;
      renderer.put(half, whole.subspan(half, wanted.offset + wanted.size - half));
      renderer.put(wanted.offset, whole.subspan(wanted.offset, half - wanted.offset));
      renderer.have(wanted.number);
      bytes += wanted.size;
    }
  }

  std::optional<MappedBundle> bundle;
  std::span<const std::byte> whole;
  std::optional<Memory> memory;
};

int blue_pixels(std::span<const std::uint8_t> pixels) {
  int blue = 0;
  for (std::size_t i = 0; i < pixels.size(); i += 4) blue += pixels[i + 2] == 255 && pixels[i] == 0;
  return blue;
}

TEST_F(WantedTest, AViewGetsBetterUntilItIsTheWholeBundles) {
  const auto wanted = picture(*make_renderer(*bundle->view, probe_gl_caps()));
  const auto renderer = start(64 << 20);
  ASSERT_TRUE(renderer);
  const auto first = picture(*renderer);
  EXPECT_GT(blue_pixels(first), 0) << "the proxy";
  EXPECT_EQ(blue_pixels(wanted), 0);
  std::uint64_t bytes = 0;
  for (std::uint64_t more = 1; more > 0;) {
    bytes += more = bring(*renderer);
    picture(*renderer);
  }
  EXPECT_TRUE(picture(*renderer) == wanted);
  EXPECT_EQ(bring(*renderer), 0u) << "nothing is requested twice";
  // The levels of 512 texels, twice, and the two chunks.
  const std::uint64_t level = 128 * 128 * 8;
  EXPECT_GE(bytes, 2 * level);
  EXPECT_LT(bytes, 2 * level + bundle->view->vertices().size() + bundle->view->indices().size());
}

TEST_F(WantedTest, WhatIsOpenIsNotDrawn) {
  const auto renderer = start(64 << 20);
  ASSERT_TRUE(renderer);
  const auto first = picture(*renderer);
  int open = 0;
  for (;;) {
    const Renderer::StreamRequest wanted = renderer->open_wanted();
    if (wanted.number == kNone) break;
    ++open;
    renderer->put(wanted.offset, whole.subspan(wanted.offset, wanted.size));
  }
  EXPECT_EQ(open, 5) << "a texture's level, and two chunks' vertices and indices";
  EXPECT_TRUE(picture(*renderer) == first);
}

/// The budget is kept at every step, invisible levels make room, and come again.
TEST_F(WantedTest, WithinABudget) {
  const std::uint64_t geometry = bundle->view->vertices().size() + bundle->view->indices().size();
  const std::uint64_t texture = 2 * (128 * 128 * 8);
  const auto renderer = start(texture / 2);  // not the finest level
  ASSERT_TRUE(renderer);
  for (int i = 0; i < 8; ++i) {
    picture(*renderer);
    bring(*renderer);
    const GpuMemory used = renderer->gpu_memory();
    EXPECT_LE(used.geometry + used.textures + used.batches, texture / 2);
  }
  EXPECT_EQ(blue_pixels(picture(*renderer)), 0) << geometry << " bytes fit";
}

/// A red chunk whose coarser level, green, uses the first of its vertices, and a blue proxy of
/// the error 5. coarser: the green level's error.
BundleContent prefixes(float coarser) {
  SceneMaker maker;
  const std::uint32_t material = maker.add_material(flat_material());
  const std::uint32_t layout = maker.add_layout(Layout::kHalfColoured);
  const auto square = [](const Rgb& tint) {
    const glm::dvec3 a(-0.5, -0.5, 0), b(0.5, -0.5, 0), c(0.5, 0.5, 0), d(-0.5, 0.5, 0);
    return std::vector<Triangle>{{{a, b, c}, {}, tint}, {{a, c, d}, {}, tint}};
  };
  maker.add_model(layout, {{{square({0, 255, 0}), square({255, 0, 0})}, {}, material, {}}}, true);
  maker.add_model(layout, {{{square({0, 0, 255})}, {}, material, {}}});
  BundleContent& content = maker.content;
  make_proxy(content, 5.0f);
  std::swap(content.levels[0], content.levels[1]);
  content.levels[0].error = 0.0f;
  content.levels[1].error = coarser;
  return content;
}

/// A view of prefixes().
class PrefixTest : public WantedTest {
 protected:
  static constexpr std::array<int, 3> kRed = {255, 0, 0}, kGreen = {0, 255, 0}, kBlue = {0, 0, 255};

  void open(float coarser) {
    hold(prefixes(coarser));
    renderer = start(1 << 20);
    ASSERT_TRUE(renderer);
    renderer->set_options(flat_light());
  }
  /// The colour in the middle.
  std::array<int, 3> seen(float distance) {
    const DrawItem item{0, glm::translate(glm::mat4(1.0f), {0.0f, 0.0f, -distance})};
    const auto pixels = draw(*renderer, default_camera(96, 72), std::span(&item, 1));
    const std::size_t middle = 4 * (36 * 96 + 48);
    return {pixels[middle], pixels[middle + 1], pixels[middle + 2]};
  }
  /// Uploads requests; returns the bytes of requested vertices.
  std::uint64_t come() {
    std::uint64_t vertices = 0;
    const auto section = memory->view.vertices();
    const auto first = static_cast<std::uint64_t>(section.data() - memory->view.bytes().data());
    for (;;) {
      const Renderer::StreamRequest wanted = renderer->open_wanted();
      if (wanted.number == kNone) return vertices;
      renderer->put(wanted.offset, whole.subspan(wanted.offset, wanted.size));
      renderer->have(wanted.number);
      if (wanted.offset - first < section.size()) vertices += wanted.size;
    }
  }

  std::unique_ptr<Renderer> renderer;
};

/// Ranges of a coarser level are not uploaded again with the rest.
TEST_F(PrefixTest, LevelsShareTheFrontOfTheirVertices) {
  open(0.05f);
  const std::uint64_t half = 6ull * memory->view.layouts()[0].stride;
  EXPECT_EQ(seen(20), kBlue);
  EXPECT_EQ(come(), half) << "the coarser level's";
  EXPECT_EQ(seen(20), kGreen);
  EXPECT_EQ(seen(2), kGreen) << "until the finer one has come";
  EXPECT_EQ(come(), half) << "the rest";
  EXPECT_EQ(seen(2), kRed);
  EXPECT_EQ(come(), 0u);
  EXPECT_EQ(seen(20), kGreen);
}

/// Proxies of a rough surface often state nearly the same error.
TEST_F(PrefixTest, LevelsOfNearlyTheSameErrorComeOneAfterTheOther) {
  for (const float error : {4.5f, 3.5f, 2.5f, 1.5f}) {
    open(error);
    EXPECT_EQ(seen(2), kBlue);
    come();
    EXPECT_EQ(seen(2), kGreen) << error;
    come();
    EXPECT_EQ(seen(2), kRed) << error;
  }
}

TEST_F(WantedTest, NeedsAContextThatDrawsTexturesInPart) {
  GlCaps caps = probe_gl_caps();
  caps.es3 = false;
  const auto refused = Renderer::create_part(memory->view, caps, Renderer::Part::kWanted);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "gl.levels");
}

/// After a view that fills the budget, a model is drawn by its finer proxy, not by the coarsest.
TEST_F(WantedTest, ProxiesMakeRoomLast) {
  SceneMaker maker;
  const std::uint32_t material = maker.add_material(flat_material());
  const std::uint32_t layout = maker.add_layout(Layout::kHalfColoured);
  const auto add = [&](std::size_t squares, const Rgb& tint) {
    const glm::dvec3 a(-0.5, -0.5, 0), b(0.5, -0.5, 0), c(0.5, 0.5, 0), d(-0.5, 0.5, 0);
    std::vector<Triangle> all;
    for (std::size_t i = 0; i < squares; ++i) {
      all.push_back({{a, b, c}, {}, tint});
      all.push_back({{a, c, d}, {}, tint});
    }
    maker.add_model(layout, {{{all}, {}, material, {}}});
  };
  add(64, {255, 0, 0});
  add(16, {0, 255, 0});
  make_proxy(maker.content, 2.0f);
  add(1, {0, 0, 255});
  make_proxy(maker.content, 5.0f);
  add(64, {255, 255, 255});
  hold(maker.content);
  const std::uint64_t square = 6ull * memory->view.layouts()[0].stride + 6ull * 2;
  // Room for a chunk and both proxies, not for two chunks.
  const auto renderer = start(112 * square);
  ASSERT_TRUE(renderer);
  renderer->set_options(flat_light());
  const auto seen = [&](std::uint32_t model) {
    const DrawItem item{model, glm::translate(glm::mat4(1.0f), {0.0f, 0.0f, -2.0f})};
    const auto pixels = draw(*renderer, default_camera(96, 72), std::span(&item, 1));
    const std::size_t middle = 4 * (36 * 96 + 48);
    return std::array<int, 3>{pixels[middle], pixels[middle + 1], pixels[middle + 2]};
  };
  using Colour = std::array<int, 3>;
  EXPECT_EQ(seen(0), (Colour{0, 0, 255}));
  bring(*renderer);
  EXPECT_EQ(seen(0), (Colour{0, 255, 0}));
  bring(*renderer);
  EXPECT_EQ(seen(0), (Colour{255, 0, 0}));
  seen(1);
  bring(*renderer);
  EXPECT_EQ(seen(1), (Colour{255, 255, 255}));
  EXPECT_EQ(seen(0), (Colour{0, 255, 0})) << "the chunk has made room";
}

/// A chunk that comes into view is there at its coarsest, so that no proxy of the whole model is
/// drawn meanwhile. One that is far off is not asked for.
TEST_F(WantedTest, ChunksAroundTheViewAreAskedFor) {
  SceneMaker maker;
  const std::uint32_t material = maker.add_material(flat_material());
  const std::uint32_t layout = maker.add_layout(Layout::kHalfColoured);
  const auto square = [](double left, const Rgb& tint) {
    const glm::dvec3 a(left, -0.25, 0), b(left + 0.25, -0.25, 0), c(left + 0.25, 0.25, 0),
        d(left, 0.25, 0);
    return std::vector<Triangle>{{{a, b, c}, {}, tint}, {{a, c, d}, {}, tint}};
  };
  std::vector<SceneMaker::Chunk> chunks;
  for (int i = 0; i < 8; ++i) {
    const double left = 0.25 * i - 1.0;
    chunks.push_back(
        {{square(left, {255, 0, 0}), square(left, {0, 255, 0})}, {0.0f, 0.1f}, material, {}});
  }
  maker.add_model(layout, chunks);
  maker.add_model(layout, {{{square(-1.0, {0, 0, 255})}, {0.0f}, material, {}}});
  make_proxy(maker.content, 5.0f);
  hold(maker.content);
  const auto renderer = start(1 << 20);
  ASSERT_TRUE(renderer);
  renderer->set_options(flat_light());
  // The right of a picture as wide as two chunks.
  const auto seen = [&](float x) {
    const DrawItem item{0, glm::translate(glm::mat4(1.0f), {-x, 0.0f, -0.5f})};
    const auto pixels = draw(*renderer, default_camera(96, 72), std::span(&item, 1));
    const std::size_t right = 4 * (36 * 96 + 84);
    return std::array<int, 3>{pixels[right], pixels[right + 1], pixels[right + 2]};
  };
  using Colour = std::array<int, 3>;
  seen(-0.6f);
  while (bring(*renderer) > 0) seen(-0.6f);
  EXPECT_EQ(seen(-0.6f), (Colour{255, 0, 0}));
  EXPECT_EQ(seen(-0.3f), (Colour{0, 255, 0})) << "around the view before";
  const std::uint64_t level = 6ull * memory->view.layouts()[0].stride + 6ull * 2;
  EXPECT_LE(renderer->gpu_memory().geometry, 10 * level) << "of 16";
}

}  // namespace
}  // namespace modar
