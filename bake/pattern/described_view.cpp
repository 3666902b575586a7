// Features of rendered views, brought back to the picture.
#include "bake/pattern/described_view.hpp"

namespace modar {

std::array<double, 2> to_picture(const AffineView& view, double x, double y) {
  const auto& a = view.linear;
  const double determinant = a[0] * a[3] - a[1] * a[2];
  const double u = x - view.offset[0];
  const double v = y - view.offset[1];
  return {(a[3] * u - a[1] * v) / determinant, (a[0] * v - a[2] * u) / determinant};
}

DetectOptions generous_detection() {
  DetectOptions options;
  options.cell = 32;
  options.per_cell = 16;
  options.max_features = 20000;
  return options;
}

}  // namespace modar
