#include "bake/bundle/request_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

namespace modar {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  std::size_t start = 0;
  for (;;) {
    const std::size_t end = text.find(separator, start);
    parts.push_back(text.substr(start, end - start));
    if (end == std::string_view::npos) return parts;
    start = end + 1;
  }
}

bool parse_number(std::string_view text, double& value) {
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  return error == std::errc() && end == last && std::isfinite(value);
}

namespace {

tl::unexpected<Error> scene_error(const std::string& text, const std::string& cause) {
  return fail(ExitCode::kUsage, "cli.scene", "--scene " + text, cause,
              "write PATTERN=MODEL, then any of ,scale=S ,up=x|y|z|-x|-y|-z ,offset=X:Y:Z ,centred "
              ",light=FILE");
}

bool parse_offset(std::string_view text, std::array<double, 3>& offset) {
  const std::vector<std::string_view> parts = split(text, ':');
  return parts.size() == 3 && parse_number(parts[0], offset[0]) &&
         parse_number(parts[1], offset[1]) && parse_number(parts[2], offset[2]);
}

}  // namespace

Result<UpAxis> parse_up(const std::string& text) {
  constexpr std::string_view kNames[] = {"x", "y", "z", "-x", "-y", "-z"};
  for (std::size_t i = 0; i < std::size(kNames); ++i) {
    if (text == kNames[i]) return static_cast<UpAxis>(i);
  }
  return fail(ExitCode::kUsage, "cli.up", text, "there is no such axis",
              "name one of x, y, z, -x, -y, -z");
}

Result<SceneRequest> parse_scene(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, ',');
  const std::size_t equals = parts[0].find('=');
  if (equals == std::string_view::npos || equals == 0 || equals + 1 == parts[0].size()) {
    return scene_error(text, "it does not begin with PATTERN=MODEL");
  }
  SceneRequest scene;
  scene.pattern = std::string(parts[0].substr(0, equals));
  scene.model = std::string(parts[0].substr(equals + 1));
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::string_view part = parts[i];
    bool good = false;
    if (part.starts_with("scale=")) {
      good = parse_number(part.substr(6), scene.scale) && scene.scale > 0;
    } else if (part.starts_with("up=")) {
      const Result<UpAxis> up = parse_up(std::string(part.substr(3)));
      if (up) scene.up = *up;
      good = up.has_value();
    } else if (part.starts_with("offset=")) {
      good = parse_offset(part.substr(7), scene.offset);
    } else if (part.starts_with("light=")) {
      scene.light = std::string(part.substr(6));
      good = !scene.light.empty();
    } else if (part == "centred") {
      good = scene.centred = true;
    }
    if (!good) return scene_error(text, "'" + std::string(part) + "' is not understood");
  }
  return scene;
}

Result<std::array<PixelPoint, 4>> parse_corners(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, ',');
  std::array<double, 8> values{};
  bool good = parts.size() == values.size();
  for (std::size_t i = 0; good && i < values.size(); ++i) good = parse_number(parts[i], values[i]);
  if (!good) {
    return fail(ExitCode::kUsage, "cli.corners", "--corners " + text,
                "these are not eight numbers with commas between them",
                "write x,y of the top-left, top-right, bottom-right and bottom-left corner");
  }
  std::array<PixelPoint, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = {values[2 * i], values[2 * i + 1]};
  return corners;
}

Result<double> parse_unit(const std::string& text) {
  struct Unit {
    const char* name;
    double metres;
  };
  constexpr Unit kUnits[] = {{"mm", 0.001},  {"cm", 0.01},   {"m", 1.0},
                             {"km", 1000.0}, {"in", 0.0254}, {"ft", 0.3048}};
  for (const Unit& unit : kUnits) {
    if (text == unit.name) return unit.metres;
  }
  return fail(ExitCode::kUsage, "cli.unit", "--unit " + text, "there is no such unit",
              "name one of mm, cm, m, km, in, ft");
}

namespace {

/// A number and a unit of length, in millimetres.
bool parse_length(std::string_view text, double& mm) {
  const std::size_t digits = text.find_last_of("0123456789.") + 1;  // 0 where there is none
  const Result<double> unit = parse_unit(std::string(text.substr(digits)));
  if (!unit || !parse_number(text.substr(0, digits), mm) || !(mm > 0)) return false;
  if (!text.ends_with("mm")) mm *= *unit * 1000;
  return true;
}

/// "120x180x40mm".
bool parse_box(std::string_view text, std::array<double, 3>& mm) {
  const std::size_t digits = text.find_last_of("0123456789.") + 1;
  const std::vector<std::string_view> parts = split(text.substr(0, digits), 'x');
  if (parts.size() != mm.size()) return false;
  for (std::size_t i = 0; i < mm.size(); ++i) {
    if (!parse_length(std::string(parts[i]) + std::string(text.substr(digits)), mm[i]))
      return false;
  }
  return true;
}

tl::unexpected<Error> shape_error(const std::string& text, const std::string& cause) {
  return fail(ExitCode::kUsage, "cli.shape", "shape=" + text, cause,
              "write cylinder,diameter=66mm,arc=120 or cone,top=80mm,bottom=60mm,arc=100 or "
              "box,size=120x180x40mm,right=FILE,back=FILE,left=FILE,top=FILE,bottom=FILE");
}

}  // namespace

Result<ShapeRequest> parse_shape(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, ',');
  ShapeRequest shape;
  shape.text = text;
  if (parts[0] == "cylinder") {
    shape.kind = ShapeRequest::Kind::kCylinder;
  } else if (parts[0] == "cone") {
    shape.kind = ShapeRequest::Kind::kCone;
  } else if (parts[0] == "box") {
    shape.kind = ShapeRequest::Kind::kBox;
  } else {
    return shape_error(text, "there is no shape '" + std::string(parts[0]) + "'");
  }
  constexpr std::string_view kSides[] = {"right", "back", "left", "top", "bottom"};
  const bool cone = shape.kind == ShapeRequest::Kind::kCone;
  const bool box = shape.kind == ShapeRequest::Kind::kBox;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::string_view part = parts[i];
    const std::string_view value = part.substr(part.find('=') + 1);
    bool good = false;
    if (box && part.starts_with("size=")) {
      good = parse_box(value, shape.box_mm);
    } else if (box) {
      const auto* side =
          std::find(std::begin(kSides), std::end(kSides), part.substr(0, part.find('=')));
      good = side != std::end(kSides) && !value.empty();
      if (good) shape.sides[static_cast<std::size_t>(side - std::begin(kSides))] = value;
    } else if (!cone && part.starts_with("diameter=")) {
      good = parse_length(value, shape.top_mm);
      shape.bottom_mm = shape.top_mm;
    } else if (cone && part.starts_with("top=")) {
      good = parse_length(value, shape.top_mm);
    } else if (cone && part.starts_with("bottom=")) {
      good = parse_length(value, shape.bottom_mm);
    } else if (part.starts_with("arc=")) {
      good = parse_number(value, shape.arc_deg) && shape.arc_deg > 0 && shape.arc_deg <= 360;
    }
    if (!good) return shape_error(text, "'" + std::string(part) + "' is not understood");
  }
  if (cone && (shape.top_mm <= 0 || shape.bottom_mm <= 0)) {
    return shape_error(text, "a cone needs its diameters at the top and at the bottom");
  }
  if (box && shape.box_mm[0] <= 0) return shape_error(text, "a box needs its size");
  return shape;
}

Result<PatternRequest> parse_pattern(const std::string& text) {
  constexpr std::string_view kShape = ":shape=";
  if (const std::size_t at = text.rfind(kShape); at != std::string::npos) {
    MODAR_ASSIGN(PatternRequest request, parse_pattern(text.substr(0, at)));
    MODAR_ASSIGN(request.shape, parse_shape(text.substr(at + kShape.size())));
    return request;
  }
  PatternRequest request;
  request.path = text;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return request;
  const std::string_view tail = std::string_view(text).substr(colon + 1);
  const std::size_t digits = tail.find_last_of("0123456789.") + 1;  // 0 where there is none
  const Result<double> unit = parse_unit(std::string(tail.substr(digits)));
  double width = 0;
  const bool number = parse_number(tail.substr(0, digits), width);
  if (!unit || (!number && !tail.ends_with("mm"))) return request;  // a file with a colon
  if (!number || width <= 0) {
    return fail(ExitCode::kUsage, "cli.pattern", "--pattern " + text,
                "'" + std::string(tail) + "' is no width",
                "write FILE:WIDTH, as in cover.png:148mm");
  }
  request.width_mm = width * *unit * 1000;
  if (tail.ends_with("mm")) request.width_mm = width;
  request.path = text.substr(0, colon);
  return request;
}

Result<MaxError> parse_max_error(const std::string& text) {
  const std::size_t digits = std::string_view(text).find_last_of("0123456789.");
  const std::size_t length = digits == std::string::npos ? 0 : digits + 1;
  const std::string unit = text.substr(length);
  MaxError error;
  bool good =
      parse_number(std::string_view(text).substr(0, length), error.value) && error.value > 0;
  if (unit.empty()) {
    error.unit = MaxError::Unit::kSource;
  } else if (unit == "%") {
    error.unit = MaxError::Unit::kPercent;
  } else if (const Result<double> metres = parse_unit(unit); metres) {
    error.unit = MaxError::Unit::kMetres;
    error.value *= *metres;
  } else {
    good = false;
  }
  if (good) return error;
  return fail(ExitCode::kUsage, "cli.max-error", "--max-error " + text,
              "this is no length above 0 that we understand",
              "write a number of source units, a percentage of the diagonal as 0.01%, or a length "
              "as 2mm");
}

}  // namespace modar
