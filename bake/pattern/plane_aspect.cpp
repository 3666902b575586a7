// Weighs the focal lengths that a photo may have by the right angle that each gives a rectangle.
#include "bake/pattern/plane_aspect.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/core.hpp>

#include "formats/base/ranges.hpp"

namespace modar {
namespace {

// Unknown quantities, in shares of the photo's longer side: a corner's place (at least a pixel),
// and where the optical axis meets the picture.
constexpr double kCornerSpread = 0.001;
constexpr double kCentreSpread = 0.01;
// The same of a cropped photo: places up to twice as far are tried. Higher: fewer shapes are known.
constexpr double kCroppedCentre = 0.4;
// Expected radial bend of a lens, of the cube of the distance from the axis. Higher trusts strong
// perspective less. [0.1, 0.25]
constexpr double kBendSpread = 0.25;
// Focal length where no EXIF tells it: main cameras of phones have 0.7 to 0.82 of the longer side.
// Spread: of its natural logarithm.
constexpr double kUsualFocal = 0.8;
constexpr double kUsualSpread = 0.15;
constexpr double kExifSpread = 0.03;
// The same of cropped photos.
constexpr double kCroppedFocal = 1.6;
constexpr double kCroppedSpread = 0.5;
// A share of photos that are outliers: cropped, or of a long lens.
constexpr double kOddShare = 0.01;
constexpr double kOddSpread = 0.7;
// Focal lengths that are tried, of the longer side.
constexpr double kShortest = 0.3;
constexpr double kLongest = 8.0;
constexpr int kFocals = 200;
constexpr int kCentres = 4;  // of a cropped photo, tried to each side of its middle

/// Corners and optical centre, relative to the photo's middle, in shares of its longer side, and
/// the lens's bend.
using View = std::array<double, 11>;

/// What a focal length makes of a view.
struct Shape {
  double log_aspect = 0;
  double cosine = 0;  ///< of the angle at the corners, 0 of a rectangle
};

/// First two columns of the homography from a unit square to a view, its optical centre in the
/// origin: the directions of the square's sides, but for the focal length.
struct Sides {
  cv::Vec3d across;
  cv::Vec3d down;

  explicit Sides(const View& view) {
    constexpr double kSquare[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    cv::Matx<double, 8, 8> equations;
    cv::Matx<double, 8, 1> values;
    for (int i = 0; i < 4; ++i) {
      double x = view[static_cast<std::size_t>(2 * i)] - view[8];
      double y = view[static_cast<std::size_t>(2 * i + 1)] - view[9];
      const double bent = 1 + view[10] * (x * x + y * y);
      x *= bent;
      y *= bent;
      const double u = kSquare[i][0];
      const double v = kSquare[i][1];
      const double rows[2][8] = {{u, v, 1, 0, 0, 0, -u * x, -v * x},
                                 {0, 0, 0, u, v, 1, -u * y, -v * y}};
      for (int k = 0; k < 8; ++k) {
        equations(2 * i, k) = rows[0][k];
        equations(2 * i + 1, k) = rows[1][k];
      }
      values(2 * i) = x;
      values(2 * i + 1) = y;
    }
    const cv::Matx<double, 8, 1> h = equations.solve(values, cv::DECOMP_LU);
    across = {h(0), h(3), h(6)};
    down = {h(1), h(4), h(7)};
  }

  [[nodiscard]] Shape shape(double focal) const {
    const cv::Vec3d scale(1 / focal, 1 / focal, 1);
    const cv::Vec3d a = across.mul(scale);
    const cv::Vec3d b = down.mul(scale);
    return {std::log(cv::norm(a) / cv::norm(b)), a.dot(b) / (cv::norm(a) * cv::norm(b))};
  }
};

double normal_density(double value, double spread) {
  const double z = value / spread;
  return std::exp(-0.5 * z * z) / spread;
}

/// How likely a focal length is before the corners are looked at; exif: 0 where it is not known.
double prior(double focal, double exif, bool cropped) {
  const double usual = exif > 0 ? exif : cropped ? kCroppedFocal : kUsualFocal;
  const double spread = exif > 0 ? kExifSpread : cropped ? kCroppedSpread : kUsualSpread;
  const double off = std::log(focal / usual);
  return (1 - kOddShare) * normal_density(off, spread) +
         kOddShare * normal_density(off, kOddSpread);
}

/// A focal length's weight, and the aspect of the rectangle that is nearest to the corners.
struct Weighed {
  double weight = 0;
  double log_aspect = 0;
  double variance = 0;
};

/// moved: the sides, with each number that is not known exactly off by its spread. usual: prior().
Weighed weigh(const Sides& sides, const std::vector<Sides>& moved, double focal, double usual) {
  const Shape here = sides.shape(focal);
  double aspects = 0;  // variances and covariance
  double cosines = 0;
  double both = 0;
  for (const Sides& one : moved) {
    const Shape there = one.shape(focal);
    const double aspect = there.log_aspect - here.log_aspect;
    const double cosine = there.cosine - here.cosine;
    aspects += aspect * aspect;
    cosines += cosine * cosine;
    both += aspect * cosine;
  }
  // Aspect and variance given that the angle is right.
  return {usual * normal_density(here.cosine, std::sqrt(cosines)),
          here.log_aspect - both / cosines * here.cosine, aspects - both * both / cosines};
}

/// Prior information about a photo, apart from its corners.
struct Known {
  double exif = 0;    ///< focal length, of the longer side; or 0
  double likely = 1;  ///< of the centre
  bool cropped = false;
};

/// Adds all focal lengths of a view. unit: the longer side, pixels.
void weigh_focals(const View& view, double unit, const Known& known, std::vector<Weighed>& all) {
  std::vector<Sides> moved;
  for (std::size_t k = 0; k < view.size(); ++k) {
    View other = view;
    other[k] += k < 8 ? std::max(kCornerSpread, 1 / unit) : k < 10 ? kCentreSpread : kBendSpread;
    moved.emplace_back(other);
  }
  const Sides sides(view);
  for (int i = 0; i < kFocals; ++i) {
    const double focal = kShortest * std::pow(kLongest / kShortest, i / (kFocals - 1.0));
    const double usual = prior(focal, known.exif, known.cropped);
    all.push_back(weigh(sides, moved, focal, known.likely * usual));
  }
}

}  // namespace

bool has_camera_shape(double width, double height) {
  constexpr double kShapes[] = {4.0 / 3, 3.0 / 2, 16.0 / 9};
  const double shape = std::max(width, height) / std::min(width, height);
  return ranges::any_of(kShapes, [&](double one) { return std::fabs(shape / one - 1) < 0.005; });
}

AspectEstimate estimate_aspect(const std::array<PixelPoint, 4>& corners, std::uint32_t width,
                               std::uint32_t height, double focal_px) {
  const double unit = std::max(width, height);
  View view{};
  for (std::size_t i = 0; i < 4; ++i) {
    view[2 * i] = (corners[i].x - 0.5 * (width - 1.0)) / unit;
    view[2 * i + 1] = (corners[i].y - 0.5 * (height - 1.0)) / unit;
  }
  const bool cropped = focal_px <= 0 && !has_camera_shape(width, height);
  const int reach = cropped ? kCentres : 0;
  std::vector<Weighed> all;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      View here = view;
      here[8] = 2 * kCroppedCentre * x / kCentres;
      here[9] = 2 * kCroppedCentre * y / kCentres;
      const double likely =
          normal_density(here[8], kCroppedCentre) * normal_density(here[9], kCroppedCentre);
      weigh_focals(here, unit, {focal_px / unit, likely, cropped}, all);
    }
  }
  double total = 0;
  double mean = 0;
  for (const Weighed& one : all) {
    total += one.weight;
    mean += one.weight * one.log_aspect;
  }
  mean /= total;
  double variance = 0;
  for (const Weighed& one : all) {
    variance += one.weight * (one.variance + std::pow(one.log_aspect - mean, 2)) / total;
  }
  return {std::exp(mean), std::exp(mean) * std::sqrt(variance)};
}

}  // namespace modar
