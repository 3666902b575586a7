// What stands still around a tracked pattern: points with their depth, learned by motion while the
// pattern is seen, from which the camera's pose follows while it is not. Internal to runtime/track.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "patch_alignment.hpp"

namespace modar::tracker {

/// A pose that follows from the surroundings, with its standard deviations.
struct ExtendedPose {
  Pose pose;
  double position_sigma = 0;  ///< of the translation, pattern units
  double rotation_sigma = 0;  ///< radians
  /// What the last motion, and what changed in the coarse picture, made of the frame before.
  std::array<Pose, 2> expected;
};

/// Standard deviation of the rotation of a pattern's own pose, radians: 0.14 degrees with 200
/// patches in place, 0.3 with 100, in one rendered room.
inline double seen_sigma(int patches) {
  constexpr double kOfPatches = 0.5;  // radians times patches
  return kOfPatches / std::max(patches, 1);
}

/// A patch of the frame that it was first seen in, and its inverse depth there.
struct MapPoint {
  Patch patch;
  Pose anchor;                 ///< of that frame
  glm::dvec2 ray;              ///< in that frame, at depth 1
  double inverse_depth = 0;    ///< 1 / pattern units
  double information = 0;      ///< of the inverse depth: 1 / variance
  double widest = 0;           ///< most pixels of the level that a unit of it has moved the point
  double anchor_position = 0;  ///< variance of the anchor's position and rotation
  double anchor_rotation = 0;
  glm::dvec2 place{};   ///< pixel of the level where it was seen last, or should be
  glm::dvec2 offset{};  ///< of where it was seen from where it should be
  double travel = 0;    ///< most pixels of the level that it was seen away from where it began
  int hits = 0;         ///< frames that showed it where it should be
  int misses = 0;       ///< frames in a row that did not
  bool in_view = false;
  bool of_pattern = true;  ///< learned while the pattern was seen
  glm::dvec2 origin{};     ///< pixel of the level where it began
  /// Motion has shown its depth, and that it goes with the pattern.
  [[nodiscard]] bool steady() const;
  /// The same, and it was learned from the pattern or seen for long: not of someone who passes by.
  [[nodiscard]] bool known() const;
  /// Whether poses may follow from it: steady, or learned since the pattern was seen and gone
  /// along.
  [[nodiscard]] bool usable() const;
};

/// What a point says of the pose: its patch's normal equations, and the Jacobians of its
/// displacement in template pixels.
struct MapPointEquations {
  PatchNormalEquations patch;
  std::array<double, 12> by_pose{};  ///< two rows of six
  glm::dvec2 by_depth{};
  const MapPoint* point = nullptr;
  double weight = 1;
};

/// What a gyroscope says of a frame's rotation, and how much that weighs in the pose's equations;
/// 0: nothing.
struct ExpectedRotation {
  glm::dmat3 rotation{1.0};
  double weight = 0;
};

/// A map of at most kMaxPoints points in the coordinates of one pattern. Allocates nothing after
/// construction. A point is an inverse depth along a ray of the frame that it was first seen in
/// (after Civera, Davison & Montiel, "Inverse depth parametrization for monocular SLAM", 2008); a
/// pose is aligned to all points in view at once, the depth of each eliminated by its estimate.
class Surroundings {
 public:
  /// Trades memory, 1.3 KB a point, for how far the camera may turn away and know the way back:
  /// some 50 are in view at a time.
  static constexpr std::size_t kMaxPoints = 192;

  explicit Surroundings(const Camera& camera);

  /// Forgets everything.
  void clear();
  /// The frame shows the pattern at that pose, with its corners there: measures the points against
  /// it, drops those that do not keep their place, adds new ones around the pattern. patches: of
  /// the pattern, that are in their place. turn: as of follow().
  void learn(const FrameView& frame, const Pose& pose, const std::array<glm::dvec2, 4>& corners,
             int patches, const glm::dvec3* turn);
  /// Whether a pose can be followed: of the steady points in view most were seen, and enough. What
  /// moves with the camera, or stays while the pattern is moved, has no depth by motion, so it is
  /// not steady.
  [[nodiscard]] bool ready() const;
  /// Share of the steady points seen last that are where this pose of a frame has them; 1 if there
  /// are no points.
  [[nodiscard]] double agreement(const FrameView& frame, const Pose& pose) const;
  /// The pose of a frame without the pattern. turn: rotation, in camera axes, of what the camera
  /// sees since the frame before, null: unknown. False if the points do not tell it; after
  /// kBridged such frames in a row everything is forgotten.
  bool follow(const FrameView& frame, const glm::dvec3* turn, ExtendedPose& out);
  /// The pattern is seen at `seen`, where the points said `followed`: moves the points learned
  /// meanwhile by the difference.
  void correct(const Pose& followed, const Pose& seen);

 private:
  void measure(const FrameView& frame, const Pose& pose);
  void add_points(const FrameView& frame, const Pose& pose,
                  const std::array<glm::dvec2, 4>* corners);
  bool add_point(const FrameView& frame, const Pose& pose, int column, int row, bool of_pattern);
  [[nodiscard]] glm::ivec2 best_corner(const GrayImage& image, int cell);
  [[nodiscard]] double expected_inverse_depth(const Pose& pose, glm::dvec2 place) const;
  [[nodiscard]] MapPoint* free_slot();
  [[nodiscard]] Pose predict(const glm::dvec3* turn) const;
  [[nodiscard]] bool enough_of_pattern() const;
  void align_coarse(const FrameView& frame, const glm::dvec3* turn, Pose& pose);
  void add_turn(const glm::dvec3* turn);
  void level_turns(const Pose& pose, int patches);
  [[nodiscard]] ExpectedRotation expected_rotation() const;
  bool align_fine(const FrameView& frame, Pose& pose, ExtendedPose& out);
  void remember(const FrameView& frame, const Pose& pose);

  const Camera& camera_;
  int level_ = 0;   ///< of the pyramid, on which patches are cut
  int coarse_ = 0;  ///< on which a frame is first aligned to the one before
  std::vector<MapPoint> points_;
  std::vector<MapPoint> coarse_points_;
  std::vector<MapPointEquations> equations_;
  std::vector<std::array<int, 3>> gradients_;  ///< products, of one cell of the frame
  std::vector<std::uint8_t> before_pixels_;    ///< coarse level of the frame before
  GrayImage before_image_;
  Pose now_;
  Pose before_;
  int known_ = 0;    ///< how many of the two
  int unknown_ = 0;  ///< frames in a row that told nothing
  int next_cell_ = 0;
  double position_variance_ = 0;  ///< of now_
  double rotation_variance_ = 0;
  double doubt_ = 1;             ///< by how much less is known of a rotation than equations say
  glm::dmat3 turned_from_{1.0};  ///< where the pattern was seen last
  glm::dmat3 turned_{1.0};       ///< that, turned as the gyroscope said since
  double turned_variance_ = 0;
  bool turned_known_ = false;  ///< a turn is known of every frame since
};

}  // namespace modar::tracker
