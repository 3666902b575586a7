// Culling against brute force over random views: what a view shows is never left out, and what it
// cannot show mostly is.
#include <random>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "modar/camera.hpp"
#include "runtime/render/draw_list.hpp"

namespace modar {
namespace {

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double real(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) / 4294967296.0);
  }
  glm::dvec3 point(double reach) {
    return {real(-reach, reach), real(-reach, reach), real(-reach, reach)};
  }

 private:
  std::mt19937 engine_;
};

glm::dmat4 random_matrix(Random& random) {
  glm::dmat4 matrix = glm::translate(
      glm::dmat4(1.0), glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-4, 1)));
  matrix = glm::rotate(matrix, random.real(0, 6.3), glm::normalize(random.point(1) + 1e-3));
  return glm::scale(matrix, glm::dvec3(random.real(0.3, 2.0)));
}

ChunkRecord random_box(Random& random) {
  ChunkRecord chunk{};
  const glm::dvec3 centre = random.point(0.8);
  for (int axis = 0; axis < 3; ++axis) {
    const double reach = random.real(0.0, 0.3);
    chunk.bounds_min[axis] = static_cast<float>(centre[axis] - reach);
    chunk.bounds_max[axis] = static_cast<float>(centre[axis] + reach);
  }
  return chunk;
}

glm::dvec3 point_of(Random& random, const ChunkRecord& chunk) {
  glm::dvec3 point;
  for (int axis = 0; axis < 3; ++axis) {
    point[axis] = random.real(static_cast<double>(chunk.bounds_min[axis]),
                              static_cast<double>(chunk.bounds_max[axis]));
  }
  return point;
}

/// Inside the picture and the depth limits, by the camera's own projection in double.
bool is_seen(const Camera& camera, const glm::dmat4& to_eye, const glm::dvec3& point) {
  const glm::dvec3 eye(to_eye * glm::dvec4(point, 1.0));
  const double depth = -eye.z;
  if (depth < 0.1 || depth > 100.0) return false;
  const double x = camera.cx + camera.fx * eye.x / depth;
  const double y = camera.cy - camera.fy * eye.y / depth;
  return x >= -0.5 && y >= -0.5 && x <= camera.width - 0.5 && y <= camera.height - 0.5;
}

TEST(Culling, FrustumNeverDropsWhatIsSeen) {
  Random random(1);
  const Camera camera = default_camera(160, 120);
  const glm::mat4 projection = gl_projection(camera, 0.1, 100.0);
  int culled = 0;
  int empty = 0;
  for (int i = 0; i < 4000; ++i) {
    const glm::mat4 to_eye(random_matrix(random));
    const ChunkRecord chunk = random_box(random);
    const bool out = outside_frustum(model_view(projection, to_eye, camera.height), chunk);
    int seen = 0;
    for (int j = 0; j < 40; ++j) {
      seen += is_seen(camera, glm::dmat4(to_eye), point_of(random, chunk));
    }
    if (out) {
      EXPECT_EQ(seen, 0);
    }
    culled += out;
    empty += seen == 0;
  }
  EXPECT_GT(empty, 1000);
  // A test of planes keeps a few boxes near the frustum's edges: not more than one in ten here.
  EXPECT_GT(culled, empty * 9 / 10);
}

TEST(Culling, ConeNeverDropsAFrontFace) {
  Random random(2);
  const glm::mat4 projection = gl_projection(default_camera(160, 120), 0.1, 100.0);
  int culled = 0;
  int hidden = 0;
  for (int i = 0; i < 3000; ++i) {
    const glm::mat4 to_eye(random_matrix(random));
    ChunkRecord chunk = random_box(random);
    // Normals within `spread` of the axis: all backs are seen where the ray is within 90 degrees
    // minus the spread of the axis, so the cutoff is the sine of the spread.
    const glm::dvec3 axis = glm::normalize(random.point(1) + 1e-3);
    const double spread = random.real(0.0, 1.2);
    for (int a = 0; a < 3; ++a) chunk.cone_axis[a] = static_cast<float>(axis[a]);
    chunk.cone_cutoff = static_cast<float>(std::sin(spread));
    const bool away = faces_away(model_view(projection, to_eye, 120), chunk);
    const glm::dvec3 eye(glm::inverse(glm::dmat4(to_eye)) * glm::dvec4(0, 0, 0, 1));
    bool front = false;
    for (int j = 0; j < 100; ++j) {
      const glm::dvec3 point = point_of(random, chunk);
      const glm::dvec3 side = glm::normalize(glm::cross(axis, random.point(1) + 1e-3));
      const double tilt = random.real(0.9, 1.0) * spread;
      const glm::dvec3 normal = std::cos(tilt) * axis + std::sin(tilt) * side;
      front = front || glm::dot(normal, eye - point) > 0.0;
    }
    if (away) {
      EXPECT_FALSE(front);
    }
    culled += away;
    hidden += !front;
  }
  EXPECT_GT(culled, 200);
  EXPECT_GT(culled, hidden / 2);
}

TEST(Culling, LevelErrorStaysUnderThePixelLimit) {
  Random random(3);
  const Camera camera = default_camera(160, 120);
  const glm::mat4 projection = gl_projection(camera, 0.1, 100.0);
  std::array<LevelRecord, 4> records{};
  const Table<LevelRecord> levels(reinterpret_cast<const std::byte*>(records.data()), 4,
                                  sizeof(LevelRecord));
  int coarse = 0;
  for (int i = 0; i < 2000; ++i) {
    const glm::dmat4 to_eye(random_matrix(random));
    ChunkRecord chunk = random_box(random);
    chunk.level_count = 4;
    for (std::size_t l = 1; l < 4; ++l) {
      records[l].error = records[l - 1].error + static_cast<float>(random.real(0.0, 0.02));
    }
    const ModelView view = model_view(projection, glm::mat4(to_eye), camera.height);
    const std::uint32_t level = choose_level(view, chunk, levels, 1.0f);
    coarse += level > 0;
    // A point of the box moved by the level's error, across the line of sight, moves on the screen
    // by no more than a pixel.
    for (int j = 0; j < 20; ++j) {
      const glm::dvec3 p(to_eye * glm::dvec4(point_of(random, chunk), 1.0));
      const double step =
          static_cast<double>(records[level].error) * glm::length(glm::dvec3(to_eye[0]));
      const double distance = glm::length(p);
      EXPECT_LE(camera.fy * step / distance, 1.0 + 1e-4);
    }
  }
  EXPECT_GT(coarse, 300);
}

}  // namespace
}  // namespace modar
