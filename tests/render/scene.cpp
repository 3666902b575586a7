// Small bundles for the renderer's tests, and a context to draw them in.
#include "tests/render/scene.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>

#include <unistd.h>

namespace modar {
namespace {

template <class T>
void put(std::vector<std::byte>& bytes, T value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Exact for the values of on_half_grid(): sign, exponent and mantissa computed here.
std::uint16_t half_bits(double value) {
  if (value == 0.0) return 0;
  int exponent = 0;
  const double mantissa = std::frexp(std::abs(value), &exponent);
  const int fraction = static_cast<int>((mantissa * 2.0 - 1.0) * 1024.0);
  const int sign = value < 0.0 ? 0x8000 : 0;
  return static_cast<std::uint16_t>(sign | (exponent + 14) << 10 | fraction);
}

AttributeRecord attribute(Semantic semantic, ComponentType type, std::uint8_t components,
                          std::uint8_t normalised, std::uint16_t offset) {
  return {static_cast<std::uint8_t>(semantic),
          static_cast<std::uint8_t>(type),
          components,
          normalised,
          offset,
          0};
}

std::int8_t snorm8(double value) {
  return static_cast<std::int8_t>(std::lround(value * 127.0));
}

bool is_i16(Layout layout) {
  return layout == Layout::kI16Coloured || layout == Layout::kI16OctLit;
}

}  // namespace

double on_half_grid(double value) {
  return std::round(value * 512.0) / 512.0;
}

SceneMaker::SceneMaker() {
  content.meta = "{}";
}

std::uint32_t SceneMaker::add_layout(Layout layout) {
  LayoutRecord record{};
  const auto set = [&](const AttributeRecord& value) {
    record.attributes[record.attribute_count++] = value;
  };
  switch (layout) {
    case Layout::kHalfColoured:
      record.stride = 12;
      set(attribute(Semantic::kPosition, ComponentType::kHalf, 3, 0, 0));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 8));
      break;
    case Layout::kHalfTextured:
      record.stride = 12;
      set(attribute(Semantic::kPosition, ComponentType::kHalf, 3, 0, 0));
      set(attribute(Semantic::kUv, ComponentType::kU16, 2, 1, 8));
      break;
    case Layout::kHalfLit:
      record.stride = 16;
      set(attribute(Semantic::kPosition, ComponentType::kHalf, 3, 0, 0));
      set(attribute(Semantic::kNormal, ComponentType::kI8, 3, 1, 8));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 12));
      break;
    case Layout::kOctLit:
      record.stride = 16;
      set(attribute(Semantic::kPosition, ComponentType::kHalf, 3, 0, 0));
      set(attribute(Semantic::kNormalOct, ComponentType::kI8, 2, 1, 8));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 12));
      break;
    case Layout::kI16OctLit:  // what the baker packs where half floats are not exact enough
      record.stride = 16;
      set(attribute(Semantic::kPosition, ComponentType::kI16, 3, 0, 0));
      set(attribute(Semantic::kNormalOct, ComponentType::kI8, 2, 1, 8));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 12));
      break;
    case Layout::kI16Coloured:
      record.stride = 12;
      set(attribute(Semantic::kPosition, ComponentType::kI16, 3, 0, 0));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 8));
      break;
    case Layout::kF32Coloured:
      record.stride = 16;
      set(attribute(Semantic::kPosition, ComponentType::kF32, 3, 0, 0));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 12));
      break;
    case Layout::kF32Skinned:
      record.stride = 28;
      set(attribute(Semantic::kPosition, ComponentType::kF32, 3, 0, 0));
      set(attribute(Semantic::kNormal, ComponentType::kI8, 3, 1, 12));
      set(attribute(Semantic::kColour, ComponentType::kU8, 4, 1, 16));
      set(attribute(Semantic::kJoints, ComponentType::kU8, 4, 0, 20));
      set(attribute(Semantic::kWeights, ComponentType::kU8, 4, 1, 24));
      break;
  }
  content.layouts.push_back(record);
  layouts_.push_back(layout);
  return static_cast<std::uint32_t>(content.layouts.size() - 1);
}

std::uint32_t SceneMaker::add_material(const MaterialRecord& material) {
  content.materials.push_back(material);
  content.materials.back().name = content.intern("material");
  return static_cast<std::uint32_t>(content.materials.size() - 1);
}

std::uint32_t SceneMaker::add_texture(std::uint32_t side,
                                      const std::vector<std::vector<std::byte>>& blocks,
                                      const std::vector<std::vector<std::byte>>& alpha,
                                      std::uint32_t flags) {
  TextureRecord record{};
  record.name = content.intern("texture");
  record.width = record.height = record.source_width = record.source_height = side;
  record.format = static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb);
  record.flags = flags;
  record.first_level = static_cast<std::uint32_t>(content.texture_levels.size());
  record.level_count = static_cast<std::uint32_t>(blocks.size());
  std::vector<std::byte> data;
  for (std::uint32_t i = 0; i < blocks.size(); ++i) {
    TextureLevelRecord level{};
    level.offset = data.size();
    level.alpha_offset = kNoOffset;
    level.size = static_cast<std::uint32_t>(blocks[i].size());
    level.width = level.height = std::max(1u, side >> i);
    data.insert(data.end(), blocks[i].begin(), blocks[i].end());
    if (!alpha.empty()) {
      level.alpha_offset = data.size();
      data.insert(data.end(), alpha[i].begin(), alpha[i].end());
    }
    content.texture_levels.push_back(level);
  }
  content.textures.push_back(record);
  content.texture_data.push_back(data);
  return static_cast<std::uint32_t>(content.textures.size() - 1);
}

void SceneMaker::append_vertex(std::uint32_t layout, const Triangle& triangle, std::size_t corner) {
  std::vector<std::byte>& out = content.vertices;
  const glm::dvec3& p = triangle.corners[corner];
  const Layout kind = layouts_[layout];
  for (int axis = 0; axis < 3; ++axis) {
    if (kind == Layout::kF32Coloured || kind == Layout::kF32Skinned) {
      put(out, static_cast<float>(p[axis]));
    } else if (is_i16(kind)) {
      put(out, static_cast<std::int16_t>(std::lround(p[axis] * 512.0)));
    } else {
      put(out, half_bits(p[axis]));
    }
  }
  if (kind != Layout::kF32Coloured && kind != Layout::kF32Skinned) put(out, std::uint16_t{0});
  if (kind == Layout::kHalfTextured) {
    for (int axis = 0; axis < 2; ++axis) {
      put(out, static_cast<std::uint16_t>(std::lround(triangle.uvs[corner][axis] * 65535.0)));
    }
    return;
  }
  if (kind == Layout::kHalfLit || kind == Layout::kF32Skinned) {
    const glm::dvec3& normal =
        kind == Layout::kHalfLit ? triangle.normal : triangle.normals[corner];
    for (int axis = 0; axis < 3; ++axis) put(out, snorm8(normal[axis]));
    put(out, std::int8_t{0});
  }
  if (kind == Layout::kOctLit || kind == Layout::kI16OctLit) {
    const glm::dvec3 n =
        triangle.normal /
        (std::abs(triangle.normal.x) + std::abs(triangle.normal.y) + std::abs(triangle.normal.z));
    const bool lower = n.z < 0.0;
    const double x = lower ? std::copysign(1.0 - std::abs(n.y), n.x) : n.x;
    const double y = lower ? std::copysign(1.0 - std::abs(n.x), n.y) : n.y;
    put(out, snorm8(x));
    put(out, snorm8(y));
    put(out, std::int16_t{0});
  }
  for (const std::uint8_t channel : triangle.colour) put(out, channel);
  put(out, std::uint8_t{255});
  if (kind != Layout::kF32Skinned) return;
  for (const std::uint8_t joint : triangle.joints[corner]) put(out, joint);
  for (const std::uint8_t weight : triangle.weights[corner]) put(out, weight);
}

std::uint32_t SceneMaker::add_model(std::uint32_t layout, const std::vector<Chunk>& chunks,
                                    bool share_vertices) {
  ModelRecord model{};
  model.name = content.intern("model");
  model.scale = 1.0;
  model.layout = layout;
  model.first_chunk = static_cast<std::uint32_t>(content.chunks.size());
  model.chunk_count = static_cast<std::uint32_t>(chunks.size());
  model.first_material = 0;
  model.material_count = static_cast<std::uint32_t>(content.materials.size());
  const std::uint32_t stride = content.layouts[layout].stride;
  std::uint64_t base = content.vertices.size();
  for (const Chunk& chunk : chunks) {
    ChunkRecord record{};
    record.position_step = is_i16(layouts_[layout]) ? 1.0f / 512.0f : 1.0f;
    record.uv_scale[0] = record.uv_scale[1] = 1.0f;
    record.material = chunk.material;
    record.first_level = static_cast<std::uint32_t>(content.levels.size());
    record.level_count = static_cast<std::uint32_t>(chunk.levels.size());
    record.cone_cutoff = 2.0f;
    if (chunk.cone) {
      std::copy_n(chunk.cone->begin(), 3, record.cone_axis);
      record.cone_cutoff = (*chunk.cone)[3];
    }
    std::fill_n(record.bounds_min, 3, 1e9f);
    std::fill_n(record.bounds_max, 3, -1e9f);
    for (std::size_t l = 0; l < chunk.levels.size(); ++l) {
      if (!share_vertices) base = content.vertices.size();
      LevelRecord level{};
      level.vertex_offset = base;
      level.index_offset = content.indices.size();
      level.error = l < chunk.errors.size() ? chunk.errors[l] : 0.0f;
      for (const Triangle& triangle : chunk.levels[l]) {
        for (std::size_t c = 0; c < 3; ++c) {
          put(content.indices,
              static_cast<std::uint16_t>((content.vertices.size() - base) / stride));
          append_vertex(layout, triangle, c);
          for (int axis = 0; axis < 3; ++axis) {
            const float value = static_cast<float>(triangle.corners[c][axis]);
            record.bounds_min[axis] = std::min(record.bounds_min[axis], value);
            record.bounds_max[axis] = std::max(record.bounds_max[axis], value);
          }
        }
      }
      level.vertex_count = static_cast<std::uint32_t>((content.vertices.size() - base) / stride);
      level.index_count = static_cast<std::uint32_t>(chunk.levels[l].size() * 3);
      model.triangle_count += l == 0 ? chunk.levels[l].size() : 0;
      content.levels.push_back(level);
    }
    content.chunks.push_back(record);
    model.level_count = std::max(model.level_count, record.level_count);
  }
  content.models.push_back(model);
  return static_cast<std::uint32_t>(content.models.size() - 1);
}

std::uint32_t SceneMaker::add_plain_model(Layout layout, const std::vector<Triangle>& triangles) {
  const std::uint32_t material = add_material(flat_material());
  Chunk chunk;
  chunk.levels = {triangles};
  chunk.material = material;
  return add_model(add_layout(layout), {chunk});
}

MappedBundle::MappedBundle(const BundleContent& content) {
  static int number = 0;
  path = (std::filesystem::temp_directory_path() /
          ("modar_render_" + std::to_string(::getpid()) + "_" + std::to_string(number++)))
             .string();
  const Result<void> saved = save_bundle(content, path);
  EXPECT_TRUE(saved.has_value()) << to_line(saved.error());
  Result<MappedFile> mapped = MappedFile::open(path);
  EXPECT_TRUE(mapped.has_value());
  file = std::move(*mapped);
  const Result<BundleView> opened = BundleView::open(file.bytes());
  EXPECT_TRUE(opened.has_value()) << to_line(opened.error());
  if (opened) view = *opened;
}

MappedBundle::~MappedBundle() {
  ::unlink(path.c_str());
}

MaterialRecord flat_material() {
  MaterialRecord material{};
  std::fill_n(material.diffuse, 3, 1.0f);
  material.opacity = 1.0f;
  material.texture = kNone;
  material.flags = kMaterialTwoSided;
  return material;
}

RenderOptions flat_light() {
  RenderOptions options;
  options.light = RoomLight{};
  options.light->key = glm::vec3(1.0f);
  return options;
}

void add_square_pattern(BundleContent& content) {
  PatternRecord pattern{};
  pattern.name = content.intern("pattern");
  pattern.width = pattern.height = 64;
  pattern.half_width = pattern.half_height = 1.0f;
  pattern.score = -1.0f;
  content.patterns.push_back(pattern);
  content.features.emplace_back();
}

Camera camera_above(int side) {
  Camera camera = default_camera(side, side);
  camera.fx = camera.fy = 2.0 * side;
  return camera;
}

std::unique_ptr<GlContext> GlTest::context_;
std::string GlTest::why_none_;

void GlTest::SetUpTestSuite() {
  Result<std::unique_ptr<GlContext>> created = GlContext::create_offscreen();
  if (created) {
    context_ = std::move(*created);
  } else {
    why_none_ = to_line(created.error());
  }
}

void GlTest::TearDownTestSuite() {
  context_.reset();
}

void GlTest::SetUp() {
  if (!context_) GTEST_SKIP() << "no OpenGL ES 2.0 context here: " << why_none_;
}

std::vector<std::uint8_t> draw(Renderer& renderer, const Camera& camera,
                               std::span<const DrawItem> items, const RgbImage& background) {
  const Result<void> sized = renderer.resize(camera.width, camera.height);
  EXPECT_TRUE(sized.has_value());
  renderer.render(background, gl_projection(camera, 0.1, 100.0), items);
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width * camera.height) * 4);
  renderer.read_pixels(pixels);
  return pixels;
}

std::unique_ptr<Renderer> make_renderer(const BundleView& bundle, const GlCaps& caps) {
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create(bundle, caps);
  if (!renderer) {
    ADD_FAILURE() << to_line(renderer.error());
    return nullptr;
  }
  (*renderer)->set_options(flat_light());
  return std::move(*renderer);
}

}  // namespace modar
