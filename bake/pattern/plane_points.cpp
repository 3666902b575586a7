// Chessboards and patterns in frames, with OpenCV.
#include "bake/pattern/plane_points.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kMostPlaces = 300;
constexpr std::size_t kFewestPlaces = 30;
constexpr double kBent = 4.0;  // pixels that a lens may move places off a homography

cv::Mat as_mat(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

/// The frame's part brought to the picture's mean and contrast, which the search for places takes
/// for granted.
void match_light(const cv::Mat& picture, const cv::Mat& mask, cv::Mat& warped) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::Scalar target;
  cv::Scalar spread;
  cv::meanStdDev(warped, mean, deviation, mask);
  cv::meanStdDev(picture, target, spread, mask);
  const double gain = spread[0] / std::max(deviation[0], 1.0);
  warped.convertTo(warped, CV_8U, gain, target[0] - gain * mean[0]);
}

}  // namespace

PlanePoints board_points(const GrayImage& frame, int columns, int rows) {
  PlanePoints points;
  const cv::Mat gray = as_mat(frame);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(
          gray, {columns, rows}, corners,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)) {
    return points;
  }
  cv::cornerSubPix(gray, corners, {5, 5}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 0.001});
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const cv::Point2f& p = corners[static_cast<std::size_t>(row * columns + column)];
      points.plane.emplace_back(column, row);
      points.pixels.emplace_back(p.x, p.y);
    }
  }
  return points;
}

struct PatternPoints::State {
  cv::Mat picture;
  std::vector<cv::Point2f> places;
  std::unique_ptr<PoseLoop> loop;
};

PatternPoints::PatternPoints(std::unique_ptr<State> state) : state_(std::move(state)) {}
PatternPoints::PatternPoints(PatternPoints&&) noexcept = default;
PatternPoints::~PatternPoints() = default;

Result<PatternPoints> PatternPoints::create(const NamedPattern& pattern, int width, int height) {
  const auto bundle = BundleView::open(pattern.bundle);
  if (!bundle) return tl::unexpected(bundle.error());
  PoseLoopOptions options;
  options.track = false;
  auto loop = PoseLoop::create(*bundle, default_camera(width, height), options);
  if (!loop) return tl::unexpected(loop.error());
  auto state = std::make_unique<State>();
  state->loop = std::move(*loop);
  state->picture = as_mat(pattern.picture.view());
  cv::goodFeaturesToTrack(state->picture, state->places, kMostPlaces, 0.01,
                          0.02 * std::max(pattern.picture.width, pattern.picture.height), {}, 7);
  return PatternPoints(std::move(state));
}

PlanePoints PatternPoints::find(const GrayImage& frame) {
  PlanePoints points;
  const auto seen = state_->loop->step(frame);
  if (!seen || seen->visible.empty()) return points;
  const cv::Mat& picture = state_->picture;
  const float right = static_cast<float>(picture.cols) - 0.5f;
  const float bottom = static_cast<float>(picture.rows) - 0.5f;
  const cv::Point2f own[4] = {{-0.5f, -0.5f}, {right, -0.5f}, {right, bottom}, {-0.5f, bottom}};
  cv::Point2f there[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2& corner = seen->visible[0].corners[i];
    there[i] = {static_cast<float>(corner.x), static_cast<float>(corner.y)};
  }
  const cv::Mat to_frame = cv::getPerspectiveTransform(own, there);
  cv::Mat warped;
  cv::Mat mask;
  cv::warpPerspective(as_mat(frame), warped, to_frame, picture.size(),
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  cv::warpPerspective(cv::Mat(frame.height, frame.width, CV_8UC1, cv::Scalar(255)), mask, to_frame,
                      picture.size(), cv::INTER_NEAREST | cv::WARP_INVERSE_MAP);
  match_light(picture, mask, warped);
  std::vector<cv::Point2f> found;
  std::vector<std::uint8_t> ok;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(picture, warped, state_->places, found, ok, error, {21, 21}, 2);
  std::vector<cv::Point2f> in_frame;
  cv::perspectiveTransform(found, in_frame, to_frame);
  std::vector<cv::Point2f> places;
  std::vector<cv::Point2f> pixels;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const cv::Point2f& p = in_frame[i];
    const bool inside = p.x >= 0 && p.y >= 0 && p.x < static_cast<float>(frame.width) &&
                        p.y < static_cast<float>(frame.height);
    if (ok[i] == 0 || error[i] > 20 || !inside) continue;
    places.push_back(state_->places[i]);
    pixels.push_back(p);
  }
  if (places.size() < kFewestPlaces) return points;
  std::vector<std::uint8_t> agrees;
  cv::findHomography(places, pixels, cv::RANSAC, kBent, agrees);
  for (std::size_t i = 0; i < agrees.size(); ++i) {
    if (agrees[i] == 0) continue;
    points.plane.emplace_back(places[i].x, places[i].y);
    points.pixels.emplace_back(pixels[i].x, pixels[i].y);
  }
  return points.plane.size() >= kFewestPlaces ? points : PlanePoints{};
}

}  // namespace modar
