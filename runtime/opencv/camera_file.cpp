// Reads calibration files through OpenCV, and catches what it throws.
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>

#include "modar/camera_file.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

tl::unexpected<Error> bad(const char* code, const std::string& path, std::string cause) {
  return fail(ExitCode::kInvalidInput, code, path, std::move(cause),
              "write it with OpenCV's calibration: camera_matrix, distortion_coefficients, "
              "image_width, image_height");
}

cv::FileNode first_of(const cv::FileStorage& file, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    cv::FileNode node = file[name];
    if (!node.empty()) return node;
  }
  return {};
}

/// OpenCV makes room for what a matrix states before it looks at its data.
bool is_small(const cv::FileNode& matrix) {
  constexpr int kMaxSide = 16;  // rows and columns: distortion has at most 14 values
  for (const char* side : {"rows", "cols"}) {
    const cv::FileNode node = matrix[side];
    if (!node.isInt() || static_cast<int>(node) < 1 || static_cast<int>(node) > kMaxSide) {
      return false;
    }
  }
  return true;
}

/// A matrix node, or a plain sequence of numbers, as one column of doubles.
cv::Mat numbers(const cv::FileNode& node) {
  cv::Mat values;
  if (node.isSeq()) {
    std::vector<double> list;
    node >> list;
    values = cv::Mat(list, true);
  } else if (node.isMap() && is_small(node)) {
    node >> values;
  }
  if (values.empty() || values.channels() != 1) return {};
  values.convertTo(values, CV_64F);
  return values.reshape(1, static_cast<int>(values.total()));
}

void read_size(const cv::FileStorage& file, Camera& camera) {
  const cv::FileNode width = first_of(file, {"image_width", "image_Width", "width"});
  const cv::FileNode height = first_of(file, {"image_height", "image_Height", "height"});
  if (width.isInt() && height.isInt()) {
    camera.width = static_cast<int>(width);
    camera.height = static_cast<int>(height);
    return;
  }
  const cv::Mat size = numbers(first_of(file, {"image_size", "imageSize", "resolution"}));
  if (size.total() == 2) {
    camera.width = cvRound(size.at<double>(0));
    camera.height = cvRound(size.at<double>(1));
  }
}

bool is_word(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  });
}

/// "K", or "K type_id="opencv-matrix"": as FileStorage writes them. Fills the name.
bool is_plain_tag(std::string_view tag, std::string_view& name) {
  constexpr std::string_view kType = " type_id=\"";
  name = tag.substr(0, tag.find(' '));
  if (!is_word(name)) return false;
  tag.remove_prefix(name.size());
  if (tag.empty()) return true;
  if (!tag.starts_with(kType) || !tag.ends_with('"') || tag.size() <= kType.size()) return false;
  return is_word(tag.substr(kType.size(), tag.size() - kType.size() - 1));
}

/// OpenCV's XML parser follows null pointers where tags are odd or do not close each other: only
/// elements that nest go there.
bool nests(std::string_view xml) {
  std::vector<std::string_view> open;
  while (!xml.empty()) {
    const std::size_t start = xml.find('<');
    if (start == std::string_view::npos) break;
    const std::size_t end = xml.find('>', start);
    if (end == std::string_view::npos) return false;
    const std::string_view tag = xml.substr(start + 1, end - start - 1);
    xml.remove_prefix(end + 1);
    if (tag.starts_with("?xml") && tag.ends_with('?')) continue;
    if (tag.starts_with("!--") && tag.ends_with("--")) continue;
    const bool closes = tag.starts_with('/');
    std::string_view name;
    if (!is_plain_tag(tag.substr(closes ? 1 : 0), name)) return false;
    if (closes && (open.empty() || open.back() != name)) return false;
    if (closes) {
      open.pop_back();
    } else {
      open.push_back(name);
    }
  }
  return open.empty();
}

Result<Camera> read(const cv::FileStorage& file, const std::string& path) {
  const cv::Mat k =
      numbers(first_of(file, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K"}));
  if (k.total() != 9) return bad("camera.matrix", path, "it has no 3x3 camera matrix");
  Camera camera;
  camera.fx = k.at<double>(0);
  camera.cx = k.at<double>(2);
  camera.fy = k.at<double>(4);
  camera.cy = k.at<double>(5);
  const bool finite = std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy);
  if (!finite || camera.fx <= 0 || camera.fy <= 0) {
    return bad("camera.matrix", path, "the focal length of its camera matrix is not positive");
  }
  const cv::Mat distortion =
      numbers(first_of(file, {"distortion_coefficients", "distCoeffs", "Distortion_Coefficients",
                              "dist_coeffs", "D"}));
  for (std::size_t i = 0; i < distortion.total(); ++i) {
    const double value = distortion.at<double>(static_cast<int>(i));
    if (!std::isfinite(value))
      return bad("camera.distortion", path, "a coefficient is not a number");
    if (i < camera.distortion.size()) {
      camera.distortion[i] = value;
    } else if (value != 0) {
      return fail(ExitCode::kUnsupported, "camera.distortion", path,
                  "its distortion has more than k1 k2 p1 p2 k3",
                  "calibrate with the five-coefficient model");
    }
  }
  read_size(file, camera);
  if (camera.width < 0 || camera.height < 0 || (camera.width == 0) != (camera.height == 0)) {
    return bad("camera.size", path, "its image size is not positive");
  }
  return camera;
}

}  // namespace

Result<Camera> read_camera_file(const std::string& path) {
  try {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    const Result<MappedFile> bytes = MappedFile::open(path);
    if (!bytes) {
      return fail(ExitCode::kIo, "camera.open", path, "the camera file cannot be opened",
                  "check the path");
    }
    const std::string text(reinterpret_cast<const char*>(bytes->bytes().data()),
                           bytes->bytes().size());
    if (text.starts_with('<') && !nests(text)) {
      return bad("camera.syntax", path, "its XML elements do not nest");
    }
    const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!file.isOpened()) return bad("camera.syntax", path, "OpenCV cannot read it");
    return read(file, path);
  } catch (const cv::Exception& error) {
    return bad("camera.syntax", path, "OpenCV cannot read it: " + error.err);
  } catch (const std::exception& error) {
    return bad("camera.syntax", path, std::string("OpenCV cannot read it: ") + error.what());
  }
}

}  // namespace modar
