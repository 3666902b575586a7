#include "runtime/record/record_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <utility>

namespace modar {
namespace {

// Ratio of scales between candidates: a third of an octave. Smaller finds more in-between distances
// and enlarges the record.
constexpr double kScaleStep = 1.2599210498948732;
constexpr int kScales = 7;

/// Bright ones first, each group filled up to whole blocks by its last; moves on `bright`.
std::vector<const RecordFeature*> by_polarity(const std::vector<RecordFeature>& features,
                                              std::uint32_t& bright) {
  std::vector<const RecordFeature*> ordered;
  for (int dark = 0; dark < 2; ++dark) {
    for (const RecordFeature& feature : features) {
      if (feature.dark == dark) ordered.push_back(&feature);
    }
    while (!ordered.empty() && ordered.size() % kTrackerBlockCodes != 0)
      ordered.push_back(ordered.back());
    if (dark == 0) bright = static_cast<std::uint32_t>(ordered.size());
  }
  return ordered;
}

template <class T>
void put(std::vector<std::byte>& bytes, std::uint64_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

}  // namespace

std::vector<AffineView> baked_views(int width, int height) {
  std::vector<AffineView> views;
  Random random(1);
  double scale = 1.0;
  for (int k = 0; k < kScales; ++k, scale /= kScaleStep) {
    // Directions get denser with the tilt (Yu & Morel, "ASIFT", 2011).
    for (const auto& [tilt, turns] : {std::pair{1.0, 2}, {1.5, 4}, {2.1, 6}, {2.9, 8}, {4.1, 11}}) {
      for (int i = 0; i < turns; ++i) {
        views.push_back(make_view(width, height, scale, tilt, turn_of(std::numbers::pi * i / turns),
                                  turn_of(random.uniform(0.0, 2 * std::numbers::pi)), kMargin));
      }
    }
  }
  return views;
}

DetectOptions baked_detection() {
  DetectOptions detection = generous_detection();
  detection.levels = 1;  // coarser ones repeat what views of a smaller scale show
  return detection;
}

RecordFeature record_feature(const AffineView& view, const TrackerFeature& feature,
                             const std::array<double, 2>& place) {
  RecordFeature made;
  made.x = place[0];
  made.y = place[1];
  const double c = static_cast<double>(feature.cosine);
  const double s = static_cast<double>(feature.sine);
  const auto& a = view.linear;
  made.warp = {c * a[0] + s * a[2], c * a[1] + s * a[3], c * a[2] - s * a[0], c * a[3] - s * a[1]};
  made.code = feature.code;
  made.dark = feature.dark;
  return made;
}

TrackerFeatureRecord stored_feature(const RecordFeature& feature) {
  TrackerFeatureRecord record{};
  record.x = static_cast<std::uint16_t>(std::lround((feature.x + 0.5) * 64));
  record.y = static_cast<std::uint16_t>(std::lround((feature.y + 0.5) * 64));
  for (std::size_t k = 0; k < 4; ++k) {
    record.warp[k] = static_cast<std::int16_t>(std::lround(feature.warp[k] * 4096));
  }
  return record;
}

// Shi & Tomasi, "Good features to track" (1994), as a root mean square gradient.
double patch_score(const GrayPicture& picture, int x, int y) {
  double xx = 0;
  double xy = 0;
  double yy = 0;
  const std::uint8_t* pixels = picture.pixels.data();
  for (int v = y - kPatchHalf; v <= y + kPatchHalf; ++v) {
    for (int u = x - kPatchHalf; u <= x + kPatchHalf; ++u) {
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(v) * picture.width + u;
      const double gx = 0.5 * (pixels[at + 1] - pixels[at - 1]);
      const double gy = 0.5 * (pixels[at + picture.width] - pixels[at - picture.width]);
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  const double least = 0.5 * (xx + yy - std::sqrt((xx - yy) * (xx - yy) + 4 * xy * xy));
  return std::sqrt(std::max(0.0, least) / ((2 * kPatchHalf + 1) * (2 * kPatchHalf + 1)));
}

TrackerPatchRecord patch_record(int x, int y, std::size_t level, double score) {
  const auto scale = static_cast<double>(1u << level);
  TrackerPatchRecord record{};
  record.x = static_cast<std::uint16_t>(std::lround((x + 0.5) * scale * 64));
  record.y = static_cast<std::uint16_t>(std::lround((y + 0.5) * scale * 64));
  record.level = static_cast<std::uint16_t>(level);
  record.score = static_cast<std::uint16_t>(std::min(score * 64, 65535.0));
  return record;
}

std::vector<std::byte> assemble_record(const std::vector<GrayPicture>& levels,
                                       const std::vector<RecordFeature>& features,
                                       const std::vector<TrackerPatchRecord>& patches) {
  TrackerRecordHeader header{};
  const auto ordered = by_polarity(features, header.bright_count);
  header.describer_version = kFeatureExtractorVersion;
  header.feature_count = static_cast<std::uint32_t>(ordered.size());
  header.patch_count = static_cast<std::uint32_t>(patches.size());
  header.width = static_cast<std::uint32_t>(levels[0].width);
  header.height = static_cast<std::uint32_t>(levels[0].height);
  header.level_count = static_cast<std::uint32_t>(levels.size());
  header.codes_offset = sizeof header;
  header.features_offset = header.codes_offset + ordered.size() * kTrackerCodeBytes;
  header.patches_offset = header.features_offset + ordered.size() * sizeof(TrackerFeatureRecord);
  header.pixels_offset = header.patches_offset + patches.size() * sizeof(TrackerPatchRecord);
  std::vector<std::byte> bytes(static_cast<std::size_t>(header.pixels_offset));
  put(bytes, 0, header);
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    const std::size_t block = i / kTrackerBlockCodes;
    for (std::size_t k = 0; k < kTrackerCodeBytes; ++k) {
      put(bytes,
          header.codes_offset + (block * kTrackerCodeBytes + k) * kTrackerBlockCodes +
              i % kTrackerBlockCodes,
          ordered[i]->code[k]);
    }
    put(bytes, header.features_offset + i * sizeof(TrackerFeatureRecord),
        stored_feature(*ordered[i]));
  }
  for (std::size_t i = 0; i < patches.size(); ++i) {
    put(bytes, header.patches_offset + i * sizeof(TrackerPatchRecord), patches[i]);
  }
  const auto pixels = std::as_bytes(std::span(levels[0].pixels));
  bytes.insert(bytes.end(), pixels.begin(), pixels.end());
  return bytes;
}

}  // namespace modar
