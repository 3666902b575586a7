// Counts over a run of the player: what the summary says.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "frame_report.hpp"

namespace modar {

inline constexpr std::array<Reason, 7> kReasons = {
    Reason::kVisible,    Reason::kNoFeatures,         Reason::kFewMatches,
    Reason::kNoGeometry, Reason::kFailedVerification, Reason::kLostByBlur,
    Reason::kOutOfView};

/// A frame whose picture comes later than this after the frame itself is late (30 frames a second).
inline constexpr double kFrameBudgetMs = 1000.0 / 30.0;

class RunStats {
 public:
  void add(const FrameReport& report);
  void set_dropped(std::uint64_t dropped) { dropped_ = dropped; }

  [[nodiscard]] std::uint64_t frames() const { return times_.size(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  [[nodiscard]] std::uint64_t visible() const { return visible_; }  ///< frames with a detection
  [[nodiscard]] std::uint64_t late() const { return late_; }
  [[nodiscard]] std::uint64_t count(Shown state) const {
    return states_[static_cast<std::size_t>(state)];
  }
  [[nodiscard]] std::uint64_t count(Reason reason) const {
    return reasons_[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] double recognised_percent() const;
  /// Lower median of each stage; 0 without frames.
  [[nodiscard]] StageTimes median_ms() const { return quantile_ms(0.5); }
  /// The value that so large a share of the frames does not exceed, rounded down to a frame's own.
  /// share: 0 to 1.
  [[nodiscard]] StageTimes quantile_ms(double share) const;

 private:
  std::vector<std::array<float, kStageNames.size()>> times_;
  std::array<std::uint64_t, 3> states_{};
  std::array<std::uint64_t, kReasons.size()> reasons_{};
  std::uint64_t visible_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace modar
