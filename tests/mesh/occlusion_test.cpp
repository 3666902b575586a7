// Shapes whose occlusion is known without casting a ray.
#include "bake/mesh/rays/occlusion.hpp"

#include <cmath>

#include "tests/mesh/stages.hpp"

namespace {

using namespace modar;
using namespace modar::testing;

/// A grid of `side` x `side` squares; height(x, y) over the square [-1,1].
template <class Height>
std::string grid(int side, const Height& height) {
  std::string text = "s 1\n";
  for (int y = 0; y <= side; ++y) {
    for (int x = 0; x <= side; ++x) {
      const double px = 2.0 * x / side - 1;
      const double py = 2.0 * y / side - 1;
      text += "v " + std::to_string(px) + " " + std::to_string(py) + " " +
              std::to_string(height(px, py)) + "\n";
    }
  }
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int a = y * (side + 1) + x + 1;
      text += "f " + std::to_string(a) + " " + std::to_string(a + 1) + " " +
              std::to_string(a + side + 2) + " " + std::to_string(a + side + 1) + "\n";
    }
  }
  return text;
}

std::vector<int> occlusion_of(const ChunkedMesh& mesh, unsigned jobs) {
  Report report;
  const Array<std::uint8_t> measured = measure_occlusion(mesh, jobs, report);
  return {measured.begin(), measured.end()};
}

TEST(Occlusion, HillsSeeAllAndPitsLittle) {
  const auto bump = [](double sign) {
    return [sign](double x, double y) { return sign * 0.9 * std::exp(-12 * (x * x + y * y)); };
  };
  const ChunkedMesh plane =
      chunked(welded(parse(grid(10, [](double, double) { return 0.0; }))), 65535);
  for (const int value : occlusion_of(plane, 1)) EXPECT_EQ(value, 127);
  for (const double sign : {1.0, -1.0}) {
    const ChunkedMesh mesh = chunked(welded(parse(grid(24, bump(sign)))), 65535);
    const std::vector<int> values = occlusion_of(mesh, 1);
    int middle = -1;
    int corner = -1;
    for (std::size_t v = 0; v < values.size(); ++v) {
      const glm::dvec3& p = mesh.mesh.positions[v];
      if (std::fabs(p.x) + std::fabs(p.y) < 1e-6) middle = values[v];
      if (p.x > 0.99 && p.y > 0.99) corner = values[v];
    }
    EXPECT_GE(corner, 120) << sign;
    if (sign > 0) {
      EXPECT_GE(middle, 126);
    } else {
      EXPECT_LT(middle, 90);
    }
    EXPECT_EQ(occlusion_of(mesh, 4), values) << "threads make no difference";
  }
}

TEST(Occlusion, ClustersOfDenseMeshesSeeAboutTheSame) {
  const ChunkedMesh mesh =
      chunked(welded(parse(grid(
                  60, [](double x, double y) { return -0.9 * std::exp(-12 * (x * x + y * y)); }))),
              65535);
  const std::vector<int> exact = occlusion_of(mesh, 1);
  Report report;
  const Array<std::uint8_t> clusters = measure_occlusion(mesh, 1, report, 1000);
  EXPECT_EQ(measure_occlusion(mesh, 3, report, 1000), clusters) << "threads make no difference";
  EXPECT_GT(report.stages[0].out, 300u);
  EXPECT_LT(report.stages[0].out, 2000u);
  double squares = 0;
  int least = 127;
  for (std::size_t v = 0; v < exact.size(); ++v) {
    squares += std::pow(exact[v] - clusters[v], 2);
    least = std::min(least, exact[v]);
  }
  EXPECT_LT(least, 90);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(exact.size())), 127 * 0.03);
}

TEST(Occlusion, WhatIsTransparentHidesNothing) {
  ChunkedMesh mesh =
      chunked(welded(parse(grid(
                  12, [](double x, double y) { return -0.9 * std::exp(-12 * (x * x + y * y)); }))),
              65535);
  mesh.mesh.materials[0].opacity = 0.5f;
  for (const int value : occlusion_of(mesh, 1)) EXPECT_EQ(value, 127);
}

TEST(Occlusion, IsPackedBehindTheNormal) {
  ChunkedMesh mesh = chunked(welded(parse(grid(2, [](double, double) { return 0.0; }))), 65535);
  EXPECT_EQ(packed(mesh).occlusion_byte, kNone);
  mesh.mesh.occlusion.assign(mesh.mesh.positions.size(), 77);
  const PackedMesh with = packed(mesh);
  ASSERT_EQ(with.occlusion_byte, 11u);
  for (std::size_t at = 11; at < with.vertices.size(); at += with.layout.stride) {
    EXPECT_EQ(with.vertices[at], std::byte{77});
  }
  Report report;
  PackOptions integers;
  integers.positions = PositionKind::kInt16;
  const Result<PackedMesh> finer =
      pack(mesh, std::vector<std::uint32_t>(mesh.mesh.materials.size(), 1024), integers, report);
  ASSERT_TRUE(finer);
  EXPECT_EQ(finer->layout.stride, 12u);
  ASSERT_EQ(finer->occlusion_byte, 11u);
  for (std::size_t at = 8; at < finer->vertices.size(); at += finer->layout.stride) {
    // The plane looks up or down.
    EXPECT_EQ(std::abs(static_cast<int>(static_cast<std::int8_t>(finer->vertices[at + 2]))), 127);
    EXPECT_EQ(finer->vertices[at + 3], std::byte{77});
  }
}

}  // namespace
