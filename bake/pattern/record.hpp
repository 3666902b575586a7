// A pattern's picture to what the device recognises it by: its tracker record, and the features of
// the ModAR paper's parameter sets.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "bake/pattern/shape.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_writer.hpp"
#include "modar/pattern_record.hpp"

namespace modar {

/// Where the device's tracker was right in rendered views, by a camera 1280 pixels wide whose focal
/// length is its width.
struct ScoreRange {
  double nearest = 0;        ///< pattern widths; 0 with farthest 0: nowhere
  double farthest = 0;       ///< the same
  double tilt_deg = 0;       ///< from the front to there; of curved ones about the axis
  double covered_share = 0;  ///< of views with half of the pattern covered
  bool curved = false;       ///< on a shape: tilt_deg is to either side of it
};

struct PatternFeatures {
  std::string name;
  PatternRecord record{};                ///< without its name
  std::vector<FeatureContent> features;  ///< one for each parameter set, in their order
  std::vector<std::byte> loop_record;    ///< a section of type kTrackerRecord
  std::optional<ScoreRange> range;       ///< where it is recognised; nothing: it was not scored
  std::vector<std::byte> shape;  ///< a section of type SectionType::kPatternShape; empty: flat
};

/// Describes an image file for the tracker, and under the ModAR paper's parameter sets as YML with
/// its binary twin. width_mm: printed width, 0: what the file states, or what the shape tells. An
/// image target of 8th Wall states its own shape. Errors: those of read_image(), shape_section()
/// and make_tracker_record(); kInvalidInput "pattern.no-features" where the first set finds fewer
/// than its min_matches.
Result<PatternFeatures> bake_pattern(const std::string& path, double width_mm,
                                     std::span<const ParameterSetRecord> sets,
                                     const TrackerRecordOptions& options, Report& report,
                                     const ShapeRequest& shape = {});

}  // namespace modar
