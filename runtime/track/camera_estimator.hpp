// The focal length of a camera that nobody measured, and the aspects of flat patterns, from the
// views of them that are tracked. Internal to runtime/track.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "modar/camera.hpp"
#include "modar/pose.hpp"
#include "modar/tracker.hpp"

namespace modar::tracker {

/// Least squares over the focal length, each pattern's aspect and the pose of each view, of points
/// of the pattern's plane that a free homography has measured: eight numbers a view, of which six
/// are its pose's and two tell of the rest (Zhang, "A flexible new technique for camera
/// calibration", 2000; the principal point is taken to be in the frame's middle, pixels to be
/// square). What no view tells stays at its prior: the focal length within a third of the start
/// value, aspects within a few percent of their picture's.
///
/// Views alike count once, the newest one: a resting camera repeats its errors and makes nothing
/// surer. The views are few, and what they leave unexplained widens the spread.
class CameraEstimator {
 public:
  /// Allocates nothing later. camera: the start value.
  CameraEstimator(const Camera& camera, std::size_t patterns);

  /// Four places of a pattern, and where a frame shows them.
  struct View {
    std::size_t pattern = 0;
    std::array<glm::dvec2, 4> world{};   ///< TrackedPattern::to_world() at aspect 1
    std::array<glm::dvec2, 4> pixels{};  ///< of the frame, undistorted
    Pose pose;                           ///< about that of the frame
  };
  /// Whether a view of these corners would say something that the views so far do not.
  [[nodiscard]] bool is_new(std::size_t pattern, const std::array<glm::dvec2, 4>& corners) const;
  void add(const View& view);

  [[nodiscard]] CameraEstimate estimate() const { return estimate_; }
  /// Height over width of a pattern, over that of its picture's pixels.
  [[nodiscard]] double aspect(std::size_t pattern) const { return aspects_[pattern].value; }
  void clear();

 private:
  /// Sums of a pattern's views for the joint step: of its aspect, and with the focal length.
  struct Aspect {
    double value = 1;
    double matrix = 0;
    double mixed = 0;
    double vector = 0;
  };
  struct KeptView {
    View view;
    std::array<double, 18> pose_by_shared{};  ///< how the pose follows: its step, and by the two
    double cost = 0;                          ///< of the residuals, in sigmas squared
  };
  void linearise(KeptView& kept, double& matrix, double& vector);
  bool step();

  Camera camera_;
  double start_ = 0;  ///< focal length, pixels
  double sigma_ = 0;  ///< of a measured place, pixels
  std::vector<Aspect> aspects_;
  std::vector<KeptView> views_;
  CameraEstimate estimate_;
};

}  // namespace modar::tracker
