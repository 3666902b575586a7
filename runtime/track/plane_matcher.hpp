// From a frame's features to the homography of one pattern. Internal to runtime/track.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

#include "kernels.hpp"
#include "modar/camera.hpp"
#include "modar/tracker_features.hpp"
#include "plane_map.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// A frame's feature and the pattern's that it looks like, with the local affine map that the two
/// orientations and scales imply.
struct PlaneMatch {
  glm::dvec2 pattern{};  ///< pixels of the pattern's image
  glm::dvec2 ideal{};    ///< undistorted frame pixels
  glm::dmat2 affine{};   ///< pattern pixels to frame pixels, around the feature
  double sigma = 1;      ///< frame pixels that a pixel of its level stands for
  int distance = 0;      ///< bits
};

/// Of a feature that looks like a pattern's: its place as if the lens did not bend, no distance.
PlaneMatch match_of(const TrackerFeatureRecord& record, const TrackerFeature& feature);
/// Whether a match lies where another one's affine map says, in a like shape.
bool agrees(const PlaneMatch& hypothesis, const PlaneMatch& other);

/// A homography that some of the matches agree with.
struct PlaneFind {
  int inliers = 0;
  glm::dmat3 homography{1.0};  ///< pattern pixels to ideal pixels
  std::vector<std::uint8_t> mask;
};

/// Buffers for the search; allocates nothing after construction.
class PlaneMatcher {
 public:
  PlaneMatcher(const Camera& camera, const Kernels& kernels, std::size_t most_features,
               std::size_t most_codes);
  /// The homographies that most matches speak for, the best first; valid until the next call.
  std::span<const PlaneFind> find(const TrackedPattern& pattern,
                                  std::span<const TrackerFeature> features);
  [[nodiscard]] std::size_t most_features() const { return matches_.capacity(); }
  /// Matches of the last find().
  [[nodiscard]] int matches() const { return static_cast<int>(matches_.size()); }
  /// Collects the points of a find's inliers for inliers().
  void choose(const TrackedPattern& pattern, const PlaneFind& find);
  [[nodiscard]] PlanePoints inliers() const {
    return {inlier_world_, inlier_ideal_, inlier_sigma_};
  }

 private:
  void match(const TrackedPattern& pattern, std::span<const TrackerFeature> features);
  bool unique(const TrackedPattern& pattern, std::size_t first, std::size_t count, int best,
              std::size_t& at) const;
  std::size_t support(const PlaneMatch& hypothesis, std::vector<std::uint8_t>* mask) const;
  std::size_t fit(const PlaneMatch& hypothesis, glm::dmat3& homography);
  bool fit_homography(std::span<const std::uint8_t> mask, glm::dmat3& homography) const;
  bool fit_affine(std::span<const std::uint8_t> mask, glm::dmat3& homography) const;
  std::size_t collect(const glm::dmat3& homography, double reach,
                      std::vector<std::uint8_t>& mask) const;

  Camera camera_;
  const Kernels& kernels_;
  std::array<PlaneFind, 4> finds_;
  std::vector<PlaneMatch> matches_;
  std::vector<std::uint8_t> distances_;
  std::vector<std::uint8_t> mask_;
  std::vector<std::uint8_t> explained_;
  std::vector<std::uint8_t> supporters_;
  std::vector<std::uint32_t> order_;
  std::vector<glm::dvec2> inlier_world_;
  std::vector<glm::dvec2> inlier_ideal_;
  std::vector<double> inlier_sigma_;
};

}  // namespace modar::tracker
