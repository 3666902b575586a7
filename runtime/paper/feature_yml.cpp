// Features as OpenCV FileStorage YML, written and read in memory: the interchange record.
#include <cstring>
#include <string_view>

#include <opencv2/core.hpp>

#include "modar/features.hpp"
#include "opencv_bridge.hpp"

namespace modar {
namespace {

constexpr const char* kCure = "bake the pattern again";
constexpr int kMaxDescriptorBytes = 512;  ///< as many as a parameter set may have

tl::unexpected<Error> bad(const char* cause) {
  return fail(ExitCode::kInvalidInput, "features.yml", "", cause, kCure);
}

/// OpenCV's parser runs forever on some texts that end inside of a sequence or have more than one
/// document: what it gets here are block maps and closed sequences of numbers and words.
bool is_plain(std::string_view yml) {
  constexpr std::string_view kMarks = " \n.,:+-_![]";
  constexpr std::string_view kHead = "%YAML:1.0\n";
  constexpr std::string_view kDocument = "---\n";  // OpenCV 2 wrote none
  if (!yml.starts_with(kHead)) return false;
  yml.remove_prefix(kHead.size());
  if (yml.starts_with(kDocument)) yml.remove_prefix(kDocument.size());
  if (yml.find("---") != std::string_view::npos || yml.find("...") != std::string_view::npos) {
    return false;
  }
  bool inside = false;
  for (const char letter : yml) {
    const bool word = (letter >= '0' && letter <= '9') || (letter >= 'a' && letter <= 'z') ||
                      (letter >= 'A' && letter <= 'Z');
    if (!word && kMarks.find(letter) == std::string_view::npos) return false;
    if ((letter == '[' && inside) || (letter == ']' && !inside)) return false;
    if (letter == '[' || letter == ']') inside = !inside;
  }
  return !inside;
}

}  // namespace

Result<std::string> features_to_yml(const Features& features) {
  const auto work = [&]() -> Result<std::string> {
    std::vector<cv::KeyPoint> keypoints;
    keypoints.reserve(features.keypoints.size());
    for (const KeypointRecord& record : features.keypoints) {
      keypoints.push_back(paper::to_opencv(record));
    }
    cv::Mat descriptors(static_cast<int>(features.keypoints.size()),
                        static_cast<int>(features.descriptor_bytes), CV_8UC1);
    if (descriptors.total() != features.descriptors.size()) {
      return fail(ExitCode::kInternal, "features.yml", "",
                  "keypoints and descriptors differ in number", "report this as a bug");
    }
    if (!features.descriptors.empty()) {
      std::memcpy(descriptors.data, features.descriptors.data(), features.descriptors.size());
    }
    cv::FileStorage storage(
        ".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
    cv::write(storage, "keypoints", keypoints);
    storage << "descriptors" << descriptors;
    return storage.releaseAndGetString();
  };
  return paper::guarded(ExitCode::kInternal, "features.yml", "report this as a bug", work);
}

Result<Features> features_from_yml(const std::string& yml) {
  const auto work = [&]() -> Result<Features> {
    if (yml.empty()) return bad("the text is empty");
    if (!is_plain(yml)) return bad("the text is not as FileStorage writes features");
    const cv::FileStorage storage(
        yml, cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
    if (!storage.isOpened() || storage["keypoints"].isNone() || storage["descriptors"].isNone()) {
      return bad("the nodes 'keypoints' and 'descriptors' are missing");
    }
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    storage["keypoints"] >> keypoints;
    const cv::FileNode matrix = storage["descriptors"];
    // OpenCV makes room for what a matrix states before it looks at its data.
    const cv::FileNode rows = matrix["rows"];
    const cv::FileNode columns = matrix["cols"];
    if (!rows.isInt() || static_cast<int>(rows) != static_cast<int>(keypoints.size())) {
      return bad("keypoints and descriptors differ in number");
    }
    if (!columns.isInt() || static_cast<int>(columns) < 0 ||
        static_cast<int>(columns) > kMaxDescriptorBytes) {
      return bad("the descriptors have an impossible length");
    }
    matrix >> descriptors;
    Features features;
    features.descriptor_bytes = static_cast<std::uint32_t>(descriptors.cols);
    if (keypoints.empty()) return features;
    if (descriptors.type() != CV_8UC1 || !descriptors.isContinuous()) {
      return bad("the descriptors are not bytes");
    }
    for (const cv::KeyPoint& point : keypoints) {
      features.keypoints.push_back(paper::from_opencv(point));
    }
    features.descriptors.resize(descriptors.total());
    std::memcpy(features.descriptors.data(), descriptors.data, descriptors.total());
    return features;
  };
  return paper::guarded(ExitCode::kInvalidInput, "features.yml", kCure, work);
}

}  // namespace modar
