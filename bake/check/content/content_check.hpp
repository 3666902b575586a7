// What follows from other parts of a bundle is computed again: hashes show damage to bytes, this
// shows records and payloads that contradict each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "modar/device_profile.hpp"

namespace modar {

struct ContentOptions {
  unsigned jobs = 1;        ///< threads; the findings do not depend on it
  bool first_only = false;  ///< stop at the first finding
  /// The byte that was changed in a bundle that was good: rules that do not read its section are
  /// left out. Nothing: all rules are run.
  std::optional<std::uint64_t> changed = {};
};

/// Computes again what `modar bake` derived: orders, cones and distances of meshes, mip levels,
/// tracker records, shadows, scenes by the meta text. Bundles of other writers may choose
/// otherwise and are not looked at, nor previews. bundle: of bytes that check_bundle() finds
/// good. Answers true if nothing was found.
bool check_content(const BundleView& bundle, const IssueSink& sink,
                   const ContentOptions& options = {});

/// All rules that need no source: check_whole(), and check_content() of sound bytes. Answers true
/// if the bytes are sound.
bool check_all(std::span<const std::byte> bytes, const DeviceProfile* device, unsigned jobs,
               const IssueSink& sink);

}  // namespace modar
