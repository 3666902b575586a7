// Wraps cv::SIFT and cv::ORB, a brute-force matcher and cv::findHomography.
#include "bake/extensions/lab/feature_peer.hpp"

#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

namespace modar {
namespace {

constexpr float kRatio = 0.8f;      // Lowe's, of the best match's distance to the second best's
constexpr double kInlierPx = 3;     // OpenCV's default threshold
constexpr int kOrbFeatures = 2000;  // of the ModAR paper's set orb-2000
constexpr int kFewestInliers = 12;  // the 8 of the ModAR paper pass on clutter

cv::Mat matrix_of(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

}  // namespace

struct FeaturePeer::State {
  explicit State(PeerMethod method)
      : features(method == PeerMethod::kOrbRansac
                     ? cv::Ptr<cv::Feature2D>(cv::ORB::create(kOrbFeatures))
                     : cv::Ptr<cv::Feature2D>(cv::SIFT::create())),
        matcher(method == PeerMethod::kOrbRansac ? cv::NORM_HAMMING : cv::NORM_L2),
        sampling(method == PeerMethod::kSiftMagsac ? cv::USAC_MAGSAC : cv::RANSAC) {}
  cv::Ptr<cv::Feature2D> features;
  cv::BFMatcher matcher;
  int sampling;
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::vector<cv::Point2d> outline;
};

FeaturePeer::FeaturePeer(std::unique_ptr<State> state) : state_(std::move(state)) {}
FeaturePeer::~FeaturePeer() = default;

std::unique_ptr<FeaturePeer> FeaturePeer::create(const GrayImage& pattern, PeerMethod method) {
  auto state = std::make_unique<State>(method);
  state->features->detectAndCompute(matrix_of(pattern), cv::noArray(), state->keypoints,
                                    state->descriptors);
  const double right = pattern.width - 0.5;
  const double bottom = pattern.height - 0.5;
  state->outline = {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
  return std::unique_ptr<FeaturePeer>(new FeaturePeer(std::move(state)));
}

Result<TrackResult> FeaturePeer::step(const GrayImage& frame) {
  TrackResult result;
  try {
    std::vector<cv::KeyPoint> seen;
    cv::Mat descriptors;
    state_->features->detectAndCompute(matrix_of(frame), cv::noArray(), seen, descriptors);
    if (descriptors.rows < 2 || state_->descriptors.rows < 2) return result;
    std::vector<std::vector<cv::DMatch>> matches;
    state_->matcher.knnMatch(descriptors, state_->descriptors, matches, 2);
    std::vector<cv::Point2f> from;
    std::vector<cv::Point2f> to;
    for (const auto& pair : matches) {
      if (pair.size() < 2 || pair[0].distance > kRatio * pair[1].distance) continue;
      from.push_back(state_->keypoints[static_cast<std::size_t>(pair[0].trainIdx)].pt);
      to.push_back(seen[static_cast<std::size_t>(pair[0].queryIdx)].pt);
    }
    if (from.size() < 4) return result;
    cv::Mat inliers;
    const cv::Mat map = cv::findHomography(from, to, state_->sampling, kInlierPx, inliers);
    if (map.empty() || cv::countNonZero(inliers) < kFewestInliers) return result;
    std::vector<cv::Point2d> corners;
    cv::perspectiveTransform(state_->outline, corners, map);
    Detection detection;
    for (std::size_t i = 0; i < 4; ++i) detection.corners[i] = {corners[i].x, corners[i].y};
    detection.matches = static_cast<int>(from.size());
    detection.inliers = cv::countNonZero(inliers);
    result.visible.push_back(detection);
    return result;
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "bench.peer", "", thrown.what(), "report this as a bug");
  }
}

}  // namespace modar
