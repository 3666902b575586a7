// Finds a chessboard or a pattern in frames, and solves for the camera with OpenCV.
#include "bake/pattern/calibrate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include <glm/vec2.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "bake/image/image.hpp"
#include "bake/pattern/gray_mat.hpp"
#include "bake/pattern/trial.hpp"
#include "bake/video/video.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/bundle_view.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

// Points of a pattern that are searched for, and the fewest that make a view: more slow the search
// down; of 30, a wrong one weighs a thirtieth.
constexpr int kMostPoints = 300;
constexpr std::size_t kFewestPoints = 30;
constexpr double kMostDistortion = 4.0;  // pixels that a lens may move points off a homography

// Zhang's method needs 3 views; 5 leave some to tell a bad one by.
constexpr std::size_t kFewestViews = 5;
constexpr int kFewestTilted = 3;
constexpr double kTilted =
    0.97;  // cosine of 14 degrees: less tilt says nothing of the focal length
// Standard deviation of the focal length over its value. 3 % moves a model by a fiftieth of its
// distance, which is visible next to real objects.
constexpr double kWeakest = 0.03;
// Degrees by which the planes' normals must scatter, see Tilts. Lower accepts nearly parallel
// planes, which give a wrong principal point.
constexpr double kFocalScatter = 8.0;
constexpr double kPrincipalPointScatter = 4.0;
constexpr int kVideoFrames = 120;  // of a video that are examined: three for each view that is used
// Times the median error, above which views are left out. Lower drops good views. [1.2, 1.5]
constexpr double kOutlier = 3.0;

/// Points of one view: on the plane (any unit) and in the frame (pixels).
struct PlanePoints {
  std::vector<glm::dvec2> plane;
  std::vector<glm::dvec2> pixels;
};

/// Inner corners of a chessboard with sub-pixel accuracy; none unless all of it is visible.
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

/// Scales the frame's part to the picture's mean and contrast: the optical flow assumes equal
/// brightness.
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

/// Finds a pattern in frames of one size.
class PatternFinder {
 public:
  /// pattern: must outlive this. Errors: those of the tracker.
  static Result<PatternFinder> create(const NamedPattern& pattern, int width, int height) {
    MODAR_ASSIGN(const auto bundle, BundleView::open(pattern.bundle));
    PoseLoopOptions options;
    options.estimate_camera = true;
    PatternFinder finder;
    MODAR_ASSIGN(finder.loop_, PoseLoop::create(bundle, default_camera(width, height), options));
    finder.picture_ = as_mat(pattern.picture.view());
    cv::goodFeaturesToTrack(finder.picture_, finder.points_, kMostPoints, 0.01,
                            0.02 * std::max(pattern.picture.width, pattern.picture.height), {}, 7);
    return finder;
  }
  /// Well-textured points of the pattern in the frame; none where it is not seen well. The tracker
  /// finds the pattern, then each point is searched for around its predicted position, so that the
  /// result depends neither on the tracker's default camera nor on a lens without distortion.
  [[nodiscard]] PlanePoints find(const GrayImage& frame) const;

 private:
  PatternFinder() = default;
  cv::Mat picture_;
  std::vector<cv::Point2f> points_;
  std::unique_ptr<PoseLoop> loop_;
};

PlanePoints PatternFinder::find(const GrayImage& frame) const {
  PlanePoints points;
  const auto seen = loop_->step(frame);
  if (!seen || seen->visible.empty()) return points;
  const float right = static_cast<float>(picture_.cols) - 0.5f;
  const float bottom = static_cast<float>(picture_.rows) - 0.5f;
  const cv::Point2f own[4] = {{-0.5f, -0.5f}, {right, -0.5f}, {right, bottom}, {-0.5f, bottom}};
  cv::Point2f there[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2& corner = seen->visible[0].corners[i];
    there[i] = {static_cast<float>(corner.x), static_cast<float>(corner.y)};
  }
  const cv::Mat to_frame = cv::getPerspectiveTransform(own, there);
  cv::Mat warped;
  cv::Mat mask;
  cv::warpPerspective(as_mat(frame), warped, to_frame, picture_.size(),
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  cv::warpPerspective(cv::Mat(frame.height, frame.width, CV_8UC1, cv::Scalar(255)), mask, to_frame,
                      picture_.size(), cv::INTER_NEAREST | cv::WARP_INVERSE_MAP);
  match_light(picture_, mask, warped);
  std::vector<cv::Point2f> found;
  std::vector<std::uint8_t> ok;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(picture_, warped, points_, found, ok, error, {21, 21}, 2);
  std::vector<cv::Point2f> in_frame;
  cv::perspectiveTransform(found, in_frame, to_frame);
  std::vector<cv::Point2f> places;
  std::vector<cv::Point2f> pixels;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const cv::Point2f& p = in_frame[i];
    const bool inside = p.x >= 0 && p.y >= 0 && p.x < static_cast<float>(frame.width) &&
                        p.y < static_cast<float>(frame.height);
    if (ok[i] == 0 || error[i] > 20 || !inside) continue;
    places.push_back(points_[i]);
    pixels.push_back(p);
  }
  if (places.size() < kFewestPoints) return points;
  std::vector<std::uint8_t> agrees;
  cv::findHomography(places, pixels, cv::RANSAC, kMostDistortion, agrees);
  for (std::size_t i = 0; i < agrees.size(); ++i) {
    if (agrees[i] == 0) continue;
    points.plane.emplace_back(places[i].x, places[i].y);
    points.pixels.emplace_back(pixels[i].x, pixels[i].y);
  }
  return points.plane.size() >= kFewestPoints ? points : PlanePoints{};
}

/// Passes frames of the video to `add`, evenly spread, about kVideoFrames of them.
template <class Add>
Result<void> read_video(const std::string& path, Add&& add) {
  MODAR_ASSIGN(Video video, Video::open(path));
  auto frame = video.next();
  if (!frame) {
    return fail(ExitCode::kIo, "calibrate.input", path, "neither a picture nor a video",
                "give pictures or a video that other players show");
  }
  const auto step = std::max<std::uint64_t>(1, video.frames() / kVideoFrames);
  for (std::uint64_t index = 0; frame; ++index, frame = video.next()) {
    if (index % step == 0) add(*frame);
  }
  return {};
}

/// Views of the plane in all frames.
struct PlaneViews {
  cv::Size size;
  std::vector<PlanePoints> views;
  int frames = 0;
  std::optional<Error> error;
};

/// Searches each frame for the plane.
class ViewCollector {
 public:
  ViewCollector(const CalibrateOptions& options, const NamedPattern* pattern, PlaneViews& out)
      : options_(options), pattern_(pattern), out_(out) {}

  void add(const std::string& path, const GrayImage& frame) {
    if (out_.error) return;
    const cv::Size size(frame.width, frame.height);
    if (out_.frames == 0) out_.size = size;
    ++out_.frames;
    if (size != out_.size) {
      out_.error = Error{ExitCode::kInvalidInput, "calibrate.size", path,
                         "its size differs from that of the frames before",
                         "use frames of one camera in one resolution"};
      return;
    }
    PlanePoints points;
    if (pattern_ == nullptr) {
      points = board_points(frame, options_.board_columns, options_.board_rows);
    } else if (ready(size)) {
      points = finder_->find(frame);
    }
    if (!points.plane.empty()) out_.views.push_back(std::move(points));
  }

 private:
  bool ready(const cv::Size& size) {
    if (finder_) return true;
    auto finder = PatternFinder::create(*pattern_, size.width, size.height);
    if (!finder) {
      out_.error = finder.error();
      return false;
    }
    finder_ = std::make_unique<PatternFinder>(std::move(*finder));
    return true;
  }

  const CalibrateOptions& options_;
  const NamedPattern* pattern_;
  PlaneViews& out_;
  std::unique_ptr<PatternFinder> finder_;
};

Result<PlaneViews> collect_views(const CalibrateOptions& options, const NamedPattern* pattern,
                                 const ProgressCallback& progress) {
  PlaneViews views;
  ViewCollector collector(options, pattern, views);
  double done = 0;
  for (const std::string& path : options.inputs) {
    if (is_picture_file(path)) {
      MODAR_ASSIGN(const GrayPicture picture, load_gray(path));
      collector.add(path, picture.view());
    } else {
      MODAR_TRY(read_video(path, [&](const GrayImage& frame) { collector.add(path, frame); }));
    }
    if (views.error) return tl::unexpected(*views.error);
    if (progress) progress("frames", ++done / static_cast<double>(options.inputs.size()));
  }
  return views;
}

/// At most `most` of the views, evenly spread.
std::vector<PlanePoints> spread_out(std::vector<PlanePoints> views, int most) {
  const std::size_t count = views.size();
  const auto keep = static_cast<std::size_t>(most);
  if (count <= keep) return views;
  std::vector<PlanePoints> kept;
  for (std::size_t i = 0; i < keep; ++i) kept.push_back(std::move(views[i * count / keep]));
  return kept;
}

/// How the planes' normals scatter about their mean, in degrees: standard deviations along the
/// direction in which they scatter most, and across. Zhang's method depends on it: from planes that
/// are nearly parallel a solver returns a wrong principal point with a small standard deviation.
struct Tilts {
  double along = 0;
  double across = 0;
};

Tilts tilts_of(const std::vector<cv::Vec3d>& normals) {
  cv::Vec2d mean(0, 0);
  const double share = 1.0 / static_cast<double>(normals.size());
  for (const cv::Vec3d& normal : normals) mean += share * cv::Vec2d(normal[0], normal[1]);
  double xx = 0;
  double yy = 0;
  double xy = 0;
  for (const cv::Vec3d& normal : normals) {
    const cv::Vec2d off = cv::Vec2d(normal[0], normal[1]) - mean;
    xx += share * off[0] * off[0];
    yy += share * off[1] * off[1];
    xy += share * off[0] * off[1];
  }
  const double middle = 0.5 * (xx + yy);
  const double half = std::hypot(0.5 * (xx - yy), xy);
  constexpr double kDegrees = 57.29577951308232;
  return {kDegrees * std::sqrt(middle + half), kDegrees * std::sqrt(std::max(0.0, middle - half))};
}

struct Solved {
  cv::Mat matrix;
  cv::Mat distortion;
  double rms = 0;
  double focal_spread = 0;
  std::vector<double> view_rms;
  int tilted = 0;  ///< views of a plane that is not square to the line of sight
  Tilts tilts;
};

/// centred: the principal point stays in the frame's middle. aspect: of the plane, over that of its
/// points.
Solved solve(const std::vector<PlanePoints>& views, const cv::Size& size, bool board, bool centred,
             double aspect) {
  std::vector<std::vector<cv::Point3f>> plane;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const PlanePoints& view : views) {
    plane.emplace_back();
    pixels.emplace_back();
    for (std::size_t i = 0; i < view.plane.size(); ++i) {
      plane.back().emplace_back(static_cast<float>(view.plane[i].x),
                                static_cast<float>(aspect * view.plane[i].y), 0.0f);
      pixels.back().emplace_back(static_cast<float>(view.pixels[i].x),
                                 static_cast<float>(view.pixels[i].y));
    }
  }
  Solved solved;
  solved.matrix = cv::Mat::eye(3, 3, CV_64F);
  int flags =
      board ? 0 : cv::CALIB_FIX_ASPECT_RATIO | cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3;
  if (centred) flags |= cv::CALIB_FIX_PRINCIPAL_POINT;
  cv::Mat rotations;
  cv::Mat translations;
  cv::Mat spread;
  cv::Mat pose_spread;
  cv::Mat errors;
  solved.rms = cv::calibrateCamera(plane, pixels, size, solved.matrix, solved.distortion, rotations,
                                   translations, spread, pose_spread, errors, flags);
  solved.focal_spread = std::max(spread.at<double>(0), spread.at<double>(1));
  std::vector<cv::Vec3d> normals;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    cv::Mat rotation;
    cv::Rodrigues(rotations.row(i).reshape(1, 3), rotation);
    const cv::Vec3d normal(rotation.col(2));
    normals.push_back(normal[2] < 0 ? -normal : normal);
    solved.tilted += std::abs(normal[2]) < kTilted ? 1 : 0;
  }
  solved.tilts = tilts_of(normals);
  solved.view_rms.assign(errors.begin<double>(), errors.end<double>());
  return solved;
}

/// Few views of few points: to choose an aspect takes fewer than a camera.
std::vector<PlanePoints> thinned(const std::vector<PlanePoints>& views) {
  constexpr std::size_t kViews = 15;
  constexpr std::size_t kPoints = 40;  // of a view
  std::vector<PlanePoints> out;
  const std::size_t count = std::min(kViews, views.size());
  for (std::size_t k = 0; k < count; ++k) {
    const PlanePoints& view = views[k * views.size() / count];
    const std::size_t step = std::max<std::size_t>(1, view.plane.size() / kPoints);
    PlanePoints& kept = out.emplace_back();
    for (std::size_t i = 0; i < view.plane.size(); i += step) {
      kept.plane.push_back(view.plane[i]);
      kept.pixels.push_back(view.pixels[i]);
    }
  }
  return out;
}

/// A print's height over its width, over that of its picture, by which its views fit best with the
/// principal point in the middle, which else takes up what an aspect is off: photos that were
/// rectified are off by up to 15 %. Golden section.
double fitted_aspect(const std::vector<PlanePoints>& views, const cv::Size& size) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSteps = 9;  // to half a percent
  const std::vector<PlanePoints> few = thinned(views);
  const auto rms = [&](double aspect) { return solve(few, size, false, true, aspect).rms; };
  double low = 0.8;
  double high = 1.25;
  double a = high - kGolden * (high - low);
  double b = low + kGolden * (high - low);
  double at_a = rms(a);
  double at_b = rms(b);
  for (int i = 0; i < kSteps; ++i) {
    if (at_a < at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = rms(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = rms(b);
    }
  }
  return 0.5 * (low + high);
}

/// Standard deviation of the focal length as the views tell it (jackknife over thirds of them):
/// what lenses, flow and paper are off by, neighbours share, so that a solver's own spread is too
/// small.
double spread_of_thirds(const std::vector<PlanePoints>& views, const cv::Size& size) {
  constexpr std::size_t kParts = 3;
  std::array<double, kParts> focal{};
  double mean = 0;
  for (std::size_t part = 0; part < kParts; ++part) {
    std::vector<PlanePoints> rest;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (i * kParts / views.size() != part) rest.push_back(views[i]);
    }
    const double aspect = fitted_aspect(rest, size);
    focal[part] = solve(thinned(rest), size, false, true, aspect).matrix.at<double>(0, 0);
    mean += focal[part] / kParts;
  }
  double sum = 0;
  for (const double one : focal) sum += (one - mean) * (one - mean);
  return std::sqrt(sum * (kParts - 1) / kParts);
}

/// The views without those that fit far worse than the others.
std::vector<PlanePoints> without_outliers(const std::vector<PlanePoints>& views,
                                          const Solved& solved) {
  std::vector<double> sorted = solved.view_rms;
  std::sort(sorted.begin(), sorted.end());
  const double limit = kOutlier * sorted[sorted.size() / 2];
  std::vector<PlanePoints> kept;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (solved.view_rms[i] <= limit) kept.push_back(views[i]);
  }
  return kept;
}

/// Errors: kInvalidInput "calibrate.weak".
Result<void> check_observable(const Solved& solved) {
  const char* cure = "tilt the plane by 30 to 50 degrees to every side, close to the camera";
  // Without tilts the solver's own spread means nothing: distance and focal length are ambiguous.
  const double focal = solved.matrix.at<double>(0, 0);
  if (solved.tilted < kFewestTilted || !(solved.focal_spread <= kWeakest * focal)) {
    char cause[120];
    std::snprintf(
        cause, sizeof cause,
        "the views are too similar to determine the focal length: %.0f +- %.0f pixels, %.0f are "
        "needed",
        focal, solved.focal_spread, kWeakest * focal);
    return fail(ExitCode::kInvalidInput, "calibrate.weak", "", cause, cure);
  }
  if (solved.tilts.along < kFocalScatter) {
    char cause[120];
    std::snprintf(cause, sizeof cause,
                  "all views are tilted to the same side: they scatter by %.1f degrees, %.0f are "
                  "needed",
                  solved.tilts.along, kFocalScatter);
    return fail(ExitCode::kInvalidInput, "calibrate.weak", "", cause, cure);
  }
  return {};
}

Calibration calibration_of(const Solved& solved, const PlaneViews& found, int views, bool centred) {
  Calibration out;
  out.camera.width = found.size.width;
  out.camera.height = found.size.height;
  out.camera.fx = solved.matrix.at<double>(0, 0);
  out.camera.fy = solved.matrix.at<double>(1, 1);
  out.camera.cx = solved.matrix.at<double>(0, 2);
  out.camera.cy = solved.matrix.at<double>(1, 2);
  for (std::size_t i = 0; i < 5 && i < solved.distortion.total(); ++i) {
    out.camera.distortion[i] = solved.distortion.at<double>(static_cast<int>(i));
  }
  out.frames = found.frames;
  out.views = views;
  out.rms_px = solved.rms;
  out.focal_spread = solved.focal_spread;
  out.principal_point_assumed = centred;
  return out;
}

Result<Calibration> calibrate_from(PlaneViews found, int most_views, bool board) {
  std::vector<PlanePoints> views = spread_out(std::move(found.views), most_views);
  if (views.size() < kFewestViews) {
    return fail(ExitCode::kInvalidInput, "calibrate.few-views", "",
                "the plane was found in " + std::to_string(views.size()) + " of " +
                    std::to_string(found.frames) + " frames, 5 are needed",
                "show all of it, sharp and close, from more sides");
  }
  const double aspect = board ? 1.0 : fitted_aspect(views, found.size);
  Solved solved = solve(views, found.size, board, false, aspect);
  std::vector<PlanePoints> kept = without_outliers(views, solved);
  const bool fewer = kept.size() < views.size() && kept.size() >= kFewestViews;
  if (fewer) views = std::move(kept);
  const bool centred = solved.tilts.across < kPrincipalPointScatter;
  if (fewer || centred) solved = solve(views, found.size, board, centred, aspect);
  if (!board) {
    solved.focal_spread = std::max(solved.focal_spread, spread_of_thirds(views, found.size));
  }
  MODAR_TRY(check_observable(solved));
  return calibration_of(solved, found, static_cast<int>(views.size()), centred);
}

}  // namespace

Result<Calibration> calibrate(const CalibrateOptions& options, const ProgressCallback& progress) {
  const bool board = options.board_columns > 0;
  std::vector<NamedPattern> patterns;
  if (!board) {
    MODAR_ASSIGN(patterns, read_patterns(options.pattern, options.shape, 1));
  }
  try {
    MODAR_ASSIGN(auto views, collect_views(options, board ? nullptr : &patterns.at(0), progress));
    return calibrate_from(std::move(views), options.most_views, board);
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInvalidInput, "calibrate.weak", "",
                std::string("no camera explains the views: ") + thrown.what(),
                "give sharp views of one plane from many sides");
  }
}

Result<void> write_camera_file(const Calibration& calibration, const std::string& path) {
  const Camera& camera = calibration.camera;
  std::string text;
  try {
    cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    file << "image_width" << camera.width << "image_height" << camera.height;
    file << "camera_matrix"
         << cv::Mat(cv::Matx33d(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1));
    file << "distortion_coefficients"
         << cv::Mat(1, 5, CV_64F, const_cast<double*>(camera.distortion.data()));
    file << "avg_reprojection_error" << calibration.rms_px << "nframes" << calibration.views;
    text = file.releaseAndGetString();
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "calibrate.opencv", path, thrown.what(),
                "report this as a bug");
  }
  return write_file(path, text);
}

}  // namespace modar
