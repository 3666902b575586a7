// Taylor's series of an angle within an eighth of a turn.
#include "formats/base/turn.hpp"

#include <cmath>

namespace modar {

Turn turn_of(double radians) {
  constexpr double kQuarter = 1.57079632679489661923;
  const double quarters = std::floor(radians / kQuarter + 0.5);
  const double x = radians - quarters * kQuarter;
  const double xx = x * x;
  double cosine = 1;
  double sine = 1;
  // Taylor's series, from the smallest term on: |x| is at most an eighth of a turn.
  for (int k = 18; k > 0; k -= 2) {
    cosine = 1 - cosine * xx / (k * (k - 1));
    sine = 1 - sine * xx / (k * (k + 1));
  }
  sine *= x;
  switch (static_cast<int>(quarters) & 3) {
    case 0:
      return {cosine, sine};
    case 1:
      return {-sine, cosine};
    case 2:
      return {-cosine, -sine};
    default:
      return {sine, -cosine};
  }
}

}  // namespace modar
