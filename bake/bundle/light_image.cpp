// Projects a panorama onto polynomials of degree two.
#include "bake/bundle/light_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "bake/image/resample.hpp"
#include "formats/base/colour.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

constexpr double kPi = 3.141592653589793;
/// The panorama is averaged down to this many rows first: light of second degree has no more
/// detail.
constexpr std::uint32_t kRows = 32;
constexpr std::uint32_t kColumns = 2 * kRows;
/// Cosine of half the angle of what counts as the key light, and of the ring around it that tells
/// how bright the room is behind it.
constexpr double kKeyCosine = 0.94;
constexpr double kRingCosine = 0.85;

struct Patch {
  glm::dvec3 direction;
  glm::dvec3 radiance{0.0};
  double solid_angle = 0;
};

std::vector<Patch> patches_of(const LinearImage& image) {
  std::vector<Patch> patches(std::size_t{kRows} * kColumns);
  std::vector<double> counts(patches.size(), 0.0);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const std::size_t row = std::uint64_t{y} * kRows / image.height;
      const std::size_t column = std::uint64_t{x} * kColumns / image.width;
      const float* pixel = &image.pixels[4 * (std::size_t{y} * image.width + x)];
      patches[row * kColumns + column].radiance += glm::dvec3(pixel[0], pixel[1], pixel[2]);
      counts[row * kColumns + column] += 1;
    }
  }
  for (std::uint32_t row = 0; row < kRows; ++row) {
    const double polar = kPi * (row + 0.5) / kRows;
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const std::size_t i = std::size_t{row} * kColumns + column;
      const double azimuth = 2 * kPi * ((column + 0.5) / kColumns - 0.5);
      patches[i].direction = {std::sin(polar) * std::sin(azimuth),
                              std::sin(polar) * std::cos(azimuth), std::cos(polar)};
      patches[i].solid_angle = std::sin(polar) * (kPi / kRows) * (2 * kPi / kColumns);
      if (counts[i] > 0) {
        patches[i].radiance /= counts[i];
      } else {
        // A picture of fewer pixels: the nearest one.
        const std::uint32_t x = column * image.width / kColumns;
        const std::uint32_t y = row * image.height / kRows;
        const float* pixel = &image.pixels[4 * (std::size_t{y} * image.width + x)];
        patches[i].radiance = {pixel[0], pixel[1], pixel[2]};
      }
    }
  }
  return patches;
}

double luma(const glm::dvec3& rgb) {
  return luminance(rgb.r, rgb.g, rgb.b);
}

/// Takes the brightest spot out of the patches, down to its surroundings; its irradiance.
glm::dvec3 take_key(std::vector<Patch>& patches, glm::dvec3& direction) {
  double brightest = -1;
  for (const Patch& centre : patches) {
    if (centre.direction.z < 0) continue;  // lamps hang
    double sum = 0;
    double size = 0;
    for (const Patch& patch : patches) {
      if (glm::dot(patch.direction, centre.direction) < kKeyCosine) continue;
      sum += luma(patch.radiance) * patch.solid_angle;
      size += patch.solid_angle;
    }
    if (sum / size <= brightest) continue;
    brightest = sum / size;
    direction = centre.direction;
  }
  glm::dvec3 ring(0.0);
  double ring_size = 0;
  for (const Patch& patch : patches) {
    const double cosine = glm::dot(patch.direction, direction);
    if (cosine >= kKeyCosine || cosine < kRingCosine) continue;
    ring += patch.radiance * patch.solid_angle;
    ring_size += patch.solid_angle;
  }
  ring /= ring_size;
  glm::dvec3 key(0.0);
  for (Patch& patch : patches) {
    if (glm::dot(patch.direction, direction) < kKeyCosine) continue;
    const glm::dvec3 excess = glm::max(patch.radiance - ring, glm::dvec3(0.0));
    key += excess * patch.solid_angle;
    patch.radiance -= excess;
  }
  return key / kPi;
}

/// Irradiance over pi, as coefficients of LightRecord's polynomials. Ramamoorthi and Hanrahan, "An
/// Efficient Representation for Irradiance Environment Maps", 2001: a band of degree l is weakened
/// to 1, 2/3 and 1/4.
std::array<glm::dvec3, 9> sky_of(const std::vector<Patch>& patches) {
  // The polynomials' squares integrate to these over the sphere.
  constexpr std::array<double, 9> kNorms = {4 * kPi,      4 * kPi / 3,  4 * kPi / 3,
                                            4 * kPi / 3,  4 * kPi / 15, 4 * kPi / 15,
                                            16 * kPi / 5, 4 * kPi / 15, 16 * kPi / 15};
  std::array<glm::dvec3, 9> sky{};
  for (const Patch& patch : patches) {
    const glm::dvec3& n = patch.direction;
    const std::array<double, 9> terms = {1,
                                         n.y,
                                         n.z,
                                         n.x,
                                         n.x * n.y,
                                         n.y * n.z,
                                         3 * n.z * n.z - 1,
                                         n.z * n.x,
                                         n.x * n.x - n.y * n.y};
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const double weakened = i == 0 ? 1.0 : (i < 4 ? 2.0 / 3 : 0.25);
      sky[i] += patch.radiance * (patch.solid_angle * terms[i] * weakened / kNorms[i]);
    }
  }
  return sky;
}

double up_luma(const std::array<glm::dvec3, 9>& sky, const glm::dvec3& key, double key_z) {
  return luma(sky[0] + sky[2] + 2.0 * sky[6] + key * std::max(key_z, 0.0));
}

}  // namespace

Result<LightRecord> read_light(const std::string& path) {
  MODAR_ASSIGN(const LinearImage image, read_linear_image(path));
  std::vector<Patch> patches = patches_of(image);
  glm::dvec3 direction(0, 0, 1);
  glm::dvec3 key = take_key(patches, direction);
  std::array<glm::dvec3, 9> sky = sky_of(patches);
  const double given = up_luma(sky, key, direction.z);
  if (!(given > 1e-6)) {
    return fail(ExitCode::kInvalidInput, "light.black", path,
                "the picture is black: it gives no light", "take a picture of a lit room");
  }
  const RoomLight room = neutral_room();
  std::array<glm::dvec3, 9> usual{};
  for (std::size_t i = 0; i < 9; ++i) usual[i] = glm::dvec3(room.sky[i]);
  const double factor =
      up_luma(usual, glm::dvec3(room.key), glm::normalize(glm::dvec3(room.direction)).z) / given;
  LightRecord record{};
  for (std::size_t i = 0; i < 9; ++i) {
    for (int c = 0; c < 3; ++c) {
      record.sky[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(factor * sky[i][c]);
    }
  }
  for (int i = 0; i < 3; ++i) {
    record.direction[i] = static_cast<float>(direction[i]);
    record.key[i] = static_cast<float>(factor * key[i]);
  }
  return record;
}

}  // namespace modar
