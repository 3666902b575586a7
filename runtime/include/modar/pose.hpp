// Plane geometry of one pattern: from four corners or a homography to the camera's pose.
// Source: the ModAR paper, section 3.2, Eq. 1 to 5.
#pragma once

#include <array>
#include <span>

#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "formats/base/error.hpp"
#include "modar/camera.hpp"

namespace modar {

/// World (pattern plane, z towards the viewer) to camera axes (x right, y down, z forward):
/// X_camera = rotation * X_world + translation. Lengths in pattern units (half of its largest
/// side).
struct Pose {
  glm::dmat3 rotation{1.0};
  glm::dvec3 translation{0.0};
};

/// World corners of a pattern of that size in pixels (ModAR Eq. 1): top-left, top-right,
/// bottom-right, bottom-left at (-W, H), (W, H), (W, -H), (-W, -H).
std::array<glm::dvec2, 4> pattern_corners(int width, int height);

/// The homography that takes four points to four points, scaled to h33 = 1 where it can be.
/// Errors: kInvalidInput "pose.degenerate" (three collinear, equal or non-finite points).
Result<glm::dmat3> homography_from_points(std::span<const glm::dvec2, 4> from,
                                          std::span<const glm::dvec2, 4> to);

/// Homography to camera pose (ModAR Eq. 3-5). homography: pattern plane -> undistorted pixels.
/// Deviation: its sign is chosen such that the pattern is in front of the camera, and the last
/// singular vector is flipped if det(U V^T) < 0. Errors: kInvalidInput "pose.degenerate".
Result<Pose> pose_from_homography(const Camera& camera, const glm::dmat3& homography);

/// Levenberg-Marquardt over the six parameters (rotation vector, translation), minimising the
/// squared distance between projections of plane points (z = 0) and undistorted pixels.
/// world.size() == pixels.size() >= 4. Returns the start pose if no step lowers the error.
Pose refine_pose(const Camera& camera, std::span<const glm::dvec2> world,
                 std::span<const glm::dvec2> pixels, const Pose& start);

/// The same of points in space.
Pose refine_pose(const Camera& camera, std::span<const glm::dvec3> world,
                 std::span<const glm::dvec2> pixels, const Pose& start);

/// Rotation matrix to rotation vector (axis times angle, radians) and back (Rodrigues).
glm::dvec3 rotation_vector(const glm::dmat3& rotation);
glm::dmat3 rotation_matrix(const glm::dvec3& vector);

/// Model-view matrix of GL (camera y up, z backward) for a pose (ModAR Eq. 6: M_VIEW). stretch:
/// Detection::stretch.
glm::mat4 gl_view(const Pose& pose, const glm::dmat4x3& stretch = glm::dmat4x3(1.0));

}  // namespace modar
