// `modar pattern score`: how well a picture will serve as a pattern, before anything is printed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/pattern/record.hpp"
#include "formats/base/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Version of the score's rules; scores of different versions cannot be compared.
inline constexpr std::uint32_t kScoreVersion = 2;
/// Patterns of this grade cause a warning: they are recognised from close by only.
inline constexpr char kWeakGrade = 'E';

struct ScoreCause {
  /// "texture", "spread", "contrast", "repetition", "aspect", "size", "blur", "mirror", "fine"
  const char* id;
  int value = 0;       ///< 0 to 100, the best
  const char* advice;  ///< what a person can do; empty where the value or the grade is good
};

/// A corner of the picture, and in how many of the test views it was matched unambiguously.
struct ScorePlace {
  float x = 0;  ///< picture pixels
  float y = 0;
  int held = 0;
};

struct PatternScore {
  int score = 0;  ///< 0 to 100, see score_of()
  ScoreRange range;
  char grade = 'E';  ///< 'A' to 'E', see grade_of()
  std::vector<ScoreCause> causes;
  std::vector<ScorePlace> places;
  int views = 0;  ///< test views
};

/// Renders the picture, flat, smaller and smaller and more and more tilted, in fixed views, and
/// runs the device's tracker on them: the range is where it is right, and the grade and the score
/// follow from the range alone. The causes come from the picture and from the features that are
/// matched again. A count of decisions, which depends neither on the machine nor on the number of
/// threads. record: the picture's tracker record. shape: its SectionType::kPatternShape section,
/// empty: flat; views of others go around the shape. Errors: those of the tracker.
Result<PatternScore> score_pattern(const GrayImage& pattern, std::span<const std::byte> record,
                                   unsigned jobs, const std::vector<std::byte>& shape = {});

/// A picture with its score, as the device has it.
struct ScoredPicture {
  ShapedPicture shaped;
  std::vector<std::byte> record;  ///< its tracker record
  PatternScore score;
};
/// The same of a pattern's file. width_mm: 0: what the file or the shape states. Errors: also those
/// of load_shaped().
Result<ScoredPicture> score_file(const std::string& path, double width_mm,
                                 const ShapeRequest& request, unsigned jobs);

/// What the grade follows from: farthest distance, tilt (over 70 degrees) and half-covered views
/// (at half weight) as factors.
double range_value(const ScoreRange& range);
/// 0 to 100, rising with range_value(): A from 80 on, B from 72, C from 60, D from 44.
int score_of(const ScoreRange& range);
/// The least score of a grade.
int least_score(char grade);
/// 'A' (the best) to 'E', from range_value() alone.
char grade_of(const ScoreRange& range);

/// "recognised from 13 cm to 1.3 m, to 70 degrees, 90 % right when half covered"; of curved ones
/// "over 140 degrees around it". width_mm: printed width, 0: unknown, distances are stated in
/// widths.
std::string range_sentence(const ScoreRange& range, double width_mm);

/// The picture with its reliable features (green), unreliable ones (orange), and places without any
/// darkened.
RgbaImage score_overlay(const GrayImage& pattern, const PatternScore& score);

}  // namespace modar
