// ModAR Eq. 1 to 6 against OpenCV, and what has no pose.
#include "modar/pose.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "runtime/track/plane_geometry.hpp"
#include "synthetic.hpp"

namespace modar {
namespace {

using Quad = std::array<glm::dvec2, 4>;

Camera pinhole() {
  Camera camera = default_camera(1280, 720);
  camera.fx = 1180;
  camera.fy = 1180;
  camera.cx = 655;
  camera.cy = 341;
  return camera;
}

double difference(const glm::dmat3& ours, const cv::Mat& theirs) {
  double largest = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      largest = std::max(largest, std::abs(ours[column][row] - theirs.at<double>(row, column)));
    }
  }
  return largest;
}

std::vector<cv::Point2f> floats(const Quad& quad) {
  std::vector<cv::Point2f> out;
  for (const glm::dvec2& p : quad)
    out.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  return out;
}

Quad quad_of(const std::vector<cv::Point2d>& points) {
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = {points[i].x, points[i].y};
  return quad;
}

cv::Mat to_mat(const glm::dmat3& m) {
  cv::Mat out(3, 3, CV_64F);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.at<double>(row, column) = m[column][row];
  }
  return out;
}

TEST(Pose, Equation1GivesTheCornersOfTheArticlesPatterns) {
  // BOTERO is 348 x 717: W = 348 / 717, H = 1; SCYTHE 300 x 245: W = 1, H = 245 / 300.
  const auto tall = pattern_corners(348, 717);
  EXPECT_DOUBLE_EQ(tall[1].x, 348.0 / 717.0);
  EXPECT_DOUBLE_EQ(tall[1].y, 1.0);
  const auto wide = pattern_corners(300, 245);
  const double h = 245.0 / 300.0;
  const Quad expected = {glm::dvec2{-1, h}, {1, h}, {1, -h}, {-1, -h}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_DOUBLE_EQ(wide[i].x, expected[i].x);
    EXPECT_DOUBLE_EQ(wide[i].y, expected[i].y);
  }
}

TEST(Pose, HomographyOfFourPointsAsOpenCv) {
  const Quad from = {glm::dvec2{-1, 0.7}, {1, 0.7}, {1, -0.7}, {-1, -0.7}};
  const Quad to = {glm::dvec2{212, 148}, {905, 95}, {1010, 600}, {180, 655}};
  const auto h = homography_from_points(from, to);
  ASSERT_TRUE(h);
  const cv::Mat direct = cv::getPerspectiveTransform(floats(from), floats(to));
  const cv::Mat fitted = cv::findHomography(floats(from), floats(to));
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double expected = direct.at<double>(row, column);
      EXPECT_NEAR((*h)[column][row], expected, 1e-4 * std::max(1.0, std::abs(expected)));
      EXPECT_NEAR((*h)[column][row], fitted.at<double>(row, column),
                  1e-4 * std::max(1.0, std::abs(expected)));
    }
  }
}

TEST(Pose, HomographyWhoseOriginMapsToInfinityIsStillAnswered) {
  // (x, y) -> (1 / x, y / x), which has h33 = 0.
  const Quad from = {glm::dvec2{1, 1}, {2, 1}, {2, 2}, {1, 2}};
  const Quad to = {glm::dvec2{1, 1}, {0.5, 0.5}, {0.5, 1}, {1, 2}};
  const auto h = homography_from_points(from, to);
  ASSERT_TRUE(h);
  const glm::dvec3 mapped = *h * glm::dvec3(4, 3, 1);
  EXPECT_NEAR(mapped.x / mapped.z, 0.25, 1e-9);
  EXPECT_NEAR(mapped.y / mapped.z, 0.75, 1e-9);
}

TEST(Pose, DegeneratePointsHaveNoHomography) {
  const Quad square = {glm::dvec2{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<Quad> bad = {
      {glm::dvec2{0, 0}, {10, 0}, {20, 0}, {5, 7}},      // three collinear
      {glm::dvec2{0, 0}, {10, 10}, {20, 20}, {30, 30}},  // all collinear: zero area
      {glm::dvec2{3, 3}, {3, 3}, {3, 3}, {3, 3}},        // one point
      {glm::dvec2{0, 0}, {0, 0}, {20, 0}, {0, 20}},      // two equal
      {glm::dvec2{0, nan}, {10, 0}, {10, 10}, {0, 10}},  // not a number
      {glm::dvec2{0, 0}, {inf, 0}, {10, 10}, {0, 10}},
      {glm::dvec2{0, 0}, {1e308, 0}, {1e308, 1e308}, {-1e308, 1e308}},
  };
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const auto to = homography_from_points(square, bad[i]);
    ASSERT_FALSE(to) << i;
    EXPECT_EQ(to.error().code, "pose.degenerate");
    EXPECT_FALSE(homography_from_points(bad[i], square)) << i;
  }
}

TEST(Pose, ClosedFormFindsThePoseThatMadeTheHomography) {
  const Camera camera = pinhole();
  for (double tilt = -60; tilt <= 60; tilt += 20) {
    for (double roll = -180; roll <= 180; roll += 45) {
      const test::View view = test::look_at(3.0, tilt, 30, roll, 0.2, -0.1);
      cv::Matx33d plane = view.rotation;
      for (int row = 0; row < 3; ++row) plane(row, 2) = view.translation[row];
      const cv::Mat h = test::camera_matrix(camera) * cv::Mat(plane);
      glm::dmat3 homography;
      for (int row = 0; row < 3; ++row) {
        // The scale and sign of a homography are arbitrary.
        for (int column = 0; column < 3; ++column)
          homography[column][row] = -2.5 * h.at<double>(row, column);
      }
      const auto pose = pose_from_homography(camera, homography);
      ASSERT_TRUE(pose);
      EXPECT_LT(difference(pose->rotation, cv::Mat(view.rotation)), 1e-9);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(pose->translation[axis], view.translation[axis], 1e-9);
      }
    }
  }
}

// The article's Eq. 3 to 5 step by step, with OpenCV's inverse and SVD, on corners that no exact
// pose explains.
TEST(Pose, ClosedFormIsTheArticlesByOpenCvsSvd) {
  const Camera camera = pinhole();
  const Quad world = pattern_corners(400, 300);
  cv::RNG random(3);
  for (int trial = 0; trial < 30; ++trial) {
    const test::View view =
        test::look_at(random.uniform(2.0, 6.0), random.uniform(-60.0, 60.0),
                      random.uniform(0.0, 180.0), random.uniform(-180.0, 180.0));
    auto noisy = test::true_corners(cv::Mat(300, 400, CV_8UC1), view, camera);
    for (auto& p : noisy) p += cv::Point2d(random.gaussian(1.5), random.gaussian(1.5));
    const auto h = homography_from_points(world, quad_of(noisy));
    ASSERT_TRUE(h);
    const cv::Mat g = test::camera_matrix(camera).inv() * to_mat(*h);
    double lambda = 1.0 / cv::norm(g.col(0));
    if (g.at<double>(2, 2) < 0) lambda = -lambda;  // the pattern is before the camera
    cv::Mat r(3, 3, CV_64F);
    cv::Mat(lambda * g.col(0)).copyTo(r.col(0));
    cv::Mat(lambda * g.col(1)).copyTo(r.col(1));
    r.col(0).cross(r.col(1)).copyTo(r.col(2));
    const cv::SVD svd(r);
    const cv::Mat nearest = svd.u * svd.vt;
    ASSERT_NEAR(cv::determinant(nearest), 1.0, 1e-9);
    const auto pose = pose_from_homography(camera, *h);
    ASSERT_TRUE(pose);
    EXPECT_LT(difference(pose->rotation, nearest), 1e-9) << trial;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(pose->translation[axis], lambda * g.at<double>(axis, 2), 1e-9) << trial;
    }
  }
}

TEST(Pose, AMirroredPatternStillGetsARotation) {
  const Quad world = pattern_corners(4, 3);
  const Quad mirrored = {glm::dvec2{800, 200}, {400, 210}, {390, 500}, {820, 520}};
  const auto h = homography_from_points(world, mirrored);
  ASSERT_TRUE(h);
  const auto pose = pose_from_homography(pinhole(), *h);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(cv::determinant(to_mat(pose->rotation)), 1.0, 1e-9);
  EXPECT_GT(pose->translation.z, 0.0);
  // It is seen from behind: the camera's centre -R^T t is below the pattern plane.
  const cv::Mat centre =
      -to_mat(pose->rotation).t() *
      cv::Mat(cv::Vec3d(pose->translation.x, pose->translation.y, pose->translation.z));
  EXPECT_LT(centre.at<double>(2), 0.0);
}

TEST(Pose, HomographiesWithoutAPose) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  glm::dmat3 zero(0.0);
  glm::dmat3 not_a_number(nan);
  glm::dmat3 line(1.0);  // both axes of the plane fall on one line through the frame
  line[1] = line[0];
  line[2] = {0, 0, 1};
  glm::dmat3 in_camera_plane(1.0);  // the pattern's centre has depth 0
  in_camera_plane[2] = {1, 1, 0};
  for (const glm::dmat3& h : {zero, not_a_number, line, in_camera_plane}) {
    const auto pose = pose_from_homography(default_camera(640, 480), h);
    ASSERT_FALSE(pose);
    EXPECT_EQ(pose.error().code, "pose.degenerate");
  }
}

TEST(Pose, RefinementReachesOpenCvsMinimum) {
  const Camera camera = pinhole();
  const Quad world = pattern_corners(400, 300);
  const std::vector<cv::Point3d> object = {{world[0].x, world[0].y, 0},
                                           {world[1].x, world[1].y, 0},
                                           {world[2].x, world[2].y, 0},
                                           {world[3].x, world[3].y, 0}};
  cv::RNG random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const test::View view =
        test::look_at(random.uniform(2.0, 6.0), random.uniform(-55.0, 55.0),
                      random.uniform(0.0, 180.0), random.uniform(-180.0, 180.0));
    auto noisy = test::true_corners(cv::Mat(300, 400, CV_8UC1), view, camera);
    for (auto& p : noisy) p += cv::Point2d(random.gaussian(0.5), random.gaussian(0.5));
    const Quad pixels = quad_of(noisy);
    const auto h = homography_from_points(world, pixels);
    ASSERT_TRUE(h);
    const auto start = pose_from_homography(camera, *h);
    ASSERT_TRUE(start);
    const Pose refined = refine_pose(camera, world, pixels, *start);
    cv::Vec3d vector;
    cv::Vec3d translation;
    cv::solvePnP(object, noisy, test::camera_matrix(camera), cv::noArray(), vector, translation,
                 false, cv::SOLVEPNP_ITERATIVE);
    cv::Mat rotation;
    cv::Rodrigues(vector, rotation);
    EXPECT_LT(difference(refined.rotation, rotation), 1e-4) << trial;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(refined.translation[axis], translation[axis], 1e-4 * view.translation[2])
          << trial;
    }
  }
}

TEST(Pose, RefinementAnswersItsStartWhereNoStepHelps) {
  const Camera camera = pinhole();
  const Quad world = pattern_corners(400, 300);
  Pose behind;
  behind.translation = {0, 0, -3};
  const Quad pixels = {glm::dvec2{100, 100}, {500, 100}, {500, 400}, {100, 400}};
  EXPECT_EQ(refine_pose(camera, world, pixels, behind).translation, behind.translation);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Quad broken = {glm::dvec2{nan, 100}, {500, 100}, {500, 400}, {100, 400}};
  Pose ahead;
  ahead.translation = {0, 0, 3};
  EXPECT_EQ(refine_pose(camera, world, broken, ahead).translation, ahead.translation);
}

TEST(Pose, RotationVectorsAsOpenCvsRodrigues) {
  const double pi = CV_PI;
  for (const glm::dvec3& v : {glm::dvec3{0, 0, 0},
                              {1e-9, 0, 0},
                              {0.3, -0.2, 0.9},
                              {0, 2.5, 0},
                              {1.8, 1.7, -1.2},
                              {pi, 0, 0}}) {
    cv::Mat expected;
    cv::Rodrigues(cv::Vec3d(v.x, v.y, v.z), expected);
    const glm::dmat3 ours = rotation_matrix(v);
    EXPECT_LT(difference(ours, expected), 1e-12);
    // A half turn has two vectors: compare what they mean.
    EXPECT_LT(difference(rotation_matrix(rotation_vector(ours)), expected), 1e-9);
  }
  const glm::dvec3 back = rotation_vector(rotation_matrix({0.3, -0.2, 0.9}));
  EXPECT_NEAR(back.x, 0.3, 1e-12);
  EXPECT_NEAR(back.y, -0.2, 1e-12);
  EXPECT_NEAR(back.z, 0.9, 1e-12);
}

TEST(Pose, GlViewAndProjectionDrawAPointWhereOpenCvSeesIt) {
  const Camera camera = pinhole();
  const test::View view = test::look_at(4.0, 40, 70, 25, 0.3, 0.2);
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    pose.translation[row] = view.translation[row];
    for (int column = 0; column < 3; ++column)
      pose.rotation[column][row] = view.rotation(row, column);
  }
  cv::Vec3d vector;
  cv::Rodrigues(view.rotation, vector);
  std::vector<cv::Point2d> pixel;
  cv::projectPoints(std::vector<cv::Point3d>{{0.4, -0.6, 0.8}}, vector, view.translation,
                    test::camera_matrix(camera), cv::noArray(), pixel);
  const glm::vec4 clip =
      gl_projection(camera, 0.1, 100.0) * gl_view(pose) * glm::vec4(0.4f, -0.6f, 0.8f, 1.0f);
  EXPECT_NEAR(0.5 * static_cast<double>(clip.x / clip.w + 1) * 1280 - 0.5, pixel[0].x, 2e-3);
  EXPECT_NEAR(0.5 * static_cast<double>(1 - clip.y / clip.w) * 720 - 0.5, pixel[0].y, 2e-3);
}

TEST(SymmetricSolver, SolvesAsOpenCvAndLeavesOutWhatNothingTells) {
  cv::RNG random(5);
  for (const int n : {1, 3, 6, 8}) {
    cv::Mat rows(n + 4, n, CV_64F);
    random.fill(rows, cv::RNG::NORMAL, 0, 3);
    cv::Mat a = rows.t() * rows;
    cv::Mat right(n, 1, CV_64F);
    random.fill(right, cv::RNG::NORMAL, 0, 1);
    cv::Mat expected;
    cv::solve(a, right, expected, cv::DECOMP_SVD);
    cv::Mat solved = right.clone();
    solve_symmetric(n, 1, a.ptr<double>(), solved.ptr<double>());
    EXPECT_LT(cv::norm(solved, expected), 1e-10 * cv::norm(expected)) << n;
  }
  // The second unknown is twice the first, as far as these equations tell.
  std::array<double, 9> a = {1, 2, 0, 2, 4, 0, 0, 0, 5};
  std::array<double, 3> x = {3, 6, 10};
  solve_symmetric(3, 1, a.data(), x.data());
  EXPECT_NEAR(x[0] + 2 * x[1], 3, 1e-12);
  EXPECT_NEAR(x[2], 2, 1e-12);
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    a = {1, 0, 0, 0, bad, 0, 0, 0, 1};
    x = {1, 1, 1};
    solve_symmetric(3, 1, a.data(), x.data());
    EXPECT_TRUE(std::isnan(x[1]));
  }
}

}  // namespace
}  // namespace modar
