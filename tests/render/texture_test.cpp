// ETC1 blocks reach the screen as the extension's tables say, decoded by the driver or by us.
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "formats/texture_format.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

// GL_OES_compressed_ETC1_RGB8_texture, table 3.17.2: intensity modifiers, in its order
// -b, -a, a, b, and table 3.17.3: pixel index bits (high, low) to column.
constexpr int kModifiers[8][4] = {{-8, -2, 2, 8},       {-17, -5, 5, 17},    {-29, -9, 9, 29},
                                  {-42, -13, 13, 42},   {-60, -18, 18, 60},  {-80, -24, 24, 80},
                                  {-106, -33, 33, 106}, {-183, -47, 47, 183}};
constexpr int kColumn[2][2] = {{2, 3}, {1, 0}};  // [high][low]

/// A block by its meaning; bits are laid by pack(), pixels told by pixel().
struct HandMadeBlock {
  bool differential = false;
  bool flipped = false;
  std::array<int, 3> first{};   ///< 4 bits each, or 5
  std::array<int, 3> second{};  ///< 4 bits each, or a signed step of 3 bits
  std::array<int, 2> table{};
  std::array<std::array<int, 2>, 16> index{};  ///< (high, low), pixels column by column

  [[nodiscard]] std::array<std::byte, 8> pack() const {
    std::array<int, 8> out{};
    for (std::size_t c = 0; c < 3; ++c) {
      out[c] = differential ? first[c] << 3 | (second[c] & 7) : first[c] << 4 | second[c];
    }
    out[3] = table[0] << 5 | table[1] << 2 | (differential ? 2 : 0) | (flipped ? 1 : 0);
    for (int p = 0; p < 16; ++p) {
      const std::array<int, 2>& bits = index[static_cast<std::size_t>(p)];
      out[p < 8 ? 5 : 4] |= bits[0] << (p % 8);
      out[p < 8 ? 7 : 6] |= bits[1] << (p % 8);
    }
    std::array<std::byte, 8> bytes{};
    for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::byte>(out[i]);
    return bytes;
  }

  [[nodiscard]] Rgb pixel(int x, int y) const {
    const int half = (flipped ? y : x) < 2 ? 0 : 1;
    const auto& bits = index[static_cast<std::size_t>(x * 4 + y)];
    const int modifier =
        kModifiers[table[static_cast<std::size_t>(half)]][kColumn[bits[0]][bits[1]]];
    Rgb rgb{};
    for (std::size_t c = 0; c < 3; ++c) {
      int base = 0;
      if (differential) {
        const int five = first[c] + (half == 1 ? second[c] : 0);
        base = five * 8 + five / 4;
      } else {
        base = (half == 0 ? first[c] : second[c]) * 17;
      }
      rgb[c] = static_cast<std::uint8_t>(std::clamp(base + modifier, 0, 255));
    }
    return rgb;
  }
};

HandMadeBlock random_block(std::mt19937& random) {
  HandMadeBlock block;
  block.differential = random() % 2 != 0;
  block.flipped = random() % 2 != 0;
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  for (std::size_t c = 0; c < 3; ++c) {
    block.first[c] = below(block.differential ? 32 : 16);
    block.second[c] = below(16);
    // What leaves 5 bits is not defined by the format.
    if (block.differential)
      block.second[c] = std::clamp(below(8) - 4, -block.first[c], 31 - block.first[c]);
  }
  block.table = {below(8), below(8)};
  for (auto& bits : block.index) bits = {below(2), below(2)};
  return block;
}

HandMadeBlock flat_block(int red, int green, int blue) {
  HandMadeBlock block;
  block.first = block.second = {red, green, blue};
  // Table 0, index (0, 0): every pixel is base + 2.
  return block;
}

std::vector<std::byte> pack_all(std::span<const HandMadeBlock> blocks) {
  std::vector<std::byte> bytes;
  for (const HandMadeBlock& block : blocks) {
    const auto packed = block.pack();
    bytes.insert(bytes.end(), packed.begin(), packed.end());
  }
  return bytes;
}

/// The square [-1,1]^2 at z = 0, uv (0,0) at its top left.
std::vector<Triangle> textured_square() {
  Triangle lower;
  lower.corners = {glm::dvec3(-1, -1, 0), {1, -1, 0}, {1, 1, 0}};
  lower.uvs = {glm::dvec2(0, 1), {1, 1}, {1, 0}};
  Triangle upper;
  upper.corners = {glm::dvec3(-1, -1, 0), {1, 1, 0}, {-1, 1, 0}};
  upper.uvs = {glm::dvec2(0, 1), {1, 0}, {0, 0}};
  return {lower, upper};
}

/// A view in which textured_square() fills a picture of side x side exactly.
struct ExactView {
  Camera camera;
  DrawItem item;
};

ExactView exact_view(int side) {
  ExactView view;
  view.camera = default_camera(side, side);
  view.camera.fx = view.camera.fy = side;
  view.camera.cx = view.camera.cy = (side - 1) / 2.0;
  view.item.to_eye = glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -2.0f));
  return view;
}

std::uint32_t add_square(SceneMaker& maker, std::uint32_t texture) {
  MaterialRecord material = flat_material();
  material.texture = texture;
  const std::uint32_t index = maker.add_material(material);
  SceneMaker::Chunk chunk;
  chunk.levels = {textured_square()};
  chunk.material = index;
  return maker.add_model(maker.add_layout(Layout::kHalfTextured), {chunk});
}

class TextureTest : public GlTest {
 protected:
  void check_random_blocks(const GlCaps& caps) {
    constexpr int kSide = 128;
    std::mt19937 random(5);
    std::vector<HandMadeBlock> blocks;
    for (int i = 0; i < kSide / 4 * kSide / 4; ++i) blocks.push_back(random_block(random));
    SceneMaker maker;
    add_square(maker, maker.add_texture(kSide, {pack_all(blocks)}, {}, 0));
    const MappedBundle bundle(maker.content);
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    const ExactView view = exact_view(kSide);
    const std::vector<std::uint8_t> pixels = draw(*renderer, view.camera, {&view.item, 1});
    int wrong = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const HandMadeBlock& block = blocks[static_cast<std::size_t>(y / 4 * (kSide / 4) + x / 4)];
        const Rgb expected = block.pixel(x % 4, y % 4);
        for (std::size_t c = 0; c < 3; ++c) {
          const int got = pixels[static_cast<std::size_t>(y * kSide + x) * 4 + c];
          // Linear filtering at a texel's centre may round by one step.
          wrong += std::abs(got - static_cast<int>(expected[c])) > 1;
        }
      }
    }
    EXPECT_EQ(wrong, 0) << "of " << kSide * kSide * 3 << " values";
  }
};

TEST_F(TextureTest, DriverDecodesBlocksAsTheTablesSay) {
  if (!probe_gl_caps().reads(TextureFormat::kEtc1Rgb)) GTEST_SKIP() << "this driver has no ETC1";
  check_random_blocks(probe_gl_caps());
}

TEST_F(TextureTest, DecodedFallbackShowsTheSame) {
  GlCaps caps = probe_gl_caps();
  caps.texture_formats = 0;
  check_random_blocks(caps);
}

TEST_F(TextureTest, EachMipLevelIsTheOneOfItsSize) {
  // Every level has a colour of its own; a square of n pixels shows the level of n texels.
  std::vector<std::vector<std::byte>> levels;
  for (int level = 0; level < 7; ++level) {
    const int side = std::max(1, 64 >> level);
    const int across = (side + 3) / 4;
    const std::vector<HandMadeBlock> blocks(static_cast<std::size_t>(across * across),
                                            flat_block(level + 1, 14 - level, 3));
    levels.push_back(pack_all(blocks));
  }
  SceneMaker maker;
  add_square(maker, maker.add_texture(64, levels, {}, 0));
  const MappedBundle bundle(maker.content);
  for (const bool etc1 : {true, false}) {
    GlCaps caps = probe_gl_caps();
    if (!etc1) caps.texture_formats = 0;
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    for (int level = 0; level < 5; ++level) {
      const int side = 64 >> level;
      const ExactView view = exact_view(side);
      const std::vector<std::uint8_t> pixels = draw(*renderer, view.camera, {&view.item, 1});
      const std::size_t middle = static_cast<std::size_t>(side / 2 * side + side / 2) * 4;
      EXPECT_NEAR(pixels[middle], (level + 1) * 17 + 2, 2) << "level " << level;
      EXPECT_NEAR(pixels[middle + 1], (14 - level) * 17 + 2, 2) << "level " << level;
    }
  }
}

TEST_F(TextureTest, LightIsAddedToEachTexelsOwn) {
  std::vector<HandMadeBlock> blocks;
  for (int gray = 0; gray < 16; ++gray) blocks.push_back(flat_block(gray, gray, gray));
  SceneMaker maker;
  add_square(maker, maker.add_texture(16, {pack_all(blocks)}, {}, 0));
  constexpr float kGlow = 0.3f;
  std::fill_n(maker.content.materials.back().emission, 3, kGlow);
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const ExactView view = exact_view(16);
  const std::vector<std::uint8_t> pixels = draw(*renderer, view.camera, {&view.item, 1});
  const auto linear = [](double c) {
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  for (int gray = 0; gray < 16; ++gray) {
    const int x = gray % 4 * 4 + 1;
    const int y = gray / 4 * 4 + 1;
    const double sum = linear(std::min(gray * 17 + 2, 255) / 255.0) + linear(double{kGlow});
    const double stored = std::min(1.055 * std::pow(sum, 1 / 2.4) - 0.055, 1.0);
    EXPECT_NEAR(pixels[static_cast<std::size_t>(4 * (16 * y + x))], 255 * stored, 4) << gray;
  }
}

TEST_F(TextureTest, LevelsBeyondTheLimitAreLeftOut) {
  std::vector<std::vector<std::byte>> levels;
  for (int level = 0; level < 7; ++level) {
    const int across = (std::max(1, 64 >> level) + 3) / 4;
    const std::vector<HandMadeBlock> blocks(static_cast<std::size_t>(across * across),
                                            flat_block(level + 1, 14 - level, 3));
    levels.push_back(pack_all(blocks));
  }
  SceneMaker maker;
  add_square(maker, maker.add_texture(64, levels, {}, 0));
  const MappedBundle bundle(maker.content);
  GlCaps caps = probe_gl_caps();
  caps.max_texture_size = 64;
  const std::uint64_t all = make_renderer(*bundle.view, caps)->gpu_memory().textures;
  caps.max_texture_size = 16;
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(renderer);
  // Levels of 64 and 32 texels: 256 and 64 blocks of 8 bytes (3 bytes a texel where decoded).
  const std::uint64_t dropped =
      caps.reads(TextureFormat::kEtc1Rgb) ? (256 + 64) * 8 : (64 * 64 + 32 * 32) * 3;
  EXPECT_EQ(renderer->gpu_memory().textures, all - dropped);
  const ExactView view = exact_view(16);
  const std::vector<std::uint8_t> pixels = draw(*renderer, view.camera, {&view.item, 1});
  EXPECT_NEAR(pixels[0], 3 * 17 + 2, 2);
}

TEST_F(TextureTest, TooLargeWithoutSmallerLevelsIsRefused) {
  const std::vector<HandMadeBlock> blocks(256, flat_block(1, 2, 3));
  SceneMaker maker;
  add_square(maker, maker.add_texture(64, {pack_all(blocks)}, {}, 0));
  const MappedBundle bundle(maker.content);
  GlCaps caps = probe_gl_caps();
  caps.max_texture_size = 32;
  const Result<std::unique_ptr<Renderer>> renderer = Renderer::create(*bundle.view, caps);
  ASSERT_FALSE(renderer.has_value());
  EXPECT_EQ(renderer.error().code, "gl.texture-size");
}

TEST_F(TextureTest, AlphaTwinBlendsOverTheBackground) {
  // Left half opaque, right half about one quarter.
  std::vector<HandMadeBlock> colour(4, flat_block(15, 0, 0));
  std::vector<HandMadeBlock> alpha = {flat_block(15, 15, 15), flat_block(4, 4, 4),
                                      flat_block(15, 15, 15), flat_block(4, 4, 4)};
  SceneMaker maker;
  add_square(maker, maker.add_texture(8, {pack_all(colour)}, {pack_all(alpha)}, kTextureAlpha));
  const MappedBundle bundle(maker.content);
  const std::vector<std::uint8_t> blue = [] {
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 64; ++i) pixels.insert(pixels.end(), {0, 0, 200});
    return pixels;
  }();
  const RgbImage background{blue.data(), 8, 8, 24};
  for (const bool etc1 : {true, false}) {
    GlCaps caps = probe_gl_caps();
    if (!etc1) caps.texture_formats = 0;
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    const ExactView view = exact_view(8);
    const std::vector<std::uint8_t> pixels =
        draw(*renderer, view.camera, {&view.item, 1}, background);
    const auto at = [&](int x, int c) {
      return pixels[static_cast<std::size_t>((3 * 8 + x) * 4 + c)];
    };
    EXPECT_NEAR(at(1, 0), 255, 2);
    EXPECT_NEAR(at(1, 2), 2, 3);
    const double a = 70.0 / 255.0;
    EXPECT_NEAR(at(6, 0), 255 * a, 2);
    EXPECT_NEAR(at(6, 2), 200 * (1.0 - a) + 2 * a, 2);
  }
}

TEST_F(TextureTest, CutOutsHideWhatIsDrawnAfterThemWhereTheyAre) {
  // Left half there, right half not. The nearer of two squares of one chunk comes first.
  std::vector<HandMadeBlock> colour = {flat_block(15, 0, 0), flat_block(15, 0, 0),
                                       flat_block(0, 15, 0), flat_block(0, 15, 0)};
  std::vector<HandMadeBlock> alpha = {flat_block(15, 15, 15), flat_block(0, 0, 0),
                                      flat_block(15, 15, 15), flat_block(15, 15, 15)};
  SceneMaker maker;
  MaterialRecord material = flat_material();
  material.texture =
      maker.add_texture(8, {pack_all(colour)}, {pack_all(alpha)}, kTextureAlpha | kTextureCutOut);
  SceneMaker::Chunk chunk;
  chunk.material = maker.add_material(material);
  chunk.levels = {textured_square()};
  for (Triangle& triangle : chunk.levels[0]) {
    for (glm::dvec3& corner : triangle.corners) corner.z = 0.5;
    for (glm::dvec2& uv : triangle.uvs) uv.y *= 0.25;  // the red blocks
  }
  for (Triangle triangle : textured_square()) {
    for (glm::dvec2& uv : triangle.uvs) uv.y = 0.875;  // the green ones
    chunk.levels[0].push_back(triangle);
  }
  maker.add_model(maker.add_layout(Layout::kHalfTextured), {chunk});
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const ExactView view = exact_view(8);
  const std::vector<std::uint8_t> pixels = draw(*renderer, view.camera, {&view.item, 1});
  const auto at = [&](int x, int c) {
    return pixels[static_cast<std::size_t>((3 * 8 + x) * 4 + c)];
  };
  EXPECT_NEAR(at(1, 0), 255, 2);
  EXPECT_NEAR(at(1, 1), 0, 4);
  EXPECT_NEAR(at(6, 0), 0, 4);
  EXPECT_NEAR(at(6, 1), 255, 2);
}

// Sections 3.7.6 and 3.7.7 of the ES 2.0 specification: halves of the picture from -1 to 2.
TEST_F(TextureTest, PicturesContinueBeyondTheirEdgesAsTheirFlagsSay) {
  const std::vector<HandMadeBlock> quarters = {flat_block(0, 0, 15), flat_block(15, 0, 15),
                                               flat_block(0, 15, 15), flat_block(15, 15, 15)};
  struct {
    std::uint32_t flags;
    const char* u;  ///< 0: left or upper half of the picture, 1: the other one
    const char* v;
  } const kCases[] = {{0, "000111", "000111"},
                      {kTextureRepeat, "010101", "010101"},
                      {kTextureRepeat | kTextureMirrorU, "100110", "010101"},
                      {kTextureRepeat | kTextureMirrorU | kTextureClampV, "100110", "000111"},
                      {kTextureRepeat | kTextureMirrorV, "010101", "100110"},
                      {kTextureRepeat | kTextureClampU | kTextureMirrorV, "000111", "100110"}};
  for (const auto& wanted : kCases) {
    SceneMaker maker;
    add_square(maker, maker.add_texture(8, {pack_all(quarters)}, {}, wanted.flags));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      maker.content.chunks[0].uv_offset[axis] = -1;
      maker.content.chunks[0].uv_scale[axis] = 3;
    }
    const MappedBundle bundle(maker.content);
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
    ASSERT_TRUE(renderer);
    const ExactView view = exact_view(24);
    const std::vector<std::uint8_t> pixels = draw(*renderer, view.camera, {&view.item, 1});
    std::string u;
    std::string v;
    for (std::size_t i = 0; i < 6; ++i) {
      u += pixels[(11 * 24 + 4 * i + 2) * 4] > 127 ? '1' : '0';
      v += pixels[((4 * i + 2) * 24 + 11) * 4 + 1] > 127 ? '1' : '0';
    }
    EXPECT_EQ(u, wanted.u) << wanted.flags;
    EXPECT_EQ(v, wanted.v) << wanted.flags;
  }
}

TEST_F(TextureTest, DrawsSortedByTextureBindEachOnce) {
  SceneMaker maker;
  const std::vector<HandMadeBlock> blocks(1, flat_block(9, 9, 9));
  std::vector<SceneMaker::Chunk> chunks;
  std::vector<std::uint32_t> materials;
  for (int i = 0; i < 2; ++i) {
    MaterialRecord material = flat_material();
    material.texture = maker.add_texture(4, {pack_all(blocks)}, {}, 0);
    materials.push_back(maker.add_material(material));
  }
  for (int i = 0; i < 8; ++i) {
    SceneMaker::Chunk chunk;
    chunk.levels = {textured_square()};
    chunk.material = materials[static_cast<std::size_t>(i % 2)];
    chunks.push_back(chunk);
  }
  maker.add_model(maker.add_layout(Layout::kHalfTextured), chunks, true);
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  RenderOptions options = flat_light();
  options.exclusive_context = true;
  renderer->set_options(options);
  const ExactView view = exact_view(32);
  draw(*renderer, view.camera, {&view.item, 1});
  draw(*renderer, view.camera, {&view.item, 1});
  EXPECT_EQ(renderer->stats().chunks_drawn, 8);
  EXPECT_EQ(renderer->stats().triangles, 16u);
  // The second frame finds program, buffers and attributes as the first one left them: the rest
  // to do is to bind the two textures.
  EXPECT_LE(renderer->stats().state_changes, 2);
}

}  // namespace
}  // namespace modar
