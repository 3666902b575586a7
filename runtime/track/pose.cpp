// Plane geometry: homographies of four points, closed-form pose, its refinement, rotation vectors.
#include "modar/pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <glm/geometric.hpp>

#include "plane_geometry.hpp"

namespace modar {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Steps of Levenberg-Marquardt: bounds the time of points without a solution; others stop earlier.
constexpr int kRefineSteps = 30;
constexpr double kDegenerateArea = 1e-6;   // of normalised points, whose mean distance is 1
constexpr double kDegenerateAngle = 1e-6;  // sine between r1 and r2

Eigen::Matrix3d to_eigen(const glm::dmat3& m) {
  Eigen::Matrix3d out;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) out(row, column) = m[column][row];
  }
  return out;
}

glm::dmat3 to_glm(const Eigen::Matrix3d& m) {
  glm::dmat3 out;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) out[column][row] = m(row, column);
  }
  return out;
}

tl::unexpected<Error> degenerate(const char* cause) {
  return fail(ExitCode::kInvalidInput, "pose.degenerate", "", cause,
              "give four corners of which no three are on a line");
}

/// Similarity that normalises four points to mean 0 and mean distance 1; false where it cannot.
bool normalisation(std::span<const glm::dvec2, 4> points, Eigen::Matrix3d& similarity) {
  glm::dvec2 mean(0.0);
  for (const glm::dvec2& p : points) mean += 0.25 * p;
  double distance = 0.0;
  for (const glm::dvec2& p : points) distance += 0.25 * glm::length(p - mean);
  if (!std::isfinite(distance) || distance <= 0.0) return false;
  similarity << 1.0 / distance, 0, -mean.x / distance, 0, 1.0 / distance, -mean.y / distance, 0, 0,
      1;
  return similarity.allFinite();
}

/// The projective map that takes the basis e1, e2, e3, (1,1,1) to four points; false where three of
/// them are collinear.
bool basis_to_points(std::span<const glm::dvec2, 4> points, const Eigen::Matrix3d& similarity,
                     Eigen::Matrix3d& basis) {
  std::array<Eigen::Vector3d, 4> p;
  for (std::size_t i = 0; i < 4; ++i)
    p[i] = similarity * Eigen::Vector3d(points[i].x, points[i].y, 1);
  for (std::size_t skip = 0; skip < 4; ++skip) {
    Eigen::Matrix3d triangle;
    triangle << p[(skip + 1) % 4], p[(skip + 2) % 4], p[(skip + 3) % 4];
    if (!(std::abs(triangle.determinant()) > kDegenerateArea)) return false;
  }
  basis << p[0], p[1], p[2];
  const Eigen::Vector3d weights = basis.inverse() * p[3];
  basis = basis * weights.asDiagonal();
  return basis.allFinite();
}

/// Sum of squared distances, and the normal equations of the six increments (rotation on the left,
/// then translation): of the matrix the lower triangle, which is all that the solver reads.
/// Infinite cost if a point is not in front of the camera.
struct NormalEquations {
  Matrix6 jtj = Matrix6::Zero();
  Vector6 jtr = Vector6::Zero();
  double cost = 0.0;
};

/// Points of a plane (z = 0) or of space: one function for both, since two of it are 2 KB.
struct PointList {
  const double* numbers;
  std::size_t dimensions;
  std::size_t count;

  explicit PointList(std::span<const glm::dvec2> points)
      : numbers(reinterpret_cast<const double*>(points.data())),
        dimensions(2),
        count(points.size()) {}
  explicit PointList(std::span<const glm::dvec3> points)
      : numbers(reinterpret_cast<const double*>(points.data())),
        dimensions(3),
        count(points.size()) {}
  [[nodiscard]] glm::dvec3 operator[](std::size_t i) const {
    const double* p = numbers + i * dimensions;
    return {p[0], p[1], dimensions == 3 ? p[2] : 0.0};
  }
};

/// Written out, not as products of Eigen's: in builds for size those take five times the
/// instructions.
NormalEquations normal_equations(const Camera& camera, const PointList& world,
                                 std::span<const glm::dvec2> pixels,
                                 const Eigen::Matrix3d& rotation,
                                 const Eigen::Vector3d& translation) {
  NormalEquations out;
  double jtj[6][6] = {};
  double jtr[6] = {};
  for (std::size_t i = 0; i < world.count; ++i) {
    const glm::dvec3 point = world[i];
    const auto turned = [&](int row) {
      return rotation(row, 0) * point.x + rotation(row, 1) * point.y + rotation(row, 2) * point.z;
    };
    const double tx = turned(0);
    const double ty = turned(1);
    const double tz = turned(2);
    const double depth = tz + translation.z();
    if (!(depth > 0.0)) {
      out.cost = std::numeric_limits<double>::infinity();
      return out;
    }
    const double inverse_z = 1.0 / depth;
    const double u = (tx + translation.x()) * inverse_z;
    const double v = (ty + translation.y()) * inverse_z;
    const double fx = camera.fx * inverse_z;
    const double fy = camera.fy * inverse_z;
    const double rx = camera.fx * u + camera.cx - pixels[i].x;
    const double ry = camera.fy * v + camera.cy - pixels[i].y;
    // A small rotation w on the left moves the point by w x turned.
    const double jx[6] = {-fx * u * ty, fx * (tz + u * tx), -fx * ty, fx, 0.0, -fx * u};
    const double jy[6] = {-fy * (tz + v * ty), fy * v * tx, fy * tx, 0.0, fy, -fy * v};
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column <= row; ++column) {
        jtj[row][column] += jx[row] * jx[column] + jy[row] * jy[column];
      }
      jtr[row] += jx[row] * rx + jy[row] * ry;
    }
    out.cost += rx * rx + ry * ry;
  }
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column <= row; ++column) out.jtj(row, column) = jtj[row][column];
    out.jtr(row) = jtr[row];
  }
  return out;
}

/// Rodrigues' formula by quaternions, without a libm, whose sines differ in their last bits from
/// phone to phone: a small part of the turn as a power series, then doubled.
Eigen::Matrix3d exponential(const Eigen::Vector3d& vector) {
  constexpr double kSmall = 1.0 / 16;  // the square up to which the series below are exact to 1e-17
  constexpr int kDoublings = 64;       // bounds the loop where the vector is not finite
  Eigen::Vector3d half = 0.5 * vector;
  double x = half.squaredNorm();
  int doublings = 0;
  for (; x > kSmall && doublings < kDoublings; ++doublings) {
    half *= 0.5;
    x *= 0.25;
  }
  double cosine = 1.0;
  double sine = 1.0;  // over the angle
  double even = 1.0;
  double odd = 1.0;
  for (int n = 1; n <= 6; ++n) {
    even *= -x / ((2 * n - 1) * (2 * n));
    odd *= -x / ((2 * n) * (2 * n + 1));
    cosine += even;
    sine += odd;
  }
  Eigen::Quaterniond turn(cosine, sine * half.x(), sine * half.y(), sine * half.z());
  for (; doublings > 0; --doublings) {
    const double w = turn.w();
    turn.w() = w * w - turn.vec().squaredNorm();
    turn.vec() *= 2.0 * w;
  }
  return turn.toRotationMatrix();
}

/// Nearest rotation matrix (ModAR Eq. 4-5): U V^T of its singular value decomposition.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

Pose refine_over(const Camera& camera, const PointList& world, std::span<const glm::dvec2> pixels,
                 const Pose& start) {
  Eigen::Matrix3d rotation = to_eigen(start.rotation);
  Eigen::Vector3d translation(start.translation.x, start.translation.y, start.translation.z);
  NormalEquations now = normal_equations(camera, world, pixels, rotation, translation);
  if (!std::isfinite(now.cost)) return start;
  const double start_cost = now.cost;
  double damping = 1e-4;
  for (int step = 0; step < kRefineSteps; ++step) {
    Matrix6 damped = now.jtj;
    damped.diagonal() *= 1.0 + damping;
    const Vector6 change = solve_symmetric(damped, Vector6(-now.jtr));
    if (!change.allFinite()) break;
    const Eigen::Matrix3d next_rotation = exponential(change.head<3>()) * rotation;
    const Eigen::Vector3d next_translation = translation + change.tail<3>();
    const NormalEquations next =
        normal_equations(camera, world, pixels, next_rotation, next_translation);
    const bool settled = std::abs(now.cost - next.cost) <= 1e-12 * now.cost;
    if (!(next.cost < now.cost)) {
      if (settled || damping > 1e8) break;
      damping *= 10.0;
      continue;
    }
    rotation = next_rotation;
    translation = next_translation;
    now = next;
    damping = std::max(damping * 0.1, 1e-12);
    if (settled) break;
  }
  if (!(now.cost < start_cost)) return start;
  Pose pose;
  pose.rotation = to_glm(nearest_rotation(rotation));
  pose.translation = {translation.x(), translation.y(), translation.z()};
  return pose;
}

}  // namespace

std::array<glm::dvec2, 4> pattern_corners(int width, int height) {
  const double longest = std::max(width, height);
  const double w = width / longest;
  const double h = height / longest;
  return {glm::dvec2{-w, h}, glm::dvec2{w, h}, glm::dvec2{w, -h}, glm::dvec2{-w, -h}};
}

Result<glm::dmat3> homography_from_points(std::span<const glm::dvec2, 4> from,
                                          std::span<const glm::dvec2, 4> to) {
  Eigen::Matrix3d normal_from;
  Eigen::Matrix3d normal_to;
  if (!normalisation(from, normal_from) || !normalisation(to, normal_to)) {
    return degenerate("the points are equal or not finite");
  }
  Eigen::Matrix3d basis_from;
  Eigen::Matrix3d basis_to;
  if (!basis_to_points(from, normal_from, basis_from) ||
      !basis_to_points(to, normal_to, basis_to)) {
    return degenerate("three of the points are on a line");
  }
  Eigen::Matrix3d h = normal_to.inverse() * basis_to * basis_from.inverse() * normal_from;
  h /= h.norm();
  if (!h.allFinite()) return degenerate("the points have no homography");
  // h33 = 0 means that the origin of `from` maps to infinity: the scale of norm 1 stays.
  if (std::abs(h(2, 2)) > 1e-12) h /= h(2, 2);
  return to_glm(h);
}

Result<Pose> pose_from_homography(const Camera& camera, const glm::dmat3& homography) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera.fx;
  k(1, 1) = camera.fy;
  k(0, 2) = camera.cx;
  k(1, 2) = camera.cy;
  Eigen::Matrix3d m = k.inverse() * to_eigen(homography);
  const double length = m.col(0).norm();
  if (!m.allFinite() || !(length > 0.0)) return degenerate("the homography is not finite or zero");
  double lambda = 1.0 / length;
  if (m(2, 2) < 0.0) lambda = -lambda;
  m *= lambda;
  if (!m.allFinite() || !(m(2, 2) > 0.0))
    return degenerate("the pattern is not in front of the camera");
  const Eigen::Vector3d r3 = m.col(0).cross(m.col(1));
  const double second = m.col(1).norm();
  if (!(r3.norm() > kDegenerateAngle * second) || !(second > kDegenerateAngle)) {
    return degenerate("the homography maps the plane to a line");
  }
  Eigen::Matrix3d approximate;
  approximate << m.col(0), m.col(1), r3;
  Pose pose;
  pose.rotation = to_glm(nearest_rotation(approximate));
  pose.translation = {m(0, 2), m(1, 2), m(2, 2)};
  return pose;
}

Pose refine_pose(const Camera& camera, std::span<const glm::dvec2> world,
                 std::span<const glm::dvec2> pixels, const Pose& start) {
  return refine_over(camera, PointList(world), pixels, start);
}

Pose refine_pose(const Camera& camera, std::span<const glm::dvec3> world,
                 std::span<const glm::dvec2> pixels, const Pose& start) {
  return refine_over(camera, PointList(world), pixels, start);
}

glm::dvec3 rotation_vector(const glm::dmat3& rotation) {
  // The other way: the turn is halved until the series of the arc sine is short.
  constexpr double kSmall = 1.0 / 64;  // square of the sine up to which it is exact to 1e-17
  constexpr int kHalvings = 8;         // 3 for half a turn; more where the matrix is no rotation
  Eigen::Quaterniond turn(to_eigen(rotation));
  turn.normalize();
  if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
  double scale = 2.0;
  for (int i = 0; i < kHalvings && turn.vec().squaredNorm() > kSmall; ++i) {
    const double w = std::sqrt(0.5 * (1.0 + turn.w()));
    turn.vec() *= 0.5 / w;
    turn.w() = w;
    scale *= 2.0;
  }
  const double x = turn.vec().squaredNorm();
  double sum = 1.0;  // of asin(s) / s
  double term = 1.0;
  for (int n = 1; n <= 8; ++n) {
    term *= x * (2 * n - 1) / (2 * n);
    sum += term / (2 * n + 1);
  }
  const Eigen::Vector3d vector = scale * sum * turn.vec();
  return {vector.x(), vector.y(), vector.z()};
}

glm::dmat3 rotation_matrix(const glm::dvec3& vector) {
  return to_glm(exponential(Eigen::Vector3d(vector.x, vector.y, vector.z)));
}

glm::mat4 gl_view(const Pose& pose, const glm::dmat4x3& stretch) {
  // From floats, as modar_pose holds them: an app that draws by those gets the player's picture.
  const glm::dmat3 rotation(glm::mat3(pose.rotation));
  glm::dmat4 view(rotation * glm::dmat4x3(glm::mat4x3(stretch)));
  view[3] += glm::dvec4(glm::vec3(pose.translation), 0.0);
  // GL's camera has y up and z backward.
  for (int column = 0; column < 4; ++column) {
    view[column][1] = -view[column][1];
    view[column][2] = -view[column][2];
  }
  return glm::mat4(view);
}

}  // namespace modar
