// Scores patches by the least eigenvalue of their gradient matrix and spreads them.
#include "bake/pattern/tracker_patches.hpp"

#include <algorithm>
#include <cmath>

namespace modar {
namespace {

constexpr int kHalf = 4;  // a patch is 9x9 pixels of its level
constexpr int kBorder = kHalf + 2;
constexpr double kWeakest = 3.0;  // gray values a pixel

struct Place {
  int x = 0;
  int y = 0;
  double score = 0;
};

/// Shi & Tomasi, "Good features to track" (1994), as a root mean square gradient.
double score_at(const GrayPicture& picture, int x, int y) {
  double xx = 0;
  double xy = 0;
  double yy = 0;
  const std::uint8_t* pixels = picture.pixels.data();
  for (int v = y - kHalf; v <= y + kHalf; ++v) {
    for (int u = x - kHalf; u <= x + kHalf; ++u) {
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(v) * picture.width + u;
      const double gx = 0.5 * (pixels[at + 1] - pixels[at - 1]);
      const double gy = 0.5 * (pixels[at + picture.width] - pixels[at - picture.width]);
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  const double least = 0.5 * (xx + yy - std::sqrt((xx - yy) * (xx - yy) + 4 * xy * xy));
  return std::sqrt(std::max(0.0, least) / ((2 * kHalf + 1) * (2 * kHalf + 1)));
}

std::vector<Place> places_of(const GrayPicture& picture) {
  std::vector<Place> places;
  for (int y = kBorder; y < picture.height - kBorder; y += 2) {
    for (int x = kBorder; x < picture.width - kBorder; x += 2) {
      const double score = score_at(picture, x, y);
      if (score >= kWeakest) places.push_back({x, y, score});
    }
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.score > b.score; });
  return places;
}

/// The best places that keep the largest distance from each other at which `count` can be had.
std::vector<Place> spread(const std::vector<Place>& places, std::uint32_t count, double side) {
  std::vector<Place> kept;
  for (double apart = side / 4; apart >= 4.0; apart *= 0.8) {
    kept.clear();
    for (const Place& place : places) {
      const bool free = std::none_of(kept.begin(), kept.end(), [&](const Place& other) {
        const double dx = place.x - other.x;
        const double dy = place.y - other.y;
        return dx * dx + dy * dy < apart * apart;
      });
      if (free) kept.push_back(place);
      if (kept.size() == count) return kept;
    }
  }
  return kept;
}

}  // namespace

std::vector<TrackerPatchRecord> choose_patches(const std::vector<ViewLevel>& levels,
                                               std::uint32_t count) {
  std::vector<TrackerPatchRecord> patches;
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const GrayPicture& picture = levels[level];
    const double scale = static_cast<double>(1u << level);
    for (const Place& place :
         spread(places_of(picture), count, std::max(picture.width, picture.height))) {
      TrackerPatchRecord record{};
      record.x = static_cast<std::uint16_t>(std::lround((place.x + 0.5) * scale * 64));
      record.y = static_cast<std::uint16_t>(std::lround((place.y + 0.5) * scale * 64));
      record.level = static_cast<std::uint16_t>(level);
      record.score = static_cast<std::uint16_t>(std::min(place.score * 64, 65535.0));
      patches.push_back(record);
    }
  }
  return patches;
}

}  // namespace modar
