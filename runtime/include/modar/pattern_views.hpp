// Affine views of a picture, anti-aliased, and the features found in them. Integer and rational
// arithmetic only, so that tracker records are the same bytes on every machine.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "formats/base/turn.hpp"
#include "formats/pattern_shape.hpp"
#include "modar/image.hpp"
#include "modar/tracker_features.hpp"

namespace modar {

/// A reproducible sequence of random numbers (SplitMix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  // Here, since exposures draw one for each pixel.
  std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1.0p-53);
  }
  /// Mean 0, standard deviation 1, within +-3: the sum of three uniforms of 16 bits, whose variance
  /// is 1/4.
  double normal() {
    const std::uint64_t bits = next();
    const auto sum =
        static_cast<int>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF));
    return 0x1.0p-15 * (sum - 98304);
  }

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

/// e to the power x, with a relative error of about 1e-15, like turn_of() from sums and products
/// only. x: within +-4.
double exp_of(double x);

/// A view scaled by `scale`, compressed by `tilt` (>= 1) along `direction`, then rotated. It shows
/// the whole picture with a border of `margin` pixels.
AffineView make_view(int picture_width, int picture_height, double scale, double tilt,
                     Turn direction, Turn rotation, int margin);

/// The picture and its successive halvings, down to a side of 8.
std::vector<GrayPicture> halved(const GrayImage& picture);

/// One of the halvings, with each pixel's neighbours packed next to it as rendering reads them.
struct ViewLevel : GrayPicture {
  std::vector<std::uint32_t> quads;  ///< see ViewSamples
};
/// The levels of halved().
std::vector<ViewLevel> view_levels(const GrayImage& picture);

/// Boxes of random grays: a background without a photo.
GrayPicture made_clutter(Random& random, int width, int height);

/// Renders a view. Outside of the picture: its border pixels where `background` is null, else the
/// background, which has the view's size.
GrayPicture render_view(const std::vector<ViewLevel>& levels, const AffineView& view,
                        const GrayPicture* background);

/// Some pixels of a view.
struct ViewPart {
  int left = 0;
  int top = 0;
  int width = 0;
  int height = 0;
};
/// The same pixels as render_view() without a background has there.
GrayPicture render_part(const std::vector<ViewLevel>& levels, const AffineView& view,
                        const ViewPart& part);

/// What a camera far away sees of a curved pattern, and which place of the picture each pixel
/// shows.
struct CurvedView {
  GrayPicture picture;
  /// By pixel: x and y of the picture, in 64ths from its top left corner; kNoPlace: the background.
  std::vector<std::array<std::uint16_t, 2>> places;
  static constexpr std::uint16_t kNoPlace = 0xFFFF;
};

/// Axes of the frame (x right, y down, z away) of a pattern's own: three rows of a rotation.
using ViewAxes = std::array<std::array<double, 3>, 3>;

/// Renders the picture on its surface, turned by the axes and scaled: small tiles of it, each by
/// the affine view of its middle. background: of the view's size, made for it.
CurvedView render_surface_view(const std::vector<ViewLevel>& levels, const PatternSurface& surface,
                               const ViewAxes& axes, double scale, int margin,
                               const std::function<GrayPicture(int width, int height)>& background);

using TrackerCode = std::array<std::uint8_t, 32>;

/// Hamming distances of a 256-bit code to `count` of the codes at `codes`: out[i] is that to
/// codes[which[i]], or to codes[i] where `which` is null.
void code_distances(const TrackerCode& code, const TrackerCode* codes, const std::uint32_t* which,
                    std::size_t count, int* out);

/// Picture coordinates of a point of a view.
std::array<double, 2> to_picture(const AffineView& view, double x, double y);

/// Detects every corner that could be kept of a pattern; a frame's search takes the best only.
DetectOptions generous_detection();

}  // namespace modar
