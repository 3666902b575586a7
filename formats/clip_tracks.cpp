#include "formats/clip_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace modar {
namespace {

constexpr double kMostPart = 0.70710678118654752;  // of a quaternion that is not the largest
constexpr double kPartSteps = 32766;               // even, so that 0 is a step

std::uint16_t word_at(const std::byte* bytes, std::size_t index) {
  std::uint16_t word = 0;
  std::memcpy(&word, bytes + 2 * index, sizeof word);
  return word;
}

/// The three words of a key's value.
std::array<std::uint16_t, 3> words_of(const std::byte* keys, std::uint32_t count,
                                      std::uint32_t key) {
  const std::size_t first = std::size_t{count} + 3 * std::size_t{key};
  return {word_at(keys, first), word_at(keys, first + 1), word_at(keys, first + 2)};
}

bool rotation_fits(const std::array<std::uint16_t, 3>& words) {
  return (words[2] & 0x8000u) == 0 && unpack_rotation(words)[words[0] & 3u] > 0;
}

const char* fault_of(const ClipTracksView& view, const TrackRecord& track) {
  const bool turns = track.path == static_cast<std::uint8_t>(TrackPath::kRotation);
  for (int i = 0; i < 3; ++i) {
    const float low = track.low[i];
    const float step = track.step[i];
    if (turns ? low != 0 || step != 0 : !(std::isfinite(low) && std::isfinite(step * 65536.0f))) {
      return "a track's range is not usable";
    }
  }
  const std::byte* keys = view.bytes + track.keys;
  for (std::uint32_t key = 0; key < track.key_count; ++key) {
    const std::uint32_t sample = view.sample(track, key);
    const bool rises = key == 0 ? sample == 0 : sample > view.sample(track, key - 1);
    if (!rises || sample >= view.header->sample_count) return "a track's keys do not rise";
    if (turns && !rotation_fits(words_of(keys, track.key_count, key))) {
      return "a rotation is no unit quaternion";
    }
  }
  return nullptr;
}

}  // namespace

std::array<std::uint16_t, 3> pack_rotation(const std::array<double, 4>& rotation) {
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i) {
    if (std::abs(rotation[i]) > std::abs(rotation[largest])) largest = i;
  }
  const double sign = rotation[largest] < 0 ? -1 : 1;
  std::uint64_t bits = largest;
  int shift = 2;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const double share = (sign * rotation[i] / kMostPart + 1) / 2;
    const double step = std::clamp(std::round(share * kPartSteps), 0.0, kPartSteps);
    bits |= static_cast<std::uint64_t>(step) << shift;
    shift += 15;
  }
  return {static_cast<std::uint16_t>(bits & 0xFFFFu),
          static_cast<std::uint16_t>(bits >> 16 & 0xFFFFu),
          static_cast<std::uint16_t>(bits >> 32 & 0xFFFFu)};
}

TrackValue unpack_rotation(const std::array<std::uint16_t, 3>& words) {
  const std::uint32_t low = words[0] | std::uint32_t{words[1]} << 16;
  const std::uint32_t steps[3] = {low >> 2 & 0x7FFFu, low >> 17, words[2] & 0x7FFFu};
  const std::size_t largest = low & 3u;
  TrackValue value{};
  float rest = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto step = static_cast<float>(steps[i]);
    const float part =
        (step * static_cast<float>(2 / kPartSteps) - 1) * static_cast<float>(kMostPart);
    value[i < largest ? i : i + 1] = part;
    rest -= part * part;
  }
  value[largest] = std::sqrt(std::max(rest, 0.0f));
  return value;
}

std::uint16_t ClipTracksView::sample(const TrackRecord& track, std::uint32_t key) const {
  return word_at(bytes + track.keys, key);
}

TrackValue ClipTracksView::value(const TrackRecord& track, std::uint32_t key) const {
  const auto words = words_of(bytes + track.keys, track.key_count, key);
  if (track.path == static_cast<std::uint8_t>(TrackPath::kRotation)) return unpack_rotation(words);
  TrackValue value{};
  for (std::size_t i = 0; i < 3; ++i) {
    value[i] = track.low[i] + track.step[i] * static_cast<float>(words[i]);
  }
  return value;
}

TrackValue ClipTracksView::at(const TrackRecord& track, float time, std::uint32_t& key) const {
  const std::uint32_t last = track.key_count - 1u;
  if (key > last || static_cast<float>(sample(track, key)) > time) key = 0;
  while (key < last && static_cast<float>(sample(track, key + 1)) <= time) ++key;
  const TrackValue from = value(track, key);
  if (key == last) return from;
  TrackValue to = value(track, key + 1);
  const auto first = static_cast<float>(sample(track, key));
  const float share = (time - first) / (static_cast<float>(sample(track, key + 1)) - first);
  float dot = 0;
  for (std::size_t i = 0; i < 4; ++i) dot += from[i] * to[i];
  // The shorter way round; of the others' parts the fourth is 0, and their signs stay.
  const bool turns = track.path == static_cast<std::uint8_t>(TrackPath::kRotation);
  const float sign = turns && dot < 0 ? -1.0f : 1.0f;
  for (std::size_t i = 0; i < 4; ++i) to[i] = from[i] + share * (sign * to[i] - from[i]);
  return to;
}

const char* view_clip_tracks(std::span<const std::byte> bytes, std::uint32_t joints,
                             ClipTracksView& view) {
  ClipTracksHeader header{};
  if (bytes.size() < sizeof header) return "it ends before its header does";
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.reserved[0] != 0 || header.reserved[1] != 0) return "reserved bytes are not zero";
  if (header.sample_count < 2 || header.sample_count > kMaxClipSamples) {
    return "it has no time, or too much";
  }
  const std::size_t room = (bytes.size() - sizeof header) / sizeof(TrackRecord);
  if (header.track_count > std::min<std::size_t>(kMaxClipTracks, room)) {
    return "its tracks do not fit into it";
  }
  view.header = reinterpret_cast<const ClipTracksHeader*>(bytes.data());
  view.tracks = {reinterpret_cast<const TrackRecord*>(bytes.data() + sizeof header),
                 header.track_count};
  view.bytes = bytes.data();
  std::uint64_t end = sizeof header + std::uint64_t{header.track_count} * sizeof(TrackRecord);
  std::uint64_t before = 0;  // joint and path of the track before
  for (const TrackRecord& track : view.tracks) {
    const std::uint64_t order = std::uint64_t{track.joint} << 8 | track.path;
    if (track.path < 1 || track.path > 3 || track.joint >= joints || order <= before) {
      return "its tracks are out of order, or of joints that do not exist";
    }
    before = order;
    if (track.reserved0 != 0 || track.reserved1 != 0) return "reserved bytes are not zero";
    // Keys follow one another without gaps, so that no bytes are unread or read twice.
    if (track.key_count == 0 || track.keys != end) return "a track's keys are not in their place";
    end += std::uint64_t{track.key_count} * 8;
    if (end > bytes.size()) return "a track's keys are beyond its end";
    if (const char* fault = fault_of(view, track)) return fault;
  }
  return end == bytes.size() ? nullptr : "bytes follow its last track";
}

}  // namespace modar
