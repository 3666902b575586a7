#include "formats/transport/feature_text.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "formats/base/shortest_number.hpp"

namespace modar {
namespace {

constexpr std::size_t kWrapMargin = 71;  ///< a line that would grow past it is broken
constexpr std::size_t kLeastLine = 10;   ///< but never for fewer characters than that

/// An integer as it is, another number with 17 digits, as FileStorage tells them apart: "31.".
std::string number(float value) {
  std::array<char, 40> text{};
  char* end = text.data();
  if (std::abs(value) < 2147483648.0f && std::nearbyint(value) == value) {
    end = std::to_chars(end, text.data() + text.size(), static_cast<std::int64_t>(value)).ptr;
    *end++ = '.';
  } else {
    return scientific_text(static_cast<double>(value), 16);
  }
  return {text.data(), end};
}

/// A list in brackets, broken into lines.
class FlowList {
 public:
  FlowList(std::string& out, std::size_t indent) : out_(out), indent_(indent) { out_ += '['; }

  void add(std::string_view item) {
    if (!empty_) out_ += ',';
    const std::size_t column = out_.size() - line_begin() + item.size();
    if (column > kWrapMargin && column - indent_ > kLeastLine) {
      out_ += '\n';
      out_.append(indent_, ' ');
    } else {
      out_ += ' ';
    }
    out_ += item;
    empty_ = false;
  }
  void close() { out_ += empty_ ? "]\n" : " ]\n"; }

 private:
  [[nodiscard]] std::size_t line_begin() {
    while (true) {
      const std::size_t next = out_.find('\n', line_begin_);
      if (next == std::string::npos) return line_begin_;
      line_begin_ = next + 1;
    }
  }

  std::string& out_;
  std::size_t indent_;
  std::size_t line_begin_ = 0;
  bool empty_ = true;
};

void add_keypoint(std::string& out, const KeypointRecord& point) {
  out += "   - ";
  FlowList list(out, 7);
  for (const float value : {point.x, point.y, point.size, point.angle, point.response}) {
    list.add(number(value));
  }
  list.add(std::to_string(point.octave));
  list.add(std::to_string(point.class_id));
  list.close();
}

}  // namespace

std::string feature_text(const FeatureView& features) {
  std::string out = "%YAML:1.0\n---\n";
  if (features.keypoints.empty()) {
    out += "keypoints: []\n";
  } else {
    out += "keypoints:\n";
    for (const KeypointRecord& point : features.keypoints) {
      std::string text;
      add_keypoint(text, point);
      out += text;
    }
  }
  out += "descriptors: !!opencv-matrix\n   rows: " + std::to_string(features.keypoints.size()) +
         "\n   cols: " + std::to_string(features.descriptor_bytes) + "\n   dt: u\n   data: ";
  std::string text = "   data: ";
  FlowList list(text, 7);
  for (const std::byte value : features.descriptors) {
    list.add(std::to_string(std::to_integer<unsigned>(value)));
  }
  list.close();
  return out + text.substr(9);
}

}  // namespace modar
