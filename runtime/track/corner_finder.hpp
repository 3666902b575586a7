// FAST-9 corners of one pyramid level, spread over cells. Internal to runtime/track.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "modar/image.hpp"
#include "modar/tracker_features.hpp"

namespace modar::tracker {

struct Corner {
  std::int16_t x = 0;
  std::int16_t y = 0;
  std::uint8_t score = 0;
  std::uint8_t dark = 0;
  std::uint8_t level = 0;
};

/// Buffers for levels up to a width; see FAST: Rosten & Drummond, "Machine learning for high-speed
/// corner detection" (2006), with the score of its later implementation (greatest threshold).
class CornerFinder {
 public:
  CornerFinder(int width, const DetectOptions& options);
  /// Appends the corners of a level in the order of their rows; never beyond the capacity that the
  /// caller reserved.
  void find(const GrayImage& image, std::uint8_t level, std::vector<Corner>& corners);

 private:
  void keep(const Corner& corner, int cell);
  void flush(std::vector<Corner>& corners);

  DetectOptions options_;
  int pitch_ = 0;
  std::vector<std::uint8_t> rows_;  ///< three rows of scores, three of bright scores, peaks
  std::vector<Corner> cells_;       ///< per_cell slots a cell of the current cell row
  std::vector<int> counts_;
};

}  // namespace modar::tracker
