// Features as OpenCV FileStorage YML; OpenCV reads it.
#include <cstring>
#include <string_view>

#include <opencv2/core.hpp>

#include "formats/transport/feature_text.hpp"
#include "modar/features.hpp"
#include "opencv_bridge.hpp"

namespace modar {
namespace {

constexpr const char* kCure = "bake the pattern again";
constexpr int kMaxDescriptorBytes = 512;  ///< as many as a parameter set may have

tl::unexpected<Error> bad(const char* cause) {
  return fail(ExitCode::kInvalidInput, "features.yml", "", cause, kCure);
}

/// Begins the base64 form of bytes; ends with OpenCV's code for them.
constexpr std::string_view kBinary = " !!binary |\n      MXUgICAgICAgICAgICAgICAgICAgICAg";

bool is_word(char letter) {
  return (letter >= '0' && letter <= '9') || (letter >= 'a' && letter <= 'z') ||
         (letter >= 'A' && letter <= 'Z');
}

/// Lines of base64, each behind six blanks, up to the end; the first continues the line of kBinary.
bool is_base64(std::string_view text) {
  constexpr std::string_view kIndent = "\n      ";
  const std::size_t padding = text.find('=');
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n' && i + 1 == text.size()) return true;
    if (text.substr(i).starts_with(kIndent)) i += kIndent.size();
    if (i == text.size()) return false;
    const char letter = text[i];
    if (i > padding ? letter != '='
                    : !is_word(letter) && letter != '+' && letter != '/' && letter != '=') {
      return false;
    }
  }
  return true;
}

/// OpenCV's parser runs forever on some texts that end inside of a sequence, have more than one
/// document or unknown base64: what it gets here are block maps, closed sequences of numbers and
/// words, and bytes.
bool is_plain(std::string_view yml) {
  constexpr std::string_view kMarks = " \n.,:+-_![]";
  constexpr std::string_view kHead = "%YAML:1.0\n";
  constexpr std::string_view kDocument = "---\n";  // OpenCV 2 wrote none
  if (!yml.starts_with(kHead)) return false;
  yml.remove_prefix(kHead.size());
  if (yml.starts_with(kDocument)) yml.remove_prefix(kDocument.size());
  if (const std::size_t binary = yml.find(kBinary); binary != std::string_view::npos) {
    if (!is_base64(yml.substr(binary + kBinary.size()))) return false;
    yml = yml.substr(0, binary);
  }
  if (yml.find("---") != std::string_view::npos || yml.find("...") != std::string_view::npos) {
    return false;
  }
  bool inside = false;
  for (const char letter : yml) {
    if (!is_word(letter) && kMarks.find(letter) == std::string_view::npos) return false;
    if ((letter == '[' && inside) || (letter == ']' && !inside)) return false;
    if (letter == '[' || letter == ']') inside = !inside;
  }
  return !inside;
}

}  // namespace

std::string features_to_yml(const Features& features) {
  FeatureView view;
  view.keypoints = features.keypoints;
  view.descriptors = features.descriptors;
  view.descriptor_bytes = features.descriptor_bytes;
  return feature_text(view);
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
