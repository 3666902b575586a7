// Keypoints and descriptors of an image: the one function that describes patterns in the bake and
// frames on the device (`--method paper`), so that the two cannot drift.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/layout.hpp"
#include "modar/image.hpp"

namespace modar {

/// descriptors: keypoints.size() rows of descriptor_bytes.
struct Features {
  std::vector<KeypointRecord> keypoints;
  std::vector<std::byte> descriptors;
  std::uint32_t descriptor_bytes = 0;
};

/// The ModAR paper's four parameter sets (Tables 4 and 5), ids 1 to 4: "orb-2000", "orb-500",
/// "brisk-3", "brisk-2". `name` fields are empty: parameter_set_name() gives them.
std::span<const ParameterSetRecord> paper_parameter_sets();
const char* parameter_set_name(std::uint32_t id);

/// Limits OpenCV to the instructions that every processor of the architecture has: its rounding
/// depends on the others. Call it before threads start.
void use_baseline_instructions();

/// Detects and describes with the given parameters. image: at least 1x1.
/// Errors: kInternal "features.opencv" with OpenCV's message; kUnsupported "features.detector".
Result<Features> describe_image(const GrayImage& image, const ParameterSetRecord& parameters);

/// The same features as OpenCV FileStorage YML: feature_text() of formats/transport.
std::string features_to_yml(const Features& features);
/// Reads it back, by OpenCV's FileStorage. Errors: kInvalidInput "features.yml".
Result<Features> features_from_yml(const std::string& yml);

}  // namespace modar
