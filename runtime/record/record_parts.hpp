// What making, packing and unpacking a tracker record share: the views that features are of, and
// how a record is laid out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/tracker_record.hpp"
#include "modar/pattern_views.hpp"
#include "modar/tracker_features.hpp"

namespace modar {

/// Pixels around a rendered pattern: half a descriptor's patch and the detector's border.
inline constexpr int kMargin = 24;
inline constexpr int kPatchHalf =
    4;  ///< a patch is 9x9 pixels of its level, as the tracker samples
inline constexpr int kPatchBorder = kPatchHalf + 2;
inline constexpr int kPatchStep = 2;  ///< pixels between places of patches

/// A feature as one of the baked views shows it.
struct RecordFeature {
  double x = 0;  ///< pattern pixels
  double y = 0;
  std::array<double, 4> warp{};
  std::array<std::uint8_t, 32> code{};
  std::uint8_t dark = 0;
};

/// The views of a picture of that size whose features a record is chosen from.
std::vector<AffineView> baked_views(int width, int height);
/// How features are found in them.
DetectOptions baked_detection();

/// place: of the feature in the picture.
RecordFeature record_feature(const AffineView& view, const TrackerFeature& feature,
                             const std::array<double, 2>& place);
TrackerFeatureRecord stored_feature(const RecordFeature& feature);

/// Least root mean square gradient of a patch around a pixel, gray values a pixel.
double patch_score(const GrayPicture& picture, int x, int y);
/// x, y: pixels of that level.
TrackerPatchRecord patch_record(int x, int y, std::size_t level, double score);

/// The bytes of a record. features: in order of choice, which becomes theirs by polarity.
std::vector<std::byte> assemble_record(const std::vector<GrayPicture>& levels,
                                       const std::vector<RecordFeature>& features,
                                       const std::vector<TrackerPatchRecord>& patches);

}  // namespace modar
