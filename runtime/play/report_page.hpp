// The report's page: one HTML file with the movie, a strip of states, the contact sheet, a table.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "frame_report.hpp"
#include "frame_sink.hpp"

namespace modar {

struct PageFrame {
  std::uint64_t frame = 0;
  double time_s = 0;
  Shown state = Shown::kHidden;
  Reason reason = Reason::kNoFeatures;
  bool seen = false;  ///< a pattern was measured
  int inliers = 0;    ///< greatest of the detections
  int matches = 0;
  std::string patterns;  ///< names of detected patterns, with commas
};

/// Needs no file but overlay.mp4, poster.png and contact_sheet.png next to it, and no network. fps:
/// of the movie, which shows one picture a PageFrame, in order.
std::string report_page(const ReportTitle& title, double fps, std::span<const PageFrame> frames,
                        const RunStats& stats);

}  // namespace modar
