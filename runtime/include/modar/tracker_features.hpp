// Corners and binary codes of our own pose loop: the one function that describes frames on the
// device and rendered views in the bake, so that the two cannot drift.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "modar/image.hpp"

namespace modar {

/// Names everything that a code depends on (tests, smoothing, orientation); a record baked under
/// another number is refused.
inline constexpr std::uint32_t kFeatureExtractorVersion = 1;
/// Levels of the dyadic pyramid on which features are looked for.
inline constexpr int kTrackerLevels = 4;
/// Pixels from the border of a level within which no feature can be described.
inline constexpr int kTrackerBorder = 18;

struct DetectOptions {
  int threshold = 14;       ///< gray values; lower finds more corners and more noise
  int cell = 64;            ///< pixels of a level; features are spread over such squares
  int per_cell = 12;        ///< most features of a cell, the strongest
  int max_features = 1500;  ///< of a frame: the strongest, and of the sure ones each cell's best
  int simd = -1;  ///< level of instructions, 0: the least that this program was built with;
                  ///< -1: the best that the processor has. All give the same bits
};

struct TrackerFeature {
  float x = 0;  ///< pixels of the frame
  float y = 0;
  float cosine = 1;  ///< orientation: direction of the patch's centroid
  float sine = 0;
  std::uint8_t level = 0;  ///< found in the frame halved that many times
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

  /// Builds the pyramid of a frame of the size of create(). The frame's pixels must stay until the
  /// next call: level 0 is the frame itself.
  void set_frame(const GrayImage& frame);
  /// The frame, halved again and again (2x2 means) down to a side of 16 or kTrackerLevels + 2
  /// levels. Pixel (x, y) of level l is centred at ((x + 0.5) * 2^l - 0.5, ...) of the frame.
  [[nodiscard]] std::span<const GrayImage> pyramid() const;
  /// Finds and describes the features of the frame. Valid until the next call.
  std::span<const TrackerFeature> features();

 private:
  struct State;
  explicit FeatureExtractor(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
