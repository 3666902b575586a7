// Reads the YAML that OpenCV's FileStorage writes of a camera: `modar calibrate`, OpenCV's own
// calibration. Flat keys and matrices with their numbers in brackets; nothing else of YAML.
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "modar/camera_yml.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

tl::unexpected<Error> bad(const char* code, const std::string& path, const char* cause) {
  return fail(ExitCode::kInvalidInput, code, path, cause, "write it with `modar calibrate`");
}

/// What follows "key:" at the start of a line, up to the end of the text.
std::optional<std::string_view> after_key(std::string_view text, std::string_view key) {
  for (std::size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at + 1)) {
    const std::string_view rest = text.substr(at + key.size());
    if ((at == 0 || text[at - 1] == '\n') && rest.starts_with(':')) return rest.substr(1);
  }
  return std::nullopt;
}

void skip_blanks(std::string_view& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n,");
  text.remove_prefix(std::min(first, text.size()));
}

std::optional<std::int64_t> parse_integer(std::string_view& text) {
  std::int64_t value = 0;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(last - text.data()));
  return value;
}

/// "5.3612345678901234e+02": right to about 15 digits, in any locale and without the standard
/// library's tables.
std::optional<double> parse_number(std::string_view& text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  double mantissa = 0;
  int scale = 0;
  int digits = 0;
  bool point = false;
  for (; !text.empty(); text.remove_prefix(1)) {
    const char letter = text.front();
    if (letter == '.' && !point) {
      point = true;
    } else if (letter >= '0' && letter <= '9' && ++digits <= 40) {
      mantissa = 10 * mantissa + (letter - '0');
      scale -= point ? 1 : 0;
    } else {
      break;
    }
  }
  if (digits == 0) return std::nullopt;
  if (text.starts_with('e') || text.starts_with('E')) {
    text.remove_prefix(1);
    const auto exponent = parse_integer(text);
    if (!exponent || std::abs(*exponent) > 300) return std::nullopt;
    scale += static_cast<int>(*exponent);
  }
  const double value =
      scale < 0 ? mantissa / std::pow(10.0, -scale) : mantissa * std::pow(10.0, scale);
  return negative ? -value : value;
}

/// The numbers in the brackets that come next: how many, at most `values` has room for; -1 for
/// others.
int parse_list(std::string_view text, std::span<double> values) {
  const std::size_t open = text.find('[');
  if (open == std::string_view::npos) return -1;
  text.remove_prefix(open + 1);
  for (std::size_t count = 0;; ++count) {
    skip_blanks(text);
    if (text.starts_with(']')) return static_cast<int>(count);
    if (count == values.size()) return -1;
    const auto value = parse_number(text);
    if (!value) return -1;
    values[count] = *value;
  }
}

std::optional<int> size_of(std::string_view text, std::string_view key) {
  auto rest = after_key(text, key);
  if (!rest) return 0;
  skip_blanks(*rest);
  const auto value = parse_integer(*rest);
  if (!value || *value < 0 || *value > 65536) return std::nullopt;
  return static_cast<int>(*value);
}

}  // namespace

Result<Camera> read_camera_yml(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) {
    return fail(ExitCode::kIo, "camera.open", path, "the camera file cannot be opened",
                "check the path");
  }
  const std::string_view text(reinterpret_cast<const char*>(file->bytes().data()),
                              file->bytes().size());
  Camera camera;
  const auto matrix = after_key(text, "camera_matrix");
  std::array<double, 9> k{};
  if (!matrix || parse_list(*matrix, k) != 9)
    return bad("camera.matrix", path, "it has no 3x3 camera matrix");
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];
  if (const auto coefficients = after_key(text, "distortion_coefficients")) {
    std::array<double, 14> values{};
    const int count = parse_list(*coefficients, values);
    if (count < 0) return bad("camera.distortion", path, "a coefficient is not a number");
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i < camera.distortion.size()) {
        camera.distortion[i] = values[i];
      } else if (values[i] != 0) {
        return fail(ExitCode::kUnsupported, "camera.distortion", path,
                    "its distortion has more than k1 k2 p1 p2 k3",
                    "calibrate with the five-coefficient model");
      }
    }
  }
  const auto width = size_of(text, "image_width");
  const auto height = size_of(text, "image_height");
  if (!width || !height || (*width == 0) != (*height == 0)) {
    return bad("camera.size", path, "its image size is not positive");
  }
  camera.width = *width;
  camera.height = *height;
  Camera checked = camera;
  // A file may leave the size to the frames.
  if (*width == 0) checked.width = checked.height = 1;
  if (auto valid = validate(checked); !valid) {
    valid.error().where = path;
    return tl::unexpected<Error>(valid.error());
  }
  return camera;
}

Result<void> validate(const Camera& camera) {
  const auto refuse = [](const char* code, const char* cause) {
    return fail(ExitCode::kInvalidInput, code, "camera", cause,
                "give the frame's size and a calibration, or modar::default_camera()");
  };
  if (camera.width < 1 || camera.height < 1)
    return refuse("camera.size", "its size is not positive");
  double sum = camera.fx + camera.fy + camera.cx + camera.cy;
  if (!std::isfinite(sum) || !(camera.fx > 0.0) || !(camera.fy > 0.0)) {
    return refuse("camera.matrix", "its focal length is not positive, or a number is not finite");
  }
  for (const double each : camera.distortion) sum += each;
  if (!std::isfinite(sum)) return refuse("camera.distortion", "a coefficient is not a number");
  return {};
}

}  // namespace modar
