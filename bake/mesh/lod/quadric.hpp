// Sums of squared distances from planes, by which collapses are priced. Internal to lod.
#pragma once

#include <array>
#include <cstdint>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace modar {

/// The corners of a triangle that follow each: a division by three takes longer than all else that
/// is done at most triangles.
inline constexpr std::array<std::array<std::uint32_t, 2>, 3> kOtherCorners = {
    {{1, 2}, {2, 0}, {0, 1}}};

/// Squared cosine of the largest turn of a triangle in one collapse. Higher blocks good collapses,
/// lower folds triangles. [0.03, 0.75] tuned: lod
inline constexpr double kLeastTurn = 0.25;

/// Does the triangle a, b and `from` turn too far, or lose its area, when `from` goes to `to`?
inline bool turns_too_far(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& from,
                          const glm::dvec3& to) {
  const glm::dvec3 before = glm::cross(a - from, b - from);
  const glm::dvec3 after = glm::cross(a - to, b - to);
  const double dot = glm::dot(before, after);
  return !(dot > 0) || dot * dot < kLeastTurn * glm::dot(before, before) * glm::dot(after, after);
}

/// Weight of a rim edge's squared length against triangle areas in the quadrics. Higher keeps
/// outlines, lower keeps the inside. [0.25, 4] tuned: lod
inline constexpr double kRimWeight = 1.0;

/// Sum of the squared distances from planes, each weighted by its triangle's area (Garland and
/// Heckbert, "Surface simplification using quadric error metrics", 1997): p^T A p + 2 b p + c.
struct Quadric {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  glm::dvec3 b{0.0};
  double c = 0;
  double area = 0;

  /// Of a triangle by its area; zero where it has none.
  static Quadric of_triangle(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
    const glm::dvec3 cross = glm::cross(q - p, r - p);
    const double twice = glm::length(cross);
    return twice > 0 ? of_plane(cross / twice, p, 0.5 * twice) : Quadric();
  }
  /// normal: of unit length.
  static Quadric of_plane(const glm::dvec3& normal, const glm::dvec3& point, double area) {
    const glm::dvec3 n = normal * area;
    const double d = -glm::dot(normal, point);
    return {n.x * normal.x, n.y * normal.y, n.z * normal.z,
            n.x * normal.y, n.x * normal.z, n.y * normal.z,
            n * d,          area * d * d,   area};
  }
  /// Of a plane through a border's edge from p to q, across its only triangle, whose third corner
  /// is r; zero where it has no area.
  static Quadric of_border(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r,
                           double weight) {
    const glm::dvec3 edge = q - p;
    const glm::dvec3 across = glm::cross(glm::cross(edge, r - p), edge);
    const double length = glm::length(across);
    if (!(length > 0)) return {};
    return of_plane(across / length, p, weight * kRimWeight * glm::dot(edge, edge));
  }
  void operator+=(const Quadric& q) {
    xx += q.xx, yy += q.yy, zz += q.zz, xy += q.xy, xz += q.xz, yz += q.yz;
    b += q.b;
    c += q.c;
    area += q.area;
  }
  void operator*=(double factor) {
    for (double* of : {&xx, &yy, &zz, &xy, &xz, &yz, &c, &area}) *of *= factor;
    b *= factor;
  }
  [[nodiscard]] double at(const glm::dvec3& p) const {
    return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + b.x)) +
           p.y * (yy * p.y + 2 * (yz * p.z + b.y)) + p.z * (zz * p.z + 2 * b.z) + c;
  }
  /// The point where it and the square of the way there, weighted by some of its area, is least.
  [[nodiscard]] glm::dvec3 least_near(const glm::dvec3& p, double pull) const {
    const double more = pull * area;
    const double x = xx + more, y = yy + more, z = zz + more;
    const glm::dvec3 slope(xx * p.x + xy * p.y + xz * p.z + b.x,
                           xy * p.x + yy * p.y + yz * p.z + b.y,
                           xz * p.x + yz * p.y + zz * p.z + b.z);
    const double m00 = y * z - yz * yz;
    const double m01 = xz * yz - xy * z;
    const double m02 = xy * yz - xz * y;
    const double m11 = x * z - xz * xz;
    const double m12 = xy * xz - x * yz;
    const double m22 = x * y - xy * xy;
    const double determinant = x * m00 + xy * m01 + xz * m02;
    return p - glm::dvec3(m00 * slope.x + m01 * slope.y + m02 * slope.z,
                          m01 * slope.x + m11 * slope.y + m12 * slope.z,
                          m02 * slope.x + m12 * slope.y + m22 * slope.z) /
                   determinant;
  }
  /// The point where it is least; false where the planes are so nearly parallel to a line that
  /// rounding decides.
  [[nodiscard]] bool least(glm::dvec3& p) const {
    /// Of the trace, as a cube.
    constexpr double kSingular = 1e-8;
    const double m00 = yy * zz - yz * yz;
    const double m01 = xz * yz - xy * zz;
    const double m02 = xy * yz - xz * yy;
    const double determinant = xx * m00 + xy * m01 + xz * m02;
    const double trace = xx + yy + zz;
    if (!(determinant > kSingular * trace * trace * trace)) return false;
    const double m11 = xx * zz - xz * xz;
    const double m12 = xy * xz - xx * yz;
    const double m22 = xx * yy - xy * xy;
    p = glm::dvec3(m00 * b.x + m01 * b.y + m02 * b.z, m01 * b.x + m11 * b.y + m12 * b.z,
                   m02 * b.x + m12 * b.y + m22 * b.z) /
        -determinant;
    return true;
  }
};

}  // namespace modar
