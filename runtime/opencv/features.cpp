// The ModAR paper's four parameter sets, and detection and description under them.
#include "features.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "modar/features.hpp"
#include "opencv_bridge.hpp"

namespace modar {
namespace {

constexpr ParameterSetRecord common(std::uint32_t id, Detector detector, std::uint32_t bits) {
  ParameterSetRecord set{};
  set.id = id;
  set.detector = static_cast<std::uint32_t>(detector);
  set.descriptor_bits = bits;
  set.max_distance = bits / 3;  // "one third of the descriptor length"
  set.min_matches = 8;
  set.min_inliers = 8;
  set.ransac_threshold = 3.0f;
  return set;
}

/// Table 5.
constexpr ParameterSetRecord fast_orb(std::uint32_t id, std::uint32_t max_features) {
  ParameterSetRecord set = common(id, Detector::kFastOrb, 256);
  set.max_features = max_features;
  set.scale_factor = 1.2f;
  set.level_count = 8;
  set.edge_threshold = 31;
  set.first_level = 0;
  set.wta_k = 2;
  set.harris = 1;
  set.patch_size = 31;
  set.fast_threshold = 20;
  return set;
}

/// Table 4.
constexpr ParameterSetRecord agast_brisk(std::uint32_t id, std::uint32_t octaves) {
  ParameterSetRecord set = common(id, Detector::kAgastBrisk, 512);
  set.agast_threshold = 30;
  set.octaves = octaves;
  set.pattern_scale = 1.0f;
  return set;
}

constexpr std::array<ParameterSetRecord, 4> kSets = {fast_orb(1, 2000), fast_orb(2, 500),
                                                     agast_brisk(3, 3), agast_brisk(4, 2)};
constexpr std::array<const char*, 4> kSetNames = {"orb-2000", "orb-500", "brisk-3", "brisk-2"};

// Values from a file reach OpenCV, which trusts them: what it cannot take is refused here.
bool sane(const ParameterSetRecord& set) {
  if (set.detector == static_cast<std::uint32_t>(Detector::kFastOrb)) {
    return set.max_features >= 1 && set.max_features <= 100000 && set.scale_factor > 1.0f &&
           set.scale_factor <= 4.0f && set.level_count >= 1 && set.level_count <= 16 &&
           set.edge_threshold <= 1024 && set.first_level < set.level_count && set.wta_k >= 2 &&
           set.wta_k <= 4 && set.patch_size >= 2 && set.patch_size <= 255 &&
           set.fast_threshold <= 255;
  }
  return set.octaves <= 8 && set.agast_threshold <= 255 && set.pattern_scale >= 0.1f &&
         set.pattern_scale <= 10.0f;
}

}  // namespace

void use_baseline_instructions() {
  cv::setUseOptimized(false);
}

std::span<const ParameterSetRecord> paper_parameter_sets() {
  return kSets;
}

const char* parameter_set_name(std::uint32_t id) {
  return id >= 1 && id <= kSetNames.size() ? kSetNames[id - 1] : "";
}

Result<cv::Ptr<cv::Feature2D>> paper::make_feature_engine(const ParameterSetRecord& set) {
  const bool orb = set.detector == static_cast<std::uint32_t>(Detector::kFastOrb);
  const bool brisk = set.detector == static_cast<std::uint32_t>(Detector::kAgastBrisk);
  if ((!orb && !brisk) || !sane(set)) {
    return fail(ExitCode::kUnsupported, "features.detector", "",
                "no detector works with parameter set " + std::to_string(set.id),
                "bake the pattern again with this version");
  }
  const auto number = [](std::uint32_t value) { return static_cast<int>(value); };
  if (brisk) {
    return cv::Ptr<cv::Feature2D>(
        cv::BRISK::create(number(set.agast_threshold), number(set.octaves), set.pattern_scale));
  }
  return cv::Ptr<cv::Feature2D>(
      cv::ORB::create(number(set.max_features), set.scale_factor, number(set.level_count),
                      number(set.edge_threshold), number(set.first_level), number(set.wta_k),
                      set.harris != 0 ? cv::ORB::HARRIS_SCORE : cv::ORB::FAST_SCORE,
                      number(set.patch_size), number(set.fast_threshold)));
}

bool paper::too_small_for_features(const ParameterSetRecord& set, int width, int height) {
  // ORB drops features nearer than the edge threshold to a border; AGAST's finest pattern is 7x7,
  // and BRISK's smallest sampling radius is larger than that.
  constexpr int kBriskSide = 16;
  const int side = std::min(width, height);
  if (set.detector == static_cast<std::uint32_t>(Detector::kAgastBrisk)) return side < kBriskSide;
  return side <= 2 * static_cast<int>(set.edge_threshold);
}

Result<Features> describe_image(const GrayImage& image, const ParameterSetRecord& parameters) {
  const auto work = [&]() -> Result<Features> {
    const auto engine = paper::make_feature_engine(parameters);
    if (!engine) return tl::unexpected(engine.error());
    Features features;
    features.descriptor_bytes = parameters.descriptor_bits / 8;
    if (paper::too_small_for_features(parameters, image.width, image.height)) return features;
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    const cv::Mat pixels = paper::view_of(image);
    (*engine)->detect(pixels, keypoints);
    (*engine)->compute(pixels, keypoints, descriptors);
    if (keypoints.empty()) return features;
    if (descriptors.rows != static_cast<int>(keypoints.size()) || !descriptors.isContinuous() ||
        descriptors.cols != static_cast<int>(features.descriptor_bytes)) {
      return fail(ExitCode::kInternal, "features.opencv", "", "descriptors of an unexpected shape",
                  "report this as a bug");
    }
    for (const cv::KeyPoint& point : keypoints) {
      features.keypoints.push_back(paper::from_opencv(point));
    }
    features.descriptors.resize(descriptors.total());
    std::memcpy(features.descriptors.data(), descriptors.data, descriptors.total());
    return features;
  };
  return paper::guarded(ExitCode::kInternal, "features.opencv", "report this as a bug", work);
}

}  // namespace modar
