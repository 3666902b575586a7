// Small bundles for the renderer's tests, made vertex by vertex, and a context to draw them in.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "modar/camera.hpp"
#include "modar/gl_context.hpp"
#include "modar/mapped_file.hpp"
#include "modar/renderer.hpp"

namespace modar {

using Rgb = std::array<std::uint8_t, 3>;

/// One triangle with a colour a triangle. Positions in model space [-1,1].
struct Triangle {
  std::array<glm::dvec3, 3> corners;
  std::array<glm::dvec2, 3> uvs{};
  Rgb colour{255, 255, 255};
  glm::dvec3 normal{0.0, 0.0, 1.0};
  /// Of the layout kF32Skinned: of each corner, its normal, bones and weights of 255.
  std::array<glm::dvec3, 3> normals{};
  std::array<std::array<std::uint8_t, 4>, 3> joints{};
  std::array<std::array<std::uint8_t, 4>, 3> weights{{{255}, {255}, {255}}};
};

enum class Layout {
  kHalfColoured,
  kHalfTextured,
  kHalfLit,
  kI16Coloured,
  kF32Coloured,
  kOctLit,
  kI16OctLit,
  kF32Skinned
};

/// Rounds a coordinate to one that half floats hold exactly in [-1,1].
double on_half_grid(double value);

class SceneMaker {
 public:
  SceneMaker();
  std::uint32_t add_layout(Layout layout);
  std::uint32_t add_material(const MaterialRecord& material);
  /// blocks: of each level; alpha: of each level or empty.
  std::uint32_t add_texture(std::uint32_t side, const std::vector<std::vector<std::byte>>& blocks,
                            const std::vector<std::vector<std::byte>>& alpha, std::uint32_t flags);
  /// Chunks of `triangles` each with its material; a chunk's levels are lists of triangles.
  struct Chunk {
    std::vector<std::vector<Triangle>> levels;
    std::vector<float> errors;
    std::uint32_t material = 0;
    std::optional<std::array<float, 4>> cone;  ///< axis and cutoff
  };
  std::uint32_t add_model(std::uint32_t layout, const std::vector<Chunk>& chunks,
                          bool share_vertices = false);
  /// One model, one white two-sided material, one level.
  std::uint32_t add_plain_model(Layout layout, const std::vector<Triangle>& triangles);

  BundleContent content;

 private:
  void append_vertex(std::uint32_t layout, const Triangle& triangle, std::size_t corner);
  std::vector<Layout> layouts_;
};

/// A bundle saved to a file, mapped and opened.
struct MappedBundle {
  explicit MappedBundle(const BundleContent& content);
  ~MappedBundle();
  std::string path;
  MappedFile file;
  std::optional<BundleView> view;
};

/// A material whose colour is what its vertices or texture say, whatever the light.
MaterialRecord flat_material();
/// Light that leaves flat_material() colours unchanged.
RenderOptions flat_light();

/// Adds a pattern of 2 x 2 units, without features.
void add_square_pattern(BundleContent& content);
/// Of side x side pixels; 4 units above a plane it shows 2 x 2 units of it.
Camera camera_above(int side);

/// Each test of the suite draws in one context; skipped where EGL has none.
class GlTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite();
  void SetUp() override;

  static std::unique_ptr<GlContext> context_;
  static std::string why_none_;
};

/// The picture of one render call with the camera's size.
std::vector<std::uint8_t> draw(Renderer& renderer, const Camera& camera,
                               std::span<const DrawItem> items, const RgbImage& background = {});

/// Renderer on a bundle with flat light; fails the test where it cannot be made.
std::unique_ptr<Renderer> make_renderer(const BundleView& bundle, const GlCaps& caps);

}  // namespace modar
