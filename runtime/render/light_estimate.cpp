// Samples the pattern's cells, throws out what does not fit, fits a plane of light.
#include "runtime/render/light_estimate.hpp"
#include "formats/colour_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

namespace modar {
namespace {

/// Samples of a cell in each direction. More reduce noise and take time.
constexpr int kSamples = 4;
/// The share of a new look: the light follows in about a third of a second at 30 frames a second.
constexpr float kFollow = 0.3f;
/// After this many frames without a sample, the first one counts alone.
constexpr std::uint64_t kForget = 60;
/// Linear. Darker cells tell noise, brighter samples are cut off by the camera.
constexpr float kDark = 0.02f;
constexpr float kBright = 0.94f;
/// Cells whose brightness is beyond this factor of the middle one's show something else: a hand,
/// a reflection.
constexpr float kOdd = 1.8f;
/// The same for a cell off the plane of light through all, and how often such cells are looked
/// for: what covers cells in part bends the plane at first.
constexpr float kOff = 1.12f;
constexpr int kPasses = 3;
/// A frame whose samples differ less between red, green and blue has no colour (of 255).
constexpr float kGray = 2.5f;
constexpr std::size_t kMostCells = kMaxColourCells * kMaxColourCells;

/// sRGB (0 to 1) to linear, off by 0.002 at most: a cubic needs no libm.
float light_of(float c) {
  return c * (c * (c * 0.305306011f + 0.682171111f) + 0.012522878f);
}

float luma(const glm::vec3& c) {
  return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b;
}

/// A pixel as sRGB, 0 to 255.
glm::vec3 pixel_of(const CameraPicture& frame, int x, int y) {
  const auto at = [&](std::size_t plane, int column, int row) {
    return static_cast<float>(frame.planes[plane][frame.strides[plane] * row + column]);
  };
  if (frame.format == PictureFormat::kRgb || frame.format == PictureFormat::kRgba) {
    const int pixel = frame.format == PictureFormat::kRgb ? 3 : 4;
    return {at(0, pixel * x, y), at(0, pixel * x + 1, y), at(0, pixel * x + 2, y)};
  }
  float v = 0;
  float u = 0;
  if (frame.format == PictureFormat::kI420) {
    u = at(1, x / 2, y / 2);
    v = at(2, x / 2, y / 2);
  } else {
    const int second = frame.format == PictureFormat::kNv21 ? 1 : 0;
    u = at(1, x / 2 * 2 + second, y / 2);
    v = at(1, x / 2 * 2 + 1 - second, y / 2);
  }
  // ITU-R BT.601, as shaders/background.frag has it.
  const float scale = frame.full_range ? 1.0f : 255.0f / 219.0f;
  const float chroma = frame.full_range ? 1.0f : 255.0f / 224.0f;
  const float gray = (at(0, x, y) - (frame.full_range ? 0.0f : 16.0f)) * scale;
  u = (u - 128) * chroma;
  v = (v - 128) * chroma;
  return glm::clamp(
      glm::vec3(gray + 1.402f * v, gray - 0.344136f * u - 0.714136f * v, gray + 1.772f * u), 0.0f,
      255.0f);
}

/// A cell of the pattern as printed and as seen, linear.
struct Cell {
  glm::vec3 stored{0.0f};
  glm::vec3 seen{0.0f};
  glm::vec2 place{0.0f};  ///< of its middle, pattern units
  float ratio = 0;        ///< of the brightness
};

class Look {
 public:
  Look(const CameraPicture& frame, const glm::mat4& matrix, const PatternRecord& pattern,
       std::span<const std::byte> colours)
      : frame_(frame), matrix_(matrix), half_(pattern.half_width, pattern.half_height) {
    std::memcpy(&header_, colours.data(), sizeof header_);
    texels_ = colours.data() + sizeof header_;
    columns_ = static_cast<float>(header_.columns);
    rows_ = static_cast<float>(header_.rows);
  }

  PlaneLight result() {
    PlaneLight light;
    collect();
    if (4 * count_ < header_.columns * header_.rows || count_ < 4) return light;
    drop_odd();
    if (count_ < 4 || !fit(light)) return light;
    for (int pass = 0; pass < kPasses; ++pass) {
      drop_covered(light);
      if (!fit(light)) return light;
    }
    tint(light);
    light.known = true;
    return light;
  }

 private:
  void collect() {
    for (std::uint32_t row = 0; row < header_.rows; ++row) {
      for (std::uint32_t column = 0; column < header_.columns; ++column) {
        Cell cell;
        const std::byte* texel = texels_ + 6 * std::size_t{row * header_.columns + column};
        for (int c = 0; c < 3; ++c) {
          std::uint16_t value = 0;
          std::memcpy(&value, texel + 2 * c, sizeof value);
          cell.stored[c] = static_cast<float>(value) / 65535.0f;
        }
        if (luma(cell.stored) < kDark || !sample(column, row, cell)) continue;
        cell.ratio = luma(cell.seen) / luma(cell.stored);
        cells_[count_++] = cell;
      }
    }
  }

  /// False where a part of the cell is out of the frame, or brighter than the camera tells.
  bool sample(std::uint32_t column, std::uint32_t row, Cell& cell) {
    const auto place = [&](float x, float y) {
      return half_ * glm::vec2(2 * (static_cast<float>(column) + x) / columns_ - 1,
                               1 - 2 * (static_cast<float>(row) + y) / rows_);
    };
    const auto inner = [](int i) { return (static_cast<float>(i) + 0.5f) / kSamples; };
    cell.place = place(0.5f, 0.5f);
    for (int j = 0; j < kSamples; ++j) {
      for (int i = 0; i < kSamples; ++i) {
        const glm::vec2 p = place(inner(i), inner(j));
        const glm::vec4 clip = matrix_ * glm::vec4(p, 0.0f, 1.0f);
        // Also false for NaN.
        if (!(clip.w > 0)) return false;
        const float x = (0.5f + 0.5f * clip.x / clip.w) * static_cast<float>(frame_.width);
        const float y = (0.5f - 0.5f * clip.y / clip.w) * static_cast<float>(frame_.height);
        if (!(x >= 0 && y >= 0 && x < static_cast<float>(frame_.width) &&
              y < static_cast<float>(frame_.height))) {
          return false;
        }
        const glm::vec3 pixel = pixel_of(frame_, static_cast<int>(x), static_cast<int>(y));
        most_colour_ =
            std::max({most_colour_, std::fabs(pixel.r - pixel.g), std::fabs(pixel.b - pixel.g)});
        for (int c = 0; c < 3; ++c) cell.seen[c] += light_of(pixel[c] / 255.0f);
      }
    }
    cell.seen /= static_cast<float>(kSamples * kSamples);
    return luma(cell.seen) < kBright;
  }

  /// Keeps the cells near the middle ratio.
  void drop_odd() {
    std::array<float, kMostCells> ratios;
    for (std::uint32_t i = 0; i < count_; ++i) ratios[i] = cells_[i].ratio;
    std::nth_element(ratios.begin(), ratios.begin() + count_ / 2, ratios.begin() + count_);
    const float middle = ratios[count_ / 2];
    keep([&](const Cell& cell) {
      return cell.ratio * kOdd >= middle && cell.ratio <= middle * kOdd;
    });
  }

  template <class Good>
  void keep(const Good& good) {
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (good(cells_[i])) cells_[kept++] = cells_[i];
    }
    count_ = kept;
  }

  /// A cell that something covers in part is still near the middle ratio, and off the plane.
  void drop_covered(const PlaneLight& light) {
    const auto fits = [&](const Cell& cell) {
      const float plane = light.middle.g * (1.0f + glm::dot(light.slope, cell.place));
      return cell.ratio * kOff >= plane && cell.ratio <= plane * kOff;
    };
    const auto left = std::count_if(cells_.begin(), cells_.begin() + count_, fits);
    if (2 * left >= static_cast<std::ptrdiff_t>(count_)) keep(fits);
  }

  /// Least squares of seen = stored * (a + b x + c y) in brightness.
  bool fit(PlaneLight& light) {
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0);
    for (std::uint32_t i = 0; i < count_; ++i) {
      const Cell& cell = cells_[i];
      const glm::dvec3 row(1.0, cell.place.x, cell.place.y);
      const double weight = static_cast<double>(luma(cell.stored));
      normal += glm::outerProduct(row, row) * weight;
      right += row * (weight * static_cast<double>(cell.ratio));
    }
    // A little of a level plane, for patterns of which a strip is seen.
    normal[1][1] += 0.02 * normal[0][0];
    normal[2][2] += 0.02 * normal[0][0];
    const double determinant = glm::determinant(normal);
    if (!(determinant > 1e-12)) return false;
    const glm::dvec3 plane = glm::inverse(normal) * right;
    if (!(plane.x > 1e-3)) return false;
    light.middle = glm::vec3(static_cast<float>(plane.x));
    light.slope = glm::clamp(glm::vec2(plane.y / plane.x, plane.z / plane.x), -0.6f, 0.6f);
    return true;
  }

  /// The colour of the light, where the frame has any.
  void tint(PlaneLight& light) const {
    if (most_colour_ <= kGray) return;
    glm::vec3 seen(0.0f);
    glm::vec3 lit(0.0f);
    for (std::uint32_t i = 0; i < count_; ++i) {
      seen += cells_[i].seen;
      lit += cells_[i].stored * (light.middle * (1.0f + glm::dot(light.slope, cells_[i].place)));
    }
    light.middle *= glm::clamp(seen / glm::max(lit, 1e-4f), 0.5f, 2.0f);
  }

  const CameraPicture& frame_;
  const glm::mat4& matrix_;
  glm::vec2 half_;
  ColourGridHeader header_{};
  const std::byte* texels_ = nullptr;
  float columns_ = 1;
  float rows_ = 1;
  std::array<Cell, kMostCells> cells_;
  std::uint32_t count_ = 0;
  float most_colour_ = 0;
};

}  // namespace

PlaneLight look_at_pattern(const CameraPicture& frame, const glm::mat4& matrix,
                           const PatternRecord& pattern, std::span<const std::byte> colours) {
  return Look(frame, matrix, pattern, colours).result();
}

void LightEstimator::create(const BundleView& bundle) {
  bundle_ = bundle;
  patterns_.assign(bundle.patterns().size(), {});
  frame_ = 0;
}

void LightEstimator::observe(const CameraPicture& frame, const glm::mat4& projection,
                             std::span<const DrawItem> items, std::uint64_t passed) {
  frame_ += passed;
  for (const DrawItem& item : items) {
    if (item.scene >= bundle_.scenes().size()) continue;
    const std::uint32_t pattern = bundle_.scenes()[item.scene].pattern;
    Watched& watched = patterns_[pattern];
    if (watched.light.known && frame_ < watched.looked + kLookPause) continue;
    const auto colours = bundle_.section(SectionType::kPatternColours, pattern);
    if (colours.empty()) continue;
    const PlaneLight light = look_at_pattern(frame, projection * item.world_to_eye,
                                             bundle_.patterns()[pattern], colours);
    if (!light.known) continue;
    const bool first = !watched.light.known || frame_ > watched.looked + kForget;
    const float share = first ? 1.0f : kFollow;
    watched.light.middle += share * (light.middle - watched.light.middle);
    watched.light.slope += share * (light.slope - watched.light.slope);
    watched.light.known = true;
    watched.looked = frame_;
  }
}

std::optional<glm::vec3> LightEstimator::at_model(std::uint32_t scene) const {
  if (scene >= bundle_.scenes().size()) return std::nullopt;
  const SceneRecord& record = bundle_.scenes()[scene];
  const PlaneLight& light = patterns_[record.pattern].light;
  if (!light.known) return std::nullopt;
  const glm::vec2 place = glm::clamp(glm::vec2(record.offset[0], record.offset[1]), -1.0f, 1.0f);
  return light.middle * std::max(0.1f, 1.0f + glm::dot(light.slope, place));
}

}  // namespace modar
