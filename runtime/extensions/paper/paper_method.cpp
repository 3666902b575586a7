// The ModAR paper's pose loop, frame by frame: match, RANSAC, Levenberg-Marquardt, corners, pose.
#include <cmath>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "modar/features.hpp"
#include "modar/paper_tracker.hpp"
#include "runtime/opencv/features.hpp"
#include "runtime/opencv/opencv_bridge.hpp"
#include "runtime/platform/lap_clock.hpp"

namespace modar {
namespace {

struct Target {
  std::uint32_t pattern = 0;
  std::vector<cv::Point2f> points;
  cv::Mat descriptors;  ///< a view of the mapped twin
  std::vector<cv::Point2f> image_corners;
  std::array<glm::dvec2, 4> world_corners{};
};

Target make_target(const PatternRecord& record, std::uint32_t index, const FeatureView& features) {
  Target target;
  target.pattern = index;
  for (const KeypointRecord& keypoint : features.keypoints) {
    target.points.emplace_back(keypoint.x, keypoint.y);
  }
  // OpenCV has no constant view; the matcher only reads.
  target.descriptors = cv::Mat(static_cast<int>(features.keypoints.size()),
                               static_cast<int>(features.descriptor_bytes), CV_8UC1,
                               const_cast<std::byte*>(features.descriptors.data()));
  // Pixel centres are integers: the picture begins half a pixel before the first.
  const float right = static_cast<float>(record.width) - 0.5f;
  const float bottom = static_cast<float>(record.height) - 0.5f;
  target.image_corners = {{-0.5f, -0.5f}, {right, -0.5f}, {right, bottom}, {-0.5f, bottom}};
  target.world_corners =
      pattern_corners(static_cast<int>(record.width), static_cast<int>(record.height));
  return target;
}

bool finite(const std::array<glm::dvec2, 4>& corners) {
  for (const glm::dvec2& corner : corners) {
    if (!std::isfinite(corner.x) || !std::isfinite(corner.y)) return false;
  }
  return true;
}

}  // namespace

struct PaperTracker::State {
  ParameterSetRecord parameters{};
  Camera camera;
  cv::Ptr<cv::Feature2D> engine;
  cv::BFMatcher matcher{cv::NORM_HAMMING, true};
  std::vector<Target> targets;

  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::vector<cv::DMatch> matches;
  std::vector<cv::Point2f> from, to;

  Result<TrackResult> step(const GrayImage& frame);
  Reason find(const Target& target, Detection& detection, TrackTimes& times);
  Reason homography(const Target& target, Detection& detection);
  Reason pose(const Target& target, Detection& detection) const;
};

PaperTracker::PaperTracker(std::unique_ptr<State> state) : state_(std::move(state)) {}
PaperTracker::~PaperTracker() = default;

Result<std::unique_ptr<PaperTracker>> PaperTracker::create(const BundleView& bundle,
                                                           std::uint32_t set_id,
                                                           const Camera& camera) {
  const auto work = [&]() -> Result<std::unique_ptr<PaperTracker>> {
    auto state = std::make_unique<State>();
    state->camera = camera;
    const Table<ParameterSetRecord> sets = bundle.parameter_sets();
    for (const ParameterSetRecord& set : sets) {
      if (set.id == set_id) state->parameters = set;
    }
    const Table<PatternRecord> patterns = bundle.patterns();
    for (std::uint32_t i = 0; i < patterns.size() && state->parameters.id == set_id; ++i) {
      const FeatureView features = bundle.features(i, set_id);
      if (features.keypoints.empty() ||
          features.descriptor_bytes != state->parameters.descriptor_bits / 8) {
        continue;
      }
      state->targets.push_back(make_target(patterns[i], i, features));
    }
    if (state->targets.empty()) {
      return fail(
          ExitCode::kInvalidInput, "tracker.no-patterns", "",
          "the bundle holds no pattern described with parameter set " + std::to_string(set_id),
          "bake it with a pattern");
    }
    auto engine = paper::make_feature_engine(state->parameters);
    if (!engine) return tl::unexpected(engine.error());
    state->engine = *engine;
    return std::unique_ptr<PaperTracker>(new PaperTracker(std::move(state)));
  };
  return paper::guarded(ExitCode::kInternal, "tracker.opencv", "report this as a bug", work);
}

Result<TrackResult> PaperTracker::step(const GrayImage& frame) {
  const Camera& camera = state_->camera;
  if (frame.pixels == nullptr || frame.width != camera.width || frame.height != camera.height ||
      frame.width <= 0 || frame.height <= 0 || frame.stride < frame.width) {
    return fail(ExitCode::kInvalidInput, "tracker.frame-size", "",
                "a frame of " + std::to_string(frame.width) + "x" + std::to_string(frame.height) +
                    " for a camera of " + std::to_string(camera.width) + "x" +
                    std::to_string(camera.height),
                "create the tracker with the camera of these frames");
  }
  return paper::guarded(ExitCode::kInternal, "tracker.opencv", "report this as a bug",
                        [&] { return state_->step(frame); });
}

Result<TrackResult> PaperTracker::State::step(const GrayImage& frame) {
  TrackResult result;
  if (paper::too_small_for_features(parameters, frame.width, frame.height)) return result;
  const cv::Mat pixels = paper::view_of(frame);
  LapClock clock;
  engine->detect(pixels, keypoints);
  result.times.detect = clock.lap();
  engine->compute(pixels, keypoints, descriptors);
  result.times.describe = clock.lap();
  result.features = static_cast<int>(keypoints.size());
  if (keypoints.empty()) return result;
  for (const Target& target : targets) {
    Detection detection;
    detection.pattern = target.pattern;
    const Reason reason = find(target, detection, result.times);
    if (progress(reason) > progress(result.reason)) result.reason = reason;
    if (reason == Reason::kVisible) result.visible.push_back(detection);
  }
  return result;
}

Reason PaperTracker::State::find(const Target& target, Detection& detection, TrackTimes& times) {
  LapClock clock;
  matcher.match(target.descriptors, descriptors, matches);
  from.clear();
  to.clear();
  for (const cv::DMatch& match : matches) {
    if (match.distance > static_cast<float>(parameters.max_distance)) continue;
    from.push_back(target.points[static_cast<std::size_t>(match.queryIdx)]);
    to.push_back(keypoints[static_cast<std::size_t>(match.trainIdx)].pt);
  }
  times.match += clock.lap();
  detection.matches = static_cast<int>(from.size());
  // Four points make a homography, whatever a file asks for.
  if (from.size() < std::max<std::size_t>(parameters.min_matches, 4)) return Reason::kFewMatches;
  Reason reason = homography(target, detection);
  times.homography += clock.lap();
  if (reason != Reason::kVisible) return reason;
  reason = pose(target, detection);
  times.pose += clock.lap();
  return reason;
}

Reason PaperTracker::State::homography(const Target& target, Detection& detection) {
  // OpenCV seeds this RANSAC with a constant, so a frame gives the same answer every time.
  std::vector<unsigned char> inlier;
  const double threshold = static_cast<double>(parameters.ransac_threshold);
  const cv::Mat sampled = cv::findHomography(from, to, cv::RANSAC, threshold, inlier);
  if (sampled.empty()) return Reason::kNoGeometry;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < inlier.size(); ++i) {
    if (inlier[i] == 0) continue;
    from[kept] = from[i];
    to[kept] = to[i];
    ++kept;
  }
  from.resize(kept);
  to.resize(kept);
  detection.inliers = static_cast<int>(kept);
  if (kept < std::max<std::size_t>(parameters.min_inliers, 4)) return Reason::kNoGeometry;
  // Method 0: least squares over all points, then Levenberg-Marquardt.
  const cv::Mat refined = cv::findHomography(from, to, 0);
  if (refined.empty()) return Reason::kNoGeometry;
  std::vector<cv::Point2f> corners;
  cv::perspectiveTransform(target.image_corners, corners, refined);
  for (std::size_t i = 0; i < 4; ++i) {
    detection.corners[i] = {static_cast<double>(corners[i].x), static_cast<double>(corners[i].y)};
  }
  return finite(detection.corners) ? Reason::kVisible : Reason::kFailedVerification;
}

Reason PaperTracker::State::pose(const Target& target, Detection& detection) const {
  std::array<glm::dvec2, 4> ideal;
  for (std::size_t i = 0; i < 4; ++i) ideal[i] = undistort(camera, detection.corners[i]);
  const auto plane = homography_from_points(target.world_corners, ideal);
  if (!plane) return Reason::kFailedVerification;
  const auto closed_form = pose_from_homography(camera, *plane);
  if (!closed_form) return Reason::kFailedVerification;
  detection.pose = refine_pose(camera, target.world_corners, ideal, *closed_form);
  return Reason::kVisible;
}

}  // namespace modar
