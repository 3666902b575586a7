// The text forms that a request's parts take in options and project files: scenes, corners,
// lengths.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/pattern/pattern.hpp"
#include "formats/error.hpp"

namespace modar {

/// The parts between separators; one part where there is none.
std::vector<std::string_view> split(std::string_view text, char separator);
/// The whole text as a finite number; false where it is none.
bool parse_number(std::string_view text, double& value);

/// "x", "-y". Errors: kUsage "cli.up".
Result<UpAxis> parse_up(const std::string& text);

/// "PATTERN=MODEL[,scale=S][,up=x|y|z|-x|-y|-z][,offset=X:Y:Z][,centred]".
/// Errors: kUsage "cli.scene".
Result<SceneRequest> parse_scene(const std::string& text);

/// "x,y,x,y,x,y,x,y" in pixels: top-left, top-right, bottom-right, bottom-left.
/// Errors: kUsage "cli.corners".
Result<std::array<PixelPoint, 4>> parse_corners(const std::string& text);

/// "FILE", "FILE:WIDTH", a physical width with a unit of parse_unit(): 210mm, 21cm, and behind
/// either ":shape=..." of parse_shape(). Errors: kUsage "cli.pattern", "cli.shape".
Result<PatternRequest> parse_pattern(const std::string& text);

/// "cylinder,diameter=66mm,arc=120", "cone,top=80mm,bottom=60mm,arc=100"; arc in degrees, left out
/// where the width tells it; "box,size=120x180x40mm,right=FILE,top=FILE": width, height and depth.
/// Errors: kUsage "cli.shape".
Result<ShapeRequest> parse_shape(const std::string& text);

/// "mm", "cm", "m", "km", "in", "ft" to metres. Errors: kUsage "cli.unit".
Result<double> parse_unit(const std::string& text);

/// "0.002" (source units), "0.01%" (of the model's diagonal) or "2mm" (a unit of parse_unit).
/// Errors: kUsage "cli.max-error".
Result<MaxError> parse_max_error(const std::string& text);

}  // namespace modar
