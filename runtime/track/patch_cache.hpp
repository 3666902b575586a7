// Templates of the patches that alignment looks at, kept from frame to frame. Internal to
// runtime/track.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// Patches of a level that alignment uses, at most.
inline constexpr std::size_t kMostPatches = 256;

/// A patch and what of its sums no frame changes: of its gray values, its gradient and their
/// products.
struct Patch {
  glm::dvec2 centre{};  ///< pixels of the pattern's image
  float t = 0, tt = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, tx = 0, ty = 0;
  PatchTemplate pixels{};
};

/// The patches of the few levels that were used last. Allocates nothing after construction.
class PatchCache {
 public:
  PatchCache();
  /// Valid until the next call.
  std::span<const Patch> of(const TrackedPattern& pattern, int level);
  /// Makes a patch of the level as it looks where everything moves by `motion` pixels of the level
  /// while the shutter is open.
  static void smear(const TrackedPattern& pattern, int level, const Patch& patch, glm::dvec2 motion,
                    Patch& smeared);
  /// Room for smeared patches, empty; valid until the next call.
  std::vector<Patch>& room();

 private:
  struct Slot {
    std::uint32_t pattern = 0;
    int level = -1;
    std::uint64_t used = 0;
    std::vector<Patch> patches;
  };
  std::array<Slot, 6> slots_;
  std::vector<Patch> room_;
  std::uint64_t now_ = 0;
};

}  // namespace modar::tracker
