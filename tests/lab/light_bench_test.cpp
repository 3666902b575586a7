// The path tracer in rooms whose light is known without following a path, and published colour
// differences.
#include "bake/extensions/lab/light_bench.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "bake/check/picture/visual_check.hpp"
#include "bake/extensions/lab/path_tracer.hpp"

namespace {

using namespace modar;

TEST(Ciede2000, GivesThePublishedDifferences) {
  // Sharma, Wu, Dalal, "The CIEDE2000 Color-Difference Formula", 2005, Table 1: pairs 1, 4, 7, 9,
  // 17, 25 and 34.
  const struct {
    glm::dvec3 a, b;
    double difference;
  } pairs[] = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
               {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
               {{50, 0, 0}, {50, -1, 2}, 2.3669},
               {{50, 2.49, -0.001}, {50, -2.49, 0.0009}, 7.1792},
               {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
               {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
               {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
  for (const auto& pair : pairs) {
    EXPECT_NEAR(ciede2000(pair.a, pair.b), pair.difference, 5e-5);
    EXPECT_NEAR(ciede2000(pair.b, pair.a), pair.difference, 5e-5);
  }
}

// Pure red and blue of sRGB are 52.88 apart by CIEDE2000, and 176.3 by CIE 1976.
TEST(ColourDifference, PicturesAreComparedByCiede2000WhereBothShowSomething) {
  RgbaImage red{4, 4, {}};
  RgbaImage blue{4, 4, {}};
  for (int i = 0; i < 16; ++i) {
    red.pixels.insert(red.pixels.end(), {255, 0, 0, 255});
    blue.pixels.insert(blue.pixels.end(), {0, 0, 255, 255});
  }
  const std::array<std::uint8_t, 3> clear{128, 128, 128};
  EXPECT_NEAR(mean_delta_e(red, blue, clear), 52.88, 0.01);
  std::fill_n(blue.pixels.begin(), 3, std::uint8_t{128});  // nothing there
  EXPECT_NEAR(mean_delta_e(red, blue, clear), 52.88, 0.01);
}

/// A level square of that side over the ground's middle.
TriMesh plate(double height, float opacity) {
  TriMesh mesh;
  for (const double y : {-0.5, 0.5}) {
    for (const double x : {-0.5, 0.5}) {
      mesh.positions.push_back({x, y, height});
      mesh.normals.push_back({0, 0, 1});
    }
  }
  mesh.triangles.push_back({0, 1, 3});
  mesh.triangles.push_back({0, 3, 2});
  mesh.triangle_material.push_back(0);
  mesh.triangle_material.push_back(0);
  mesh.materials.resize(1);
  mesh.materials[0].diffuse = glm::vec3(1.0f);
  mesh.materials[0].opacity = opacity;
  mesh.materials[0].two_sided = true;
  return mesh;
}

struct Room {
  TriMesh mesh;
  std::vector<SoftTexture> textures{SoftTexture()};
  RoomLight light;
  double ground = 0.5;

  /// Seen from above and aside; the middle of the picture is the middle of the plate.
  [[nodiscard]] TracedPicture picture(int samples) const {
    const TracedScene scene{
        mesh, textures, glm::dmat4(1.0), light, {SoftTexture(), 1, 1, glm::dvec3(ground)}};
    const PathTracer tracer(scene);
    return tracer.draw(default_camera(21, 21), view(), samples, 1, 2);
  }
  [[nodiscard]] glm::dmat4 view() const {
    const glm::dvec3 target = mesh.positions[0] + glm::dvec3(0.5, 0.5, 0);
    return glm::lookAt(target + glm::dvec3(0, -1.5, 2), target, glm::dvec3(0, 0, 1));
  }
};

double middle_of(const TracedPicture& picture) {
  return picture.pixels[10 * 21 + 10].y;
}

TEST(PathTracer, WhiteThingsInEvenLightVanish) {
  Room room{plate(1.0, 1.0f), {SoftTexture()}, {}, 1.0};
  room.light.sky[0] = glm::vec3(1.0f);
  const TracedPicture picture = room.picture(64);
  // Paths end after some bounces: under the plate a little is lost.
  for (const glm::dvec3& pixel : picture.pixels) EXPECT_NEAR(pixel.y, 1.0, 0.05);
  EXPECT_NEAR(middle_of(picture), 1.0, 1e-9);
  EXPECT_EQ(picture.model[10 * 21 + 10], 1.0);
  EXPECT_EQ(picture.model[0], 0.0);
}

TEST(PathTracer, TheKeyLightGivesWhatItSaysAndCastsAShadow) {
  Room room{plate(1.0, 1.0f), {SoftTexture()}, {}, 0.0};
  room.light.direction = {0, 0, 1};
  room.light.key = glm::vec3(0.8f);
  // The lamp is a disc of radius 0.2 at distance 1: the mean cosine over it is 0.990.
  EXPECT_NEAR(middle_of(room.picture(128)), 0.8 * 0.990, 0.002);
  // A sheet on a mirror's other side: light reaches the ground's middle through the sheet alone.
  room.mesh = plate(0.01, 0.25f);
  room.ground = 0.5;
  const TracedPicture through = room.picture(512);
  // A quarter is the sheet, which is white; three quarters show the ground, to which three quarters
  // come. Light that goes to and fro between both adds up: computed here, without the rim, with t =
  // 0.75 and a = 0.25 for the sheet and g = 0.5 for the ground.
  const double t = 0.75;
  const double a = 0.25;
  const double g = 0.5;
  const double to_ground = (t) / (1 - a * g);
  EXPECT_NEAR(middle_of(through), 0.8 * 0.99 * a + t * g * to_ground * 0.8 * 0.99, 0.03);
}

TEST(PathTracer, ThreadsMakeNoDifference) {
  Room room{plate(0.5, 0.5f), {SoftTexture()}, {}, 0.4};
  room.light = neutral_room();
  const TracedScene scene{room.mesh,
                          room.textures,
                          glm::dmat4(1.0),
                          room.light,
                          {SoftTexture(), 1, 1, glm::dvec3(0.4)}};
  const PathTracer tracer(scene);
  const Camera camera = default_camera(16, 12);
  EXPECT_EQ(tracer.draw(camera, room.view(), 4, 1, 1).pixels,
            tracer.draw(camera, room.view(), 4, 1, 3).pixels);
  EXPECT_NE(tracer.draw(camera, room.view(), 4, 1, 1).pixels,
            tracer.draw(camera, room.view(), 4, 2, 1).pixels);
}

}  // namespace
