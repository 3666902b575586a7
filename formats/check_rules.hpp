// The rules on payloads, split by subject. Internal to formats/.
#pragma once

#include <cstdint>
#include <string>

#include "formats/bundle_view.hpp"
#include "formats/rules.hpp"

namespace modar {

/// Hashes of sections, zero padding between them, sections that are skipped.
/// Needs sections that lie inside the file, nothing more.
void check_section_bytes(FaultLog& log, const BundleParts& parts);

// What follows needs a bundle whose structure was found clean.

/// Counts, placements, boxes, cones, order of levels, materials, bytes that nothing refers to.
void check_model_records(FaultLog& log, const BundleParts& parts);

/// Every index and every vertex that one refers to. Time grows with the index buffer.
void check_geometry(FaultLog& log, const BundleParts& parts);

/// Sides, overlaps and gaps of textures.
void check_textures(FaultLog& log, const BundleParts& parts);

/// Parameter sets, keypoints, descriptors, feature texts.
void check_patterns(FaultLog& log, const BundleParts& parts);

/// Counts how often a rule is broken and remembers where first, so that a million bad vertices make
/// one line.
struct Tally {
  std::uint64_t count = 0;
  std::uint64_t first = 0;  ///< byte in the file
  void hit(std::uint64_t offset) {
    if (count++ == 0) first = offset;
  }
};

/// Where something is in the file.
inline std::uint64_t offset_of(const BundleParts& parts, const void* place) {
  return static_cast<std::uint64_t>(static_cast<const std::byte*>(place) - parts.bytes.data());
}

/// "model 'spider'".
inline std::string label(const BundleParts& parts, const char* what, NameRef name) {
  const auto* text = reinterpret_cast<const char*>(parts.names.data());
  return what + (" '" + (name.length == 0 ? "" : std::string(text + name.offset, name.length))) +
         "'";
}

}  // namespace modar
