// What an MP4 file says of itself (ISO/IEC 14496-12 and -15): codecs, sizes, duration, and whether
// its index is in front, so that it plays before all of it is there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace modar {

/// H.264's baseline profile: what hardware of 2012 decodes.
inline constexpr std::uint8_t kBaselineProfile = 66;

struct Mp4Info {
  int video_tracks = 0;
  int sound_tracks = 0;
  std::array<char, 5> video_codec{};  ///< "avc1"; of the last such track
  std::array<char, 5> sound_codec{};  ///< "mp4a"
  std::uint8_t profile = 0;           ///< of H.264
  std::uint8_t level = 0;             ///< of H.264, ten times
  std::uint32_t width = 0;            ///< pixels
  std::uint32_t height = 0;
  double seconds = 0;        ///< of the longest track
  bool index_first = false;  ///< the box "moov" is before "mdat"
};

/// Where a file breaks the rules, and which.
struct Mp4Fault {
  std::size_t offset = 0;
  const char* cause = "";
};

/// Reads the boxes of a file; sample data are not looked at. Nothing: it keeps the rules. Allocates
/// nothing.
std::optional<Mp4Fault> view_mp4(std::span<const std::byte> bytes, Mp4Info& info);

}  // namespace modar
