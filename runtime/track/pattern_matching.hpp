// Matching of a frame's features: with one pattern's codes, to homographies, and with all patterns'
// codes through an index, to the patterns worth matching. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "kernels.hpp"
#include "modar/camera.hpp"
#include "modar/tracker_features.hpp"
#include "plane_geometry.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// Matches from which on there is a hypothesis: an affine map needs three, and as many to confirm
/// it.
inline constexpr std::size_t kMinMatches = 6;

/// Matches whose affine map is voted on, nearest first. More find small and tilted patterns; cost
/// is proportional. [96, 1000] tuned: pose
inline constexpr std::size_t kVotes = 96;
// The same with the spare features, where all vote.
inline constexpr std::size_t kSpareVotes = 1000;

/// A frame's feature and the pattern's feature that it resembles, with the local affine map that
/// their orientations and scales imply.
struct FeatureMatch {
  glm::dvec2 pattern{};  ///< pixels of the pattern's image
  glm::dvec2 ideal{};    ///< undistorted frame pixels
  glm::dmat2 affine{};   ///< pattern pixels to frame pixels, around the feature
  double sigma = 1;      ///< frame pixels per pixel of the feature's level
  int distance = 0;      ///< Hamming distance, bits
};

/// Leaves the lens distortion in `ideal` and sets no distance.
FeatureMatch match_of(const TrackerFeatureRecord& record, const TrackerFeature& feature);
/// Whether `other` is where the affine map of `hypothesis` puts it, with a similar shape.
bool agrees(const FeatureMatch& hypothesis, const FeatureMatch& other);

/// A homography that some of the matches agree with.
struct HomographyHypothesis {
  int inliers = 0;
  glm::dmat3 homography{1.0};      ///< pattern pixels to undistorted frame pixels
  std::vector<std::uint8_t> mask;  ///< by match: 1 for inliers
};

/// The pose that shows the surface's tangent plane at a place of the picture nearly alike: both
/// solutions of a plane's pose (Collins & Bartoli, "Infinitesimal plane-based pose estimation",
/// 2014).
Pose mirrored_about(const TrackedPattern& pattern, glm::dvec2 place, const Pose& pose);

/// Finds homographies of one pattern at a time. Allocates nothing after construction.
class PlaneMatcher {
 public:
  PlaneMatcher(const Camera& camera, const Kernels& kernels, std::size_t max_features,
               std::size_t max_codes);
  /// At most four hypotheses, by falling inliers; valid until the next call.
  std::span<const HomographyHypothesis> find(const TrackedPattern& pattern,
                                             std::span<const TrackerFeature> features);
  /// The same in slices: match() with `next` 0 at first until it returns true, a vote, then
  /// hypotheses(). Of the first `count` features every second comes first, and `end` counts in that
  /// order; after hypotheses(), match() may continue to a greater one. work: about how many ARMv7
  /// instructions match() may take; it subtracts what it took.
  bool match(const TrackedPattern& pattern, std::span<const TrackerFeature> features,
             std::size_t count, std::size_t end, std::size_t& next, std::int64_t& work);
  /// Drops the matches that a copy of the pattern at this place explains. map: to undistorted
  /// pixels.
  void forget(const PlaneMap& map);
  /// Counts the matches that agree with each of the `most` nearest ones: vote() until it returns
  /// true.
  void begin_vote(std::size_t most);
  bool vote(std::int64_t& work);
  std::span<const HomographyHypothesis> hypotheses();
  [[nodiscard]] std::size_t max_features() const { return matches_.capacity(); }
  /// Matches of the last find().
  [[nodiscard]] int matches() const { return static_cast<int>(matches_.size()); }
  /// Of a pattern that is not flat: extends from the part of it that a hypothesis took for flat to
  /// all parts turned to the camera, and makes the matches found there the hypothesis' inliers.
  /// Returns how many poses explain them, the better one first.
  int spread(const TrackedPattern& pattern, std::size_t hypothesis, std::array<Pose, 2>& poses);
  /// Matches that a hypothesis of the last find() misses by `near` to `far` frame pixels, but whose
  /// scale and direction it has right.
  [[nodiscard]] int beside(const HomographyHypothesis& one, double near, double far) const;
  [[nodiscard]] std::span<const FeatureMatch> all_matches() const { return matches_; }
  /// The match that most others of the last find() agree with, and how many; null: none.
  [[nodiscard]] const FeatureMatch* strongest(int& votes) const;
  /// Makes inliers() those of a hypothesis of the last find().
  void select(const TrackedPattern& pattern, const HomographyHypothesis& hypothesis);
  [[nodiscard]] PlanePoints inliers() const {
    return {inlier_world_, inlier_ideal_, inlier_sigma_};
  }

 private:
  bool unambiguous(const TrackedPattern& pattern, std::size_t first, std::size_t count, int best,
                   std::size_t& at) const;
  std::size_t support(const FeatureMatch& hypothesis, std::vector<std::uint8_t>* mask) const;
  std::size_t fit(const FeatureMatch& hypothesis, glm::dmat3& homography);
  bool fit_homography(std::span<const std::uint8_t> mask, glm::dmat3& homography) const;
  bool fit_affine(std::span<const std::uint8_t> mask, glm::dmat3& homography) const;
  std::size_t collect(const glm::dmat3& homography, double pixels,
                      std::vector<std::uint8_t>& mask) const;
  std::size_t collect_on_surface(const TrackedPattern& pattern, const Pose& pose, double pixels,
                                 std::vector<std::uint8_t>& mask) const;
  std::size_t spread_pose(const TrackedPattern& pattern, Pose& pose);

  const Camera& camera_;
  const Kernels& kernels_;
  std::array<HomographyHypothesis, 4> hypotheses_;
  std::vector<FeatureMatch> matches_;
  std::vector<std::uint8_t> distances_;
  std::vector<std::uint8_t> mask_;
  std::vector<std::uint8_t> explained_;
  std::vector<std::uint8_t> supporters_;
  std::vector<std::uint32_t> order_;  ///< matches that vote
  std::size_t voted_ = 0;             ///< of them
  std::vector<glm::dvec3> inlier_world_;
  std::vector<glm::dvec2> inlier_ideal_;
  std::vector<double> inlier_sigma_;
};

/// Which patterns a frame may show: an inverted file (Sivic & Zisserman, "Video Google", 2003) over
/// the binary codes of all patterns, whose words are a sample of the codes. A feature is compared
/// with the words and then with the codes of the nearest few, so that its cost grows with the
/// square root of the number of patterns. It votes for the pattern of the nearest code found; of a
/// pattern's votes only those count that agree on one place and shape.
class CodeIndex {
 public:
  using Code = std::array<std::uint8_t, kCodeBytes>;

  /// The patterns must outlive it.
  CodeIndex(std::span<const TrackedPattern> patterns, const Kernels& kernels,
            std::size_t max_features);
  /// Continues indexing the most repeatable codes of each pattern, 9 KB a pattern or more, until it
  /// returns true; then vote() may be called, which allocates nothing. work: about how many ARMv7
  /// instructions it may take; it subtracts what it took.
  bool build(std::int64_t& work);
  /// The evidence for a pattern.
  struct Support {
    std::uint16_t votes = 0;  ///< features that agree on one place,
    FeatureMatch place;       ///< given by one of them
  };
  /// One per pattern, valid until the next call. Of the features every n-th votes, from `first`.
  std::span<const Support> vote(std::span<const TrackerFeature> features, std::size_t first,
                                std::size_t every);
  [[nodiscard]] std::span<const Support> support() const { return support_; }
  /// Codes that a feature is compared with, about.
  [[nodiscard]] std::size_t compared() const;

 private:
  /// Words whose codes a feature is compared with. More find votes that the nearest word misses,
  /// and take time.
  static constexpr std::size_t kProbes = 4;

  /// Codes of one polarity, in blocks as Kernels::distances() takes them.
  struct Group {
    std::vector<std::uint8_t> words;
    std::vector<std::uint32_t> starts;  ///< by word, in blocks, and the end
    std::vector<std::uint8_t> codes;
    std::vector<std::uint32_t> owners;  ///< by code: pattern and feature
  };
  struct Vote {
    std::uint32_t previous = 0;  ///< the same pattern's vote before this one
    FeatureMatch match;
  };
  void collect(Group& group, bool dark);
  void sort_into_words(Group& group);
  std::array<std::uint32_t, kProbes> nearest_words(const Group& group, const Code& code);
  std::uint32_t nearest_owner(const Group& group, const Code& code);
  [[nodiscard]] Support largest_agreement(std::uint32_t last, std::size_t count) const;
  void fit_place(std::uint32_t last, FeatureMatch& place) const;

  std::span<const TrackedPattern> patterns_;
  const Kernels& kernels_;
  std::array<Group, 2> groups_;  ///< bright, dark
  std::vector<std::uint8_t> distances_;
  std::vector<Vote> votes_;
  std::vector<std::uint32_t> last_;  ///< by pattern: its last vote
  std::vector<Support> support_;
  std::size_t indexed_;  ///< codes of a pattern and polarity, at most

  // Of the group that build() is at, by code:
  std::size_t group_ = 0;
  std::vector<Code> codes_;
  std::vector<std::uint32_t> owners_;
  std::vector<std::uint32_t> nearest_;  ///< word; of the codes that were compared
};

}  // namespace modar::tracker
