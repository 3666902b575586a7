// From views of a plane to a camera, with OpenCV's solver.
#include "bake/pattern/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "bake/pattern/pattern_picture.hpp"
#include "bake/pattern/plane_points.hpp"
#include "formats/atomic_file.hpp"

namespace modar {
namespace {

constexpr std::size_t kFewestViews = 5;
constexpr int kFewestTilted = 3;
constexpr double kTilted = 0.97;   // cosine of 14 degrees
constexpr double kWeakest = 0.03;  // spread of the focal length
constexpr double kOneSide = 8.0;   // degrees: see Tilts; less tells no focal length
constexpr double kOneAxis = 4.0;   // degrees: less tells no principal point
constexpr int kVideoSteps = 120;   // frames of a video that are looked at
constexpr double kOutlier = 3.0;   // times the median error of a view

using Look = std::function<void(const GrayImage& frame)>;

bool is_picture(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  });
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".bmp" ||
         ending == ".tif" || ending == ".tiff";
}

Result<void> look_at_video(const std::string& path, const Look& look) {
  cv::VideoCapture capture(path, cv::CAP_FFMPEG);
  cv::Mat picture;
  if (!capture.isOpened() || !capture.read(picture)) {
    return fail(ExitCode::kIo, "calibrate.input", path, "neither a picture nor a video",
                "give pictures or a video that other players show");
  }
  const int count = static_cast<int>(capture.get(cv::CAP_PROP_FRAME_COUNT));
  const int step = std::max(1, count / kVideoSteps);
  cv::Mat gray;
  for (int frame = 0; !picture.empty(); ++frame) {
    if (frame % step == 0) {
      cv::cvtColor(picture, gray, cv::COLOR_BGR2GRAY);
      look({gray.data, gray.cols, gray.rows, static_cast<std::ptrdiff_t>(gray.step[0])});
    }
    if (!capture.read(picture)) break;
  }
  return {};
}

/// What the frames gave.
struct Gathered {
  cv::Size size;
  std::vector<PlanePoints> views;
  int frames = 0;
  std::optional<Error> error;
};

/// Looks for the plane in each frame.
class Gatherer {
 public:
  Gatherer(const CalibrateOptions& options, const NamedPattern* pattern, Gathered& out)
      : options_(options), pattern_(pattern), out_(out) {}

  void look(const std::string& path, const GrayImage& frame) {
    if (out_.error) return;
    const cv::Size size(frame.width, frame.height);
    if (out_.frames == 0) out_.size = size;
    ++out_.frames;
    if (size != out_.size) {
      out_.error = Error{ExitCode::kInvalidInput, "calibrate.size", path,
                         "it has another size than the frames before",
                         "give frames of one camera in one resolution"};
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
    auto finder = PatternPoints::create(*pattern_, size.width, size.height);
    if (!finder) {
      out_.error = finder.error();
      return false;
    }
    finder_ = std::make_unique<PatternPoints>(std::move(*finder));
    return true;
  }

  const CalibrateOptions& options_;
  const NamedPattern* pattern_;
  Gathered& out_;
  std::unique_ptr<PatternPoints> finder_;
};

Result<Gathered> gather(const CalibrateOptions& options, const NamedPattern* pattern,
                        const ProgressCallback& progress) {
  Gathered gathered;
  Gatherer gatherer(options, pattern, gathered);
  double done = 0;
  for (const std::string& path : options.inputs) {
    if (is_picture(path)) {
      const auto picture = load_gray(path);
      if (!picture) return tl::unexpected(picture.error());
      gatherer.look(path, picture->view());
    } else if (auto looked =
                   look_at_video(path, [&](const GrayImage& frame) { gatherer.look(path, frame); });
               !looked) {
      return tl::unexpected(looked.error());
    }
    if (gathered.error) return tl::unexpected(*gathered.error);
    if (progress) progress("frames", ++done / static_cast<double>(options.inputs.size()));
  }
  return gathered;
}

/// Every so many-th, so that at most `most` are left.
std::vector<PlanePoints> spread_out(std::vector<PlanePoints> views, int most) {
  const std::size_t count = views.size();
  const auto keep = static_cast<std::size_t>(most);
  if (count <= keep) return views;
  std::vector<PlanePoints> kept;
  for (std::size_t i = 0; i < keep; ++i) kept.push_back(std::move(views[i * count / keep]));
  return kept;
}

/// How the planes' normals scatter about their mean, in degrees: standard deviations along the
/// direction in which they scatter most, and across. Zhang's method lives on it: from planes that
/// are all but parallel a solver makes up a principal point, and is sure of it.
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

/// centred: the principal point stays in the frame's middle.
Solved solve(const std::vector<PlanePoints>& views, const cv::Size& size, bool board,
             bool centred) {
  std::vector<std::vector<cv::Point3f>> plane;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const PlanePoints& view : views) {
    plane.emplace_back();
    pixels.emplace_back();
    for (std::size_t i = 0; i < view.plane.size(); ++i) {
      plane.back().emplace_back(static_cast<float>(view.plane[i].x),
                                static_cast<float>(view.plane[i].y), 0.0f);
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

/// Leaves out views that fit far worse than the others.
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
Result<Solved> trusted(Solved solved) {
  const char* cure =
      "tilt the plane by 30 to 50 degrees, to every side, near and large in the frame";
  // Without tilts the solver's own spread means nothing: distance and focal length are one.
  if (solved.tilted < kFewestTilted ||
      !(solved.focal_spread <= kWeakest * solved.matrix.at<double>(0, 0))) {
    return fail(ExitCode::kInvalidInput, "calibrate.weak", "",
                "the views are too alike to tell the focal length", cure);
  }
  if (solved.tilts.along < kOneSide) {
    char cause[120];
    std::snprintf(cause, sizeof cause,
                  "all views are tilted to the same side: they scatter by %.1f degrees, %.0f are "
                  "needed",
                  solved.tilts.along, kOneSide);
    return fail(ExitCode::kInvalidInput, "calibrate.weak", "", cause, cure);
  }
  return solved;
}

Calibration calibration_of(const Solved& solved, const Gathered& gathered, int views,
                           bool centred) {
  Calibration out;
  out.camera.width = gathered.size.width;
  out.camera.height = gathered.size.height;
  out.camera.fx = solved.matrix.at<double>(0, 0);
  out.camera.fy = solved.matrix.at<double>(1, 1);
  out.camera.cx = solved.matrix.at<double>(0, 2);
  out.camera.cy = solved.matrix.at<double>(1, 2);
  for (std::size_t i = 0; i < 5 && i < solved.distortion.total(); ++i) {
    out.camera.distortion[i] = solved.distortion.at<double>(static_cast<int>(i));
  }
  out.frames = gathered.frames;
  out.views = views;
  out.rms_px = solved.rms;
  out.focal_spread = solved.focal_spread;
  out.principal_point_assumed = centred;
  return out;
}

Result<Calibration> calibrated(Gathered gathered, int most_views, bool board) {
  std::vector<PlanePoints> views = spread_out(std::move(gathered.views), most_views);
  if (views.size() < kFewestViews) {
    return fail(ExitCode::kInvalidInput, "calibrate.few-views", "",
                "the plane was found in " + std::to_string(views.size()) + " of " +
                    std::to_string(gathered.frames) + " frames, 5 are needed",
                "show all of it, sharp and large, from more sides");
  }
  Solved solved = solve(views, gathered.size, board, false);
  std::vector<PlanePoints> kept = without_outliers(views, solved);
  const bool fewer = kept.size() < views.size() && kept.size() >= kFewestViews;
  if (fewer) views = std::move(kept);
  const bool centred = solved.tilts.across < kOneAxis;
  if (fewer || centred) solved = solve(views, gathered.size, board, centred);
  auto good = trusted(std::move(solved));
  if (!good) return tl::unexpected(good.error());
  return calibration_of(*good, gathered, static_cast<int>(views.size()), centred);
}

}  // namespace

Result<Calibration> calibrate(const CalibrateOptions& options, const ProgressCallback& progress) {
  const bool board = options.board_columns > 0;
  std::vector<NamedPattern> patterns;
  if (!board) {
    auto read = read_patterns({options.pattern}, 1);
    if (!read) return tl::unexpected(read.error());
    patterns = std::move(*read);
  }
  try {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
    auto gathered = gather(options, board ? nullptr : &patterns.at(0), progress);
    if (!gathered) return tl::unexpected(gathered.error());
    return calibrated(std::move(*gathered), options.most_views, board);
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
