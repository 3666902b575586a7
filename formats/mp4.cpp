#include "formats/mp4.hpp"

#include <algorithm>
#include <cstring>

namespace modar {
namespace {

using Bytes = std::span<const std::byte>;

constexpr int kMostDepth = 8;             // moov/trak/mdia/minf/stbl/stsd/avc1/avcC
constexpr std::size_t kMostBoxes = 4096;  // of all; a file of a video and its sound has about 50

std::uint64_t big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    value = value << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
  }
  return value;
}

/// A track while its boxes are read.
struct Mp4Track {
  char handler[5] = "";
  char codec[5] = "";
  std::uint8_t profile = 0;
  std::uint8_t level = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  double seconds = 0;
};

class Mp4Reader {
 public:
  Mp4Reader(Bytes bytes, Mp4Info& info) : bytes_(bytes), info_(info) {}

  std::optional<Mp4Fault> run() {
    info_ = Mp4Info();
    const bool read = boxes(bytes_, 0, nullptr);
    if (read && !moov_) refuse(bytes_, "there is no index (moov)");
    if (read && moov_ && !mdat_) refuse(bytes_, "there are no data (mdat)");
    return fault_;
  }

 private:
  bool refuse(Bytes at, const char* cause) {
    if (!fault_) fault_ = Mp4Fault{static_cast<std::size_t>(at.data() - bytes_.data()), cause};
    return false;
  }

  /// Each box inside `within`, which they fill.
  bool boxes(Bytes within, int depth, Mp4Track* track) {
    if (depth > kMostDepth) return refuse(within, "boxes are nested too deeply");
    while (!within.empty()) {
      if (++count_ > kMostBoxes) return refuse(within, "there are too many boxes");
      if (within.size() < 8) return refuse(within, "a box has no room for its header");
      std::uint64_t size = big_endian(within, 0, 4);
      std::size_t head = 8;
      if (size == 1) {
        if (within.size() < 16) return refuse(within, "a box has no room for its size");
        size = big_endian(within, 8, 8);
        head = 16;
      } else if (size == 0) {
        if (depth != 0) return refuse(within, "a box inside another has no size");
        size = within.size();
      }
      if (size < head || size > within.size())
        return refuse(within, "a box extends past the one that contains it");
      char type[5] = "";
      std::memcpy(type, within.data() + 4, 4);
      const Bytes body = within.subspan(head, static_cast<std::size_t>(size) - head);
      if (!box(type, body, depth, track)) return false;
      within = within.subspan(static_cast<std::size_t>(size));
    }
    return true;
  }

  bool box(const char* type, Bytes body, int depth, Mp4Track* track) {
    const auto is = [type](const char* other) { return std::memcmp(type, other, 4) == 0; };
    if (depth == 0) return file_box(type, body);
    if (is("trak"))
      return depth == 1 ? read_track(body, depth) : refuse(body, "a track in a track");
    if (track == nullptr) return true;
    if (is("mdia") || is("minf") || is("stbl")) return boxes(body, depth + 1, track);
    if (is("mdhd")) return read_times(body, *track);
    if (is("hdlr")) {
      if (body.size() < 12) return refuse(body, "a track's kind (hdlr) is cut off");
      std::memcpy(track->handler, body.data() + 8, 4);
    }
    if (is("stsd")) return read_codec(body, depth, *track);
    if (is("avcC")) {
      if (body.size() < 4) return refuse(body, "H.264's settings (avcC) are cut off");
      track->profile = std::to_integer<std::uint8_t>(body[1]);
      track->level = std::to_integer<std::uint8_t>(body[3]);
    }
    return true;
  }

  bool file_box(const char* type, Bytes body) {
    const auto is = [type](const char* other) { return std::memcmp(type, other, 4) == 0; };
    if (!begun_ && !is("ftyp")) return refuse(bytes_, "it does not begin as an MP4 file (ftyp)");
    begun_ = true;
    if (is("mdat")) mdat_ = true;
    if (!is("moov")) return true;
    if (moov_) return refuse(body, "there are two indices (moov)");
    moov_ = true;
    info_.index_first = !mdat_;
    return boxes(body, 1, nullptr);
  }

  bool read_track(Bytes body, int depth) {
    Mp4Track track;
    if (!boxes(body, depth + 1, &track)) return false;
    const bool video = std::memcmp(track.handler, "vide", 4) == 0;
    if (!video && std::memcmp(track.handler, "soun", 4) != 0) return true;
    info_.seconds = std::max(info_.seconds, track.seconds);
    if (!video) {
      ++info_.sound_tracks;
      std::copy_n(track.codec, 4, info_.sound_codec.begin());
      return true;
    }
    ++info_.video_tracks;
    std::copy_n(track.codec, 4, info_.video_codec.begin());
    info_.profile = track.profile;
    info_.level = track.level;
    info_.width = track.width;
    info_.height = track.height;
    return true;
  }

  bool read_times(Bytes body, Mp4Track& track) {
    const bool wide = !body.empty() && body[0] == std::byte{1};
    if (body.size() < (wide ? 32u : 20u)) return refuse(body, "a track's times (mdhd) are cut off");
    const std::uint64_t scale = big_endian(body, wide ? 20 : 12, 4);
    const std::uint64_t duration = wide ? big_endian(body, 24, 8) : big_endian(body, 16, 4);
    if (scale == 0) return refuse(body, "a track has no unit of time (mdhd)");
    track.seconds = static_cast<double>(duration) / static_cast<double>(scale);
    return true;
  }

  /// The first sample description.
  bool read_codec(Bytes body, int depth, Mp4Track& track) {
    if (body.size() < 16) return refuse(body, "a track's codec (stsd) is cut off");
    const Bytes entry = body.subspan(8);
    const std::uint64_t size = big_endian(entry, 0, 4);
    std::memcpy(track.codec, entry.data() + 4, 4);
    // Behind the header: 78 bytes of a picture's description, then its boxes.
    constexpr std::size_t kDescription = 8 + 78;
    if (std::memcmp(track.codec, "avc1", 4) != 0) return true;
    if (size < kDescription || size > entry.size()) {
      return refuse(entry, "a picture's description (avc1) is cut off");
    }
    track.width = static_cast<std::uint32_t>(big_endian(entry, 8 + 24, 2));
    track.height = static_cast<std::uint32_t>(big_endian(entry, 8 + 26, 2));
    return boxes(entry.subspan(kDescription, static_cast<std::size_t>(size) - kDescription),
                 depth + 2, &track);
  }

  Bytes bytes_;
  Mp4Info& info_;
  std::optional<Mp4Fault> fault_;
  std::size_t count_ = 0;
  bool begun_ = false;
  bool moov_ = false;
  bool mdat_ = false;
};

}  // namespace

std::optional<Mp4Fault> view_mp4(std::span<const std::byte> bytes, Mp4Info& info) {
  return Mp4Reader(bytes, info).run();
}

}  // namespace modar
