#include "formats/transport/feature_text.hpp"

#include <array>
#include <cstdlib>

#include "formats/base/shortest_number.hpp"

namespace modar {
namespace {

/// OpenCV's base64 data begin with their element format, padded with blanks: "1u" is one byte.
constexpr std::string_view kElementFormat = "1u                      ";
constexpr std::size_t kLineBytes = 48;  ///< of data in a line of base64: 64 characters

/// Fewest digits that a reader which takes doubles and rounds to float reads back; with a point or
/// an exponent, so that it is no integer: "31.".
std::string number(float value) {
  std::string text = shortest_text(value);
  if (static_cast<float>(std::strtod(text.c_str(), nullptr)) != value) {
    text = shortest_text(static_cast<double>(value));
  }
  return text.find_first_of(".e") == std::string::npos ? text + "." : text;
}

void add_keypoint(std::string& out, const KeypointRecord& point) {
  out += "   - [ ";
  for (const float value : {point.x, point.y, point.size, point.angle, point.response}) {
    out += number(value) + ", ";
  }
  out += std::to_string(point.octave) + ", " + std::to_string(point.class_id) + " ]\n";
}

/// Base64 of RFC 4648, in lines.
void add_base64(std::string& out, std::string_view bytes) {
  constexpr const char* kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    if (at % kLineBytes == 0) out += "\n      ";
    std::uint32_t three = 0;
    for (std::size_t i = at; i < at + 3; ++i) {
      three = three << 8 | (i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      out += at + i > bytes.size() ? '=' : kLetters[three >> (18 - 6 * i) & 63];
    }
  }
  out += '\n';
}

}  // namespace

std::string feature_text(const FeatureView& features) {
  std::string out = "%YAML:1.0\n---\nkeypoints:";
  out += features.keypoints.empty() ? " []\n" : "\n";
  for (const KeypointRecord& point : features.keypoints) add_keypoint(out, point);
  out += "descriptors: !!opencv-matrix\n   rows: " + std::to_string(features.keypoints.size()) +
         "\n   cols: " + std::to_string(features.descriptor_bytes) + "\n   dt: u\n   data: ";
  if (features.descriptors.empty()) return out + "[]\n";
  std::string data(kElementFormat);
  data.append(reinterpret_cast<const char*>(features.descriptors.data()),
              features.descriptors.size());
  add_base64(out += "!!binary |", data);
  return out;
}

}  // namespace modar
