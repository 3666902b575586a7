// The benchmark's rows on a small bundle, in a process that has opened no context before.
#include "bake/extensions/lab/render_bench.hpp"

#include <algorithm>

#include "tests/render/scene.hpp"

namespace modar {
namespace {

double value(const std::vector<RenderBenchRow>& rows, const std::string& measure, bool reference) {
  const auto found = std::ranges::find(rows, measure, &RenderBenchRow::measure);
  EXPECT_NE(found, rows.end()) << measure;
  if (found == rows.end()) return -1;
  return reference ? found->reference : found->ours;
}

TEST(RenderBench, TellsWhatEachWayCosts) {
  constexpr std::uint32_t kTriangles = 800;
  SceneMaker maker;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < kTriangles; ++i) {
    const double x = on_half_grid(i % 40 / 20.0 - 1.0);
    const double y = on_half_grid(i / 40 / 10.0 - 1.0);
    Triangle triangle;
    triangle.corners = {glm::dvec3(x, y, 0), {x + 0.03125, y, 0}, {x, y + 0.03125, 0}};
    triangles.push_back(triangle);
  }
  maker.add_plain_model(Layout::kHalfColoured, triangles);
  const MappedBundle bundle(maker.content);
  RenderBenchOptions options;
  options.most_copies = 3;
  options.frames = 2;
  options.idle_frames = 0;  // the no-op driver writes out of bounds, which a sanitizer sees
  const auto rows = bench_render(std::span(&bundle.path, 1), options);
  if (!rows && rows.error().code == "gl.context") GTEST_SKIP() << to_line(rows.error());
  ASSERT_TRUE(rows) << to_line(rows.error());

  for (const char* way : {"index_arrays", "index_vbo", "instancing_arrays", "instancing_vbo"}) {
    const std::string head = std::string("model x3 ") + way;
    const bool one = head.find("instancing") != std::string::npos;
    EXPECT_EQ(value(*rows, head + " draw_calls", false), one ? 1 : 3);
    EXPECT_EQ(value(*rows, head + " state_changes", false), 0) << "the same copies again";
    const bool streams = head.find("arrays") != std::string::npos;
    EXPECT_EQ(value(*rows, head + " bytes_per_frame", false) > 3.0 * kTriangles * 3 * (12 + 2),
              streams);
  }
  EXPECT_EQ(value(*rows, "model x3 instancing_vbo draw_calls", false), 1);
  EXPECT_EQ(value(*rows, "model x3 instancing_vbo draw_calls", true), 3);
  // On paper: three copies of vertices of 12 bytes and indices of 2, three a triangle.
  const double sent = value(*rows, "model x3 instancing_vbo bytes_per_frame", true);
  EXPECT_GE(sent, 3.0 * kTriangles * 3 * (12 + 2));
  EXPECT_LE(value(*rows, "model x3 instancing_vbo bytes_per_frame", false), sent / 10);
  EXPECT_EQ(value(*rows, bundle.path + " gl_geometry_bytes", false), kTriangles * 3.0 * (12 + 2));
  EXPECT_EQ(value(*rows, bundle.path + " arrival draw_calls", false), 1);
  EXPECT_EQ(value(*rows, bundle.path + " arrival uploaded_bytes", true),
            kTriangles * 3.0 * (12 + 2));
  // From its middle, 12 of the 14 views have the one flat chunk before them (the two along z look
  // away from it), and need a part of it.
  EXPECT_EQ(value(*rows, "model inside triangles_sent", false), 12.0 * kTriangles);
  EXPECT_LT(value(*rows, "model inside triangles_sent", true), 12.0 * kTriangles);
  EXPECT_GT(value(*rows, "model inside triangles_sent", true), 0);

  options.device = "nokia";
  EXPECT_EQ(bench_render(std::span(&bundle.path, 1), options).error().exit, ExitCode::kUsage);
}

}  // namespace
}  // namespace modar
