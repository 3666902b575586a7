// The text forms that a request's parts take in options and project files: scenes, corners,
// lengths.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "bake/options/request.hpp"
#include "bake/pattern/pattern.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Of scenes: beyond the greatest, floats of the record lose the offset.
inline constexpr double kLeastScale = 1e-6;
inline constexpr double kMostScale = 1e6;

/// The parts between separators; one part if none.
std::vector<std::string_view> split(std::string_view text, char separator);
/// The whole text as a finite number; false if it is not one.
bool parse_number(std::string_view text, double& value);

/// "x", "-y", "Z". Errors: kUsage "cli.up".
Result<UpAxis> parse_up(const std::string& text);

/// The fault of a part of a text, and how to write it.
struct WrongValue {
  std::string cause;
  std::string cure;
};

/// "210mm", "21cm", "8.3in": a length above 0, in millimetres.
tl::expected<double, WrongValue> parse_millimetres(std::string_view text);

/// "90" (degrees about the pattern's z axis) or "0:45:90" (about x, y and z).
tl::expected<std::array<double, 3>, WrongValue> parse_turn(std::string_view text);

/// "0:0:20mm", "0.1:0:0".
tl::expected<SceneOffset, WrongValue> parse_offset(std::string_view text);

/// One key of a scene (scale, height, width, up, turn, offset, light) with its value. False: there
/// is no such key.
tl::expected<bool, WrongValue> parse_scene_part(std::string_view key, std::string_view value,
                                                SceneRequest& scene);

/// "found", "lost", "tap NAME" or "after 3s"; then "show NAME", "hide NAME", "toggle NAME",
/// "text NAME", "next NAME", "play NAME", "pause NAME", "link https://...", "turn NAME by 90 [about
/// x] [in 2s]", into the action.
tl::expected<void, WrongValue> parse_event(std::string_view text, ActionRequest& action);
tl::expected<void, WrongValue> parse_command(std::string_view text, ActionRequest& action);

/// Where a video is seen through, into the node: "none", "beside" or a colour, "#00ff00".
tl::expected<void, WrongValue> parse_alpha(std::string_view text, NodeRequest& node);

/// "PATTERN=MODEL[,scale=S|,height=120mm|,width=80mm][,up=y][,turn=90][,offset=X:Y:Z][,centred]
/// [,light=FILE][,clip=NAME][,once]". Errors: kUsage "cli.scene".
Result<SceneRequest> parse_scene(const std::string& text);

/// "FILE" or "NAME=FILE".
ModelRequest parse_model(const std::string& text);

/// "x,y,x,y,x,y,x,y" in pixels: top-left, top-right, bottom-right, bottom-left.
/// Errors: kUsage "cli.corners".
Result<std::array<PixelPoint, 4>> parse_corners(const std::string& text);

/// "FILE", "FILE:WIDTH", a physical width with a unit of parse_unit(): 210mm, 21cm, and behind
/// either ":shape=..." of parse_shape(), and at the end ":copies=N". Errors: kUsage "cli.pattern",
/// "cli.shape", "cli.copies".
Result<PatternRequest> parse_pattern(const std::string& text);

/// "cylinder,diameter=66mm,arc=120", "cone,top=80mm,bottom=60mm,arc=100"; arc in degrees, left out
/// where the width tells it; "box,size=120x180x40mm,right=FILE,top=FILE": width, height and depth;
/// "flat,corners=X:Y:X:Y:X:Y:X:Y,height=297mm", which any may have: the file is a photo of it.
/// Errors: kUsage "cli.shape".
Result<ShapeRequest> parse_shape(const std::string& text);

/// "mm", "cm", "m", "km", "in", "ft" to metres. Errors: kUsage "cli.unit".
Result<double> parse_unit(const std::string& text);

/// "0.002" (source units), "0.01%" (of the model's diagonal) or "2mm" (a unit of parse_unit).
/// Errors: kUsage "cli.max-error".
Result<MaxError> parse_max_error(const std::string& text);

}  // namespace modar
