// A pattern made on the spot: the order of its corners; rectified and described through OpenCV,
// which throws: caught here.
#include "spot_pattern.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "formats/bundle_writer.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

double cross(glm::dvec2 a, glm::dvec2 b) {
  return a.x * b.y - a.y * b.x;
}

}  // namespace

Result<std::array<glm::dvec2, 4>> ordered_corners(const std::array<glm::dvec2, 4>& clicked) {
  constexpr double kLeastSide = 24;
  std::array<glm::dvec2, 4> corners = clicked;
  const glm::dvec2 centre = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  const auto angle = [centre](glm::dvec2 p) { return std::atan2(p.y - centre.y, p.x - centre.x); };
  // y points down, so that growing angles go clockwise on the screen.
  std::sort(corners.begin(), corners.end(),
            [&](glm::dvec2 a, glm::dvec2 b) { return angle(a) < angle(b); });
  const auto top_left =
      std::min_element(corners.begin(), corners.end(),
                       [](glm::dvec2 a, glm::dvec2 b) { return a.x + a.y < b.x + b.y; });
  std::rotate(corners.begin(), top_left, corners.end());
  bool good = true;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 side = corners[(i + 1) % 4] - corners[i];
    const glm::dvec2 next = corners[(i + 2) % 4] - corners[(i + 1) % 4];
    // Twice a triangle's area against its sides: three points in a row make no corner.
    good = good && glm::length(side) >= kLeastSide &&
           cross(side, next) > 0.1 * glm::length(side) * glm::length(next);
  }
  if (good) return corners;
  return fail(ExitCode::kUsage, "spot.corners", "", "the four clicks make no four-sided figure",
              "click the corners of the pattern, at least 24 pixels apart");
}

namespace {

/// The quadrilateral as a rectangle with the mean of its opposite sides.
cv::Mat rectified(const RgbImage& frame, const std::array<glm::dvec2, 4>& corners) {
  constexpr double kMostSide = 640;  // pixels: what camera frames show of it; more costs time
  double width =
      0.5 * (glm::distance(corners[0], corners[1]) + glm::distance(corners[3], corners[2]));
  double height =
      0.5 * (glm::distance(corners[0], corners[3]) + glm::distance(corners[1], corners[2]));
  const double shrink = std::min(1.0, kMostSide / std::max(width, height));
  width = std::round(width * shrink);
  height = std::round(height * shrink);
  std::array<cv::Point2f, 4> from;
  for (std::size_t i = 0; i < 4; ++i) {
    from[i] = {static_cast<float>(corners[i].x), static_cast<float>(corners[i].y)};
  }
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  const std::array<cv::Point2f, 4> to = {{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
  const cv::Mat rgb(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.pixels),
                    static_cast<std::size_t>(frame.stride));
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  cv::Mat flat;
  cv::warpPerspective(gray, flat, cv::getPerspectiveTransform(from.data(), to.data()),
                      cv::Size(static_cast<int>(width), static_cast<int>(height)), cv::INTER_LINEAR,
                      cv::BORDER_REPLICATE);
  return flat;
}

Result<BundleContent> content_of(const cv::Mat& flat, const ParameterSetRecord& asked) {
  const ParameterSetRecord& parameters = asked.id == 0 ? paper_parameter_sets().front() : asked;
  MODAR_ASSIGN(Features features, describe_image({flat.data, flat.cols, flat.rows,
                                                  static_cast<std::ptrdiff_t>(flat.step)},
                                                 parameters));
  if (features.keypoints.size() < parameters.min_matches) {
    return fail(ExitCode::kInvalidInput, "spot.features", "",
                "too little is found on it to know it again",
                "take a pattern with more texture, or hold the camera closer");
  }
  BundleContent content;
  PatternRecord pattern{};
  pattern.name = content.intern("on the spot");
  pattern.width = static_cast<std::uint32_t>(flat.cols);
  pattern.height = static_cast<std::uint32_t>(flat.rows);
  const auto side = static_cast<float>(std::max(flat.cols, flat.rows));
  pattern.half_width = static_cast<float>(flat.cols) / side;
  pattern.half_height = static_cast<float>(flat.rows) / side;
  pattern.score = -1;
  content.patterns.push_back(pattern);
  ParameterSetRecord set = parameters;
  set.name = content.intern(parameter_set_name(set.id));
  content.parameter_sets.push_back(set);
  content.features.push_back({{set.id, features.descriptor_bytes, std::move(features.keypoints),
                               std::move(features.descriptors), ""}});
  return content;
}

}  // namespace

Result<std::shared_ptr<const SpotPattern>> make_spot_pattern(
    const RgbImage& frame, const std::array<glm::dvec2, 4>& clicked,
    const ParameterSetRecord& parameters) {
  MODAR_ASSIGN(const auto corners, ordered_corners(clicked));
  try {
    MODAR_ASSIGN(const BundleContent content, content_of(rectified(frame, corners), parameters));
    Result<std::vector<std::byte>> bytes = encode_bundle(content);
    if (!bytes) return tl::unexpected(bytes.error());
    auto pattern = std::make_shared<SpotPattern>();
    pattern->bytes = std::move(*bytes);
    Result<BundleView> view = BundleView::open(pattern->bytes);
    if (!view) return tl::unexpected(view.error());
    pattern->view = *view;
    return pattern;
  } catch (const std::exception& error) {
    return fail(ExitCode::kInternal, "spot.opencv", "", std::string("OpenCV: ") + error.what(),
                "report this with the picture that it happened on");
  }
}

}  // namespace modar
