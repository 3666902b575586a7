// A room's picture as light, and a model's shadow, against sums over the sphere and simple shapes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <glm/geometric.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/light_image.hpp"
#include "bake/bundle/scene/scene_shadow.hpp"
#include "bake/import/source_model.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/colour.hpp"
#include "modar/renderer.hpp"

namespace {

using namespace modar;

constexpr int kWidth = 32;
constexpr int kHeight = 16;

/// A flat Radiance file (RGBE without runs) of radiance(direction), one channel.
template <class Radiance>
std::string write_hdr(const Radiance& radiance) {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("modar_light_" + std::to_string(::getpid()) + ".hdr"))
                               .string();
  std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(kHeight) +
                      " +X " + std::to_string(kWidth) + "\n";
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double polar = M_PI * (y + 0.5) / kHeight;
      const double azimuth = 2 * M_PI * ((x + 0.5) / kWidth - 0.5);
      const glm::dvec3 d(std::sin(polar) * std::sin(azimuth), std::sin(polar) * std::cos(azimuth),
                         std::cos(polar));
      int exponent = 0;
      const double mantissa = std::frexp(radiance(d), &exponent);
      const char value = static_cast<char>(static_cast<int>(mantissa * 256));
      bytes += {value, value, value, static_cast<char>(exponent + 128)};
    }
  }
  EXPECT_TRUE(write_file(path, std::as_bytes(std::span(bytes))));
  return path;
}

double sky_at(const LightRecord& light, const glm::dvec3& n) {
  const double terms[9] = {
      1, n.y, n.z, n.x, n.x * n.y, n.y * n.z, 3 * n.z * n.z - 1, n.z * n.x, n.x * n.x - n.y * n.y};
  double sum = 0;
  for (int i = 0; i < 9; ++i) sum += terms[i] * static_cast<double>(light.sky[3 * i]);
  return sum;
}

/// What a white surface gets: the cosine-weighted mean of the radiance, by a sum over the sphere.
template <class Radiance>
double irradiance(const Radiance& radiance, const glm::dvec3& n) {
  double sum = 0;
  constexpr int kSteps = 180;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < 2 * kSteps; ++j) {
      const double polar = M_PI * (i + 0.5) / kSteps;
      const double azimuth = M_PI * (j + 0.5) / kSteps;
      const glm::dvec3 d(std::sin(polar) * std::sin(azimuth), std::sin(polar) * std::cos(azimuth),
                         std::cos(polar));
      sum += radiance(d) * std::max(0.0, glm::dot(d, n)) * std::sin(polar);
    }
  }
  return sum * (M_PI / kSteps) * (M_PI / kSteps) / M_PI;
}

TEST(LightImage, ASmoothRoomBecomesItsIrradiance) {
  const auto room = [](const glm::dvec3& d) {
    return 1.0 + 0.5 * d.z + 0.3 * d.x - 0.2 * d.y * d.z;
  };
  const std::string path = write_hdr(room);
  const auto light = read_light(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(light) << to_line(light.error());
  const glm::dvec3 up(0, 0, 1);
  const glm::dvec3 to_key(light->direction[0], light->direction[1], light->direction[2]);
  const auto all = [&](const glm::dvec3& n) {
    return sky_at(*light, n) +
           static_cast<double>(light->key[0]) * std::max(0.0, glm::dot(n, to_key));
  };
  // Scaled as a whole, so that only ratios are known.
  for (const glm::dvec3& n :
       {glm::dvec3(1, 0, 0), {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0.6, 0, 0.8}, {0, 0, -1}}) {
    EXPECT_NEAR(all(n) / all(up), irradiance(room, n) / irradiance(room, up), 0.03)
        << n.x << " " << n.y << " " << n.z;
  }
}

TEST(LightImage, ALampBecomesTheKeyLight) {
  const glm::dvec3 lamp = glm::normalize(glm::dvec3(0.5, -0.4, 0.8));
  const auto room = [&](const glm::dvec3& d) { return glm::dot(d, lamp) > 0.97 ? 60.0 : 0.3; };
  const std::string path = write_hdr(room);
  const auto light = read_light(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(light) << to_line(light.error());
  const glm::dvec3 found(light->direction[0], light->direction[1], light->direction[2]);
  EXPECT_GT(glm::dot(found, lamp), std::cos(0.15));
  EXPECT_GT(light->key[0], 3 * light->sky[0]);
  EXPECT_NEAR(sky_at(*light, {1, 0, 0}), sky_at(*light, {-1, 0, 0}), 0.02);
}

TEST(LightImage, BlackRoomsAndBrokenFilesAreRefused) {
  const std::string path = write_hdr([](const glm::dvec3&) { return 0.0; });
  const auto light = read_light(path);
  ASSERT_FALSE(light);
  EXPECT_EQ(light.error().code, "light.black");
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 40);
  const auto cut = read_light(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().code, "image.decode");
}

/// A plate of 1 x 1 units, half a unit over the pattern's plane.
BundleContent plate() {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("modar_plate_" + std::to_string(::getpid()) + ".obj"))
                               .string();
  const std::string obj = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\nf 4 3 2 1\n";
  EXPECT_TRUE(write_file(path, std::as_bytes(std::span(obj))));
  BakeRequest request;
  request.models = {path};
  Report report;
  auto content = build_bundle(request, report);
  std::filesystem::remove(path);
  EXPECT_TRUE(content);
  SceneRecord scene{};
  scene.scale = 0.5f;
  scene.offset[2] = 0.5f;
  scene.rotation[3] = 1.0f;
  content->scenes.push_back(scene);
  return std::move(*content);
}

TEST(NeutralRoom, ShowsTheFormOfClay) {
  // All directions that are seen from before, 20 degrees above: what modar-play's turntable shows.
  const RoomLight room = neutral_room();
  LightRecord record{};
  for (int i = 0; i < 9; ++i) record.sky[3 * i] = room.sky[static_cast<std::size_t>(i)].g;
  const glm::dvec3 to_key = glm::normalize(glm::dvec3(room.direction));
  const auto stored = [&](const glm::dvec3& n, float colour) {
    const double light =
        sky_at(record, n) + static_cast<double>(room.key.g) * std::max(glm::dot(n, to_key), 0.0);
    return 255 * srgb_of_linear(light * linear_of_srgb(static_cast<double>(colour)));
  };
  EXPECT_NEAR(stored({0, 0, 1}, 1.0f), 255, 2) << "white paper on a table is white";
  EXPECT_GT(stored(to_key, kClay), 240);
  EXPECT_LT(stored(to_key, kClay), 255) << "clipped";
  std::vector<double> seen;
  for (int i = 0; i < 4000; ++i) {
    const double x = 2 * std::fmod(0.618033988749895 * i, 1.0) - 1;
    const double y = (2 * i + 1) / 4000.0 - 1;
    if (x * x + y * y >= 1) continue;
    const double z = std::sqrt(1 - x * x - y * y);
    const double tilt = 20 * M_PI / 180;
    seen.push_back(stored(
        {x, -z * std::cos(tilt) + y * std::sin(tilt), y * std::cos(tilt) + z * std::sin(tilt)},
        kClay));
  }
  std::sort(seen.begin(), seen.end());
  // three.js with a hemisphere and a key light shows busts between 72 and 255 (white).
  EXPECT_LT(seen[seen.size() / 100], 110);
  EXPECT_GT(seen[seen.size() * 99 / 100], 240);
}

TEST(SceneShadow, LiesUnderTheModelAwayFromTheLight) {
  const BundleContent content = plate();
  const std::vector<std::byte> section = scene_shadow(content, 0, 1);
  ASSERT_EQ(section.size(), sizeof(ShadowHeader) + 64 * 64);
  const auto& header = *reinterpret_cast<const ShadowHeader*>(section.data());
  const auto at = [&](double x, double y) {
    const double u = (x - static_cast<double>(header.low[0])) /
                     static_cast<double>(header.high[0] - header.low[0]);
    const double v = (y - static_cast<double>(header.low[1])) /
                     static_cast<double>(header.high[1] - header.low[1]);
    const auto column = static_cast<std::size_t>(u * 64);
    const auto row = static_cast<std::size_t>((1 - v) * 64);
    return std::to_integer<int>(section[sizeof(ShadowHeader) + row * 64 + column]);
  };
  EXPECT_LT(at(0, 0), 130);
  // The neutral room's key light stands over -x, -y: its shadow falls towards +x, +y.
  EXPECT_LT(at(0.5, 0.4) + 20, at(-0.5, -0.4));
  EXPECT_EQ(at(static_cast<double>(header.low[0]) + 0.01, 0), 255) << "no edge is seen";
  EXPECT_EQ(scene_shadow(content, 0, 4), section) << "threads make no difference";
}

}  // namespace
