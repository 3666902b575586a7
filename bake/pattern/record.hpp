// A pattern's picture to what the device recognises it by: its tracker record, and the features of
// the ModAR paper's parameter sets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/pattern/shape.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_writer.hpp"
#include "modar/image.hpp"

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

struct TrackerRecordOptions {
  /// Descriptors kept, at most. More of them are right in harder views and cost matching time and
  /// 44 bytes each. The study in which this loop was designed: 1,000 features a frame on 3,000
  /// codes 89 % right at area 0.1-0.25 in 9 ms, 1,500 on 4,000 codes 94 % in 12 ms.
  std::uint32_t features = 3000;
  /// Random renderings that decide which descriptors are kept. More make a better choice and a
  /// slower bake. Set by hand.
  std::uint32_t trial_views = 120;
  /// Tracked patches of each halving of the picture, at most: a frame uses a few dozen of them, the
  /// rest stand by where those are covered. Set by hand.
  std::uint32_t patches_per_level = 256;
  bool score = true;  ///< bake_pattern() scores the picture, too
  unsigned jobs = 1;  ///< threads; the bytes do not depend on it
  [[nodiscard]] Result<void> validate() const;
};

/// The bytes of a SectionType::kTrackerRecord section. pattern: 8-bit gray, at most 1023 pixels a
/// side. The same picture gives the same bytes on every machine. Errors: kInvalidInput
/// "pattern.loop-size"; "pattern.no-features" where nothing repeats. surface: of the pattern.
Result<std::vector<std::byte>> bake_tracker_record(const GrayImage& pattern,
                                                   const TrackerRecordOptions& options,
                                                   const PatternSurface& surface = {});

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
/// image target of 8th Wall brings its own shape. Errors: those of read_image(), shape_section()
/// and bake_tracker_record(); kInvalidInput "pattern.no-features" where the first set finds fewer
/// than its min_matches.
Result<PatternFeatures> bake_pattern(const std::string& path, double width_mm,
                                     std::span<const ParameterSetRecord> sets,
                                     const TrackerRecordOptions& options, Report& report,
                                     const ShapeRequest& shape = {});

}  // namespace modar
