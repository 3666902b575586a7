// A pattern's picture to its record and its features under every parameter set of the article.
#include <algorithm>
#include <cmath>
#include <string_view>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/pattern_image.hpp"
#include "modar/features.hpp"
#include "modar/pose.hpp"

namespace modar {
namespace {

// The article's patterns are 245 to 717 pixels on a side. Larger pictures only move the scales at
// which features are found away from those at which a camera sees the pattern.
constexpr int kLargestSide = 720;

std::string base_name(std::string_view path) {
  const std::size_t slash = path.find_last_of("/\\");
  std::string_view name = slash == std::string_view::npos ? path : path.substr(slash + 1);
  const std::size_t dot = name.find_last_of('.');
  if (dot != std::string_view::npos && dot > 0) name = name.substr(0, dot);
  return std::string(name);
}

/// Grey as cameras deliver it; what is transparent shows white paper.
cv::Mat grey_of(const RgbaImage& image) {
  cv::Mat grey(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC1);
  for (std::size_t i = 0; i < grey.total(); ++i) {
    const std::uint8_t* p = image.pixels.data() + 4 * i;
    // Rec. 601 luma, in 16-bit fixed point: the same bytes on every machine.
    const std::uint32_t luma = (19595u * p[0] + 38470u * p[1] + 7471u * p[2] + 32768u) >> 16;
    grey.data[i] = static_cast<std::uint8_t>((luma * p[3] + 255u * (255u - p[3]) + 127u) / 255u);
  }
  return grey;
}

Result<cv::Mat> pattern_pixels(const RgbaImage& image) {
  try {
    cv::Mat grey = grey_of(image);
    const int longest = std::max(grey.cols, grey.rows);
    if (longest <= kLargestSide) return grey;
    const double scale = static_cast<double>(kLargestSide) / longest;
    const cv::Size size(std::max(1, static_cast<int>(std::lround(grey.cols * scale))),
                        std::max(1, static_cast<int>(std::lround(grey.rows * scale))));
    cv::Mat small;
    cv::resize(grey, small, size, 0, 0, cv::INTER_AREA);
    return small;
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "pattern.opencv", "", thrown.what(), "report this as a bug");
  }
}

Result<FeatureContent> describe(const GrayImage& image, const ParameterSetRecord& parameters) {
  auto features = describe_image(image, parameters);
  if (!features) return tl::unexpected(features.error());
  auto yml = features_to_yml(*features);
  if (!yml) return tl::unexpected(yml.error());
  FeatureContent content;
  content.set_id = parameters.id;
  content.descriptor_bytes = features->descriptor_bytes;
  content.keypoints = std::move(features->keypoints);
  content.descriptors = std::move(features->descriptors);
  content.yml = std::move(*yml);
  return content;
}

}  // namespace

Result<PatternFeatures> bake_pattern(const std::string& path, double width_mm, Report& report) {
  StageTimer timer(report, "pattern");
  const auto image = read_image(path);
  if (!image) return tl::unexpected(image.error());
  auto pixels = pattern_pixels(*image);
  if (!pixels) {
    pixels.error().where = path;
    return tl::unexpected(pixels.error());
  }
  const GrayImage grey{pixels->data, pixels->cols, pixels->rows,
                       static_cast<std::ptrdiff_t>(pixels->step[0])};
  if (grey.width != static_cast<int>(image->width)) {
    report.findings.push_back({"pattern.resized", FindingSeverity::kInfo, path, 0,
                               "the picture was made smaller, to " + std::to_string(grey.width) +
                                   "x" + std::to_string(grey.height) + " pixels",
                               ""});
  }
  PatternFeatures out;
  out.name = base_name(path);
  out.record.width = static_cast<std::uint32_t>(grey.width);
  out.record.height = static_cast<std::uint32_t>(grey.height);
  out.record.width_mm = width_mm > 0 ? width_mm : read_width_mm(path);
  const auto corners = pattern_corners(grey.width, grey.height);
  out.record.half_width = static_cast<float>(corners[1].x);
  out.record.half_height = static_cast<float>(corners[1].y);
  out.record.score = -1.0f;
  const auto sets = paper_parameter_sets();
  for (const ParameterSetRecord& parameters : sets) {
    auto content = describe(grey, parameters);
    if (!content) return tl::unexpected(content.error());
    out.features.push_back(std::move(*content));
  }
  const std::size_t found = out.features.front().keypoints.size();
  if (found < sets.front().min_matches) {
    return fail(ExitCode::kInvalidInput, "pattern.no-features", path,
                "the picture holds " + std::to_string(found) + " features, too few to recognise it",
                "take a larger, sharper picture with more texture");
  }
  timer.done(pixels->total(), found);
  return out;
}

}  // namespace modar
