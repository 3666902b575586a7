// GPU memory is held to its budget, pages are touched when they are drawn, and a frame allocates
// nothing.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>

#include <glm/gtc/matrix_transform.hpp>

#include "tests/render/scene.hpp"

namespace {

thread_local bool counting = false;
thread_local int allocations = 0;

void* counted(std::size_t size) {
  if (counting) ++allocations;
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) std::abort();
  return memory;
}

}  // namespace

// Replaced for the whole program: only what a test asks to be counted is.
// Not inline: in callers that are, GCC warns of memory that no delete of its own gets.
void* operator new(std::size_t size) {
  return counted(size);
}
void* operator new[](std::size_t size) {
  return counted(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace modar {
namespace {

/// A row of `count` tiles along x, a chunk each, `n` squares a side, with a coarse second level.
BundleContent tile_row(int count, int n) {
  SceneMaker maker;
  const std::uint32_t material = maker.add_material(flat_material());
  std::vector<SceneMaker::Chunk> chunks;
  const double width = 2.0 / count;
  for (int tile = 0; tile < count; ++tile) {
    SceneMaker::Chunk chunk;
    chunk.material = material;
    chunk.errors = {0.0f, 0.05f};
    const double left = -1.0 + tile * width;
    for (const int squares : {n, 1}) {
      std::vector<Triangle> triangles;
      const double step = width / squares;
      for (int i = 0; i < squares * squares; ++i) {
        const double x = left + i % squares * step;
        const double y = (i / squares) * step - width / 2;
        Triangle lower;
        lower.colour = {static_cast<std::uint8_t>(20 * tile + 15), 100, 200};
        Triangle upper = lower;
        lower.corners = {glm::dvec3(x, y, 0), {x + step, y, 0}, {x + step, y + step, 0}};
        upper.corners = {glm::dvec3(x, y, 0), {x + step, y + step, 0}, {x, y + step, 0}};
        triangles.push_back(lower);
        triangles.push_back(upper);
      }
      chunk.levels.push_back(triangles);
    }
    chunks.push_back(chunk);
  }
  maker.add_model(maker.add_layout(Layout::kF32Coloured), chunks);
  return maker.content;
}

/// The camera is in front of tile `x` of [-1,1], close enough to see a few.
DrawItem before(double x) {
  return {0, glm::translate(glm::mat4(1.0f), glm::vec3(static_cast<float>(-x), 0.0f, -0.4f))};
}

class MemoryTest : public GlTest {};

TEST_F(MemoryTest, BudgetKeepsWhatIsSeenAndEvictsTheRest) {
  const BundleContent content = tile_row(10, 12);
  const MappedBundle bundle(content);
  const std::uint64_t all = content.vertices.size() + content.indices.size();
  GlCaps unlimited = probe_gl_caps();
  GlCaps limited = unlimited;
  limited.gpu_memory = all / 2;
  const std::unique_ptr<Renderer> reference = make_renderer(*bundle.view, unlimited);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, limited);
  ASSERT_TRUE(reference && renderer);
  EXPECT_EQ(reference->gpu_memory().geometry, all);
  EXPECT_EQ(renderer->gpu_memory().geometry, 0u);
  RenderOptions options = flat_light();
  options.lod_pixels = 0.1f;
  reference->set_options(options);
  renderer->set_options(options);
  const Camera camera = default_camera(96, 64);
  std::uint64_t evictions = 0;
  for (double x = -0.9; x <= 0.9; x += 0.05) {
    const DrawItem item = before(x);
    const std::vector<std::uint8_t> expected = draw(*reference, camera, {&item, 1});
    const std::vector<std::uint8_t> pixels = draw(*renderer, camera, {&item, 1});
    EXPECT_TRUE(expected == pixels) << "at " << x;
    EXPECT_LE(renderer->gpu_memory().geometry, limited.gpu_memory);
    EXPECT_EQ(renderer->stats().chunks_skipped, 0);
    EXPECT_GT(renderer->stats().chunks_culled, 3);
    evictions += renderer->stats().evictions;
  }
  EXPECT_GT(evictions, 5u);
  // Standing still sends no geometry.
  const DrawItem item = before(0.9);
  draw(*renderer, camera, {&item, 1});
  EXPECT_LT(renderer->stats().bytes_uploaded, 4096u);
}

TEST_F(MemoryTest, TooSmallABudgetFallsBackToCoarseLevels) {
  const BundleContent content = tile_row(10, 12);
  const MappedBundle bundle(content);
  GlCaps caps = probe_gl_caps();
  // One fine chunk, and coarse ones next to it.
  caps.gpu_memory = 30000;
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(renderer);
  RenderOptions options = flat_light();
  options.lod_pixels = 0.1f;
  renderer->set_options(options);
  const Camera camera = default_camera(96, 64);
  const DrawItem item = before(0.1);
  const std::vector<std::uint8_t> pixels = draw(*renderer, camera, {&item, 1});
  EXPECT_LE(renderer->gpu_memory().geometry, caps.gpu_memory);
  EXPECT_EQ(renderer->stats().chunks_skipped, 0);
  EXPECT_GT(renderer->stats().triangles, 288u);
  EXPECT_LT(renderer->stats().triangles, 2u * 288u);
  // Every tile is flat: its coarse level shows the same, so no pixel of the row is left empty.
  for (int x = 0; x < 96; ++x)
    EXPECT_EQ(pixels[static_cast<std::size_t>(32 * 96 + x) * 4 + 1], 100);
}

TEST_F(MemoryTest, DecodedTexturesLeaveGeometryWhatTheyDoNotTake) {
  SceneMaker maker;
  maker.content = tile_row(10, 12);
  const std::vector<std::byte> blocks(256 * 8);
  maker.content.materials[0].texture = maker.add_texture(64, {blocks}, {}, 0);
  const MappedBundle bundle(maker.content);
  ASSERT_TRUE(bundle.view);
  for (const bool reads : {false, true}) {
    GlCaps caps = probe_gl_caps();
    caps.gpu_memory = 80000;
    caps.texture_formats = reads ? caps.texture_formats : 0;
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    if (!reads) {
      EXPECT_EQ(renderer->gpu_memory().textures, 64u * 64 * 3);
    }
    RenderOptions options = flat_light();
    options.lod_pixels = 0.1f;
    renderer->set_options(options);
    std::uint64_t most = 0;
    for (double x = -0.9; x <= 0.9; x += 0.05) {
      const DrawItem item = before(x);
      draw(*renderer, default_camera(96, 64), {&item, 1});
      most = std::max(most, renderer->gpu_memory().geometry + renderer->gpu_memory().textures);
    }
    EXPECT_LE(most, caps.gpu_memory) << reads;
    EXPECT_GT(most, caps.gpu_memory / 2) << "nothing is filled: the test proves nothing";
  }
}

TEST_F(MemoryTest, AFrameHasSoManyTriangles) {
  // A tile, each of its 288 triangles again and again: a million or so, more than 100,000.
  for (const auto& [times, fits, fits_small] :
       {std::tuple(3600u, false, false), std::tuple(400u, true, false),
        std::tuple(300u, true, true)}) {
    BundleContent content = tile_row(1, 12);
    LevelRecord& level = content.levels[0];
    const std::vector<std::byte> once(
        content.indices.begin() + static_cast<std::ptrdiff_t>(level.index_offset),
        content.indices.begin() +
            static_cast<std::ptrdiff_t>(level.index_offset + 2 * level.index_count));
    level.index_offset = content.indices.size();
    level.index_count *= times;
    for (unsigned i = 0; i < times; ++i) {
      content.indices.insert(content.indices.end(), once.begin(), once.end());
    }
    content.models[0].triangle_count = level.index_count / 3;
    const MappedBundle bundle(content);
    ASSERT_TRUE(bundle.view);
    for (const bool small : {false, true}) {
      GlCaps caps = probe_gl_caps();
      if (small) caps.es3 = false;
      const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
      ASSERT_TRUE(renderer);
      RenderOptions options = flat_light();
      options.lod_pixels = 0.1f;
      renderer->set_options(options);
      const DrawItem item = before(0.0);
      draw(*renderer, default_camera(96, 64), {&item, 1});
      const std::uint64_t all = 288ull * times;
      EXPECT_EQ(renderer->stats().triangles, (caps.es3 ? fits : fits_small) ? all : 2u) << times;
    }
  }
}

/// Bytes of a file's mapping that this process has touched, from /proc/self/smaps.
std::size_t touched_bytes(const std::string& path) {
  std::ifstream maps("/proc/self/smaps");
  std::string line;
  bool inside = false;
  while (std::getline(maps, line)) {
    if (line.find(path) != std::string::npos) inside = true;
    if (inside && line.rfind("Rss:", 0) == 0) {
      return static_cast<std::size_t>(std::strtoull(line.c_str() + 4, nullptr, 10)) * 1024;
    }
  }
  return 0;
}

TEST_F(MemoryTest, PagesAreTouchedWhenTheyAreDrawn) {
  // 20 chunks of about 0.7 MB: the system maps pages by the half megabyte and more.
  const BundleContent content = tile_row(20, 80);
  const MappedBundle bundle(content);
  const std::size_t all = bundle.file.bytes().size();
  ASSERT_GT(all, 10u << 20);
  EXPECT_LT(touched_bytes(bundle.path), all / 20);
  GlCaps caps = probe_gl_caps();
  caps.gpu_memory = all / 2;
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
  ASSERT_TRUE(renderer);
  EXPECT_LT(touched_bytes(bundle.path), all / 20);
  RenderOptions options = flat_light();
  options.lod_pixels = 0.1f;
  renderer->set_options(options);
  const Camera camera = default_camera(96, 64);
  const DrawItem item = before(-0.9);
  draw(*renderer, camera, {&item, 1});
  const std::uint64_t drawn = renderer->gpu_memory().geometry;
  EXPECT_GT(drawn, 0u);
  EXPECT_LT(drawn, all / 4);
  EXPECT_GT(touched_bytes(bundle.path), drawn * 9 / 10);
  EXPECT_LT(touched_bytes(bundle.path), drawn + all / 4);
}

TEST_F(MemoryTest, FramesAllocateNothingOnceTheyRun) {
  const BundleContent content = tile_row(4, 4);
  const MappedBundle bundle(content);
  const std::vector<std::uint8_t> bytes(96 * 64 * 3, 90);
  const RgbImage picture{bytes.data(), 96, 64, 96 * 3};
  const Camera camera = default_camera(96, 64);
  const glm::mat4 projection = gl_projection(camera, 0.1, 100.0);
  for (const bool instances : {true, false}) {
    GlCaps caps = probe_gl_caps();
    caps.instanced_arrays = caps.instanced_arrays && instances;
    const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
    ASSERT_TRUE(renderer);
    ASSERT_TRUE(renderer->resize(96, 64).has_value());
    const DrawItem items[] = {before(-0.2), before(0.0), before(0.3)};
    std::vector<std::uint8_t> pixels(96 * 64 * 4);
    for (int frame = 0; frame < 4; ++frame) {
      counting = frame >= 2;
      renderer->render(picture, projection, items);
      counting = false;
      renderer->read_pixels(pixels);
    }
    EXPECT_EQ(allocations, 0);
    allocations = 0;
  }
}

TEST_F(MemoryTest, OpeningAllocatesTheSameForAnySize) {
  int counts[2] = {0, 0};
  int which = 0;
  for (const int squares : {2, 60}) {
    const MappedBundle bundle(tile_row(10, squares));
    allocations = 0;
    counting = true;
    const Result<BundleView> view = BundleView::open(bundle.file.bytes());
    counting = false;
    EXPECT_TRUE(view.has_value());
    counts[which++] = allocations;
    allocations = 0;
  }
  EXPECT_EQ(counts[0], counts[1]);
  EXPECT_LT(counts[0], 20);
}

}  // namespace
}  // namespace modar
