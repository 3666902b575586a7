// The pictures of a pattern with its shape: those of a box side by side in one.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/box_edges.hpp"
#include "bake/pattern/gray_mat.hpp"
#include "bake/pattern/rectify.hpp"
#include "bake/pattern/shape.hpp"
#include "bake/pattern/target_file.hpp"

namespace modar {
namespace {

/// A side of a box: its place in the common picture and in space.
struct BoxSide {
  const GrayPicture* picture = nullptr;
  int place[4] = {};  ///< left, top, width, height
  double corner[3] = {};
  double right[3] = {};
  double down[3] = {};
};

/// Sides that have a picture: front, right, back and left in a row, top and bottom below. Lengths
/// in millimetres about the middle of the front.
std::vector<BoxSide> sides_of(const std::array<GrayPicture, 6>& pictures,
                              const std::array<double, 3>& box_mm) {
  const auto [w, h, d] = box_mm;
  const double x = 0.5 * w;
  const double y = 0.5 * h;
  const std::vector<BoxSide> all = {{&pictures[0], {}, {-x, y, 0}, {w, 0, 0}, {0, -h, 0}},
                                    {&pictures[1], {}, {x, y, 0}, {0, 0, -d}, {0, -h, 0}},
                                    {&pictures[2], {}, {x, y, -d}, {-w, 0, 0}, {0, -h, 0}},
                                    {&pictures[3], {}, {-x, y, -d}, {0, 0, d}, {0, -h, 0}},
                                    {&pictures[4], {}, {-x, y, -d}, {w, 0, 0}, {0, 0, d}},
                                    {&pictures[5], {}, {-x, -y, 0}, {w, 0, 0}, {0, 0, -d}}};
  std::vector<BoxSide> sides;
  for (const BoxSide& side : all) {
    if (!side.picture->pixels.empty()) sides.push_back(side);
  }
  return sides;
}

double length_of(const double (&v)[3]) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/// Places the sides, and returns the size of the picture that holds them; pixels: of a millimetre.
cv::Size lay_out(double pixels, std::vector<BoxSide>& sides) {
  int across[2] = {0, 0};
  int heights[2] = {0, 0};
  for (BoxSide& side : sides) {
    const std::size_t row = side.down[2] != 0 ? 1 : 0;
    const int width = std::max(1, static_cast<int>(std::lround(length_of(side.right) * pixels)));
    const int height = std::max(1, static_cast<int>(std::lround(length_of(side.down) * pixels)));
    side.place[0] = across[row];
    side.place[1] = row == 0 ? 0 : heights[0];
    side.place[2] = width;
    side.place[3] = height;
    across[row] += width;
    heights[row] = std::max(heights[row], height);
  }
  return {std::max(across[0], across[1]), heights[0] + heights[1]};
}

/// Whether a picture has about the proportions of its side, of that width and height.
bool fits(const GrayPicture& picture, double width, double height) {
  constexpr double kSlack = 0.06;
  return std::fabs(picture.width * height / (picture.height * width) - 1) <= kSlack;
}

Result<ShapedPicture> load_box(const std::string& path, const ShapeRequest& request) {
  std::array<GrayPicture, 6> pictures;
  const auto [w, h, d] = request.box_mm;
  const double widths[] = {w, d, w, d, w, w};
  const double heights[] = {h, h, h, h, d, d};
  const auto folder = std::filesystem::path(path).parent_path();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (i > 0 && request.sides[i - 1].empty()) continue;
    const std::string file = i == 0 ? path : (folder / request.sides[i - 1]).string();
    if (i == 0) {
      MODAR_ASSIGN(const RgbaImage front, read_pattern_picture(path, w, request));
      pictures[0] = gray_of(front);
    } else {
      MODAR_ASSIGN(pictures[i], load_gray(file));
    }
    if (fits(pictures[i], widths[i], heights[i])) continue;
    return fail(ExitCode::kUsage, "pattern.shape", file,
                "the picture is " + std::to_string(pictures[i].width) + "x" +
                    std::to_string(pictures[i].height) +
                    " pixels, which are not the proportions of its side of the box",
                "cut it along the edges of its side, or correct size=WIDTHxHEIGHTxDEPTHmm");
  }
  const CorrectedBox corrected = correct_crops(pictures);
  ShapedPicture box = assemble_box(corrected.pictures, request.box_mm);
  box.corrected = corrected.most;
  box.cut_beyond = corrected.beyond;
  return box;
}

}  // namespace

ShapedPicture assemble_box(const std::array<GrayPicture, 6>& pictures,
                           const std::array<double, 3>& box_mm, int longest) {
  std::vector<BoxSide> sides = sides_of(pictures, box_mm);
  const cv::Size whole = lay_out(1000, sides);
  const double pixels = 1000.0 * longest / std::max(whole.width, whole.height);
  const cv::Size size = lay_out(pixels, sides);
  ShapedPicture out;
  out.picture = {size.width, size.height,
                 std::vector<std::uint8_t>(static_cast<std::size_t>(size.area()), 128)};
  out.width_mm = size.width / pixels;
  cv::Mat atlas(size, CV_8UC1, out.picture.pixels.data());
  PatternShapeHeader header{};
  header.kind = static_cast<std::uint32_t>(ShapeKind::kFaces);
  header.face_count = static_cast<std::uint32_t>(sides.size());
  out.section.resize(sizeof header);
  std::memcpy(out.section.data(), &header, sizeof header);
  const double unit = 2 * pixels / std::max(size.width, size.height);
  for (const BoxSide& side : sides) {
    cv::Mat there = atlas(cv::Rect(side.place[0], side.place[1], side.place[2], side.place[3]));
    const cv::Mat source = as_mat(side.picture->view());
    cv::resize(source, there, there.size(), 0, 0,
               source.cols > there.cols ? cv::INTER_AREA : cv::INTER_LINEAR);
    ShapeFaceRecord face{};
    for (std::size_t i = 0; i < 4; ++i) face.place[i] = static_cast<std::uint16_t>(side.place[i]);
    for (std::size_t i = 0; i < 3; ++i) {
      face.corner[i] = static_cast<float>(unit * side.corner[i]);
      face.right[i] = static_cast<float>(unit * side.right[i]);
      face.down[i] = static_cast<float>(unit * side.down[i]);
    }
    const auto bytes = std::as_bytes(std::span(&face, 1));
    out.section.insert(out.section.end(), bytes.begin(), bytes.end());
  }
  return out;
}

Result<RgbaImage> read_pattern_picture(const std::string& path, double width_mm,
                                       const ShapeRequest& request) {
  if (!request.corners) return read_image(path);
  MODAR_ASSIGN(const Photo photo, read_photo(path));
  RectifyOptions options;
  options.corners = *request.corners;
  options.width_mm = width_mm;
  options.height_mm = request.height_mm;
  options.focal_px = photo.focal_px;
  auto cut = rectify(photo.image, options);
  if (cut) return std::move(cut->image);
  cut.error().where = path;
  return tl::unexpected(std::move(cut.error()));
}

std::vector<std::string> files_of(const std::string& path, const ShapeRequest& request) {
  std::vector<std::string> files;
  for (const std::string& side : request.sides) {
    if (!side.empty()) files.push_back((std::filesystem::path(path).parent_path() / side).string());
  }
  return files;
}

Result<ShapedPicture> load_shaped(const std::string& path, double width_mm,
                                  const ShapeRequest& request) {
  if (request.kind == ShapeRequest::Kind::kBox) return load_box(path, request);
  ShapedPicture out;
  if (request.corners) {
    MODAR_ASSIGN(const RgbaImage cut, read_pattern_picture(path, width_mm, request));
    out.picture = gray_of(cut);
  } else {
    MODAR_ASSIGN(out.picture, load_pattern(path, out.shrunk));
  }
  ShapeRequest told = request;
  if (request.flat() && is_target_file(path)) {
    MODAR_ASSIGN(told, target_shape(path));
  }
  // Diameter and arc tell the width: what the file states may be a program's default. A photo's
  // is not that of the picture in it.
  const bool told_width = told.top_mm > 0 && told.arc_deg > 0;
  const bool stated = !told_width && !request.corners;
  out.width_mm = width_mm > 0 ? width_mm : stated ? png_width_mm(path) : 0;
  out.width_of_file = width_mm <= 0 && out.width_mm > 0;
  MODAR_ASSIGN(out.section,
               shape_section(told, out.picture.width, out.picture.height, out.width_mm));
  return out;
}

}  // namespace modar
