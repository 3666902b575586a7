// Keys of the JSON files are those of the tools that 8th Wall published for users' own projects.
#include "bake/pattern/target_file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "bake/json.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> no_target(const std::string& path, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "target.json", path, cause,
              R"(write {"name": "poster", "type": "PLANAR", "imagePath": "poster.png"})");
}

Result<Json> read_target(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  Json json = Json::parse(file.bytes());
  const auto type = json["type"].text();
  if (!type) return no_target(path, "it is not an image target of 8th Wall");
  for (const char* known : {"PLANAR", "CYLINDER", "CONICAL"}) {
    if (*type == known) return json;
  }
  return fail(ExitCode::kUnsupported, "target.type", path,
              "its picture is on an unknown kind of object (" + *type + ")",
              "PLANAR, CYLINDER and CONICAL are supported: choose another target");
}

/// A member of the target's geometry, which newer files call properties.
Json member(const Json& json, const std::string& key) {
  return json.find("properties/" + key).value_or(json["xrMetadata/" + key]);
}

/// The place of a target's picture, in millimetres.
struct CurvedTarget {
  ShapeRequest shape;
  double side_mm = 0;   ///< of the picture, along the axis' direction
  double width_mm = 0;  ///< in the middle of its height
};

Result<CurvedTarget> read_curved(const Json& json, const std::string& path) {
  double numbers[9] = {};
  constexpr const char* kKeys[] = {"cylinderCircumferenceTop",
                                   "cylinderCircumferenceBottom",
                                   "cylinderSideLength",
                                   "arcAngle",
                                   "left",
                                   "top",
                                   "width",
                                   "height",
                                   "originalWidth"};
  for (std::size_t i = 0; i < std::size(kKeys); ++i) {
    const auto number = member(json, kKeys[i]).number();
    if (!number) {
      return no_target(path, std::string("it is on a curved object but has no ") + kKeys[i]);
    }
    numbers[i] = *number;
  }
  const auto& [top_around, bottom_around, side, arc, left, top, width, height, whole_width] =
      numbers;
  const double whole = member(json, "originalHeight").number().value_or(0);
  const bool sane = top_around > 0 && bottom_around > 0 && side > 0 && arc > 0 && arc <= 360 &&
                    width > 0 && height > 0 && width <= whole_width && height <= whole;
  if (!sane) return no_target(path, "its geometry is impossible");
  // A target on its side has its crop measured after the turn, by a quarter with the clock.
  const bool on_side = member(json, "isRotated").truth().value_or(false);
  const double across = on_side ? height / whole : width / whole_width;
  const double down = on_side ? width / whole_width : height / whole;
  const double above = on_side ? (whole_width - left - width) / whole_width : top / whole;
  const double mm = member(json, "unit").text() == "in" ? 25.4 : 1;
  const auto around_at = [&, top_around = top_around, bottom_around = bottom_around](double share) {
    return mm * (top_around + (bottom_around - top_around) * share);
  };
  CurvedTarget out;
  const bool cone = json.text_at("type") == "CONICAL";
  out.shape.kind = cone ? ShapeRequest::Kind::kCone : ShapeRequest::Kind::kCylinder;
  out.shape.top_mm = around_at(above) / std::numbers::pi;
  out.shape.bottom_mm = around_at(above + down) / std::numbers::pi;
  out.shape.arc_deg = arc * across;
  out.shape.text = fs::path(path).filename().string();
  out.side_mm = mm * side * down;
  out.width_mm = around_at(above + 0.5 * down) * out.shape.arc_deg / 360;
  return out;
}

/// The picture with the proportions that it has on the object: a cone's is stored as wide as its
/// wider end.
GrayPicture in_proportion(const GrayPicture& picture, const CurvedTarget& target) {
  GrayPicture out{picture.width, 0, {}};
  out.height =
      std::max(1, static_cast<int>(std::lround(picture.width * target.side_mm / target.width_mm)));
  if (out.height == picture.height) return picture;
  out.pixels.reserve(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  for (int y = 0; y < out.height; ++y) {
    const double at =
        std::clamp((y + 0.5) * picture.height / out.height - 0.5, 0.0, picture.height - 1.0);
    const int row = std::min(static_cast<int>(at), std::max(0, picture.height - 2));
    const int next = std::min(row + 1, picture.height - 1);
    const double part = at - row;
    for (int x = 0; x < out.width; ++x) {
      const auto gray = [&](int line) {
        return picture.pixels[static_cast<std::size_t>(line * picture.width + x)];
      };
      out.pixels.push_back(
          static_cast<std::uint8_t>(gray(row) * (1 - part) + gray(next) * part + 0.5));
    }
  }
  return out;
}

/// A turn by 90 degrees against the clock, which takes back that of 8th Wall's tools.
RgbaImage turned_back(const RgbaImage& picture) {
  RgbaImage out{picture.height, picture.width, {}};
  out.pixels.reserve(picture.pixels.size());
  for (std::size_t y = 0; y < out.height; ++y) {
    for (std::size_t x = 0; x < out.width; ++x) {
      const std::uint8_t* const from = &picture.pixels[4 * ((x + 1) * picture.width - 1 - y)];
      out.pixels.insert(out.pixels.end(), from, from + 4);
    }
  }
  return out;
}

}  // namespace

bool is_target_file(std::string_view path) {
  return path.ends_with(".json");
}

Result<std::string> target_picture(const std::string& path) {
  MODAR_ASSIGN(const Json json, read_target(path));
  std::string named;
  for (const char* key : {"resources/croppedImage", "resources/luminanceImage", "imagePath"}) {
    const auto value = json.find(key);
    if (!value || !value->text()) continue;
    // imagePath is an address on the web: the file is next to the target.
    for (const fs::path& name : {fs::path(*value->text()), fs::path(*value->text()).filename()}) {
      const fs::path picture = fs::path(path).parent_path() / name;
      std::error_code failed;
      if (fs::is_regular_file(picture, failed)) return picture.string();
    }
    named += (named.empty() ? "" : ", ") + *value->text();
  }
  if (named.empty()) return no_target(path, "it names no picture");
  return fail(ExitCode::kIo, "target.picture", path, "none of its pictures exists: " + named,
              "copy them next to it, or pass the picture itself with --pattern");
}

Result<RgbaImage> read_target_colours(const std::string& path) {
  MODAR_ASSIGN(const std::string file, target_picture(path));
  MODAR_ASSIGN(RgbaImage picture, read_image(file));
  MODAR_ASSIGN(const Json json, read_target(path));
  const bool turned = member(json, "isRotated").truth().value_or(false);
  return turned ? turned_back(picture) : std::move(picture);
}

Result<GrayPicture> load_target(const std::string& path) {
  MODAR_ASSIGN(const RgbaImage colours, read_target_colours(path));
  const GrayPicture picture = gray_of(colours);
  MODAR_ASSIGN(const Json json, read_target(path));
  if (json.find("type")->text() == "PLANAR") return picture;
  MODAR_ASSIGN(const CurvedTarget curved, read_curved(json, path));
  return in_proportion(picture, curved);
}

Result<ShapeRequest> target_shape(const std::string& path) {
  MODAR_ASSIGN(const Json json, read_target(path));
  if (json.find("type")->text() == "PLANAR") return ShapeRequest{};
  MODAR_ASSIGN(CurvedTarget curved, read_curved(json, path));
  return std::move(curved.shape);
}

}  // namespace modar
