// From a photo of a flat thing to its frontal picture, and to features.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/pattern/tracker_record_bake.hpp"
#include "bake/report.hpp"
#include "formats/bundle_writer.hpp"
#include "formats/error.hpp"

namespace modar {

struct PixelPoint {
  double x = 0;
  double y = 0;
};

struct RectifyOptions {
  /// In the photo: top-left, top-right, bottom-right, bottom-left of the pattern.
  std::array<PixelPoint, 4> corners{};
  double width_mm = 0;   ///< physical width, 0: unknown
  double height_mm = 0;  ///< physical height; 0: estimated from the perspective
  std::uint32_t max_side =
      720;  ///< pixels of the longer side of the result, never more than the photo has
  [[nodiscard]] Result<void> validate() const;
};

/// A frontal view of the quadrilateral. Its aspect ratio comes from the sizes in mm where both are
/// known, else from the perspective (Zhang & He, "Whiteboard scanning", 2006, with the principal
/// point in the photo's centre), else from the sides' lengths. Errors: kInvalidInput
/// "rectify.corners" (not convex, outside of the photo, too small).
Result<RgbaImage> rectify(const RgbaImage& photo, const RectifyOptions& options);

/// Writes a PNG whose physical size (pHYs) tells width_mm where it is not 0.
Result<void> write_pattern_png(const RgbaImage& image, double width_mm, const std::string& path);

/// The physical width that a PNG's pHYs states, in mm; 0: none.
double read_width_mm(const std::string& path);

struct PatternFeatures {
  std::string name;
  PatternRecord record{};                ///< lacks its name
  std::vector<FeatureContent> features;  ///< one a parameter set, in their order
  std::vector<std::byte> loop_record;    ///< a section of type kTrackerRecord
};

/// Describes an image file for our loop, and under the article's parameter sets with YML and twin.
/// Errors: those of read_image() and bake_tracker_record(); kInvalidInput "pattern.no-features"
/// where the first set finds fewer than its min_matches.
Result<PatternFeatures> bake_pattern(const std::string& path, double width_mm,
                                     std::span<const ParameterSetRecord> sets,
                                     const TrackerRecordOptions& loop, Report& report);

}  // namespace modar
