// Points of a known plane in a frame: the input of a calibration. Internal to bake/pattern.
#pragma once

#include <memory>
#include <vector>

#include <glm/vec2.hpp>

#include "bake/pattern/confusion.hpp"
#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Points of one view: on the plane (any unit) and in the frame (pixels).
struct PlanePoints {
  std::vector<glm::dvec2> plane;
  std::vector<glm::dvec2> pixels;
};

/// Inner corners of a chessboard, to sub-pixels; none where it is not all in sight.
PlanePoints board_points(const GrayImage& frame, int columns, int rows);

/// Finds a pattern in frames of one size.
class PatternPoints {
 public:
  /// pattern: must outlive this. Errors: those of PoseLoop.
  static Result<PatternPoints> create(const NamedPattern& pattern, int width, int height);
  PatternPoints(PatternPoints&&) noexcept;
  ~PatternPoints();
  /// Well-textured places of the pattern in the frame; none where it is not seen well. The loop
  /// finds the pattern, then each place is looked for around where it should be, so that neither
  /// the loop's default camera nor a straight lens is taken for granted.
  [[nodiscard]] PlanePoints find(const GrayImage& frame);

 private:
  struct State;
  explicit PatternPoints(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
