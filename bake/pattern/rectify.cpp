// A quadrilateral in a photo to its frontal view, with the object's aspect ratio.
#include "bake/pattern/rectify.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace modar {
namespace {

// Photo pixels of the shortest side: the smallest picture that can be baked.
constexpr double kSmallestSide = 32.0;
// Of the result: the largest texture side that the workstation handles anywhere.
constexpr std::uint32_t kLargestResult = 8192;

double length(const PixelPoint& a, const PixelPoint& b) {
  return std::hypot(b.x - a.x, b.y - a.y);
}

tl::unexpected<Error> bad_corners(const char* cause) {
  return fail(ExitCode::kInvalidInput, "rectify.corners", "", cause,
              "give the corners inside of the photo as top-left, top-right, bottom-right, "
              "bottom-left of the pattern");
}

Result<RgbaImage> warp(const RgbaImage& photo, const std::array<PixelPoint, 4>& corners,
                       std::uint32_t width, std::uint32_t height, int oversampling) {
  try {
    const cv::Mat source(static_cast<int>(photo.height), static_cast<int>(photo.width), CV_8UC4,
                         const_cast<std::uint8_t*>(photo.pixels.data()));
    const cv::Size large(static_cast<int>(width) * oversampling,
                         static_cast<int>(height) * oversampling);
    std::array<cv::Point2f, 4> from;
    for (std::size_t i = 0; i < 4; ++i) {
      from[i] = {static_cast<float>(corners[i].x), static_cast<float>(corners[i].y)};
    }
    // The picture's edges are half a pixel outside the outermost pixel centres.
    const float right = static_cast<float>(large.width) - 0.5f;
    const float bottom = static_cast<float>(large.height) - 0.5f;
    const std::array<cv::Point2f, 4> to = {cv::Point2f{-0.5f, -0.5f}, cv::Point2f{right, -0.5f},
                                           cv::Point2f{right, bottom}, cv::Point2f{-0.5f, bottom}};
    cv::Mat warped;
    cv::warpPerspective(source, warped, cv::getPerspectiveTransform(from.data(), to.data()), large,
                        cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    RgbaImage out;
    out.width = width;
    out.height = height;
    out.pixels.resize(std::size_t{width} * height * 4);
    cv::Mat target(static_cast<int>(height), static_cast<int>(width), CV_8UC4, out.pixels.data());
    cv::resize(warped, target, target.size(), 0, 0, cv::INTER_AREA);
    return out;
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "rectify.opencv", "", thrown.what(), "report this as a bug");
  }
}

}  // namespace

Result<void> RectifyOptions::validate() const {
  for (std::size_t i = 0; i < 4; ++i) {
    const PixelPoint& a = corners[i];
    const PixelPoint& b = corners[(i + 1) % 4];
    const PixelPoint& c = corners[(i + 2) % 4];
    if (!std::isfinite(a.x) || !std::isfinite(a.y)) return bad_corners("a corner is not a number");
    // y points down, so a clockwise turn has a positive cross product.
    const double turn = (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
    if (!(turn > 0.0)) return bad_corners("the corners are not convex and clockwise");
    if (length(a, b) < kSmallestSide) return bad_corners("a side is shorter than 32 pixels");
  }
  if (!(width_mm >= 0) || !(height_mm >= 0) || !std::isfinite(width_mm) ||
      !std::isfinite(height_mm)) {
    return fail(ExitCode::kUsage, "rectify.size", "", "a physical size is negative or not a number",
                "give millimetres");
  }
  if (max_side < 32 || max_side > kLargestResult) {
    return fail(ExitCode::kUsage, "rectify.max-side", "",
                "the longer side must be 32 to 8192 pixels", "give another number");
  }
  return {};
}

Result<Rectified> rectify(const RgbaImage& photo, const RectifyOptions& options) {
  MODAR_TRY(options.validate());
  const double width = photo.width;
  const double height = photo.height;
  for (const PixelPoint& corner : options.corners) {
    if (corner.x < -0.5 || corner.y < -0.5 || corner.x > width - 0.5 || corner.y > height - 0.5) {
      return bad_corners("a corner is outside the photo");
    }
  }
  const auto& c = options.corners;
  const bool measured = options.width_mm > 0 && options.height_mm > 0;
  Rectified out;
  out.seen = estimate_aspect(c, photo.width, photo.height, options.focal_px);
  out.aspect = measured ? AspectEstimate{options.width_mm / options.height_mm, 0} : out.seen;
  const double aspect = out.aspect.aspect;
  const double photo_longest =
      std::max({length(c[0], c[1]), length(c[1], c[2]), length(c[2], c[3]), length(c[3], c[0])});
  const double longest = std::min(photo_longest, static_cast<double>(options.max_side));
  const double shortest = aspect >= 1.0 ? longest / aspect : longest * aspect;
  const auto long_pixels = static_cast<std::uint32_t>(std::lround(longest));
  const auto short_pixels = static_cast<std::uint32_t>(std::max(1L, std::lround(shortest)));
  // A result coarser than the photo is sampled finer and averaged, so that it does not alias.
  const int oversampling = std::clamp(static_cast<int>(std::ceil(photo_longest / longest)), 1, 8);
  const std::uint32_t wide = aspect >= 1.0 ? long_pixels : short_pixels;
  const std::uint32_t high = aspect >= 1.0 ? short_pixels : long_pixels;
  MODAR_ASSIGN(out.image, warp(photo, c, wide, high, oversampling));
  return out;
}

}  // namespace modar
