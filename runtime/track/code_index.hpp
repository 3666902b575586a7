// One index over the codes of all patterns, which tells which of them a frame's features may belong
// to. Internal to runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels.hpp"
#include "modar/tracker_features.hpp"
#include "plane_matcher.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// An inverted file (Sivic & Zisserman, "Video Google", 2003) over binary codes, whose words are
/// some of the codes themselves. A feature is compared with the words and with the codes of the few
/// nearest of them, so that its cost grows with the square root of the patterns' number. It speaks
/// for the pattern that holds the nearest code of all, and of a pattern count only features that
/// agree in place and shape.
class CodeIndex {
 public:
  using Code = std::array<std::uint8_t, kCodeBytes>;

  /// Takes the most repeatable codes of each pattern (each group's first), some 9 KB a pattern.
  /// Nothing is allocated later. The patterns must outlive it.
  CodeIndex(std::span<const TrackedPattern> patterns, const Kernels& kernels,
            std::size_t most_features);
  /// What speaks for a pattern.
  struct Support {
    std::uint16_t votes = 0;  ///< features that show it at one place,
    PlaneMatch place;         ///< as one of them tells it
  };
  /// One a pattern, valid until the next call.
  std::span<const Support> vote(std::span<const TrackerFeature> features);

 private:
  static constexpr std::size_t kProbes = 4;  ///< words whose codes a feature is compared with

  /// Codes of one polarity, in blocks as Kernels::distances() takes them.
  struct Group {
    std::vector<std::uint8_t> words;
    std::vector<std::uint32_t> starts;  ///< by word, in blocks, and the end
    std::vector<std::uint8_t> codes;
    std::vector<std::uint32_t> owners;  ///< by code: pattern and feature
  };
  struct Vote {
    std::uint32_t before = 0;  ///< the same pattern's vote before this one
    PlaneMatch match;
  };
  void build(Group& group, bool dark);
  std::array<std::uint32_t, kProbes> near_words(const Group& group, const Code& code);
  std::uint32_t nearest_owner(const Group& group, const Code& code);
  [[nodiscard]] Support agreeing(std::uint32_t last, std::size_t count) const;

  std::span<const TrackedPattern> patterns_;
  const Kernels& kernels_;
  std::array<Group, 2> groups_;  ///< bright, dark
  std::vector<std::uint8_t> distances_;
  std::vector<Vote> votes_;
  std::vector<std::uint32_t> last_;  ///< by pattern: its last vote
  std::vector<Support> support_;
};

}  // namespace modar::tracker
