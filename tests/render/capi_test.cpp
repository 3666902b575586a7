// The C API where C++ has no test of its own: assets inside other files, camera files, versions,
// options.
#include "modar/modar.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>
#include <tuple>
#include <vector>

#include "tests/formats/support.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

Triangle one_triangle() {
  Triangle triangle;
  triangle.corners = {glm::dvec3(-1, -1, 0), {1, -1, 0}, {0, 1, 0}};
  return triangle;
}

class CapiTest : public ::testing::Test {
 protected:
  void SetUp() override {
    SceneMaker maker;
    maker.add_plain_model(Layout::kHalfColoured, {one_triangle()});
    bundle_ = std::make_unique<MappedBundle>(maker.content);
    path_ = bundle_->path + ".apk";
  }
  void TearDown() override { std::remove(path_.c_str()); }

  /// A file with the bundle's bytes behind some others, and some more.
  void write_asset(std::size_t offset) const {
    const auto bytes = bundle_->view->bytes();
    std::ofstream file(path_, std::ios::binary);
    file << std::string(offset, 'x');
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file << "tail";
  }

  std::unique_ptr<MappedBundle> bundle_;
  std::string path_;
};

TEST_F(CapiTest, OpensAnAssetWhereverItLies) {
  const auto size = static_cast<std::int64_t>(bundle_->view->bytes().size());
  // zipalign puts assets at multiples of 4.
  for (const std::size_t offset : {0u, 4u, 8u, 12u, 4092u, 4096u, 4100u, 70004u}) {
    write_asset(offset);
    const int file = open(path_.c_str(), O_RDONLY);
    ASSERT_GE(file, 0);
    auto error = sized<modar_error>();
    modar_bundle* bundle =
        modar_bundle_open_fd(file, static_cast<std::int64_t>(offset), size, &error);
    close(file);
    ASSERT_NE(bundle, nullptr) << offset << ": " << error.code << " " << error.cause;
    EXPECT_EQ(modar_model_count(bundle), 1u);
    EXPECT_EQ(modar_pattern_width_mm(bundle, 0), 0.0) << "no such pattern";
    modar_bundle_close(bundle);
  }
}

TEST_F(CapiTest, RefusesARangeThatTheFileDoesNotHold) {
  const auto size = static_cast<std::int64_t>(bundle_->view->bytes().size());
  write_asset(8);
  const int file = open(path_.c_str(), O_RDONLY);
  for (const auto& [offset, length] : {std::pair<std::int64_t, std::int64_t>{8, size + 5},
                                       {size * 2, 10},
                                       {8, 0},
                                       {-8, 10},
                                       {8, -1}}) {
    auto error = sized<modar_error>();
    EXPECT_EQ(modar_bundle_open_fd(file, offset, length, &error), nullptr);
    EXPECT_STREQ(error.code, "io.range") << offset << " " << length;
  }
  close(file);
  auto error = sized<modar_error>();
  EXPECT_EQ(modar_bundle_open_fd(-1, 0, 10, &error), nullptr);
  EXPECT_STREQ(error.code, "io.map");
}

TEST_F(CapiTest, ReportsAFileThatWasCutShort) {
  modar_bundle* bundle = modar_bundle_open(bundle_->path.c_str(), nullptr);
  ASSERT_NE(bundle, nullptr);
  auto error = sized<modar_error>();
  EXPECT_EQ(modar_bundle_intact(bundle, &error), MODAR_OK);
  modar_guard_files();
  ASSERT_EQ(truncate(bundle_->path.c_str(), 100), 0);
  EXPECT_EQ(modar_bundle_intact(bundle, &error), MODAR_IO);
  EXPECT_STREQ(error.code, "io.changed");
  EXPECT_EQ(modar_bundle_verify(bundle, nullptr), MODAR_IO);
  EXPECT_EQ(modar_model_count(bundle), 1u) << "tables are kept";
  modar_context* context = modar_context_create(nullptr);
  EXPECT_EQ(modar_renderer_create(bundle, nullptr, 0, nullptr), nullptr);
  modar_context_destroy(context);
  modar_bundle_close(bundle);
}

TEST_F(CapiTest, TakesBytesAtAnyMultipleOfFour) {
  const auto bytes = bundle_->view->bytes();
  std::vector<std::uint64_t> room(bytes.size() / 8 + 602);
  for (std::size_t i = 0; i < 1200; ++i) {
    auto* start = reinterpret_cast<std::byte*>(room.data()) + 4 * i;
    std::memcpy(start, bytes.data(), bytes.size());
    auto error = sized<modar_error>();
    modar_bundle* bundle = modar_bundle_open_bytes(start, bytes.size(), &error);
    ASSERT_NE(bundle, nullptr) << error.cause;
    EXPECT_EQ(modar_model_count(bundle), 1u);
    modar_bundle_close(bundle);
  }
}

TEST_F(CapiTest, ReadsTheFileThatCalibrateWrites) {
  std::ofstream(path_)
      << "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
         "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
         "   data: [ 5.3612345678901234e+02, 0., 342.5, 0., 5.37e2, 235., 0.,\n       0., 1. ]\n"
         "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
         "   data: [ -2.65e-01, -4.67e-02, 1.83e-03, -3.14e-04, 2.52e-01 ]\n";
  auto camera = sized<modar_camera>();
  auto error = sized<modar_error>();
  ASSERT_EQ(modar_camera_read(path_.c_str(), &camera, &error), 0) << error.cause;
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_NEAR(camera.fx, 536.12345678901234, 1e-11);
  EXPECT_DOUBLE_EQ(camera.cx, 342.5);
  EXPECT_DOUBLE_EQ(camera.fy, 537);
  EXPECT_DOUBLE_EQ(camera.cy, 235);
  const double coefficients[] = {-0.265, -0.0467, 0.00183, -0.000314, 0.252};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(camera.distortion[i], coefficients[i], 1e-15);
}

TEST_F(CapiTest, RefusesDamagedCameraFiles) {
  const std::pair<const char*, const char*> files[] = {
      {"", "camera.open"},
      {"image_width: 640\n", "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ 1, 0, 0 ]\n", "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ 0, 0, 1, 0, 1, 1, 0, 0, 1 ]\n", "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ .Nan, 0, 1, 0, 1, 1, 0, 0, 1 ]\n",
       "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ 1e400, 0, 1, 0, 1, 1, 0, 0, 1 ]\n",
       "camera.matrix"},
      {"camera_matrix: [ 1, 0, 1, 0, 1, 1, 0, 0, 1 ]\nimage_width: -4\n", "camera.size"},
      {"camera_matrix: [ 1, 0, 1, 0, 1, 1, 0, 0, 1 ]\ndistortion_coefficients: [ 1, x ]\n",
       "camera.distortion"},
      {"camera_matrix: [ 1, 0, 1, 0, 1, 1, 0, 0, 1 ]\ndistortion_coefficients: [ 0, 0, 0, 0, 0, 1 "
       "]\n",
       "camera.distortion"},
  };
  for (const auto& [text, code] : files) {
    std::ofstream(path_) << text;
    auto camera = sized<modar_camera>();
    auto error = sized<modar_error>();
    EXPECT_NE(modar_camera_read(path_.c_str(), &camera, &error), 0) << text;
    EXPECT_STREQ(error.code, code) << text;
  }
}

TEST_F(CapiTest, RefusesACameraThatCannotBe) {
  auto error = sized<modar_error>();
  modar_bundle* bundle = modar_bundle_open(bundle_->path.c_str(), &error);
  ASSERT_NE(bundle, nullptr);
  const double bad[] = {0.0, -1.0, std::nan(""), HUGE_VAL};
  for (const double focal : bad) {
    auto camera = sized<modar_camera>();
    modar_camera_default(64, 48, &camera);
    camera.fx = focal;
    EXPECT_EQ(modar_tracker_create(bundle, &camera, nullptr, &error), nullptr);
    EXPECT_STREQ(error.code, "camera.matrix") << focal;
  }
  auto camera = sized<modar_camera>();
  modar_camera_default(64, 48, &camera);
  camera.distortion[2] = std::nan("");
  EXPECT_EQ(modar_tracker_create(bundle, &camera, nullptr, &error), nullptr);
  EXPECT_STREQ(error.code, "camera.distortion");
  modar_camera_default(0, 48, &camera);
  EXPECT_EQ(modar_tracker_create(bundle, &camera, nullptr, &error), nullptr);
  EXPECT_STREQ(error.code, "camera.size");
  modar_bundle_close(bundle);
}

TEST_F(CapiTest, ShrinksByTheMeanOfSquares) {
  constexpr int kWide = 23;  // no multiple of the factor: the rest is left out
  constexpr int kHigh = 11;
  constexpr std::size_t kStride = 29;
  std::vector<std::uint8_t> gray(kStride * kHigh);
  for (std::size_t i = 0; i < gray.size(); ++i) gray[i] = static_cast<std::uint8_t>(i * i * 7919);
  for (const int factor : {1, 2, 3, 5}) {
    const int columns = kWide / factor;
    const int rows = kHigh / factor;
    std::vector<std::uint8_t> expected;
    for (int i = 0; i < columns * rows; ++i) {
      double sum = 0;
      for (int k = 0; k < factor * factor; ++k) {
        const int x = i % columns * factor + k % factor;
        const int y = i / columns * factor + k / factor;
        sum += gray[static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x)];
      }
      expected.push_back(static_cast<std::uint8_t>(std::floor(sum / (factor * factor) + 0.5)));
    }
    std::vector<std::uint8_t> in_place = gray;
    modar_shrink(in_place.data(), kStride, kWide, kHigh, factor, in_place.data());
    in_place.resize(expected.size());
    EXPECT_EQ(in_place, expected) << factor;
  }
}

TEST_F(CapiTest, StatesAModelsBox) {
  auto error = sized<modar_error>();
  const auto bytes = bundle_->view->bytes();
  modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), &error);
  ASSERT_NE(bundle, nullptr) << error.cause;
  float low[3] = {7, 7, 7};
  float high[3] = {7, 7, 7};
  EXPECT_EQ(modar_model_bounds(bundle, 1, low, high), 0);
  EXPECT_EQ(low[0], 7);
  ASSERT_EQ(modar_model_bounds(bundle, 0, low, high), 1);
  const float corners[2][3] = {{-1, -1, 0}, {1, 1, 0}};  // of one_triangle()
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(low[axis], corners[0][axis], 0.002) << axis;  // boxes hold what halves make of them
    EXPECT_NEAR(high[axis], corners[1][axis], 0.002) << axis;
  }
  modar_bundle_close(bundle);
}

/// A structure of the caller's with bytes behind it that the library does not know.
template <class Struct>
struct Longer {
  Struct known;
  std::uint8_t more[24];
};

TEST_F(CapiTest, WritesNoMoreThanTheCallersStructure) {
  auto error = sized<modar_error>();
  modar_bundle* bundle = modar_bundle_open(bundle_->path.c_str(), &error);
  ASSERT_NE(bundle, nullptr);
  // A program of today with a library of tomorrow: that one knows fields behind `fy`.
  modar_camera older{};
  std::memset(&older, 0x5A, sizeof older);
  const modar_camera before = older;
  older.size = offsetof(modar_camera, cx);
  modar_camera_default(64, 48, &older);
  EXPECT_EQ(older.size, offsetof(modar_camera, cx));
  EXPECT_EQ(older.fy, 64.0);
  EXPECT_EQ(std::memcmp(&older.cx, &before.cx, sizeof older - offsetof(modar_camera, cx)), 0);
  // A program of tomorrow with today's library.
  Longer<modar_camera> newer{};
  std::memset(&newer, 0x5A, sizeof newer);
  newer.known.size = sizeof newer;
  modar_camera_default(64, 48, &newer.known);
  EXPECT_EQ(newer.known.size, sizeof newer);
  EXPECT_EQ(newer.known.cx, 31.5);
  for (const std::uint8_t byte : newer.more) EXPECT_EQ(byte, 0x5A);
  modar_camera none{};  // its size was forgotten
  modar_camera_default(64, 48, &none);
  EXPECT_EQ(none.width, 0);
  modar_error unset{};
  EXPECT_EQ(modar_bundle_verify(nullptr, &unset), MODAR_USAGE);
  EXPECT_EQ(unset.code[0], '\0');
  modar_bundle_close(bundle);
}

TEST_F(CapiTest, AnswersNullHandles) {
  auto error = sized<modar_error>();
  auto camera = sized<modar_camera>();
  auto pose = sized<modar_pose>();
  auto scene = sized<modar_scene>();
  auto item = sized<modar_item>();
  auto stats = sized<modar_render_stats>();
  auto picture = sized<modar_picture>();
  auto surface = sized<modar_surface>();
  auto hit = sized<modar_hit>();
  char text[8];
  float matrix[16];
  const std::uint8_t gray[4] = {};
  const double turn[3] = {};
  const modar_drawing drawing = {sizeof drawing, &camera, nullptr, &item, 1};
  EXPECT_EQ(modar_model_count(nullptr) + modar_pattern_count(nullptr) + modar_scene_count(nullptr),
            0u);
  EXPECT_EQ(modar_model_name(nullptr, 0, text, sizeof text), 0u);
  EXPECT_EQ(modar_pattern_name(nullptr, 0, text, sizeof text), 0u);
  EXPECT_EQ(modar_language(nullptr, 0, text, sizeof text), 0u);
  EXPECT_EQ(modar_pattern_text(nullptr, 0, MODAR_TEXT, "en", text, sizeof text), 0u);
  EXPECT_EQ(modar_model_bounds(nullptr, 0, matrix, matrix), 0);
  EXPECT_EQ(modar_pattern_picture(nullptr, 0, nullptr, nullptr, nullptr), 0);
  EXPECT_EQ(modar_pattern_width_mm(nullptr, 0), 0.0);
  EXPECT_EQ(modar_scene_at(nullptr, 0, &scene), 0);
  EXPECT_EQ(modar_tracker_create(nullptr, &camera, nullptr, &error), nullptr);
  modar_tracker_reset(nullptr);
  modar_tracker_turn(nullptr, turn);
  for (const int failed :
       {modar_bundle_verify(nullptr, &error), modar_tracker_step(nullptr, gray, 2, 0, &error),
        modar_gray(nullptr, nullptr, &error), modar_renderer_restore(nullptr, &error),
        modar_renderer_resize(nullptr, 8, 8, &error)}) {
    EXPECT_EQ(failed, MODAR_USAGE);
    EXPECT_STREQ(error.code, "capi.null");
  }
  EXPECT_EQ(modar_tracker_pose(nullptr, 0, &pose), 0);
  EXPECT_EQ(modar_tracker_camera(nullptr, &camera), 0.0);
  EXPECT_EQ(modar_tracker_reason(nullptr), -1);
  EXPECT_STREQ(modar_reason_text(-1), "unknown");
  EXPECT_STREQ(modar_reason_text(MODAR_REASON_CURVED), "curved");
  EXPECT_STREQ(modar_reason_text(MODAR_REASON_AT_THE_EDGE), "at the edge");
  EXPECT_STREQ(modar_reason_text(MODAR_REASON_AT_THE_EDGE + 1), "unknown");
  modar_camera_default(8, 8, nullptr);
  modar_projection(nullptr, 1, 2, matrix);
  modar_view(nullptr, matrix);
  modar_item_place(nullptr, &scene, &pose);
  modar_item_place(&item, nullptr, &pose);
  modar_renderer_render(nullptr, &picture, &drawing);
  modar_renderer_draw(nullptr, &surface, &picture, &drawing);
  modar_renderer_observe(nullptr, &picture, &drawing);
  modar_renderer_set_options(nullptr, nullptr);
  modar_render_options_default(nullptr);
  modar_renderer_show(nullptr, 8, 8);
  modar_renderer_read_rgba(nullptr, nullptr);
  modar_renderer_stats(nullptr, &stats);
  EXPECT_EQ(modar_renderer_gpu_bytes(nullptr), 0u);
  EXPECT_EQ(modar_pick(nullptr, &drawing, 0, 0, &hit), 0);
  modar_surface_to_frame(nullptr, &camera, 0, 0, nullptr, nullptr);
}

TEST_F(CapiTest, NamesTheStrideThatIsWrong) {
  auto error = sized<modar_error>();
  auto picture = sized<modar_picture>();
  std::vector<std::uint8_t> bytes(64 * 48 * 4);
  picture.width = 64;
  picture.height = 48;
  std::fill(picture.planes, picture.planes + 3, bytes.data());
  const std::tuple<int, std::size_t, std::ptrdiff_t> rows[] = {
      {MODAR_RGB, 0, 192}, {MODAR_RGBA, 0, 256}, {MODAR_NV21, 0, 64},       {MODAR_NV12, 1, 64},
      {MODAR_I420, 1, 32}, {MODAR_I420, 2, 32},  {MODAR_YUV_420_888, 2, 63}};
  std::vector<std::uint8_t> gray(64 * 48);
  for (const auto& [format, plane, least] : rows) {
    picture.format = format;
    picture.chroma_step = 2;
    std::fill(picture.strides, picture.strides + 3, 256);
    picture.strides[plane] = least;
    EXPECT_EQ(modar_gray(&picture, gray.data(), &error), MODAR_OK) << format << error.cause;
    picture.strides[plane] = least - 1;
    EXPECT_EQ(modar_gray(&picture, gray.data(), &error), MODAR_USAGE) << format;
    EXPECT_STREQ(error.code, "capi.stride") << format;
    const std::string cause = error.cause;
    EXPECT_NE(cause.find("plane " + std::to_string(plane)), std::string::npos) << cause;
    EXPECT_NE(cause.find(std::to_string(least - 1)), std::string::npos) << cause;
  }
  picture.format = 9;
  EXPECT_EQ(modar_gray(&picture, gray.data(), &error), MODAR_USAGE);
  picture.format = MODAR_YUV_420_888;
  picture.chroma_step = 3;
  EXPECT_EQ(modar_gray(&picture, gray.data(), &error), MODAR_USAGE);
  EXPECT_STREQ(error.where, "chroma_step");
}

TEST(CapiTexts, AreHandedOutByLanguage) {
  BundleContent content = test::pattern_content();
  const std::string name = "box";
  content.meta =
      R"({"tool":"test","texts":[{"text":{"el":"Βάζο","en":"A \"red\" vase,\u00e9\ud83c\udffa"},"pattern":")" +
      name + R"("},{"pattern":"other","text":{"de":"Nichts"}},{"pattern":")" + name +
      R"(","model":"m","text":{"en":"from Athens."},"alt":{"en":"A vase from Athens."}}]})";
  const auto bytes = test::encode(content);
  modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), nullptr);
  ASSERT_NE(bundle, nullptr);
  std::string languages;
  char text[64];
  for (std::uint32_t i = 0; modar_language(bundle, i, text, sizeof text) != 0; ++i)
    languages += std::string(text) + " ";
  EXPECT_EQ(languages, "el en de ");
  EXPECT_EQ(modar_pattern_text(bundle, 0, MODAR_TEXT, "en", text, sizeof text), 32u);
  EXPECT_STREQ(text, "A \"red\" vase,\xC3\xA9\xF0\x9F\x8F\xBA from Athens.");
  EXPECT_EQ(modar_pattern_text(bundle, 0, MODAR_ALT_TEXT, "en", text, 8), 19u);
  EXPECT_STREQ(text, "A vase ");
  EXPECT_EQ(modar_pattern_text(bundle, 0, MODAR_TEXT, "el", text, sizeof text), 8u);
  EXPECT_EQ(modar_pattern_text(bundle, 0, MODAR_TEXT, "de", text, sizeof text), 0u);
  EXPECT_EQ(modar_pattern_text(bundle, 99, MODAR_TEXT, "en", text, sizeof text), 0u);
  modar_bundle_close(bundle);
}

/// A triangle of sides 1 that stands upright on the pattern, facing its lower edge, a quarter to
/// the right of its centre.
BundleContent standing_triangle() {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, {one_triangle()});
  BundleContent content = std::move(maker.content);
  const BundleContent pattern = test::pattern_content();
  content.patterns = pattern.patterns;
  content.parameter_sets = pattern.parameter_sets;
  for (auto& each : content.patterns) each.name = content.models[0].name;
  for (auto& each : content.parameter_sets) each.name = content.models[0].name;
  const float half = std::sqrt(0.5f);
  content.scenes = {{0, 0, 0.5f, {0.25f, 0.0f, 0.5f}, {half, 0.0f, 0.0f, half}, {}}};
  return content;
}

TEST(CapiOrbit, GoesAroundWhatStandsOnAPattern) {
  const auto bytes = test::encode(standing_triangle());
  auto error = sized<modar_error>();
  modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), &error);
  ASSERT_NE(bundle, nullptr) << error.code << error.where << error.cause;
  float box[2][3] = {{7}, {7}};
  EXPECT_EQ(modar_pattern_bounds(bundle, 1, box[0], box[1]), 0);
  EXPECT_EQ(box[0][0], 7);
  ASSERT_EQ(modar_pattern_bounds(bundle, 0, box[0], box[1]), 1);
  const float wanted[2][3] = {{-0.25f, 0.0f, 0.0f}, {0.75f, 0.0f, 1.0f}};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(box[i / 3][i % 3], wanted[i / 3][i % 3], 0.002) << i;

  auto camera = sized<modar_camera>();
  camera.width = 300;
  camera.height = 200;
  auto pose = sized<modar_pose>();
  const auto orbit = [&](std::uint32_t pattern, double turn, double tilt, double zoom) {
    const modar_turntable from{sizeof from, turn, tilt, zoom};
    return modar_orbit(bundle, pattern, &from, &camera, &pose);
  };
  EXPECT_EQ(orbit(1, 0, 0, 1), 0);
  EXPECT_EQ(orbit(0, 0, 0, 0), 0);
  // Where a point of the pattern's space is seen.
  const auto pixel = [&](double x, double y, double z) {
    const double at[3] = {x, y, z};
    double eye[3];
    for (int row = 0; row < 3; ++row) {
      eye[row] = static_cast<double>(pose.translation[row]);
      for (int k = 0; k < 3; ++k)
        eye[row] += static_cast<double>(pose.rotation[3 * row + k]) * at[k];
    }
    EXPECT_GT(eye[2], 0.0);
    return glm::dvec2(camera.cx + camera.fx * eye[0] / eye[2],
                      camera.cy + camera.fy * eye[1] / eye[2]);
  };
  for (const double turn : {0.0, 1.0, 3.0, -2.0}) {
    for (const double tilt : {0.1, 0.7, 1.5}) {
      ASSERT_EQ(orbit(0, turn, tilt, 1), 1);
      EXPECT_NEAR(glm::distance(pixel(0, 0, 0.5), {149.5, 99.5}), 0, 0.1) << turn << " " << tilt;
      const glm::dvec2 tip = pixel(0, 0, 1);
      EXPECT_LT(tip.y, 99.5) << "up is up";
      for (const glm::dvec2 seen : {tip, pixel(-1, 0, 0), pixel(1, 0, 0)}) {
        EXPECT_TRUE(seen.x > 0 && seen.x < 299 && seen.y > 0 && seen.y < 199)
            << seen.x << " " << seen.y;
      }
    }
  }
  // From the pattern's lower edge, its right is on the right; half around, on the left.
  orbit(0, 0, 0.1, 1);
  const double wide = pixel(0.75, 0, 0.5).x - pixel(-0.25, 0, 0.5).x;
  EXPECT_GT(wide, 60);
  orbit(0, 0, 0.1, 2);
  EXPECT_GT(pixel(0.75, 0, 0.5).x - pixel(-0.25, 0, 0.5).x, 1.9 * wide);
  orbit(0, 3.14159265, 0.1, 1);
  EXPECT_NEAR(pixel(0.75, 0, 0.5).x - pixel(-0.25, 0, 0.5).x, -wide, 0.1);
  // A quarter, as the content turns: its right is behind, which is higher up.
  orbit(0, 1.57079633, 0.7, 1);
  EXPECT_LT(pixel(0.75, 0, 0).y, pixel(-0.25, 0, 0).y - 5);
  modar_bundle_close(bundle);
}

TEST(CapiBounds, EnclosePicturesAndLabels) {
  modar::BundleContent content = test::acting_content();
  content.nodes[1].half_size[0] = 50;  // along y and z, as turned
  content.nodes[1].half_size[1] = 25;
  content.nodes[1].place[2] = 40;
  content.nodes[2].place[0] = -75;
  const auto bytes = test::encode(content);
  modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), nullptr);
  ASSERT_NE(bundle, nullptr);
  float low[3];
  float high[3];
  ASSERT_EQ(modar_pattern_bounds(bundle, 0, low, high), 1);
  EXPECT_EQ(low[0], -75);
  EXPECT_NEAR(low[1], -50, 1e-4);
  EXPECT_NEAR(high[1], 50, 1e-4);
  EXPECT_NEAR(high[2], 65, 1e-4);
  EXPECT_LT(high[0], 10);
  modar_bundle_close(bundle);
}

TEST(CapiActions, RunABundlesNodes) {
  modar::BundleContent content = test::acting_content();
  content.scenes.pop_back();  // of a model that no node shows
  const auto bytes = test::encode(content);
  modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), nullptr);
  ASSERT_NE(bundle, nullptr);
  ASSERT_EQ(modar_node_count(bundle), 5u);
  auto node = sized<modar_node>();
  ASSERT_EQ(modar_node_at(bundle, 2, &node), 1);
  EXPECT_EQ(node.kind, MODAR_NODE_LABEL);
  EXPECT_EQ(node.place[0], -0.75f);
  ASSERT_EQ(modar_node_at(bundle, 3, &node), 1);
  EXPECT_EQ(node.kind, MODAR_NODE_VIDEO);
  EXPECT_EQ(node.media, 1u);
  EXPECT_EQ(node.loops, 1);
  ASSERT_EQ(modar_node_at(bundle, 4, &node), 1);
  EXPECT_EQ(node.kind, MODAR_NODE_SOUND);
  EXPECT_EQ(node.media, 2u);
  EXPECT_EQ(modar_node_at(bundle, 5, &node), 0);
  auto media = sized<modar_media>();
  ASSERT_EQ(modar_media_at(bundle, 0, &media), 1);
  EXPECT_EQ(media.width, 640);
  EXPECT_EQ(media.seconds, 12.0);
  ASSERT_GT(media.byte_count, 8u);
  EXPECT_EQ(std::memcmp(media.bytes + 4, "ftyp", 4), 0);
  ASSERT_EQ(modar_media_at(bundle, 1, &media), 1);
  EXPECT_EQ(media.width, 0);
  EXPECT_EQ(media.sound, 1);
  EXPECT_EQ(modar_media_at(bundle, 2, &media), 0);
  char text[64];
  modar_node_text(bundle, 4, MODAR_CAPTIONS, "en", text, sizeof text);
  EXPECT_STREQ(text, "WEBVTT\n\n00:00.500 --> 00:02.000\nA pot.\n");
  EXPECT_EQ(modar_node_name(bundle, 2, text, sizeof text), 3u);
  EXPECT_EQ(modar_node_mark(bundle, 2, text, sizeof text), 1u);
  EXPECT_EQ(modar_node_text(bundle, 2, MODAR_TITLE, "en", text, sizeof text), 7u);
  EXPECT_STREQ(text, "The rim");
  EXPECT_EQ(modar_node_text(bundle, 2, MODAR_TITLE, "de", text, sizeof text), 0u);
  EXPECT_EQ(modar_action_address(bundle, 4, text, sizeof text), 22u);
  EXPECT_STREQ(text, "https://museum.org/pot");

  modar_screen* screen = modar_screen_create(bundle, nullptr);
  ASSERT_NE(screen, nullptr);
  const float view[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -4, 1};
  Longer<modar_item> items[8] = {};
  items[0].known.size = sizeof items[0];
  const auto item = [&](std::size_t i) { return items[i].known; };
  auto seen = sized<modar_event>();
  auto command = sized<modar_command>();
  // Found shows the pot and plays the video; the pot's first part, tapped, lets the map take its
  // place.
  ASSERT_EQ(modar_screen_step(screen, 0, &seen, 1), 1u);
  ASSERT_EQ(modar_screen_command(screen, 0, &command), 1);
  EXPECT_EQ(command.kind, MODAR_PLAY);
  EXPECT_EQ(command.node, 3u);
  EXPECT_EQ(modar_screen_items(screen, 0, view, &items[0].known, 8), 2u);
  EXPECT_EQ(item(1).node, 4u);
  EXPECT_EQ(item(0).node, 1u);
  EXPECT_EQ(item(0).scene, 1u);
  EXPECT_EQ(item(0).size, sizeof items[0]);
  EXPECT_EQ(modar_screen_waiting(screen), 1);
  modar_event events[2] = {seen, seen};
  events[1].kind = MODAR_TAP;
  events[1].subject = 0;
  events[1].material = 1;
  EXPECT_EQ(modar_screen_step(screen, 0.1, events, 2), 0u);
  EXPECT_EQ(modar_screen_items(screen, 0, view, &items[0].known, 8), 2u);
  EXPECT_EQ(item(0).node, 2u);
  EXPECT_EQ(item(0).to_eye[14], -3.75f);
  EXPECT_EQ(modar_screen_shown(screen, 0), 0);
  EXPECT_EQ(modar_screen_shown(screen, 1), 1);
  events[1].subject = 1;
  events[1].material = 0;
  ASSERT_EQ(modar_screen_step(screen, 0.2, events, 2), 2u);
  ASSERT_EQ(modar_screen_command(screen, 0, &command), 1);
  EXPECT_EQ(command.kind, MODAR_OPEN_LINK);
  EXPECT_EQ(command.action, 4u);
  ASSERT_EQ(modar_screen_command(screen, 1, &command), 1);
  EXPECT_EQ(command.kind, MODAR_SHOW_TEXT);
  EXPECT_EQ(command.node, 2u);
  EXPECT_EQ(modar_screen_command(screen, 2, &command), 0);

  auto camera = sized<modar_camera>();
  modar_camera_default(64, 64, &camera);
  auto label = sized<modar_label>();
  modar_drawing drawing{sizeof drawing, &camera, nullptr, nullptr, 0};
  ASSERT_EQ(modar_label_project(screen, 2, &drawing, view, &label), 1);
  // 64 pixels of focal length, 0.75 to the left of the middle, four away.
  EXPECT_FLOAT_EQ(label.x, 31.5f - 64 * 0.75f / 4);
  EXPECT_FLOAT_EQ(label.y, 31.5f);
  EXPECT_EQ(label.covered, 0);
  modar_item before = sized<modar_item>();
  before.node = 2;
  for (const int i : {0, 5, 10, 15}) before.to_eye[i] = 1;
  before.to_eye[14] = -2;
  drawing.items = &before;
  drawing.item_count = 1;
  ASSERT_EQ(modar_label_project(screen, 2, &drawing, view, &label), 1);
  EXPECT_EQ(label.covered, 1);
  before.to_eye[14] = -5;
  ASSERT_EQ(modar_label_project(screen, 2, &drawing, view, &label), 1);
  EXPECT_EQ(label.covered, 0);
  drawing.item_count = 0;
  EXPECT_EQ(modar_label_project(screen, 0, &drawing, view, &label), 0);
  modar_screen_reset(screen);
  EXPECT_EQ(modar_screen_shown(screen, 1), 0);
  modar_screen_destroy(screen);
  modar_bundle_close(bundle);
}

/// Draws through the C API.
class CapiDrawTest : public GlTest {
 protected:
  static constexpr int kWide = 32;
  static constexpr int kHigh = 24;
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    SceneMaker maker;
    maker.add_plain_model(Layout::kHalfColoured, {one_triangle()});
    file_ = std::make_unique<MappedBundle>(maker.content);
    bundle_ = modar_bundle_open(file_->path.c_str(), nullptr);
    renderer_ = modar_renderer_create(bundle_, nullptr, 0, nullptr);
    ASSERT_NE(renderer_, nullptr);
    ASSERT_EQ(modar_renderer_resize(renderer_, kWide, kHigh, nullptr), 0);
    modar_camera_default(kWide, kHigh, &camera_);
    for (std::size_t i = 0; i < luma_.size(); ++i)
      luma_[i] = static_cast<std::uint8_t>(60 + i * 7 % 120);
    for (std::size_t i = 0; i < u_.size(); ++i) {
      u_[i] = static_cast<std::uint8_t>(90 + i % 16 * 4);
      v_[i] = static_cast<std::uint8_t>(160 - i % 12 * 5);
    }
  }
  void TearDown() override {
    modar_renderer_destroy(renderer_);
    modar_bundle_close(bundle_);
  }
  std::vector<std::uint8_t> drawn(const modar_picture* picture,
                                  const std::vector<modar_item>& items = {}) {
    std::vector<std::uint8_t> rgba(std::size_t{4} * kWide * kHigh);
    const modar_drawing drawing{sizeof drawing, &camera_, nullptr, items.data(), items.size()};
    modar_renderer_render(renderer_, picture, &drawing);
    modar_renderer_read_rgba(renderer_, rgba.data());
    return rgba;
  }
  static int farthest(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
    int most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
    return most;
  }
  modar_picture yuv(int format) const {
    auto picture = sized<modar_picture>();
    picture.format = format;
    picture.width = kWide;
    picture.height = kHigh;
    picture.full_range = 1;
    picture.planes[0] = luma_.data();
    picture.planes[1] = u_.data();
    picture.planes[2] = v_.data();
    picture.strides[0] = kWide;
    picture.strides[1] = picture.strides[2] = kWide / 2;
    picture.chroma_step = 1;
    return picture;
  }

  std::unique_ptr<MappedBundle> file_;
  modar_bundle* bundle_ = nullptr;
  modar_renderer* renderer_ = nullptr;
  modar_camera camera_ = sized<modar_camera>();
  std::vector<std::uint8_t> luma_ = std::vector<std::uint8_t>(std::size_t{kWide} * kHigh);
  std::vector<std::uint8_t> u_ = std::vector<std::uint8_t>(luma_.size() / 4);
  std::vector<std::uint8_t> v_ = u_;
};

TEST_F(CapiDrawTest, TakesAndroidsPlanesHoweverTheyLie) {
  modar_picture picture = yuv(MODAR_I420);
  const std::vector<std::uint8_t> expected = drawn(&picture);
  picture.format = MODAR_YUV_420_888;
  EXPECT_EQ(farthest(drawn(&picture), expected), 0);
  std::vector<std::uint8_t> pairs(2 * u_.size());
  for (const int first : {0, 1}) {  // V before U as in NV21, U before V
    for (std::size_t i = 0; i < u_.size(); ++i) {
      pairs[2 * i + static_cast<std::size_t>(1 - first)] = u_[i];
      pairs[2 * i + static_cast<std::size_t>(first)] = v_[i];
    }
    picture.planes[1] = pairs.data() + 1 - first;
    picture.planes[2] = pairs.data() + first;
    picture.strides[1] = picture.strides[2] = kWide;
    picture.chroma_step = 2;
    EXPECT_LE(farthest(drawn(&picture), expected), 1) << first;
  }
  // Two planes with gaps, which no format of GL has.
  std::vector<std::uint8_t> apart(2 * v_.size());
  for (std::size_t i = 0; i < v_.size(); ++i) apart[2 * i] = v_[i];
  picture.planes[1] = pairs.data();
  picture.planes[2] = apart.data();
  EXPECT_EQ(farthest(drawn(&picture), expected), 0);
  picture.strides[2] = kWide - 2;  // too short: refused, nothing is drawn
  const std::vector<std::uint8_t> refused = drawn(&picture);
  EXPECT_EQ(refused[0] + refused[1] + refused[2], 0);
}

TEST_F(CapiDrawTest, TakesRgbaAsRgb) {
  std::vector<std::uint8_t> rgb(std::size_t{3} * kWide * kHigh);
  std::vector<std::uint8_t> rgba(std::size_t{4} * kWide * kHigh, 77);
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] = static_cast<std::uint8_t>(i * 31 + i / 97);
    rgba[i / 3 * 4 + i % 3] = rgb[i];
  }
  auto picture = sized<modar_picture>();
  picture.width = kWide;
  picture.height = kHigh;
  picture.planes[0] = rgb.data();
  picture.strides[0] = std::ptrdiff_t{3} * kWide;
  const std::vector<std::uint8_t> expected = drawn(&picture);
  EXPECT_EQ(expected[4], rgb[3]);
  picture.format = MODAR_RGBA;
  picture.planes[0] = rgba.data();
  picture.strides[0] = std::ptrdiff_t{4} * kWide;
  EXPECT_EQ(farthest(drawn(&picture), expected), 0);
}

TEST_F(CapiDrawTest, ShowsThroughAnItemOfSomeOpacity) {
  auto item = sized<modar_item>();
  for (const int i : {0, 5, 10, 15}) item.to_eye[i] = 1.0f;
  item.to_eye[14] = -2.0f;
  const modar_picture picture = yuv(MODAR_I420);
  const std::vector<std::uint8_t> behind = drawn(&picture);
  const std::vector<std::uint8_t> solid = drawn(&picture, {item});
  ASSERT_GT(farthest(behind, solid), 40);
  item.opacity = 1.0f;
  EXPECT_EQ(farthest(drawn(&picture, {item}), solid), 0);
  item.opacity = 0.25f;
  const std::vector<std::uint8_t> faded = drawn(&picture, {item});
  for (std::size_t i = 0; i < faded.size(); ++i) {
    if (i % 4 == 3) continue;
    EXPECT_NEAR(faded[i], 0.25 * solid[i] + 0.75 * behind[i], 2.1) << i;
  }
  // Two copies, of which one fades, share no draw call.
  modar_item other = item;
  other.opacity = 0.0f;
  other.to_eye[12] = 30.0f;
  EXPECT_EQ(farthest(drawn(&picture, {item, other}), faded), 0);
}

TEST_F(CapiDrawTest, StridesOverItemsOfAnotherVersion) {
  auto item = sized<modar_item>();
  for (const int i : {0, 5, 10, 15}) item.to_eye[i] = 1.0f;
  item.to_eye[14] = -2.0f;
  const std::vector<std::uint8_t> expected = drawn(nullptr, {item});
  modar_item away = item;
  away.to_eye[12] = 30.0f;
  Longer<modar_item> longer[2] = {{away, {}}, {item, {}}};
  for (Longer<modar_item>& each : longer) each.known.size = sizeof each;
  std::vector<std::uint8_t> rgba(expected.size());
  const modar_drawing drawing{sizeof drawing, &camera_, nullptr, &longer[0].known, 2};
  modar_renderer_render(renderer_, nullptr, &drawing);
  modar_renderer_read_rgba(renderer_, rgba.data());
  EXPECT_EQ(farthest(rgba, expected), 0);
  EXPECT_GT(*std::max_element(rgba.begin(), rgba.end() - 1), 0);
  longer[0].known.size = 0;  // forgotten
  modar_renderer_render(renderer_, nullptr, &drawing);
  auto stats = sized<modar_render_stats>();
  modar_renderer_stats(renderer_, &stats);
  EXPECT_EQ(stats.draw_calls, 0);
}

TEST(CapiGray, IsWhatTheStandardSays) {
  constexpr int kWide = 6;
  constexpr int kHigh = 4;
  auto picture = sized<modar_picture>();
  picture.width = kWide;
  picture.height = kHigh;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kHigh) * 31);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<std::uint8_t>(i * 37 + i * i);
  std::uint8_t gray[kWide * kHigh];
  for (const int format : {MODAR_RGB, MODAR_RGBA, MODAR_NV21}) {
    for (const int full : {0, 1}) {
      picture.format = format;
      picture.full_range = full;
      std::fill(picture.planes, picture.planes + 3, pixels.data());
      std::fill(picture.strides, picture.strides + 3, 31);
      ASSERT_EQ(modar_gray(&picture, gray, nullptr), MODAR_OK);
      for (int i = 0; i < kWide * kHigh; ++i) {
        const std::uint8_t* row = pixels.data() + 31 * (i / kWide);
        const std::uint8_t* at = row + (i % kWide) * (format == MODAR_RGB    ? 3
                                                      : format == MODAR_RGBA ? 4
                                                                             : 1);
        // ITU-R BT.601; limited range has 219 steps from 16 on.
        const double expected = format != MODAR_NV21 ? 0.299 * at[0] + 0.587 * at[1] + 0.114 * at[2]
                                : full != 0          ? at[0]
                                            : std::clamp((at[0] - 16) * 255.0 / 219.0, 0.0, 255.0);
        EXPECT_NEAR(gray[i], expected, 0.51) << format << " " << full << " " << i;
      }
    }
  }
}

TEST_F(CapiTest, StatesItsVersion) {
  EXPECT_EQ(modar_version(), static_cast<std::uint32_t>(MODAR_VERSION_NUMBER));
}

}  // namespace
}  // namespace modar
