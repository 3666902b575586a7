// The tracks of a clip: how joints turn, move and grow, as the keys that linear interpolation
// needs. Bake, checker and renderer read them in place, through view_clip_tracks(). Numbers are
// little-endian, reserved fields are zero.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

inline constexpr std::uint32_t kClipRate = 120;  ///< samples in a second
inline constexpr std::uint32_t kMaxClipSamples =
    65536;  ///< nine minutes; keys count them in 16 bits
/// Three vec4 of vertex uniforms each; the rest of ES 2.0's 128 is the program's.
inline constexpr std::uint32_t kMostPartBones = 32;
inline constexpr std::uint32_t kMostPartTargets = 4;  ///< morph targets: one vec4 of weights
inline constexpr int kMorphUnits = 32767;             ///< of the farthest vertex of a target
inline constexpr std::uint32_t kMaxJoints = 4096;     ///< of a bundle
inline constexpr std::uint32_t kMaxClipTracks = 3 * kMaxJoints;

enum class TrackPath : std::uint8_t { kTranslation = 1, kRotation = 2, kScale = 3 };

/// Start of the section. TrackRecord[track_count] follows, then the tracks' keys.
struct ClipTracksHeader {
  std::uint32_t track_count;
  std::uint32_t sample_count;  ///< 2 to kMaxClipSamples; the clip lasts one sample less
  std::uint32_t reserved[2];
};
static_assert(sizeof(ClipTracksHeader) == 16);

/// Sorted by (joint, path), without duplicates. At `keys`, bytes from the start of the section, are
/// key_count sample numbers (u16, rising, the first is 0) and then key_count values of three u16. A
/// translation or scale is low + step * value. A rotation is a unit quaternion x, y, z, w: bits 0-1
/// name its largest component, which is positive and left out; the others follow in their order,
/// 15 bits each, from -1/sqrt(2) to 1/sqrt(2); bit 47 is 0.
struct TrackRecord {
  std::uint32_t joint;
  std::uint8_t path;  ///< TrackPath
  std::uint8_t reserved0;
  std::uint16_t key_count;  ///< 1: it never changes
  std::uint32_t keys;       ///< a multiple of 2
  float low[3];             ///< 0 for rotations, like step
  float step[3];
  std::uint32_t reserved1;
};
static_assert(sizeof(TrackRecord) == 40);

/// Three components, or the quaternion x, y, z, w.
using TrackValue = std::array<float, 4>;

struct ClipTracksView {
  const ClipTracksHeader* header = nullptr;
  std::span<const TrackRecord> tracks;
  const std::byte* bytes = nullptr;

  [[nodiscard]] std::uint16_t sample(const TrackRecord& track, std::uint32_t key) const;
  [[nodiscard]] TrackValue value(const TrackRecord& track, std::uint32_t key) const;
  /// sample: 0 to sample_count - 1. `key` is the one that was found last, of this track: frames in
  /// a row find theirs there or next to it. Rotations are not normalised between keys: their length
  /// is above 0.7.
  [[nodiscard]] TrackValue at(const TrackRecord& track, float sample, std::uint32_t& key) const;
};

/// A clip's tracks in their bytes, which must be aligned to 4. Answers the fault of damaged ones,
/// or nullptr.
const char* view_clip_tracks(std::span<const std::byte> bytes, std::uint32_t joints,
                             ClipTracksView& view);

/// The six bytes of a unit quaternion.
std::array<std::uint16_t, 3> pack_rotation(const std::array<double, 4>& rotation);
TrackValue unpack_rotation(const std::array<std::uint16_t, 3>& words);

}  // namespace modar
