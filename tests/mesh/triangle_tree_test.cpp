// The tree finds what trying every triangle finds; nearest points are nearest by a fine raster.
#include "bake/mesh/rays/triangle_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <glm/geometric.hpp>

#include "bake/mesh/rays/parallel_rays.hpp"

namespace {

using namespace modar;

glm::dvec3 draw(std::mt19937& random) {
  const auto one = [&random] { return static_cast<double>(random() % 2001) / 1000.0 - 1.0; };
  return {one(), one(), one()};
}

TEST(TriangleTree, NearestPointsOfATriangleBeatARaster) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const glm::dvec3 a = draw(random);
    const glm::dvec3 b = draw(random);
    const glm::dvec3 c = trial % 10 == 0 ? a : draw(random);  // some have no area
    const glm::dvec3 p = 2.0 * draw(random);
    double least = 1e9;
    constexpr int kSteps = 100;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j + i <= kSteps; ++j) {
        const glm::dvec3 q = a + (b - a) * (double(i) / kSteps) + (c - a) * (double(j) / kSteps);
        least = std::min(least, glm::length(q - p));
      }
    }
    const double found = std::sqrt(distance_square(p, {a, b, c}));
    const ClosestPoint closest = closest_point(p, {a, b, c});
    EXPECT_NEAR(glm::length(a + closest.b * (b - a) + closest.c * (c - a) - p), found, 1e-12);
    EXPECT_LE(found, least + 1e-12);
    EXPECT_GE(found, least - 0.05);  // the raster is that coarse
  }
}

TEST(TriangleTree, FindsWhatTryingAllFinds) {
  std::mt19937 random(4);
  for (const std::size_t count : {1u, 4u, 5u, 300u}) {
    std::vector<glm::dvec3> positions;
    std::vector<TriangleTree::Triangle> triangles;
    for (std::uint32_t t = 0; t < count; ++t) {
      const glm::dvec3 at = draw(random);
      for (int corner = 0; corner < 3; ++corner) positions.push_back(at + 0.1 * draw(random));
      triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    TriangleTree tree(positions, triangles);
    for (int trial = 0; trial < 200; ++trial) {
      const glm::dvec3 p = 1.5 * draw(random);
      double least = 1e9;
      for (const auto& t : triangles) {
        least = std::min(least,
                         distance_square(p, {positions[t[0]], positions[t[1]], positions[t[2]]}));
      }
      EXPECT_EQ(tree.nearest(p), least);
      const auto& [a, b, c] = tree.last_triangle();
      EXPECT_EQ(distance_square(p, {positions[a], positions[b], positions[c]}), least);
    }
  }
}

TEST(RayTree, RaysMeetWhatTryingAllMeets) {
  std::mt19937 random(5);
  std::vector<glm::dvec3> positions;
  std::vector<RayTree::Triangle> triangles;
  for (std::uint32_t t = 0; t < 200; ++t) {
    const glm::dvec3 at = draw(random);
    for (int corner = 0; corner < 3; ++corner) positions.push_back(at + 0.3 * draw(random));
    triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  const RayTree tree(positions, triangles);
  int hits = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const glm::dvec3 origin = 1.5 * draw(random);
    const glm::dvec3 direction = draw(random);
    double nearest = 2.0;
    for (const auto& t : triangles) {
      // A plane and three half planes, by signed volumes.
      const glm::dvec3 n =
          glm::cross(positions[t[1]] - positions[t[0]], positions[t[2]] - positions[t[0]]);
      const double at = glm::dot(positions[t[0]] - origin, n) / glm::dot(direction, n);
      const glm::dvec3 p = origin + at * direction;
      bool inside = at >= 0.05 && at < nearest;
      for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3& a = positions[t[i]];
        inside = inside && glm::dot(glm::cross(positions[t[(i + 1) % 3]] - a, p - a), n) >= 0;
      }
      if (inside) nearest = at;
    }
    const auto found = tree.first_hit(origin, direction, 0.05, 2.0);
    ASSERT_EQ(found.has_value(), nearest < 2.0) << trial;
    if (!found) continue;
    ++hits;
    EXPECT_NEAR(found->distance, nearest, 1e-9);
    const auto& t = found->triangle;
    const glm::dvec3 point = positions[t[0]] + found->b * (positions[t[1]] - positions[t[0]]) +
                             found->c * (positions[t[2]] - positions[t[0]]);
    EXPECT_NEAR(glm::length(point - (origin + nearest * direction)), 0.0, 1e-9);
  }
  EXPECT_GT(hits, 50);
}

TEST(ParallelRays, MeetWhatRaysOfATreeMeet) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1, 1);
  std::uniform_real_distribution<float> near(-0.2f, 0.2f);
  const auto point = [&](auto& along) {
    return glm::vec3(along(random), along(random), along(random));
  };
  std::vector<glm::vec3> corners;
  std::vector<ParallelRays::Triangle> triangles;
  for (std::uint32_t t = 0; t < 400; ++t) {
    const glm::vec3 middle = point(place) * 0.8f;
    auto& size = t % 20 == 0 ? place : near;  // some span many cells
    for (int i = 0; i < 3; ++i) corners.push_back(middle + point(size));
    triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  std::vector<glm::vec3> origins;
  std::vector<glm::vec3> normals;
  for (int i = 0; i < 700; ++i) {
    origins.push_back(point(place));
    normals.push_back(glm::normalize(point(place)));
  }
  const std::vector<glm::dvec3> exact(corners.begin(), corners.end());
  const RayTree tree(exact, triangles);
  ParallelRays rays(origins, normals, corners, triangles);
  int met = 0;
  for (const glm::vec3& axis : {glm::vec3(0, 0, 1), glm::normalize(glm::vec3(1, -2, 0.5f))}) {
    ASSERT_TRUE(rays.cast(axis, {0.01f, 0.9f}));
    ASSERT_EQ(rays.size(), origins.size());
    std::vector<bool> seen(origins.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const std::uint32_t p = rays.point(i);
      seen[p] = true;
      const float cosine = glm::dot(normals[p], axis);
      EXPECT_NEAR(rays.cosine(i), std::fabs(cosine), 1e-6f);
      const auto hit =
          tree.first_hit(glm::dvec3(origins[p]), glm::dvec3(cosine < 0 ? -axis : axis), 0.01, 0.9);
      EXPECT_NEAR(static_cast<double>(rays.distance(i)), hit ? hit->distance : 0.9, 1e-4) << p;
      if (hit) ++met;
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 700) << "each point has one ray";
  }
  EXPECT_GT(met, 300);
  EXPECT_LT(met, 1300);
}

}  // namespace
