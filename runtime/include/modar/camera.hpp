// The camera's interior orientation (K and distortion) and the projection matrix it gives GL.
#pragma once

#include <array>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

namespace modar {

/// Pinhole with Brown-Conrady distortion, as OpenCV has it. Pixels; the centre of the top-left
/// pixel is (0, 0). The ModAR paper has one camera constant c: fx = fy = c.
struct Camera {
  int width = 0;
  int height = 0;
  double fx = 0;
  double fy = 0;
  double cx = 0;
  double cy = 0;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3
};

/// The camera that is assumed when none is given: focal length = longer side of
/// the frame, principal point = centre.
Camera default_camera(int width, int height);

/// The same lens for frames of another size (same aspect: scaled; other aspect: centre crop).
Camera scaled_camera(const Camera& camera, int width, int height);

/// Distorted pixel to that of a pinhole camera with the same K (fixed-point iteration).
glm::dvec2 undistort(const Camera& camera, glm::dvec2 pixel);

/// A point in camera axes (x right, y down, z forward) to a distorted pixel. z must be > 0.
glm::dvec2 project(const Camera& camera, glm::dvec3 point);

/// OpenGL projection from the intrinsics (ModAR Eq. 7: NDC x M_Persp). Maps camera axes of GL (x
/// right, y up, z backward) to clip space such that pixel centres of the frame land on pixel
/// centres of a viewport that shows the whole frame. 0 < near < far.
glm::mat4 gl_projection(const Camera& camera, double near_plane, double far_plane);

}  // namespace modar
