// Diameters and an arc to a radius in pattern units and a slope.
#include "bake/pattern/shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace modar {
namespace {

using std::numbers::pi;

tl::unexpected<Error> contradiction(const ShapeRequest& request, const std::string& cause,
                                    const std::string& cure) {
  return fail(ExitCode::kUsage, "pattern.shape", "shape=" + request.text, cause, cure);
}

std::string rounded(double value) {
  const double tenths = std::round(value * 10) / 10;
  std::string text = std::to_string(tenths);
  return text.substr(0, text.find('.') + 2);
}

/// Degrees that the picture covers, from the stated dimensions.
Result<double> arc_of(const ShapeRequest& request, double width_mm) {
  // A ruler laid around a bottle is right to a few percent.
  constexpr double kSlack = 0.05;
  const double around = pi * 0.5 * (request.top_mm + request.bottom_mm);
  const double told = around > 0 ? 360 * width_mm / around : 0;
  if (request.arc_deg <= 0 && told <= 0) {
    return contradiction(request, "the angle that the picture covers is missing",
                         "add arc=DEGREES, or the diameter and the picture's width");
  }
  const double arc = request.arc_deg > 0 ? request.arc_deg : told;
  if (arc > 360) {
    return contradiction(
        request, "a picture " + rounded(width_mm) + " mm wide covers " + rounded(arc) + " degrees",
        "correct the width or the diameter");
  }
  if (told > 0 && std::fabs(told / arc - 1) > kSlack) {
    return contradiction(
        request, "width and diameter give " + rounded(told) + " degrees, not " + rounded(arc),
        "leave out the width or the arc");
  }
  return arc;
}

}  // namespace

Result<std::vector<std::byte>> shape_section(const ShapeRequest& request, int width, int height,
                                             double& width_mm) {
  if (request.flat()) return std::vector<std::byte>();
  MODAR_ASSIGN(const double arc, arc_of(request, width_mm));
  const double around = pi * 0.5 * (request.top_mm + request.bottom_mm);
  if (width_mm <= 0) width_mm = around * arc / 360;
  PatternShapeHeader header{};
  header.kind = static_cast<std::uint32_t>(ShapeKind::kRound);
  header.half_arc = std::min(arc * pi / 360, pi);
  if (request.kind == ShapeRequest::Kind::kCone) {
    const double side = width_mm * height / width;
    header.slope = 0.5 * (request.top_mm - request.bottom_mm) / side;
    if (!(std::fabs(header.slope) < 0.95)) {
      return contradiction(request,
                           "the picture is " + rounded(side) +
                               " mm high along the cone, too little for these diameters",
                           "correct the diameters or the arc");
    }
  }
  std::vector<std::byte> section(sizeof header);
  std::memcpy(section.data(), &header, sizeof header);
  PatternSurface surface;
  const char* fault = view_pattern_shape(section, static_cast<std::uint32_t>(width),
                                         static_cast<std::uint32_t>(height), surface);
  if (fault != nullptr) return contradiction(request, fault, "correct the diameters or the arc");
  return section;
}

PatternSurface surface_of(const std::vector<std::byte>& section, int width, int height) {
  PatternSurface surface;
  if (!section.empty()) {
    static_cast<void>(view_pattern_shape(section, static_cast<std::uint32_t>(width),
                                         static_cast<std::uint32_t>(height), surface));
  }
  return surface;
}

}  // namespace modar
