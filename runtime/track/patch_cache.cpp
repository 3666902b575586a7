// Cuts patches out of a pattern's picture.
#include "patch_cache.hpp"

#include <algorithm>
#include <cmath>

#include "bilinear.hpp"

namespace modar::tracker {
namespace {

void add_sums(Patch& patch) {
  for (int k = 0; k < kPatchPixels; ++k) {
    const float t = patch.pixels.gray[k];
    const float gx = patch.pixels.right[k];
    const float gy = patch.pixels.down[k];
    patch.t += t;
    patch.tt += t * t;
    patch.x += gx;
    patch.y += gy;
    patch.xx += gx * gx;
    patch.xy += gx * gy;
    patch.yy += gy * gy;
    patch.tx += t * gx;
    patch.ty += t * gy;
  }
}

constexpr int kSide = 2 * kPatchHalf + 1;
constexpr int kRing = 2;  // pixels around a patch: one for the smoothing, one for the differences
constexpr int kWide = kSide + 2 * kRing;
using Surroundings = std::array<float, kWide * kWide>;

/// 1 2 1 along one direction, where both neighbours are at hand.
void smooth(const float* from, int step, int first, int last, float* to) {
  for (int k = first; k < last; ++k) {
    to[k] = 0.25f * (from[k - step] + 2.0f * from[k] + from[k + step]);
  }
}

/// Smooths as a lens does, about, and takes the differences. A template sharper than its picture is
/// drawn aside by what lies on the patch's edge, each patch its own way: a steady error of the
/// pose.
void fill(const Surroundings& gray, Patch& patch) {
  constexpr int kAll = kWide * kWide;
  Surroundings rows{};
  Surroundings both{};
  smooth(gray.data(), 1, 1, kAll - 1, rows.data());
  smooth(rows.data(), kWide, kWide, kAll - kWide, both.data());
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const float* at = both.data() + (v + kRing) * kWide + u + kRing;
      const int k = v * kSide + u;
      patch.pixels.gray[k] = at[0];
      patch.pixels.right[k] = 0.5f * (at[1] - at[-1]);
      patch.pixels.down[k] = 0.5f * (at[kWide] - at[-kWide]);
    }
  }
  add_sums(patch);
}

/// False where the patch or its ring reaches over the picture's border.
bool cut(const GrayImage& picture, const TrackerPatchRecord& record, int level, Patch& patch) {
  constexpr int kReach = kPatchHalf + kRing;
  const double grow = static_cast<double>(1 << level);
  const int column = static_cast<int>(record.x / (64.0 * grow));
  const int row = static_cast<int>(record.y / (64.0 * grow));
  if (column < kReach || row < kReach || column >= picture.width - kReach ||
      row >= picture.height - kReach) {
    return false;
  }
  patch = {};
  patch.centre = {(column + 0.5) * grow - 0.5, (row + 0.5) * grow - 0.5};
  Surroundings gray;
  for (int v = 0; v < kWide; ++v) {
    std::copy_n(picture.pixels + (row + v - kReach) * picture.stride + column - kReach, kWide,
                gray.begin() + v * kWide);
  }
  fill(gray, patch);
  return true;
}

/// Beyond the border that of the border.
float sample_inside(const GrayImage& picture, float x, float y) {
  return sample(picture, std::clamp(x, 0.0f, static_cast<float>(picture.width) - 1.001f),
                std::clamp(y, 0.0f, static_cast<float>(picture.height) - 1.001f));
}

}  // namespace

std::vector<Patch>& PatchCache::room() {
  room_.clear();
  return room_;
}

void PatchCache::smear(const TrackedPattern& pattern, int level, const Patch& patch,
                       glm::dvec2 motion, Patch& smeared) {
  constexpr int kMostTaps = 16;
  const GrayImage& picture = pattern.levels[static_cast<std::size_t>(level)];
  const double grow = static_cast<double>(1 << level);
  const auto x0 = static_cast<float>((patch.centre.x + 0.5) / grow - 0.5) - kPatchHalf - kRing;
  const auto y0 = static_cast<float>((patch.centre.y + 0.5) / grow - 0.5) - kPatchHalf - kRing;
  const int taps =
      std::clamp(static_cast<int>(std::ceil(std::hypot(motion.x, motion.y))), 2, kMostTaps);
  Surroundings gray{};
  for (int tap = 0; tap < taps; ++tap) {
    const double share = (tap + 0.5) / taps - 0.5;
    const float left = x0 + static_cast<float>(share * motion.x);
    const float top = y0 + static_cast<float>(share * motion.y);
    for (int v = 0; v < kWide; ++v) {
      for (int u = 0; u < kWide; ++u) {
        gray[static_cast<std::size_t>(v * kWide + u)] +=
            sample_inside(picture, left + static_cast<float>(u), top + static_cast<float>(v));
      }
    }
  }
  smeared = {};
  smeared.centre = patch.centre;
  for (float& sum : gray) sum /= static_cast<float>(taps);
  fill(gray, smeared);
}

PatchCache::PatchCache() {
  room_.reserve(kMostPatches);
  for (Slot& slot : slots_) slot.patches.reserve(kMostPatches);
}

std::span<const Patch> PatchCache::of(const TrackedPattern& pattern, int level) {
  ++now_;
  Slot* oldest = slots_.data();
  for (Slot& slot : slots_) {
    if (slot.level == level && slot.pattern == pattern.index) {
      slot.used = now_;
      return slot.patches;
    }
    if (slot.used < oldest->used) oldest = &slot;
  }
  oldest->pattern = pattern.index;
  oldest->level = level;
  oldest->used = now_;
  oldest->patches.clear();
  Patch patch;
  for (const TrackerPatchRecord& record : pattern.patches[static_cast<std::size_t>(level)]) {
    if (oldest->patches.size() == kMostPatches) break;
    if (cut(pattern.levels[static_cast<std::size_t>(level)], record, level, patch)) {
      oldest->patches.push_back(patch);
    }
  }
  return oldest->patches;
}

}  // namespace modar::tracker
