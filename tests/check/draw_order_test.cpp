// Transparent parts, drawn by the renderer from a baked bundle, against each pixel's layers
// sorted by brute force.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/import/read_model.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/draw_order.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"

namespace {

using namespace modar;

constexpr int kSide = 64;

/// An OBJ file of one material that is seen through. Faces have colours of their own and are
/// written in both windings: seen from both sides, one at a time.
class Sheets {
 public:
  void face(const std::vector<glm::dvec3>& corners, const glm::dvec3& colour) {
    for (const glm::dvec3& p : corners) {
      text_ += "v";
      for (const glm::dvec3& three : {p, colour}) {
        for (int i = 0; i < 3; ++i) text_ += " " + std::to_string(three[i]);
      }
      text_ += "\n";
    }
    const int count = static_cast<int>(corners.size());
    text_ += "f";
    for (int i = -count; i < 0; ++i) text_ += " " + std::to_string(i);
    text_ += "\nf";
    for (int i = -1; i >= -count; --i) text_ += " " + std::to_string(i);
    text_ += "\n";
  }

  [[nodiscard]] std::string write() const {
    const auto base =
        std::filesystem::temp_directory_path() / ("modar_order_" + std::to_string(::getpid()));
    const auto put = [](const std::string& path, const std::string& text) {
      EXPECT_TRUE(write_file(path, std::as_bytes(std::span(text))));
    };
    put(base.string() + ".mtl", "newmtl sheet\nKd 1 1 1\nKs 0 0 0\nd 0.6\n");
    put(base.string() + ".obj",
        "mtllib " + base.filename().string() + ".mtl\nusemtl sheet\n" + text_);
    return base.string() + ".obj";
  }

 private:
  std::string text_;
};

/// The stored colour of a pixel's ray: all layers that face the eye over black, the farthest first.
glm::dvec3 layers(const TriMesh& mesh, const glm::dvec3& eye, const glm::dvec3& ray) {
  std::vector<std::pair<double, std::uint32_t>> hits;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    const glm::dvec3 a = mesh.positions[corners[0]];
    const glm::dvec3 u = mesh.positions[corners[1]] - a;
    const glm::dvec3 v = mesh.positions[corners[2]] - a;
    const glm::dvec3 n = glm::cross(u, v);
    const double facing = glm::dot(n, ray);
    if (facing >= 0) continue;
    const double distance = glm::dot(n, a - eye) / facing;
    const glm::dvec3 p = eye + distance * ray - a;
    const double b = glm::dot(glm::cross(p, v), n) / glm::dot(n, n);
    const double c = glm::dot(glm::cross(u, p), n) / glm::dot(n, n);
    if (b >= 0 && c >= 0 && b + c <= 1) hits.emplace_back(distance, t);
  }
  std::sort(hits.begin(), hits.end(), std::greater<>());
  glm::dvec3 colour(0.0);
  for (const auto& [ignored, t] : hits) {
    const glm::dvec3 own = glm::dvec3(glm::dvec4(mesh.colours[mesh.triangles[t][0]])) / 255.0;
    const double share = 0.6;
    colour = share * own + (1 - share) * colour;
  }
  return colour;
}

/// Light that leaves stored colours unchanged.
RenderOptions plain_light() {
  RenderOptions options;
  options.light = RoomLight{};
  options.light->sky[0] = glm::vec3(1.0f);
  return options;
}

/// Pixels of twelve views that are off by more than 8 of 255, as a share of those that the model
/// covers.
double wrong_share(const std::string& path) {
  BakeRequest request;
  request.models = {path};
  Report report;
  const auto content = build_bundle(request, report);
  if (!content) {
    ADD_FAILURE() << to_line(content.error());
    return 1;
  }
  EXPECT_EQ(std::ranges::count(content->extra, static_cast<std::uint32_t>(SectionType::kDrawOrder),
                               &ExtraSection::type),
            1);
  const std::vector<std::byte> bytes = *encode_bundle(*content);
  const auto bundle = BundleView::open(bytes);
  if (!bundle) {
    ADD_FAILURE() << to_line(bundle.error());
    return 1;
  }
  const TriMesh mesh = *weld(*read_model(path, {}), report, {1});
  const auto renderer = *Renderer::create(*bundle, probe_gl_caps());
  renderer->set_options(plain_light());
  EXPECT_TRUE(renderer->resize(kSide, kSide));
  const Camera camera = default_camera(kSide, kSide);
  std::vector<std::uint8_t> pixels(std::size_t{4} * kSide * kSide);
  int covered = 0;
  int wrong = 0;
  for (int view = 0; view < 12; ++view) {
    const double angle = 0.1 + view * M_PI / 6;
    const glm::dvec3 eye(3 * std::cos(angle), 3 * std::sin(angle), 2.5 * std::sin(2.3 * view));
    const glm::dmat4 to_eye = glm::lookAt(eye, glm::dvec3(0), glm::dvec3(0, 0, 1));
    const DrawItem item{0, glm::mat4(to_eye)};
    renderer->render(RgbImage{}, gl_projection(camera, 0.1, 10.0), {&item, 1});
    renderer->read_pixels(pixels);
    const glm::dmat3 back = glm::transpose(glm::dmat3(to_eye));
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const glm::dvec3 ray =
            back * glm::dvec3((x - camera.cx) / camera.fx, -(y - camera.cy) / camera.fy, -1.0);
        const glm::dvec3 expected = 255.0 * layers(mesh, eye, ray);
        double off = 0;
        for (int i = 0; i < 3; ++i) {
          const double seen = pixels[static_cast<std::size_t>(4 * (y * kSide + x) + i)];
          off = std::max(off, std::fabs(seen - expected[i]));
        }
        covered += expected != glm::dvec3(0.0);
        wrong += off > 8;
      }
    }
  }
  return static_cast<double>(wrong) / covered;
}

void expect_right(const Sheets& sheets, double most) {
  const std::string path = sheets.write();
  EXPECT_LT(wrong_share(path), most);
  std::filesystem::remove(path);
  std::filesystem::remove(path.substr(0, path.size() - 3) + "mtl");
}

class DrawOrder : public ::testing::Test {
 protected:
  void SetUp() override {
    auto context = GlContext::create_offscreen();
    if (!context) GTEST_SKIP() << to_line(context.error());
    context_ = std::move(*context);
  }
  std::unique_ptr<GlContext> context_;
};

TEST_F(DrawOrder, CrossedCardsHideOneAnotherInPart) {
  Sheets sheets;
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 along(std::cos(i * M_PI / 3 + 0.3), std::sin(i * M_PI / 3 + 0.3), 0.1 * i);
    const glm::dvec3 up(0.15 * i, -0.1, 1);
    sheets.face({-along - up, along - up, along + up, -along + up},
                {i == 0 ? 1 : 0, i == 1 ? 1 : 0, i == 2 ? 1 : 0});
  }
  expect_right(sheets, 0.02);
}

/// A ring of glass: up to four layers, none of which has to be cut.
TEST_F(DrawOrder, LayersOfGlassLieFromFarToNear) {
  constexpr int kAround = 20;
  constexpr int kAcross = 10;
  const auto at = [](int i, int j) {
    const double a = 2 * M_PI * i / kAround;
    const double b = 2 * M_PI * j / kAcross;
    const double radius = 1 + 0.4 * std::cos(b);
    return glm::dvec3(radius * std::cos(a), radius * std::sin(a), 0.4 * std::sin(b));
  };
  Sheets sheets;
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      sheets.face({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)},
                  {i % 2, j % 2, (i + j) % 3 / 2.0});
    }
  }
  expect_right(sheets, 0.03);
}

}  // namespace
