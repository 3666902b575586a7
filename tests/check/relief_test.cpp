// Relief that is drawn into base colours, against the renderer's own shading of surfaces that are
// as a normal map says.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/export/room_models.hpp"
#include "bake/image/image.hpp"
#include "bake/texture/relief/relief.hpp"
#include "formats/base/atomic_file.hpp"
#include "modar/camera.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"

namespace {

using namespace modar;
namespace fs = std::filesystem;

constexpr std::uint8_t kGrey = 150;

class Relief : public testing::Test {
 protected:
  Relief() {
    fs::create_directories(folder_);
    EXPECT_TRUE(write_png(plain(4, 4, {kGrey, kGrey, kGrey}), path("grey.png")));
  }
  ~Relief() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }

  static RgbaImage plain(std::uint32_t width, std::uint32_t height, std::array<int, 3> colour) {
    RgbaImage image{width, height, {}};
    for (std::uint32_t i = 0; i < width * height; ++i) {
      for (const int channel : colour) image.pixels.push_back(static_cast<std::uint8_t>(channel));
      image.pixels.push_back(255);
    }
    return image;
  }

  /// Bytes of a normal of unit length.
  static std::array<int, 3> stored(const glm::dvec3& n) {
    return {int(std::lround(128 + 127 * n.x)), int(std::lround(128 + 127 * n.y)),
            int(std::lround(128 + 127 * n.z))};
  }

  void write(const std::string& name, const std::string& text) const {
    ASSERT_TRUE(write_file(path(name), std::as_bytes(std::span(text))));
  }

  /// A square in z = 0 with these uvs at (-1,-1), (1,-1), (1,1), (-1,1), v up.
  void write_square(const std::string& name, const std::array<glm::dvec2, 4>& uvs,
                    const glm::dvec3& n, const std::string& maps) const {
    std::string obj = "mtllib " + name + ".mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
    for (const glm::dvec2& uv : uvs) {
      obj += "vt " + std::to_string(uv.x) + " " + std::to_string(uv.y) + "\n";
    }
    obj += "vn " + std::to_string(n.x) + " " + std::to_string(n.y) + " " + std::to_string(n.z) +
           "\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";
    write(name + ".obj", obj);
    write(name + ".mtl", "newmtl m\nKd 1 1 1\n" + maps);
  }

  /// What the renderer draws of its middle from above, green.
  int seen(const std::string& name) {
    BakeRequest request;
    request.models = {path(name + ".obj")};
    request.up = UpAxis::kZ;
    request.occlusion = false;
    report_ = {};
    const auto content = build_bundle(request, report_);
    EXPECT_TRUE(content) << to_line(content.error());
    if (!content) return -1;
    const auto bytes = encode_bundle(*content);
    const auto bundle = BundleView::open(*bytes);
    const auto context = GlContext::create_offscreen();
    auto renderer = Renderer::create(*bundle, probe_gl_caps());
    EXPECT_TRUE(renderer->get()->resize(32, 32));
    const glm::mat4 view = glm::lookAt(glm::vec3(0, 0, 4), glm::vec3(0), glm::vec3(0, 1, 0));
    const DrawItem item{0, view, kNone, view};
    const DepthRange range = depth_range(*bundle, {&item, 1});
    renderer->get()->render(
        RgbImage{}, gl_projection(default_camera(32, 32), range.near_plane, range.far_plane),
        {&item, 1});
    std::vector<std::uint8_t> pixels(std::size_t{4} * 32 * 32);
    renderer->get()->read_pixels(pixels);
    return pixels[4 * (16 * 32 + 16) + 1];
  }

  /// A square of two triangles whose uvs are the whole picture `repeats` times.
  [[nodiscard]] TriMesh square(const std::string& colour, const std::string& normal,
                               double repeats = 1) const {
    TriMesh mesh;
    for (const glm::dvec2& p : {glm::dvec2(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
      mesh.positions.push_back(glm::dvec3(2.0 * p - 1.0, 0.0));
      mesh.normals.push_back({0, 0, 1});
      mesh.uvs.push_back(repeats * glm::dvec2(p.x, 1 - p.y));
    }
    mesh.triangles.push_back({0, 1, 2});
    mesh.triangles.push_back({0, 2, 3});
    for (int t = 0; t < 2; ++t) mesh.triangle_material.push_back(0);
    mesh.materials.resize(1);
    if (!colour.empty()) mesh.materials[0].diffuse_map = path(colour);
    mesh.materials[0].normal.path = path(normal);
    return mesh;
  }

  static RgbaImage picture_of(const TriMesh& mesh) {
    const auto image = read_image(mesh.materials[0].diffuse_map);
    EXPECT_TRUE(image) << to_line(image.error());
    return image ? *image : RgbaImage{};
  }

  Report report_;

 private:
  fs::path folder_ = fs::temp_directory_path() / ("modar_relief_" + std::to_string(::getpid()));
};

using Uvs = std::array<glm::dvec2, 4>;
constexpr Uvs kUpright = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
constexpr Uvs kMirrored = {{{1, 0}, {0, 0}, {0, 1}, {1, 1}}};
constexpr Uvs kTurned = {{{0, 0}, {0, -1}, {1, -1}, {1, 0}}};  // u along y, v along -x

TEST_F(Relief, AColourShowsWhatTheRendererDrawsOfASurfaceThatLiesSo) {
  const glm::dvec3 map = glm::normalize(glm::dvec3(0.6, -0.3, 1));
  ASSERT_TRUE(write_png(plain(4, 4, stored(map)), path("normal.png")));
  const std::string grey = "map_Kd grey.png\n";
  write_square("flat", kUpright, {0, 0, 1}, grey);
  const int flat = seen("flat");
  const struct {
    const char* name;
    Uvs uvs;
    glm::dvec3 normal;
  } cases[] = {{"upright", kUpright, map},
               {"mirrored", kMirrored, {-map.x, map.y, map.z}},
               {"turned", kTurned, {-map.y, map.x, map.z}}};
  std::vector<int> all = {flat};
  for (const auto& one : cases) {
    write_square("lies", one.uvs, one.normal, grey);
    write_square("drawn", one.uvs, {0, 0, 1}, grey + "norm normal.png\n");
    const int wanted = seen("lies");
    EXPECT_NEAR(seen("drawn"), wanted, 2) << one.name;
    for (const int other : all) EXPECT_GT(std::abs(wanted - other), 2) << "the cases differ";
    all.push_back(wanted);
  }
}

TEST_F(Relief, BrightensWhatHasNoPictureToo) {
  const glm::dvec3 map = glm::normalize(glm::dvec3(-0.4, -0.3, 1));  // towards the lamp
  ASSERT_TRUE(write_png(plain(4, 4, stored(map)), path("normal.png")));
  const std::string kd = "Kd 0.5 0.5 0.5\n";
  write_square("flat", kUpright, {0, 0, 1}, kd);
  write_square("lies", kUpright, map, kd);
  write_square("drawn", kUpright, {0, 0, 1}, kd + "norm normal.png\n");
  const int wanted = seen("lies");
  EXPECT_GT(wanted, seen("flat") + 4);
  EXPECT_NEAR(seen("drawn"), wanted, 2);
}

TEST_F(Relief, IsExportedAsBrightThoughFilesHoldNoFactorAboveOne) {
  // One half towards the lamp, one away from it, on a white surface.
  RgbaImage map = plain(64, 64, stored(glm::normalize(glm::dvec3(-0.4, -0.3, 1))));
  const auto away = stored(glm::normalize(glm::dvec3(0.4, 0.3, 1)));
  for (std::size_t i = 0; i < map.pixels.size() / 2; ++i) {
    if (i % 4 != 3) map.pixels[i] = static_cast<std::uint8_t>(away[i % 4]);
  }
  ASSERT_TRUE(write_png(map, path("normal.png")));
  write_square("white", kUpright, {0, 0, 1}, "norm normal.png\n");
  BakeRequest request;
  request.models = {path("white.obj")};
  request.up = UpAxis::kZ;
  const auto content = build_bundle(request, report_);
  ASSERT_TRUE(content) << to_line(content.error());
  const MaterialRecord& material = content->materials[0];
  EXPECT_GT(material.diffuse[0], 1.0F);
  const auto bytes = encode_bundle(*content);
  const auto bundle = BundleView::open(*bytes);
  ASSERT_TRUE(bundle);
  EXPECT_EQ(exported_diffuse(*bundle, material, 0), 1.0);
  const RgbaImage pixels = decoded_textures(*bundle).at(0).pixels;
  std::uint8_t least = 255;
  std::uint8_t most = 0;
  for (std::size_t i = 0; i < pixels.pixels.size(); i += 4) {
    least = std::min(least, pixels.pixels[i]);
    most = std::max(most, pixels.pixels[i]);
  }
  EXPECT_GE(most, 253);
  // As the device shows them next to each other.
  TriMesh mesh = square("grey.png", "normal.png");
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  const std::vector<std::uint8_t> grey = picture_of(mesh).pixels;
  EXPECT_NEAR(least, 255.0 * *std::min_element(grey.begin(), grey.end()) / kGrey, 4);
}

TEST_F(Relief, ShadesWhatLiesBetweenVertices) {
  // A map that is nearly flat on four normals that fan out, and as many squares as pixels.
  ASSERT_TRUE(write_png(plain(64, 64, {129, 128, 255}), path("normal.png")));
  const auto write_fan = [&](const std::string& name, int squares, const std::string& maps) {
    std::string obj = "mtllib " + name + ".mtl\nusemtl m\n";
    for (int i = 0; i < (squares + 1) * (squares + 1); ++i) {
      const glm::dvec2 at = glm::dvec2(i % (squares + 1), i / (squares + 1)) / double(squares);
      const glm::dvec2 p = 2.0 * at - 1.0;
      const glm::dvec3 n = glm::normalize(glm::dvec3(p, 0.5));
      for (const auto& [word, v] :
           {std::pair("v", glm::dvec3(p, 0)), {"vt", glm::dvec3(at, 0)}, {"vn", n}}) {
        obj += word + (" " + std::to_string(v.x)) + " " + std::to_string(v.y) + " " +
               std::to_string(v.z) + "\n";
      }
    }
    for (int i = 0; i < squares * squares; ++i) {
      obj += "f";
      const int first = 1 + i / squares * (squares + 1) + i % squares;
      for (const int v : {first, first + 1, first + squares + 2, first + squares + 1}) {
        const std::string text = std::to_string(v);
        obj += " " + text + "/" + text + "/" + text;
      }
      obj += "\n";
    }
    write(name + ".obj", obj);
    write(name + ".mtl", "newmtl m\nmap_Kd grey.png\n" + maps);
  };
  write_fan("fine", 64, "");
  write_fan("coarse", 1, "");
  write_fan("drawn", 1, "norm normal.png\n");
  const int wanted = seen("fine");
  EXPECT_GT(wanted, seen("coarse") + 10);
  EXPECT_NEAR(seen("drawn"), wanted, 4);
}

TEST_F(Relief, ChangesAColourByThreeTenthsAtMost) {
  // Away from the lamp, which stands over -x, -y.
  const glm::dvec3 away = glm::normalize(glm::dvec3(1, 0.7, 0.2));
  ASSERT_TRUE(write_png(plain(4, 4, stored(away)), path("normal.png")));
  TriMesh mesh = square("grey.png", "normal.png");
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  EXPECT_EQ(picture_of(mesh).pixels[0], kGrey * 7 / 10);
  EXPECT_EQ(picture_of(mesh).pixels[3], 255);
}

TEST_F(Relief, PlacesThatShareATexelShareItsMean) {
  ASSERT_TRUE(
      write_png(plain(4, 4, stored(glm::normalize(glm::dvec3(0.3, 0, 1)))), path("normal.png")));
  const auto drawn = [&](bool mirrored) {
    TriMesh mesh = square("grey.png", "normal.png");
    for (glm::dvec2& uv : mesh.uvs) uv.x = mirrored ? 1 - uv.x : uv.x;
    EXPECT_TRUE(draw_relief(mesh, {}, report_));
    return int(picture_of(mesh).pixels[4 * 4]);
  };
  const int one = drawn(false);
  const int other = drawn(true);
  ASSERT_GT(std::abs(one - other), 8);
  // A mesh of both squares.
  TriMesh both = square("grey.png", "normal.png");
  const TriMesh mirrored = square("grey.png", "normal.png");
  for (std::size_t v = 0; v < 4; ++v) {
    both.positions.push_back(mirrored.positions[v] + glm::dvec3(3, 0, 0));
    both.normals.push_back({0, 0, 1});
    both.uvs.push_back({1 - mirrored.uvs[v].x, mirrored.uvs[v].y});
  }
  both.triangles.push_back({4, 5, 6});
  both.triangles.push_back({4, 6, 7});
  for (int t = 0; t < 2; ++t) both.triangle_material.push_back(0);
  ASSERT_TRUE(draw_relief(both, {}, report_));
  EXPECT_NEAR(picture_of(both).pixels[4 * 4], (one + other) / 2.0, 1);
}

TEST_F(Relief, MapsOfOtherSizesAndPlacesAreWhereTheyBelong) {
  // Steep in its left half alone.
  RgbaImage map = plain(64, 64, {128, 128, 255});
  const auto steep = stored(glm::normalize(glm::dvec3(1, 1, 1)));
  for (std::uint32_t i = 0; i < 64 * 64; ++i) {
    for (std::size_t c = 0; c < 3 && i % 64 < 32; ++c) {
      map.pixels[4 * i + c] = static_cast<std::uint8_t>(steep[c]);
    }
  }
  ASSERT_TRUE(write_png(map, path("half.png")));
  TriMesh mesh = square("grey.png", "half.png");
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  const RgbaImage large = picture_of(mesh);
  ASSERT_EQ(large.width, 64U) << "the picture keeps the map's detail";
  EXPECT_LT(large.pixels[4 * (64 * 20 + 20)], kGrey - 20);
  EXPECT_EQ(large.pixels[4 * (64 * 20 + 50)], kGrey);

  mesh = square("grey.png", "half.png");
  mesh.materials[0].normal.uv[0][0] = 2;  // twice across the colour
  ASSERT_TRUE(draw_relief(mesh, {.max_side = 32}, report_));
  const RgbaImage twice = picture_of(mesh);
  ASSERT_EQ(twice.width, 32U);
  for (const std::size_t x : {4U, 20U}) EXPECT_LT(twice.pixels[4 * (32 * 9 + x)], kGrey - 20) << x;
  for (const std::size_t x : {12U, 28U}) EXPECT_EQ(twice.pixels[4 * (32 * 9 + x)], kGrey) << x;

  // Without a colour: as large as the map, white where it is flat; many repeats.
  mesh = square("", "half.png", 40);
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  const RgbaImage made = picture_of(mesh);
  ASSERT_EQ(made.width, 64U);
  EXPECT_LT(made.pixels[4 * (64 * 20 + 20)], 230);
  EXPECT_EQ(made.pixels[4 * (64 * 20 + 50)], 255);
}

TEST_F(Relief, BeyondTheEdgeItIsWhereTheColourIs) {
  // Normals that fan out, so that each place has a factor of its own.
  const auto drawn = [&](const std::array<double, 2>& u, const std::array<double, 2>& v,
                         std::uint32_t beyond, const std::string& map) {
    TriMesh mesh = square("grey.png", map);
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec3& p = mesh.positions[i];
      mesh.normals[i] = glm::normalize(glm::vec3(0.2 * p.x, 0.3 * p.y, 1));
      mesh.uvs[i] = {u[p.x > 0 ? 1 : 0], v[p.y > 0 ? 1 : 0]};
    }
    mesh.materials[0].beyond = kTextureRepeat | beyond;
    EXPECT_TRUE(draw_relief(mesh, {}, report_));
    return picture_of(mesh).pixels;
  };
  const auto tilted = [&](const glm::dvec3& map, const std::string& name) {
    ASSERT_TRUE(write_png(plain(16, 16, stored(glm::normalize(map))), path(name)));
  };
  // Tilted across the axis that is mirrored: uvs written mirrored mean the same.
  tilted({0, 0.4, 1}, "tall.png");
  const auto tall = drawn({1, 0}, {1, 0}, 0, "tall.png");
  EXPECT_NE(tall, drawn({0, 1}, {1, 0}, 0, "tall.png"));
  EXPECT_EQ(drawn({1, 2}, {1, 0}, kTextureMirrorU, "tall.png"), tall);
  EXPECT_EQ(drawn({-1, 0}, {1, 0}, kTextureMirrorU, "tall.png"), tall);
  tilted({0.4, 0, 1}, "wide.png");
  EXPECT_EQ(drawn({0, 1}, {2, 1}, kTextureMirrorV, "wide.png"),
            drawn({0, 1}, {0, 1}, 0, "wide.png"));

  // Two squares side by side on a clamped picture: the second shows its edge, and adds nothing.
  TriMesh pair = square("grey.png", "wide.png");
  const TriMesh alone = pair;
  for (std::size_t i = 0; i < 4; ++i) {
    pair.positions.push_back(alone.positions[i] + glm::dvec3(2, 0, 0));
    pair.normals.push_back(glm::normalize(glm::vec3(1, 0, 1)));
    pair.uvs.push_back(alone.uvs[i] + glm::dvec2(1, 0));
  }
  for (const auto& [a, b, c] : alone.triangles) {
    pair.triangles.push_back({a + 4, b + 4, c + 4});
    pair.triangle_material.push_back(0);
  }
  pair.materials[0].beyond = kTextureRepeat | kTextureClampU;
  TriMesh one = alone;
  ASSERT_TRUE(draw_relief(one, {}, report_));
  ASSERT_TRUE(draw_relief(pair, {}, report_));
  EXPECT_EQ(picture_of(pair).pixels, picture_of(one).pixels);

  // A map that is flat at its last column, clamped there by a sampler of its own.
  RgbaImage map = plain(16, 16, stored(glm::normalize(glm::dvec3(1, 1, 1))));
  for (std::size_t y = 0; y < 16; ++y) {
    std::copy_n(std::array<std::uint8_t, 3>{128, 128, 255}.data(), 3,
                &map.pixels[4 * (16 * y + 15)]);
  }
  ASSERT_TRUE(write_png(map, path("edge.png")));
  TriMesh mesh = square("grey.png", "edge.png");
  for (glm::dvec2& uv : mesh.uvs) uv.x += 1;
  mesh.materials[0].normal.wrap = {Wrap::kClamp, Wrap::kRepeat};
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  EXPECT_EQ(mesh.materials[0].diffuse_map, path("grey.png")) << "nothing to draw";
}

TEST_F(Relief, ThreadsMakeNoDifference) {
  RgbaImage map = plain(64, 64, {128, 128, 255});
  for (std::size_t i = 0; i < map.pixels.size(); i += 4) {
    map.pixels[i] = static_cast<std::uint8_t>(100 + i % 61);
    map.pixels[i + 1] = static_cast<std::uint8_t>(100 + i % 53);
  }
  ASSERT_TRUE(write_png(map, path("rough.png")));
  std::vector<std::vector<std::uint8_t>> pixels;
  for (const unsigned jobs : {1U, 3U}) {
    TriMesh mesh = square("grey.png", "rough.png", 20);
    ASSERT_TRUE(draw_relief(mesh, {.jobs = jobs}, report_));
    pixels.push_back(picture_of(mesh).pixels);
  }
  EXPECT_EQ(pixels[0], pixels[1]);
}

TEST_F(Relief, WhatCannotBeReadOrIsFlatLeavesTheColourAsItIs) {
  write("broken.png", "no picture");
  TriMesh mesh = square("grey.png", "broken.png");
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  EXPECT_EQ(mesh.materials[0].diffuse_map, path("grey.png"));
  ASSERT_EQ(report_.diagnostics.size(), 1U);
  EXPECT_EQ(report_.diagnostics[0].severity, DiagnosticSeverity::kWarning);
  EXPECT_EQ(report_.diagnostics[0].file, path("broken.png"));

  ASSERT_TRUE(write_png(plain(4, 4, {128, 128, 255}), path("flat.png")));
  mesh = square("grey.png", "flat.png");
  ASSERT_TRUE(draw_relief(mesh, {}, report_));
  EXPECT_EQ(mesh.materials[0].diffuse_map, path("grey.png"));
}

TEST_F(Relief, GreyBumpMapsAreHeights) {
  // A ramp up to the right: it looks to the left, where the lamp is.
  RgbaImage ramp = plain(64, 64, {0, 0, 0});
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      ramp.pixels[4 * i + c] = static_cast<std::uint8_t>(4 * (i % 64));
    }
  }
  ASSERT_TRUE(write_png(ramp, path("ramp.png")));
  const auto middle = [&](float scale) {
    TriMesh mesh = square("grey.png", "ramp.png");
    mesh.materials[0].normal.may_be_heights = true;
    mesh.materials[0].normal.scale = scale;
    EXPECT_TRUE(draw_relief(mesh, {}, report_));
    return int(picture_of(mesh).pixels[4 * (64 * 30 + 30)]);
  };
  EXPECT_GT(middle(2), kGrey);
  EXPECT_LT(middle(-2), kGrey);
}

}  // namespace
