// Atlases: rectangles that hold the visible content and never overlap, colours that stay those of
// the pictures.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "../mesh/stages.hpp"
#include "bake/image/image.hpp"
#include "bake/texture/atlas/atlas.hpp"
#include "bake/texture/atlas/atlas_layout.hpp"
#include "texture_samples.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;
using testing::grid;
using testing::parse;
using testing::welded;

TEST(AtlasLayout, BoxesHoldEveryShownCellOnce) {
  std::mt19937 random(3);
  for (int round = 0; round < 20; ++round) {
    AtlasCells cells{30, 20, std::vector<std::int32_t>(600, AtlasCells::kNotShown)};
    // An L, a bar apart from it, and dust.
    for (std::uint32_t i = 0; i < 600; ++i) {
      const std::uint32_t x = i % 30;
      const std::uint32_t y = i / 30;
      const bool shown = (x < 4 || y > 16) || (x > 20 && x < 24 && y < 12) || random() % 400 == 0;
      if (shown) cells.vertices[i] = static_cast<std::int32_t>(random() % 9);
    }
    const std::vector<AtlasBox> boxes = cut_into_boxes(cells, {8, 4, 24});
    EXPECT_GE(boxes.size(), 2u);
    std::vector<int> in(600, 0);
    for (const AtlasBox& box : boxes) {
      for (std::uint32_t y = box.top; y < box.bottom; ++y) {
        for (std::uint32_t x = box.left; x < box.right; ++x) ++in[y * 30 + x];
      }
    }
    for (std::size_t i = 0; i < 600; ++i) {
      EXPECT_LE(in[i], 1);
      EXPECT_TRUE(in[i] == 1 || cells.vertices[i] == AtlasCells::kNotShown);
    }
  }
  // Where vertices are dear, nothing is cut through.
  AtlasCells whole{30, 20, std::vector<std::int32_t>(600, 100)};
  for (std::uint32_t i = 0; i < 600; ++i) {
    if (i % 30 > 4 && i / 30 < 15) whole.vertices[i] = AtlasCells::kNotShown;
  }
  EXPECT_EQ(cut_into_boxes(whole, {8, 4, 1e6}).size(), 1u);
  EXPECT_GT(cut_into_boxes(whole, {8, 4, 1}).size(), 1u);
}

TEST(AtlasLayout, RectanglesNeverOverlap) {
  std::mt19937 random(5);
  for (const std::uint32_t max_side : {256u, 64u}) {
    std::vector<AtlasSize> sizes;
    for (int i = 0; i < 60; ++i) {
      sizes.push_back({4 + 4 * static_cast<std::uint32_t>(random() % 12),
                       4 + 4 * static_cast<std::uint32_t>(random() % 12)});
    }
    const std::optional<AtlasPages> packed = pack_rectangles(sizes, max_side);
    ASSERT_TRUE(packed);
    EXPECT_EQ(packed->pages.size() > 1, max_side == 64);
    std::vector<std::vector<int>> used;
    for (const AtlasSize& page : packed->pages) {
      EXPECT_LE(std::max(page.width, page.height), max_side);
      used.emplace_back(std::size_t{page.width} * page.height, 0);
    }
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const AtlasPlace& place = packed->places[i];
      const AtlasSize& page = packed->pages[place.page];
      ASSERT_LE(place.left + sizes[i].width, page.width);
      ASSERT_LE(place.top + sizes[i].height, page.height);
      for (std::uint32_t y = 0; y < sizes[i].height; ++y) {
        for (std::uint32_t x = 0; x < sizes[i].width; ++x) {
          ++used[place.page][std::size_t{place.top + y} * page.width + place.left + x];
        }
      }
    }
    for (const std::vector<int>& page : used) {
      for (const int count : page) EXPECT_LE(count, 1);
    }
  }
  EXPECT_FALSE(pack_rectangles(std::vector<AtlasSize>{{65, 3}}, 64));
}

/// Bilinear, as GL samples it, clamped at the edges; v down.
std::array<double, 3> sample(const RgbaImage& image, glm::dvec2 uv) {
  const double x = uv.x * image.width - 0.5;
  const double y = uv.y * image.height - 0.5;
  const auto texel = [&](double column, double row, std::size_t c) {
    const auto i = static_cast<std::size_t>(std::clamp(column, 0.0, image.width - 1.0));
    const auto j = static_cast<std::size_t>(std::clamp(row, 0.0, image.height - 1.0));
    return double(image.pixels[4 * (j * image.width + i) + c]);
  };
  const double left = std::floor(x);
  const double top = std::floor(y);
  std::array<double, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double upper = std::lerp(texel(left, top, c), texel(left + 1, top, c), x - left);
    const double lower = std::lerp(texel(left, top + 1, c), texel(left + 1, top + 1, c), x - left);
    colour[c] = std::lerp(upper, lower, y - top);
  }
  return colour;
}

class AtlasOfPictures : public ::testing::Test {
 protected:
  AtlasOfPictures()
      : folder_(fs::temp_directory_path() / ("modar_atlas_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~AtlasOfPictures() override { fs::remove_all(folder_); }

  /// A wavy surface in three stripes, each of which shows a third of a picture of its own.
  TriMesh striped(std::array<RgbaImage, 3> pictures) {
    TriMesh mesh = welded(parse(grid(24, 3)));
    for (std::size_t m = 0; m < 3; ++m) {
      const std::string path = folder_ / (std::to_string(m) + ".png");
      EXPECT_TRUE(write_png(pictures[m], path));
      mesh.materials[m].diffuse_map = path;
    }
    pictures_ = std::move(pictures);
    return mesh;
  }

  Report report_;
  TextureUses textures_;
  std::array<RgbaImage, 3> pictures_;

 private:
  fs::path folder_;
};

AtlasOptions options_of(AtlasMode mode) {
  AtlasOptions options;
  options.mode = mode;
  return options;
}

/// Greatest difference of the colours of random points of the surface, before and after.
double greatest_difference(const TriMesh& before, const TriMesh& after,
                           const std::array<RgbaImage, 3>& pictures, const TextureUses& textures,
                           const std::vector<std::uint32_t>& uses) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform;
  double greatest = 0;
  for (std::size_t t = 0; t < before.triangles.size(); ++t) {
    for (int i = 0; i < 4; ++i) {
      const double a = uniform(random);
      const double b = uniform(random) * (1 - a);
      const auto at = [&](const TriMesh& mesh) {
        const auto& [p, q, r] = mesh.triangles[t];
        return (1 - a - b) * mesh.uvs[p] + a * mesh.uvs[q] + b * mesh.uvs[r];
      };
      const std::array<double, 3> expected =
          sample(pictures[before.triangle_material[t]], at(before));
      const TextureUse& use = textures.uses[uses[after.triangle_material[t]]];
      const std::array<double, 3> found = sample(*use.image, at(after));
      for (std::size_t c = 0; c < 3; ++c) {
        greatest = std::max(greatest, std::abs(expected[c] - found[c]));
      }
    }
  }
  return greatest;
}

TEST_F(AtlasOfPictures, ShowsThePicturesOwnColours) {
  const TriMesh before =
      striped({test::noise(256, 512, 1), test::noise(256, 256, 2), test::noise(128, 64, 3)});
  TriMesh mesh = before;
  std::vector<std::uint32_t> uses = collect_textures(mesh, textures_);
  ASSERT_TRUE(make_atlases(options_of(AtlasMode::kAlways), mesh, uses, textures_, report_));
  ASSERT_EQ(mesh.materials.size(), 1u);
  ASSERT_EQ(uses.size(), 1u);
  ASSERT_NE(textures_.uses[uses[0]].image, nullptr);
  EXPECT_LT(greatest_difference(before, mesh, pictures_, textures_, uses), 1e-6);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(textures_.uses[i].replaced);
  // Stripes shared a row of vertices twice, and nothing but uvs has changed.
  EXPECT_EQ(mesh.positions.size(), before.positions.size() + 2 * 25);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = mesh.triangles[t][i];
      const std::uint32_t w = before.triangles[t][i];
      EXPECT_EQ(mesh.positions[v], before.positions[w]);
      EXPECT_EQ(mesh.normals[v], before.normals[w]);
      EXPECT_EQ(mesh.source_position(v), before.source_position(w));
    }
  }
  ASSERT_FALSE(report_.diagnostics.empty());
  EXPECT_EQ(report_.diagnostics.back().id, "texture.atlas");
  EXPECT_NE(report_.diagnostics.back().message.find("pictures' own"), std::string::npos);
}

TEST_F(AtlasOfPictures, GuttersHoldThePictureAround) {
  // A texel that a coarser mip level mixes into a part is the picture's, or its edge's.
  TriMesh mesh =
      striped({test::noise(256, 256, 1), test::noise(256, 256, 2), test::noise(256, 256, 3)});
  const TriMesh before = mesh;
  std::vector<std::uint32_t> uses = collect_textures(mesh, textures_);
  ASSERT_TRUE(make_atlases(options_of(AtlasMode::kAlways), mesh, uses, textures_, report_));
  // Parts are two gutters apart. So far from a corner, the outermost texels are read as well.
  const std::string& said = report_.diagnostics.back().message;
  const std::size_t end = said.find(" texels or more apart");
  ASSERT_NE(end, std::string::npos) << said;
  const double widest = std::stod(said.substr(said.rfind(' ', end - 1))) / 2 - 0.5;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t m = before.triangle_material[t];
    const RgbaImage& page = *textures_.uses[uses[mesh.triangle_material[t]]].image;
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::dvec2 moved = mesh.uvs[mesh.triangles[t][i]];
      const glm::dvec2 own = before.uvs[before.triangles[t][i]];
      for (const double step : {-widest, -3.0, 3.0, widest}) {
        const glm::dvec2 from(own.x, own.y + step / 256);
        const glm::dvec2 to(moved.x, moved.y + step / page.height);
        const std::array<double, 3> expected = sample(pictures_[m], from);
        const std::array<double, 3> found = sample(page, to);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-6);
      }
    }
  }
}

TEST_F(AtlasOfPictures, StatesWhatResamplingLost) {
  const TriMesh before =
      striped({test::synthetic_photo(300, 500, 1), test::synthetic_photo(300, 500, 2),
               test::synthetic_photo(300, 500, 3)});
  TriMesh mesh = before;
  std::vector<std::uint32_t> uses = collect_textures(mesh, textures_);
  AtlasOptions options = options_of(AtlasMode::kAlways);
  options.textures.max_side = 256;  // of each, if they were baked apart
  options.max_side = 256;
  ASSERT_TRUE(make_atlases(options, mesh, uses, textures_, report_));
  for (const TextureUse& use : textures_.uses) {
    EXPECT_TRUE(!use.image || std::max(use.image->width, use.image->height) <= 256);
  }
  EXPECT_NE(report_.diagnostics.back().message.find("dB, apart it would"), std::string::npos);
}

TEST_F(AtlasOfPictures, MaterialsThatDifferAndPicturesThatRepeatStay) {
  TriMesh mesh =
      striped({test::noise(256, 256, 1), test::noise(256, 256, 2), test::noise(64, 64, 3)});
  mesh.materials[1].diffuse = glm::vec3(0.5f);
  // Vertices of the last stripe that no other one has.
  std::vector<bool> others(mesh.uvs.size(), false);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (mesh.triangle_material[t] != 2) others[v] = true;
    }
  }
  for (std::size_t v = 0; v < others.size(); ++v) {
    if (!others[v]) mesh.uvs[v].x *= 1.5;
  }
  std::vector<std::uint32_t> uses = collect_textures(mesh, textures_);
  const std::uint32_t repeated = uses[2];
  ASSERT_TRUE(make_atlases(options_of(AtlasMode::kAlways), mesh, uses, textures_, report_));
  ASSERT_EQ(mesh.materials.size(), 3u);
  EXPECT_EQ(uses[0], uses[1]);
  EXPECT_EQ(uses[2], repeated);
  EXPECT_FALSE(textures_.uses[repeated].replaced);
  EXPECT_EQ(mesh.materials[1].diffuse, glm::vec3(0.5f));
}

TEST_F(AtlasOfPictures, PicturesThatAreShownWhollyStayApart) {
  TriMesh mesh =
      striped({test::noise(256, 256, 1), test::noise(256, 256, 2), test::noise(256, 256, 3)});
  for (glm::dvec2& uv : mesh.uvs) uv.y = std::fmod(uv.y * 3, 1.0);
  // Materials differ as well: no draw call could be saved.
  for (std::size_t m = 0; m < 3; ++m) mesh.materials[m].shininess = static_cast<float>(m);
  const std::size_t vertices = mesh.positions.size();
  std::vector<std::uint32_t> uses = collect_textures(mesh, textures_);
  ASSERT_TRUE(make_atlases(options_of(AtlasMode::kWhereItPays), mesh, uses, textures_, report_));
  EXPECT_EQ(mesh.positions.size(), vertices);
  EXPECT_EQ(uses.size(), 3u);
  EXPECT_TRUE(std::none_of(textures_.uses.begin(), textures_.uses.end(),
                           [](const TextureUse& use) { return use.replaced; }));
}

}  // namespace
}  // namespace modar
