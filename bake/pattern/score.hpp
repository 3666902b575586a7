// `modar pattern score`: how well a picture serves as a pattern, before anything is printed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/pattern/view_render.hpp"
#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Names the rules of the score; scores of different versions cannot be compared.
inline constexpr std::uint32_t kScoreVersion = 1;
/// Scores below this are worth a warning: such patterns are found from close by only.
inline constexpr int kWeakScore = 30;

struct ScoreCause {
  const char* id;      ///< "texture", "spread", "contrast", "repetition", "aspect", "size", "blur"
  int value = 0;       ///< 0 to 100, the best
  const char* advice;  ///< what a person can do; empty where the value is good
};

/// A corner of the picture and in how many of the test views it was told from all others.
struct ScorePlace {
  float x = 0;  ///< picture pixels
  float y = 0;
  int held = 0;
};

struct PatternScore {
  int score = 0;  ///< 0 to 100
  std::vector<ScoreCause> causes;
  std::vector<ScorePlace> places;
  int views = 0;  ///< test views
};

/// Renders the picture ever smaller and ever more tilted, in fixed views by whole numbers, and asks
/// the device's loop for it: the score is the share of these views in which it is right. The causes
/// come from the picture and from the features that hold. A count of decisions, so that no
/// machine and no number of threads changes it. loop_record: of that picture. Errors: those of
/// the loop.
Result<PatternScore> score_pattern(const GrayImage& pattern, std::span<const std::byte> loop_record,
                                   unsigned jobs);

/// The picture with its good features (green), poor ones (red), and shades where there are none.
RgbaImage score_overlay(const GrayImage& pattern, const PatternScore& score);

}  // namespace modar
