// `modar pattern score`: how well a picture will serve as a pattern, before anything is printed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Version of the score's rules; scores of different versions cannot be compared.
inline constexpr std::uint32_t kScoreVersion = 1;
/// Scores below this cause a warning: such patterns are recognised from close by only. Set by hand
/// on the twelve pictures that the score was tuned on.
inline constexpr int kWeakScore = 30;

struct ScoreCause {
  /// "texture", "spread", "contrast", "repetition", "aspect", "size", "blur", "mirror"
  const char* id;
  int value = 0;       ///< 0 to 100, the best
  const char* advice;  ///< what a person can do; empty where the value is good
};

/// Where the device's tracker was right in rendered views, by a camera 1280 pixels wide whose focal
/// length is its width.
struct ScoreRange {
  double nearest = 0;        ///< pattern widths; 0 with farthest 0: nowhere
  double farthest = 0;       ///< the same
  double tilt_deg = 0;       ///< from the front to there; of curved ones about the axis
  double covered_share = 0;  ///< of views with half of the pattern covered
  bool curved = false;       ///< on a shape: tilt_deg is to either side of it
};

/// A corner of the picture, and in how many of the test views it was matched unambiguously.
struct ScorePlace {
  float x = 0;  ///< picture pixels
  float y = 0;
  int held = 0;
};

struct PatternScore {
  int score = 0;  ///< 0 to 100
  ScoreRange range;
  char grade = 'E';  ///< 'A' to 'E', see grade_of()
  std::vector<ScoreCause> causes;
  std::vector<ScorePlace> places;
  int views = 0;  ///< test views
};

/// Renders the picture, flat, smaller and smaller and more and more tilted, in fixed views, and
/// runs the device's tracker on them: the score is the share of these views in which it is right.
/// The causes come from the picture and from the features that are matched again. A count of
/// decisions, which depends neither on the machine nor on the number of threads. record: the
/// picture's tracker record. shape: its kPatternShape section, empty: flat; views of others go
/// around the shape. with_range: false spares the views that only the range, its grade and
/// the cause "mirror" need, as a bake does. Errors: those of the tracker.
Result<PatternScore> score_pattern(const GrayImage& pattern, std::span<const std::byte> record,
                                   unsigned jobs, bool with_range = true,
                                   const std::vector<std::byte>& shape = {});

/// What the grade follows from: farthest distance, tilt (over 70 degrees) and half-covered views
/// (at half weight) as factors.
double range_value(const ScoreRange& range);
/// 'A' (the best) to 'E', from range_value() alone.
char grade_of(const ScoreRange& range);

/// "recognised from 13 cm to 1.3 m, to 70 degrees, 90 % right when half covered"; of curved ones
/// "over 140 degrees around it". width_mm: printed width, 0: unknown, distances are told in widths.
std::string range_sentence(const ScoreRange& range, double width_mm);

/// The picture with its reliable features (green), unreliable ones (orange), and places without any
/// darkened.
RgbaImage score_overlay(const GrayImage& pattern, const PatternScore& score);

}  // namespace modar
