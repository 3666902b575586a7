#include "bake/options/request_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include <fast_float/fast_float.h>

#include "formats/base/address.hpp"
#include "formats/base/nearest.hpp"
#include "formats/layout.hpp"

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
  const auto [end, error] = fast_float::from_chars(text.data(), last, value);
  return error == std::errc() && end == last && std::isfinite(value);
}

namespace {

constexpr double kMostOffset = 1e6;  // millimetres or sides, the same
constexpr double kMostTurn = 360;
constexpr double kLeastLength = 0.01;  // millimetres: less is not printed
constexpr double kMostLength = 1e6;    // millimetres, as offsets

/// Where the unit of a number begins.
std::size_t unit_start(std::string_view text) {
  return text.find_last_of("0123456789.") + 1;  // 0 where there is no digit
}

tl::unexpected<Error> scene_error(const std::string& text, const std::string& cause,
                                  const std::string& cure =
                                      "write PATTERN=MODEL, then any of ,height=120mm ,width=80mm "
                                      ",scale=0.8 ,up=y ,turn=90 ,offset=X:Y:Z ,centred "
                                      ",light=FILE ,clip=NAME ,once") {
  return fail(ExitCode::kUsage, "cli.scene", "--scene " + text, cause, cure);
}

/// Of a text that commas divide: whether one of them is within a number, and how to write that
/// part.
std::optional<WrongValue> decimal_comma(const std::vector<std::string_view>& parts) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    const std::string_view next = parts[i + 1];
    if (parts[i].empty() || !is_digit(parts[i].back()) || next.empty() || !is_digit(next[0]))
      continue;
    const std::string whole(parts[i].data(), parts[i].size() + 1 + next.size());
    std::string point = whole;
    point[parts[i].size()] = '.';
    return WrongValue{"'" + whole + "': the number contains a comma",
                      "write " + point + ", with a point"};
  }
  return std::nullopt;
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// "0.8". Errors: its fault, for a message.
tl::expected<double, WrongValue> parse_scale(std::string_view text) {
  double value = 0;
  const bool percent = text.ends_with('%');
  const std::string_view digits = percent ? text.substr(0, text.size() - 1) : text;
  if (!parse_number(digits, value)) {
    return tl::unexpected(WrongValue{"it is not a number", "write a factor, as in scale=0.8"});
  }
  if (percent) {
    return tl::unexpected(
        WrongValue{"it is a factor, not a percentage", "write scale=" + number_text(value / 100)});
  }
  if (!(value >= kLeastScale)) {
    return tl::unexpected(WrongValue{"a model of that size would be invisible",
                                     "write a factor above 0, as in scale=0.8"});
  }
  if (value > kMostScale) {
    return tl::unexpected(WrongValue{"that is more than " + number_text(kMostScale),
                                     "write a multiple of the pattern's longest side"});
  }
  return value;
}

bool is_file(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// "NAME=FILE" to both; a file whose own path has an equals sign has no name.
std::pair<std::string, std::string> split_name(const std::string& text) {
  const std::size_t equals = text.find('=');
  const bool named = equals != std::string::npos && equals > 0 && equals + 1 < text.size() &&
                     text.find('/') > equals && !is_file(text);
  if (!named) return {"", text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// The unit meant by an unknown word: "inch", "MM".
std::string_view meant_unit(const std::string& word) {
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"inch", "in"},  {"inches", "in"}, {"\"", "in"},   {"zoll", "in"},
      {"MM", "mm"},    {"Mm", "mm"},     {"CM", "cm"},   {"Cm", "cm"},
      {"M", "m"},      {"meter", "m"},   {"metre", "m"}, {"metres", "m"},
      {"meters", "m"}, {"feet", "ft"},   {"foot", "ft"}, {"'", "ft"}};
  for (const auto& [said, meant] : kWords) {
    if (word == said) return meant;
  }
  return {};
}

}  // namespace

ModelRequest parse_model(const std::string& text) {
  auto [name, path] = split_name(text);
  return {std::move(path), std::move(name)};
}

tl::expected<double, WrongValue> parse_millimetres(std::string_view text) {
  const std::size_t digits = unit_start(text);
  const std::string number(text.substr(0, digits));
  const std::string unit(text.substr(std::min(text.find_first_not_of(' ', digits), text.size())));
  double value = 0;
  if (const std::size_t comma = number.find(','); comma != std::string::npos) {
    std::string point = number;
    point[comma] = '.';
    return tl::unexpected(
        WrongValue{"the number contains a comma", "write " + point + unit + ", with a point"});
  }
  if (!parse_number(number, value)) {
    return tl::unexpected(
        WrongValue{"it is not a length", "write a number and a unit, as in 210mm"});
  }
  if (unit.empty()) {
    return tl::unexpected(WrongValue{
        "its unit is missing", "write " + number + "mm, " + number + "cm or " + number + "in"});
  }
  const Result<double> metres = parse_unit(unit);
  if (!metres) {
    const std::string_view meant = meant_unit(unit);
    return tl::unexpected(WrongValue{"there is no unit '" + unit + "'",
                                     meant.empty() ? "name one of mm, cm, m, km, in, ft"
                                                   : "write " + number + std::string(meant)});
  }
  if (!(value > 0)) {
    return tl::unexpected(WrongValue{"a length has to be above 0", "write one, as in 210mm"});
  }
  const double length = unit == "mm" ? value : value * *metres * 1000;
  if (length >= kLeastLength && length <= kMostLength) return length;
  return tl::unexpected(WrongValue{"lengths are from 0.01mm to 1000m", "write one, as in 210mm"});
}

tl::expected<std::array<double, 3>, WrongValue> parse_turn(std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ':');
  std::array<double, 3> turn{};
  bool good = parts.size() == 1 || parts.size() == 3;
  for (std::size_t i = 0; good && i < parts.size(); ++i) {
    good = parse_number(parts[i], turn[parts.size() == 1 ? 2 : i]) &&
           std::fabs(turn[parts.size() == 1 ? 2 : i]) <= kMostTurn;
  }
  if (good) return turn;
  return tl::unexpected(WrongValue{
      "it is neither one angle nor three",
      "write degrees: turn=90 about the axis out of the pattern, or turn=X:Y:Z about each axis"});
}

tl::expected<SceneOffset, WrongValue> parse_offset(std::string_view text) {
  const tl::unexpected<WrongValue> wrong(
      WrongValue{"it is not three numbers",
                 "write X:Y:Z, as in offset=0:0:20mm; without a unit they are millimetres if the "
                 "pattern's width is known, else its longest sides"});
  const std::vector<std::string_view> parts = split(text, ':');
  SceneOffset offset;
  if (parts.size() != offset.value.size()) return wrong;
  // A number without a unit has that of the last one.
  const std::string_view last = parts.back().substr(unit_start(parts.back()));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t digits = unit_start(parts[i]);
    const std::string unit(digits < parts[i].size() ? parts[i].substr(digits) : last);
    double& value = offset.value[i];
    if (!parse_number(parts[i].substr(0, digits), value)) return wrong;
    if (!unit.empty()) {
      const Result<double> metres = parse_unit(unit);
      if (!metres || last.empty()) return wrong;
      offset.unit = SceneOffset::Unit::kMillimetres;
      if (unit != "mm") value *= *metres * 1000;
    }
    if (!(std::fabs(value) <= kMostOffset)) return wrong;
  }
  return offset;
}

Result<UpAxis> parse_up(const std::string& text) {
  if (const auto up = up_axis_of(text)) return *up;
  return fail(ExitCode::kUsage, "cli.up", text, "there is no such axis",
              "name one of x, y, z, -x, -y, -z");
}

tl::expected<bool, WrongValue> parse_scene_part(std::string_view key, std::string_view value,
                                                SceneRequest& scene) {
  const auto lengths = [&](SceneSize::Kind kind) -> tl::expected<bool, WrongValue> {
    scene.size.kind = kind;
    auto mm = parse_millimetres(value);
    if (!mm) return tl::unexpected(std::move(mm.error()));
    scene.size.value = *mm;
    return true;
  };
  if (key == "height") return lengths(SceneSize::Kind::kHeight);
  if (key == "width") return lengths(SceneSize::Kind::kWidth);
  if (key == "scale") {
    auto scale = parse_scale(value);
    if (!scale) return tl::unexpected(std::move(scale.error()));
    scene.size = {SceneSize::Kind::kScale, *scale};
    return true;
  }
  if (key == "up") {
    scene.up = up_axis_of(value);
    if (scene.up) return true;
    return tl::unexpected(WrongValue{"there is no such axis", "name one of x, y, z, -x, -y, -z"});
  }
  if (key == "turn") {
    auto turn = parse_turn(value);
    if (!turn) return tl::unexpected(std::move(turn.error()));
    scene.turn = *turn;
    return true;
  }
  if (key == "offset") {
    auto offset = parse_offset(value);
    if (!offset) return tl::unexpected(std::move(offset.error()));
    scene.offset = *offset;
    return true;
  }
  if (key == "clip" && !value.empty()) {
    scene.clip = std::string(value);
    return true;
  }
  if (key == "light" && !value.empty()) {
    scene.light = std::string(value);
    return true;
  }
  return false;
}

namespace {

/// "3s", "0.5s".
bool parse_seconds(std::string_view text, double& seconds) {
  return text.ends_with('s') && parse_number(text.substr(0, text.size() - 1), seconds) &&
         seconds >= 0 && seconds <= static_cast<double>(kMostSeconds);
}

/// What stands behind a word, without it; empty where the text does not begin with the word.
std::string_view behind(std::string_view text, std::string_view word) {
  const bool begins =
      text.size() > word.size() + 1 && text.starts_with(word) && text[word.size()] == ' ';
  return begins ? text.substr(word.size() + 1) : std::string_view();
}

/// "NAME by 90 about x in 2s".
bool parse_turn_command(std::string_view text, ActionRequest& action) {
  const std::size_t by = text.rfind(" by ");
  if (by == std::string_view::npos || by == 0) return false;
  action.target = std::string(text.substr(0, by));
  const std::vector<std::string_view> words = split(text.substr(by + 4), ' ');
  constexpr std::string_view kAxes = "xyz";
  bool good = parse_number(words[0], action.degrees) &&
              std::fabs(action.degrees) <= static_cast<double>(kMostDegrees) &&
              words.size() % 2 == 1;
  for (std::size_t i = 1; good && i < words.size(); i += 2) {
    const std::string_view value = words[i + 1];
    if (words[i] == "about") {
      const std::size_t axis = value.size() == 1 ? kAxes.find(value) : std::string_view::npos;
      good = axis != std::string_view::npos;
      action.axis = static_cast<int>(axis);
    } else {
      good = words[i] == "in" && parse_seconds(value, action.duration);
    }
  }
  return good;
}

/// "CLIP on NAME", "CLIP on NAME once".
bool parse_clip_command(std::string_view text, ActionRequest& action) {
  constexpr std::string_view kOnce = " once";
  const bool once = text.ends_with(kOnce);
  if (once) text.remove_suffix(kOnce.size());
  const std::size_t on = text.rfind(" on ");
  if (on == std::string_view::npos || on == 0 || on + 4 == text.size()) return false;
  action.command = once ? ActionCommand::kClipOnce : ActionCommand::kClip;
  action.address = std::string(text.substr(0, on));
  action.target = std::string(text.substr(on + 4));
  return true;
}

}  // namespace

tl::expected<void, WrongValue> parse_event(std::string_view text, ActionRequest& action) {
  const std::string_view node = behind(text, "tap");
  const std::string_view delay = behind(text, "after");
  if (text == "found" || text == "lost") {
    action.event = text == "found" ? ActionEvent::kFound : ActionEvent::kLost;
  } else if (!node.empty()) {
    action.event = ActionEvent::kTap;
    action.source = std::string(node);
  } else if (parse_seconds(delay, action.seconds)) {
    action.event = ActionEvent::kAfter;
  } else {
    return tl::unexpected(WrongValue{"there is no such event",
                                     "write found, lost, tap NAME, or after 3s (at most a day)"});
  }
  return {};
}

tl::expected<void, WrongValue> parse_alpha(std::string_view text, NodeRequest& node) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  if (text == "none" || text == "beside") {
    node.alpha = text == "none" ? VideoAlpha::kOpaque : VideoAlpha::kBeside;
    return {};
  }
  bool good = text.size() == 7 && text[0] == '#';
  for (std::size_t i = 0; good && i < 3; ++i) {
    const std::size_t high = kDigits.find(text[1 + 2 * i]);
    const std::size_t low = kDigits.find(text[2 + 2 * i]);
    good = high != std::string_view::npos && low != std::string_view::npos;
    node.key[i] = static_cast<float>(16 * high + low) / 255.0f;
  }
  if (!good) {
    return tl::unexpected(
        WrongValue{"this is not a kind of alpha",
                   "write `none`, `beside` (the right half is the alpha of the left "
                   "one) or a colour that is not seen, \"#00ff00\""});
  }
  node.alpha = VideoAlpha::kKey;
  node.reach = 0.4f;  // keyed studio green varies by this much
  return {};
}

tl::expected<void, WrongValue> parse_command(std::string_view text, ActionRequest& action) {
  constexpr std::pair<std::string_view, ActionCommand> kCommands[] = {
      {"play", ActionCommand::kPlay},     {"pause", ActionCommand::kPause},
      {"show", ActionCommand::kShow},     {"hide", ActionCommand::kHide},
      {"toggle", ActionCommand::kToggle}, {"text", ActionCommand::kText},
      {"next", ActionCommand::kNext},     {"link", ActionCommand::kLink},
      {"turn", ActionCommand::kTurn},     {"stop", ActionCommand::kStop}};
  for (const auto& [word, command] : kCommands) {
    const std::string_view rest = behind(text, word);
    if (rest.empty()) continue;
    action.command = command;
    if (command == ActionCommand::kLink) {
      action.address = std::string(rest);
      const char* const fault = address_fault(rest);
      if (fault != nullptr) {
        return tl::unexpected(WrongValue{std::string("the link is refused: ") + fault,
                                         "write link https://museum.org/vase"});
      }
      if (rest.starts_with("https://")) return {};
      return tl::unexpected(
          WrongValue{"links lead to https addresses only", "write link https://museum.org/vase"});
    }
    if (command == ActionCommand::kPlay && parse_clip_command(rest, action)) return {};
    if (command != ActionCommand::kTurn) {
      action.target = std::string(rest);
      return {};
    }
    if (parse_turn_command(rest, action)) return {};
    return tl::unexpected(WrongValue{"the turn is not understood",
                                     "write turn NAME by 90, or turn NAME by 90 about x in 2s"});
  }
  return tl::unexpected(
      WrongValue{"there is no such command",
                 "write play, pause, show, hide, toggle, text, next, turn or stop and a NAME, play "
                 "CLIP on NAME, or link https://..."});
}

Result<SceneRequest> parse_scene(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, ',');
  const std::size_t equals = parts[0].find('=');
  if (equals == std::string_view::npos || equals == 0 || equals + 1 == parts[0].size()) {
    return scene_error(text, "it does not begin with PATTERN=MODEL");
  }
  if (const auto comma = decimal_comma(parts)) return scene_error(text, comma->cause, comma->cure);
  SceneRequest scene;
  scene.pattern = std::string(parts[0].substr(0, equals));
  scene.model = std::string(parts[0].substr(equals + 1));
  std::string_view sized;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::string_view part = parts[i];
    const std::string_view key = part.substr(0, part.find('='));
    if (part == "centred" || part == "once") {
      (part == "once" ? scene.once : scene.centred) = true;
      continue;
    }
    const bool valued = key.size() < part.size();
    auto taken = parse_scene_part(key, valued ? part.substr(key.size() + 1) : "", scene);
    const std::string quoted = "'" + std::string(part) + "'";
    if (!taken) return scene_error(text, quoted + ": " + taken.error().cause, taken.error().cure);
    if (!*taken || !valued) return scene_error(text, quoted + " is not understood");
    if (key != "scale" && key != "height" && key != "width") continue;
    if (!sized.empty()) {
      return scene_error(text, "it states the size twice", "leave " + quoted + " out");
    }
    sized = key;
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

/// "120x180x40mm".
bool parse_box(std::string_view text, std::array<double, 3>& mm) {
  const std::size_t digits = text.find_last_of("0123456789.") + 1;
  const std::vector<std::string_view> parts = split(text.substr(0, digits), 'x');
  if (parts.size() != mm.size()) return false;
  for (std::size_t i = 0; i < mm.size(); ++i) {
    const auto parsed = parse_millimetres(std::string(parts[i]) + std::string(text.substr(digits)));
    if (!parsed) return false;
    mm[i] = *parsed;
  }
  return true;
}

/// What follows a picture's last colon: a length that is written wrong, or part of a name?
bool looks_like_length(std::string_view tail) {
  constexpr std::string_view kStarts = "0123456789.,-+";
  return (!tail.empty() && kStarts.find(tail[0]) != std::string_view::npos) ||
         tail.starts_with("nan") || tail.starts_with("inf") ||
         parse_unit(std::string(tail)).has_value();
}

tl::unexpected<Error> shape_error(
    const std::string& text, const std::string& cause,
    const std::string& cure =
        "write cylinder,diameter=66mm,arc=120 or cone,top=80mm,bottom=60mm,arc=100 or "
        "box,size=120x180x40mm,right=FILE,back=FILE,left=FILE,top=FILE,bottom=FILE, or flat; "
        "behind each corners=X:Y:X:Y:X:Y:X:Y,height=297mm where the file is a photo of it") {
  return fail(ExitCode::kUsage, "cli.shape", "shape=" + text, cause, cure);
}

/// Corners within a shape, whose own parts stand between commas.
std::string commas_for_colons(std::string_view text) {
  std::string out(text);
  std::replace(out.begin(), out.end(), ':', ',');
  return out;
}

tl::expected<void, WrongValue> parse_shape_corners(std::string_view value, ShapeRequest& shape) {
  auto corners = parse_corners(commas_for_colons(value));
  if (!corners) {
    return tl::unexpected(WrongValue{"these are not eight numbers with colons between them",
                                     "write X:Y of the top-left, top-right, bottom-right and "
                                     "bottom-left corner"});
  }
  RectifyOptions cut;
  cut.corners = *corners;
  if (const auto valid = cut.validate(); !valid) {
    return tl::unexpected(WrongValue{valid.error().cause, valid.error().cure});
  }
  shape.corners = *corners;
  return {};
}

/// The sides of a box but the front.
constexpr std::string_view kBoxSides[] = {"right", "back", "left", "top", "bottom"};

/// The keys of a shape's kind, "corners" and "height" first.
std::vector<std::string_view> shape_keys(const ShapeRequest& shape) {
  std::vector<std::string_view> keys = {"corners", "height"};
  switch (shape.kind) {
    case ShapeRequest::Kind::kBox:
      keys.push_back("size");
      keys.insert(keys.end(), std::begin(kBoxSides), std::end(kBoxSides));
      break;
    case ShapeRequest::Kind::kCylinder:
      keys.insert(keys.end(), {"diameter", "arc"});
      break;
    case ShapeRequest::Kind::kCone:
      keys.insert(keys.end(), {"top", "bottom", "arc"});
      break;
    default:
      break;
  }
  return keys;
}

/// One part of a shape, of a key that its kind has.
tl::expected<void, WrongValue> parse_shape_part(std::string_view key, std::string_view value,
                                                ShapeRequest& shape) {
  const auto length = [&](double& mm) -> tl::expected<void, WrongValue> {
    const auto parsed = parse_millimetres(value);
    if (!parsed) return tl::unexpected(parsed.error());
    mm = *parsed;
    return {};
  };
  if (key == "corners") return parse_shape_corners(value, shape);
  if (key == "height") return length(shape.height_mm);
  if (key == "size") {
    if (parse_box(value, shape.box_mm)) return {};
    return tl::unexpected(
        WrongValue{"this is not a size", "write width, height and depth, as 120x180x40mm"});
  }
  if (key == "arc") {
    if (parse_number(value, shape.arc_deg) && shape.arc_deg > 0 && shape.arc_deg <= 360) return {};
    return tl::unexpected(
        WrongValue{"this is not an angle", "write degrees above 0, at most 360, as arc=120"});
  }
  if (shape.kind == ShapeRequest::Kind::kBox) {
    if (value.empty()) return tl::unexpected(WrongValue{"its file is missing", "name a picture"});
    const auto* side = std::find(std::begin(kBoxSides), std::end(kBoxSides), key);
    shape.sides[static_cast<std::size_t>(side - std::begin(kBoxSides))] = value;
    return {};
  }
  if (key == "bottom") return length(shape.bottom_mm);
  auto taken = length(shape.top_mm);
  if (taken && key == "diameter") shape.bottom_mm = shape.top_mm;
  return taken;
}

}  // namespace

Result<ShapeRequest> parse_shape(const std::string& text) {
  const std::vector<std::string_view> parts = split(text, ',');
  if (const auto comma = decimal_comma(parts)) return shape_error(text, comma->cause, comma->cure);
  ShapeRequest shape;
  shape.text = text;
  if (parts[0] == "cylinder") {
    shape.kind = ShapeRequest::Kind::kCylinder;
  } else if (parts[0] == "cone") {
    shape.kind = ShapeRequest::Kind::kCone;
  } else if (parts[0] == "box") {
    shape.kind = ShapeRequest::Kind::kBox;
  } else if (parts[0] != "flat") {
    return shape_error(text, "there is no shape '" + std::string(parts[0]) + "'");
  }
  const std::vector<std::string_view> keys = shape_keys(shape);
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::string_view key = parts[i].substr(0, parts[i].find('='));
    const std::string quoted = "'" + std::string(parts[i]) + "'";
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      return shape_error(text, std::string(parts[0]) + " has no '" + std::string(key) + "'",
                         cure_of_name(key, keys));
    }
    const bool valued = key.size() < parts[i].size();
    const auto taken = parse_shape_part(key, valued ? parts[i].substr(key.size() + 1) : "", shape);
    if (!taken) return shape_error(text, quoted + ": " + taken.error().cause, taken.error().cure);
  }
  const bool cone = shape.kind == ShapeRequest::Kind::kCone;
  if (cone && (shape.top_mm <= 0 || shape.bottom_mm <= 0)) {
    return shape_error(text, "a cone needs its diameters at the top and at the bottom");
  }
  if (shape.kind == ShapeRequest::Kind::kBox && shape.box_mm[0] <= 0) {
    return shape_error(text, "a box needs its size");
  }
  if (shape.height_mm > 0 && !shape.corners) {
    return shape_error(text, "a height needs corners=, whose picture has it");
  }
  return shape;
}

Result<PatternRequest> parse_pattern(const std::string& text) {
  constexpr std::string_view kShape = ":shape=";
  constexpr std::string_view kCopies = ":copies=";
  if (const std::size_t at = text.rfind(kCopies); at != std::string::npos) {
    MODAR_ASSIGN(PatternRequest request, parse_pattern(text.substr(0, at)));
    const std::string_view count = std::string_view(text).substr(at + kCopies.size());
    double copies = 0;
    if (!parse_number(count, copies) || copies != std::floor(copies) || copies < 1 ||
        copies > kMaxCopies) {
      return fail(ExitCode::kUsage, "cli.copies", "--pattern " + text,
                  "'" + std::string(count) + "' is no number of copies",
                  "write a number from 1 to 16, last: FILE:210mm:shape=SHAPE:copies=4");
    }
    request.copies = static_cast<std::uint32_t>(copies);
    return request;
  }
  if (const std::size_t at = text.rfind(kShape); at != std::string::npos) {
    MODAR_ASSIGN(PatternRequest request, parse_pattern(text.substr(0, at)));
    MODAR_ASSIGN(request.shape, parse_shape(text.substr(at + kShape.size())));
    return request;
  }
  PatternRequest request;
  std::tie(request.name, request.path) = split_name(text);
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return request;
  const std::string_view tail = std::string_view(text).substr(colon + 1);
  const auto width = parse_millimetres(tail);
  if (!width) {
    if (is_file(text)) return request;
    const std::string before = text.substr(0, colon);
    if (!looks_like_length(tail)) {
      if (!is_file(split_name(before).second)) return request;
      return fail(ExitCode::kUsage, "cli.pattern", "--pattern " + text,
                  "'" + std::string(tail) + "' is neither a width nor a shape",
                  "write " + before + ":210mm for a width, or " + before + ":shape=SHAPE");
    }
    return fail(ExitCode::kUsage, "cli.pattern", "--pattern " + text,
                "'" + std::string(tail) + "' is not a width: " + width.error().cause,
                width.error().cure);
  }
  request.width_mm = *width;
  std::tie(request.name, request.path) = split_name(text.substr(0, colon));
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
  if (const auto comma = decimal_comma(split(text, ','))) {
    return fail(ExitCode::kUsage, "cli.max-error", "--max-error " + text, comma->cause,
                comma->cure);
  }
  return fail(ExitCode::kUsage, "cli.max-error", "--max-error " + text,
              "this is not a length above 0",
              "write a number of source units, a percentage of the diagonal as 0.01%, or a length "
              "as 2mm");
}

}  // namespace modar
