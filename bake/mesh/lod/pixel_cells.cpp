// Averages over the cells of an octree, from the smallest to the largest.
#include "bake/mesh/lod/pixel_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Steps of a colour that a picture changes by for a radian of a normal, in the mean. Higher draws
/// coarse levels later. [50, 70]
constexpr float kNormalGain = 54;
/// Share of a colour's change that is seen in the light of a room. Higher draws coarse levels
/// later.
constexpr float kColourGain = 0.5f;
/// Steps of an 8-bit colour for one of 127 steps of ambient light. Lower draws levels too early on
/// shaded models.
constexpr float kOcclusionGain = 1;
/// Steps of a colour for a texture shift of one pixel. Lower draws levels too early on photo
/// textures. [30, 100]
constexpr float kSlideGain = 100;
/// Bytes, however far a texture slides: across a seam, it tells nothing.
constexpr float kMostSlide = 60;
/// Mean difference of 255 that nobody sees. Higher draws coarse levels larger.
constexpr double kSame = 1.5;
/// Share of the area that may differ by more where a picture shows a part of it only.
constexpr double kShare = 0.01;
/// Pixels along the box of which pictures show all: the mean tells nothing of larger ones. Higher
/// draws coarse levels larger.
constexpr double kShownWhole = 400;
/// Halvings of the box to the smallest cell: a chunk has at most 65,535 vertices, some 256 along a
/// side.
constexpr unsigned kBits = 10;

/// The lowest ten bits, two zeros after each.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000FFu;
  x = (x | x << 8) & 0x0300F00Fu;
  x = (x | x << 4) & 0x030C30C3u;
  return (x | x << 2) & 0x09249249u;
}

/// Of 255. sum: over a cell. side: of the pixel.
float shown(const LookDifference& sum, float side) {
  const glm::vec3 c = glm::abs(sum.colour);
  return (kNormalGain * glm::length(sum.normal) + kColourGain * std::max({c.x, c.y, c.z}) +
          std::min(kSlideGain * glm::length(sum.slide) / side, kMostSlide * sum.area)) /
         sum.area;
}

}  // namespace

Look look_at(const TriMesh& mesh, const std::array<std::uint32_t, 3>& corners, double b, double c) {
  Look look;
  const std::array<double, 3> weights = {1 - b - c, b, c};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = corners[k];
    if (!mesh.normals.empty()) look.normal += weights[k] * glm::dvec3(mesh.normals[v]);
    if (!mesh.occlusion.empty()) {
      look.colour +=
          weights[k] * static_cast<double>(kOcclusionGain * static_cast<float>(mesh.occlusion[v]));
    }
    if (!mesh.colours.empty()) look.colour += weights[k] * glm::dvec3(mesh.colours[v]);
    if (!mesh.uvs.empty()) look.uv += weights[k] * mesh.uvs[v];
  }
  return look;
}

PixelCells::PixelCells(std::span<const glm::dvec3> points) {
  glm::dvec3 low = points[0];
  glm::dvec3 high = low;
  for (const glm::dvec3& p : points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  side_ = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  const double scale = side_ > 0 ? ((1 << kBits) - 1) / side_ : 0.0;
  places_.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const glm::uvec3 at(scale * (points[i] - low));
    places_.push_back({spread(at.x) | spread(at.y) << 1 | spread(at.z) << 2, i});
  }
  std::sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) {
    return std::tie(a.cell, a.point) < std::tie(b.cell, b.point);
  });
}

PixelCells::Shown PixelCells::shown_in(unsigned bits) const {
  const auto side = static_cast<float>(std::ldexp(side_, -static_cast<int>(bits)));
  const unsigned shift = 3 * (kBits - bits);
  double all = 0;
  Shown found;
  LookDifference cell;
  const auto close = [&] {
    if (cell.area > 0) {
      all += static_cast<double>(cell.area);
      const auto here = static_cast<double>(shown(cell, side));
      found.mean += static_cast<double>(cell.area) * here;
      if (here > kSame) found.share += static_cast<double>(cell.area);
    }
    cell = {};
  };
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (i > 0 && places_[i].cell >> shift != places_[i - 1].cell >> shift) close();
    const LookDifference& d = weighed_[i];
    cell += d;
  }
  close();
  return all > 0 ? Shown{found.mean / all, found.share / all} : Shown();
}

/// Of 255, where the whole box is a pixel. A pixel that is larger shows as much less as the box is
/// a smaller part of its area.
double PixelCells::shown_at_once() const {
  LookDifference all;
  for (const LookDifference& d : weighed_) all += d;
  return static_cast<double>(shown(all, static_cast<float>(side_)));
}

double PixelCells::smallest_pixel(std::span<const LookDifference> differences) {
  weighed_.clear();
  weighed_.reserve(places_.size());
  for (const Place& place : places_) {
    LookDifference& d = weighed_.emplace_back(differences[place.point]);
    d.normal *= d.area;
    d.colour *= d.area;
    d.slide *= d.area;
  }
  const Shown finest = shown_in(kBits);
  const double least = finest.share > kShare ? side_ / kShownWhole : 0.0;
  if (finest.mean <= kSame) return least;
  // What differs in the finest averages out in larger ones, and is passed on.
  double finer = finest.mean;
  double mean = shown_in(bits_).mean;
  for (; mean <= kSame; ++bits_) {
    finer = bits_ + 1 == kBits ? finest.mean : shown_in(bits_ + 1).mean;
    if (finer > kSame) break;
    mean = finer;
  }
  for (; mean > kSame && bits_ > 0; --bits_) {
    finer = mean;
    mean = shown_in(bits_ - 1).mean;
  }
  const double side = std::ldexp(side_, -static_cast<int>(bits_));
  if (mean > kSame) return 2 * side * std::sqrt(shown_at_once() / kSame);
  // Between the two sides, as a power law.
  const double most = std::log(finer / std::max(mean, kSame / 16));
  return std::max(least, side * std::exp2(-1 + std::log(finer / kSame) / most));
}

}  // namespace modar
