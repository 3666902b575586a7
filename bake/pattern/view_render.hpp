// Affine views of a picture, anti-aliased, for the bake of patterns. Plain arithmetic, no library.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "modar/image.hpp"

namespace modar {

/// A repeatable sequence (SplitMix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  double uniform(double low, double high);
  /// Mean 0, standard deviation 1, within +-3: the sum of three uniforms.
  double normal();

 private:
  std::uint64_t state_;
};

/// Picture pixels to view pixels: view = linear * picture + offset. Row by row.
struct AffineView {
  std::array<double, 4> linear{1, 0, 0, 1};
  std::array<double, 2> offset{};
  int width = 0;
  int height = 0;
};

/// The cosine and the sine of an angle.
struct Turn {
  double cosine = 1;
  double sine = 0;
};
/// By sums and products alone, as exp_of(): a library's sine may differ in its last bit from
/// machine to machine, and baked bytes must not. Right to about 1e-15. radians: within +-1000.
Turn turn_of(double radians);
/// e to the power x, right to about 1e-15 of it. x: within +-4.
double exp_of(double x);

/// A view scaled by `scale`, compressed by `tilt` (>= 1) along `direction`, then rotated. It shows
/// the whole picture with `margin` pixels around. Sums and products only: turns of rational numbers
/// give the same view on every machine.
AffineView make_view(int picture_width, int picture_height, double scale, double tilt,
                     Turn direction, Turn rotation, int margin);

struct GrayPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayImage view() const { return {pixels.data(), width, height, width}; }
};

/// The picture and its halves, down to a side of 8.
std::vector<GrayPicture> halved(const GrayImage& picture);

/// A halved picture, and beside each pixel its neighbours, as rendering reads them.
struct ViewLevel : GrayPicture {
  std::vector<std::uint32_t> quads;  ///< see ViewSamples
};
/// Those of halved().
std::vector<ViewLevel> view_levels(const GrayImage& picture);

/// Boxes of random grays, as a background.
GrayPicture made_clutter(Random& random, int width, int height);

/// Renders a view. Outside of the picture: its border pixels where `background` is null, else the
/// background, which has the view's size.
GrayPicture render_view(const std::vector<ViewLevel>& levels, const AffineView& view,
                        const GrayPicture* background);

}  // namespace modar
