// A tap finds the model and the point that the rays of the reference find.
#include <glm/gtc/matrix_transform.hpp>

#include "tests/render/reference.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

TEST(Pick, AgreesWithTheReferencesRays) {
  std::vector<Triangle> triangles(2);
  triangles[0].corners = {glm::dvec3(-1, -1, 0), {0.5, -0.5, 0.25}, {-0.5, 0.75, -0.25}};
  triangles[1].corners = {glm::dvec3(-0.5, -0.5, 0.5), {0.75, 0.25, 0}, {0, 1, 0}};
  for (const Layout layout : {Layout::kHalfColoured, Layout::kI16Coloured, Layout::kF32Coloured}) {
    SceneMaker maker;
    maker.add_plain_model(layout, triangles);
    const MappedBundle bundle(maker.content);
    const Camera camera = default_camera(64, 48);
    const glm::dmat4 view = glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(0.1, 0, -2.5)),
                                        0.3, glm::dvec3(0, 1, 0));
    const auto eye = to_eye_space(triangles, view, true);
    const std::vector<Hit> hits = cast_rays(camera, eye);
    // The second item is hidden by the first, the third does not exist.
    const glm::mat4 behind = glm::translate(glm::mat4(1.0f), glm::vec3(0, 0, -1)) * glm::mat4(view);
    const DrawItem items[] = {{7, glm::mat4(view)}, {0, behind}, {0, glm::mat4(view)}};
    int met = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (!hits[i].certain) continue;
      const glm::dvec2 pixel(static_cast<double>(i % 64), static_cast<double>(i / 64));
      const auto found = pick(*bundle.view, camera, pixel, std::span(items).last(1));
      ASSERT_EQ(found.has_value(), hits[i].triangle >= 0) << i;
      if (!found) continue;
      const std::size_t triangle = static_cast<std::size_t>(hits[i].triangle);
      glm::dvec3 point(0.0);
      glm::dvec3 in_eye(0.0);
      for (int c = 0; c < 3; ++c) {
        const std::size_t corner = static_cast<std::size_t>(c);
        point += hits[i].weights[c] * triangles[triangle].corners[corner];
        in_eye += hits[i].weights[c] * eye[triangle].corners[corner];
      }
      EXPECT_NEAR(glm::distance(glm::dvec3(found->point), point), 0.0, 2e-3) << i;
      EXPECT_NEAR(static_cast<double>(found->distance), glm::length(in_eye), 2e-3) << i;
      EXPECT_EQ(pick(*bundle.view, camera, pixel, items)->item, 2u);
      ++met;
    }
    EXPECT_GT(met, 300);
  }
}

}  // namespace
}  // namespace modar
