// Corners and binary codes: one function describes frames on the device and rendered views in the
// bake, so that the two cannot differ.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "modar/image.hpp"

namespace modar {

/// Version of everything that a code depends on (tests, smoothing, orientation); records of another
/// version are refused.
inline constexpr std::uint32_t kFeatureExtractorVersion = 1;
/// Levels of the dyadic pyramid that features are extracted on.
inline constexpr int kTrackerLevels = 4;
/// Pixels from the border of a level within which no feature can be described.
inline constexpr int kTrackerBorder = 18;

struct DetectOptions {
  /// FAST threshold, gray values, 1 to 255: lower finds more corners in dim frames, and more noise.
  /// Chosen without a measurement.
  int threshold = 14;
  /// Side of the squares over which features are spread, in pixels of a level: smaller ones spread
  /// better, but admit weaker corners. From the study that the detector follows.
  int cell = 64;
  /// Most features per cell, the strongest: with `cell`, limits what one object takes. Not
  /// measured.
  int per_cell = 12;
  /// Most features of a frame, the strongest, and of high-contrast ones each cell's best. Time of
  /// matching grows with it. 1,000 / 1,250 / 1,500: half-covered patterns were 95.0 % right with
  /// the first and 98.8 % with the second; small ones gained 2 % more with the third.
  int max_features = 1500;
  /// Most features that extend_spare() adds, of those that `per_cell` left out, the strongest:
  /// bounds the time of a search that finds nothing. A frame of 640x480 has at most 1,440.
  int max_spare = 1500;
  /// Levels of the pyramid that are searched for features, at most.
  int levels = 8;
  /// SIMD level, 0: the lowest that this program was built for; -1: the best of this processor. All
  /// give the same bits.
  int simd = -1;
};

struct TrackerFeature {
  float x = 0;  ///< pixels of the frame
  float y = 0;
  float cosine = 1;  ///< orientation: direction of the intensity centroid
  float sine = 0;
  std::uint8_t level = 0;  ///< pyramid level: the frame halved that many times
  std::uint8_t dark = 0;   ///< 1: the arc of the corner is darker than its centre
  std::uint8_t score = 0;  ///< FAST score
  std::uint8_t reserved = 0;
  std::array<std::uint8_t, 32> code{};
};

/// Holds the buffers for frames of one size; allocates nothing after create().
class FeatureExtractor {
 public:
  /// width, height: 1 to 16384.
  static std::unique_ptr<FeatureExtractor> create(int width, int height,
                                                  const DetectOptions& options);
  FeatureExtractor(const FeatureExtractor&) = delete;
  FeatureExtractor& operator=(const FeatureExtractor&) = delete;
  ~FeatureExtractor();

  /// Builds the pyramid of a frame of the size given to create(). The frame's pixels must stay
  /// valid until the next call: level 0 is the frame itself.
  void set_frame(const GrayImage& frame);
  /// The frame, halved again and again (2x2 means) down to a side of 16 or kTrackerLevels + 2
  /// levels. Pixel (x, y) of level l is centred at ((x + 0.5) * 2^l - 0.5, ...) of the frame.
  [[nodiscard]] std::span<const GrayImage> pyramid() const;
  /// Finds and describes the features of the frame. Valid until the next call.
  std::span<const TrackerFeature> features();
  /// The same in slices: begin(), then extend() until it returns true; found() has the features
  /// then. work: about how many ARMv7 instructions extend() may take; it subtracts what it took.
  void begin();
  bool extend(std::int64_t& work);
  /// After that, in slices as well: adds to found() the next strongest of each cell, at most
  /// per_cell; of a small thing in a large frame a cell shows most.
  bool extend_spare(std::int64_t& work);
  [[nodiscard]] std::span<const TrackerFeature> found() const;

 private:
  struct State;
  explicit FeatureExtractor(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
