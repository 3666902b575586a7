// Composes the display's line.
#include "display.hpp"

#include <cstdio>

namespace modar {

void RateMeter::add(std::int64_t now_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  if (start_ns_ == 0) {
    start_ns_ = now_ns;
    return;
  }
  ++count_;
  const std::int64_t passed = now_ns - start_ns_;
  if (passed < kSecond) return;
  rate_ = static_cast<double>(count_) * kSecond / static_cast<double>(passed);
  start_ns_ = now_ns;
  count_ = 0;
}

std::string display_text(const FrameReport& report, std::span<const std::string> pattern_names,
                         double fps) {
  std::string text = std::to_string(report.frame) + "  ";
  if (fps > 0) {
    char rate[32];
    // Whole tenths by integers: printf would ask the locale for the point.
    const auto tenths = static_cast<long>(fps * 10 + 0.5);
    std::snprintf(rate, sizeof rate, "%ld.%ld fps  ", tenths / 10, tenths % 10);
    text += rate;
  }
  text += to_string(report.state);
  if (report.visible.empty()) {
    text += std::string(": ") + to_string(report.reason);
  } else if (report.state == Shown::kHidden) {
    text += ": seen once";
  }
  for (const Detection& seen : report.visible) {
    text += "  ";
    if (seen.pattern < pattern_names.size()) text += pattern_names[seen.pattern] + " ";
    text += std::to_string(seen.inliers) + " inliers";
  }
  return text;
}

}  // namespace modar
