// The player's JSON lines: one a frame, and the summary. Their keys are a contract (see --json).
#pragma once

#include <span>
#include <string>

#include "frame_report.hpp"
#include "run_stats.hpp"

namespace modar {

/// {frame,time_s,visible:[{pattern,corners,rotation,translation,inliers,matches}],reason,state,ms}.
/// Rotation row by row; numbers that are not finite become null. No newline at the end.
/// pattern_names: by the bundle's pattern index.
std::string frame_line(const FrameReport& report, std::span<const std::string> pattern_names);

/// {"summary":{frames,dropped,visible,recognised_percent,states,reasons,late,ms}}; ms: medians.
std::string summary_line(const RunStats& stats);

/// {frame,model,angle_deg,triangles,draw_calls,ms:{render}}: a picture of the turntable.
struct TurntableReport {
  std::uint64_t frame = 0;
  std::string_view model;
  double angle_deg = 0;
  std::uint64_t triangles = 0;
  int draw_calls = 0;
  double render_ms = 0;
};
std::string turntable_line(const TurntableReport& report);

}  // namespace modar
