// Short ways through the stages for tests, and a mesh that suits most of them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bake/import/read_model.hpp"
#include "bake/mesh/pack/pack.hpp"
#include "bake/mesh/weld/weld.hpp"

namespace modar::testing {

inline SourceModel parse(const std::string& text) {
  auto model = parse_obj(text, "", "test.obj");
  EXPECT_TRUE(model);
  return model ? std::move(*model) : SourceModel();
}

inline TriMesh welded(const SourceModel& source) {
  Report report;
  auto mesh = weld(source, report);
  EXPECT_TRUE(mesh);
  return mesh ? std::move(*mesh) : TriMesh();
}

inline ChunkedMesh chunked(TriMesh mesh, std::uint32_t max_vertices) {
  Report report;
  ChunkOptions options;
  options.max_vertices = max_vertices;
  auto result = chunk(std::move(mesh), options, report);
  EXPECT_TRUE(result);
  return result ? std::move(*result) : ChunkedMesh();
}

inline PackedMesh packed(const ChunkedMesh& mesh, std::uint32_t side = 1024) {
  Report report;
  auto result =
      pack(mesh, std::vector<std::uint32_t>(mesh.mesh.materials.size(), side), {}, report);
  EXPECT_TRUE(result);
  return result ? std::move(*result) : PackedMesh();
}

/// A wavy grid of 2 * n * n triangles, with uv, `materials` of them in stripes.
inline std::string grid(int n, int materials) {
  std::string text;
  const auto number = [](double x) { return std::to_string(x) + " "; };
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) {
      text += "v " + number(x * 0.7) + number(y) +
              number(3 * std::sin(x * 0.3) + std::cos(y * 0.2)) + "\nvt " + number(double(x) / n) +
              number(double(y) / n) + "\n";
    }
  }
  for (int y = 0; y < n; ++y) {
    text += "usemtl m" + std::to_string(y * materials / n) + "\n";
    for (int x = 0; x < n; ++x) {
      const auto corner = [&](int i, int j) {
        const std::string v = std::to_string(j * (n + 1) + i + 1);
        return " " + v + "/" + v;
      };
      text +=
          "f" + corner(x, y) + corner(x + 1, y) + corner(x + 1, y + 1) + corner(x, y + 1) + "\n";
    }
  }
  return text;
}

/// Moved to where maps count metres (UTM): floats there are half a metre apart.
inline SourceModel on_a_map(SourceModel model) {
  for (glm::dvec3& position : model.positions)
    position += glm::dvec3(349011.8489, 6648378.3181, 9.7628);
  return model;
}

}  // namespace modar::testing
