// The small on-screen display: what it says, and painting it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/error.hpp"
#include "frame_report.hpp"
#include "overlay.hpp"

namespace modar {

/// Pictures a second over the last second or so.
class RateMeter {
 public:
  void add(std::int64_t now_ns);
  [[nodiscard]] double rate() const { return rate_; }

 private:
  std::int64_t start_ns_ = 0;
  int count_ = 0;
  double rate_ = 0;
};

/// One line: the frame, its state with the reason when lost, and of each pattern seen its name and
/// inliers. fps: 0 leaves it out (pictures of a file are the same in each run).
std::string display_text(const FrameReport& report, std::span<const std::string> pattern_names,
                         double fps);

/// Paints the line on a dark bar along the top. Characters outside ASCII become question marks.
/// Errors: kUnsupported "display.unsupported" in a build without OpenCV's letters.
Result<void> draw_text_bar(const Canvas& canvas, const std::string& text);

}  // namespace modar
