#include "bake/mesh/clip/clip_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include <glm/geometric.hpp>

namespace modar {
namespace {

constexpr double kMostValue = 65535;

/// A track at every sample, and how far its key values may be from them.
struct DenseTrack {
  std::uint32_t joint = 0;
  TrackPath path = TrackPath::kTranslation;
  std::vector<glm::dvec4> values;
  double weight = 0;  ///< most that a point moves for a unit of the track's values
};

struct Key {
  std::uint16_t sample = 0;
  std::array<std::uint16_t, 3> words{};
};

void place_value(JointPlace& place, TrackPath path, const glm::dvec4& value) {
  switch (path) {
    case TrackPath::kTranslation:
      place.translation = glm::dvec3(value);
      break;
    case TrackPath::kRotation:
      place.rotation = glm::normalize(value);
      break;
    case TrackPath::kScale:
      place.scale = glm::dvec3(value);
      break;
  }
}

std::vector<glm::dmat4> composed(std::span<const SourceJoint> joints,
                                 const std::vector<JointPlace>& places) {
  std::vector<glm::dmat4> matrices;
  matrices.reserve(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const glm::dmat4 own = joints[j].before * places[j].matrix();
    matrices.push_back(joints[j].parent == kNoJoint ? own : matrices[joints[j].parent] * own);
  }
  return matrices;
}

std::vector<JointPlace> rest_places(std::span<const SourceJoint> joints) {
  std::vector<JointPlace> places;
  for (const SourceJoint& joint : joints) places.push_back(joint.rest);
  return places;
}

glm::dvec4 read_value(const TrackValue& value) {
  return {static_cast<double>(value[0]), static_cast<double>(value[1]),
          static_cast<double>(value[2]), static_cast<double>(value[3])};
}

/// The most that a matrix lengthens a vector, from above.
double stretch_of(const glm::dmat4& m) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += glm::dot(glm::dvec3(m[i]), glm::dvec3(m[i]));
  return std::sqrt(sum);
}

class Fit {
 public:
  Fit(std::span<const SourceJoint> joints, const SourceClip& clip,
      std::span<const JointPoints> points)
      : joints_(joints), points_(points), samples_(clip_samples(clip)) {
    for (std::uint32_t i = 0; i < samples_; ++i) {
      poses_.push_back(clip_pose(joints, clip, clip.duration * i / (samples_ - 1)));
    }
    weigh();
    for (const SourceTrack& track : clip.tracks) tracks_.push_back(dense(track, clip.duration));
  }

  /// A point is further than the bound from its rest place at some time.
  [[nodiscard]] bool moves(double bound) const {
    const auto rest = composed(joints_, rest_places(joints_));
    return greatest(bound, [&rest](std::uint32_t) { return rest; }) > bound;
  }

  /// Keys whose tracks are within `share` of the bound, each by itself. Its error is the greatest,
  /// or one above the bound.
  [[nodiscard]] FittedClip pack(double bound, double share) const {
    FittedClip fitted;
    std::vector<std::pair<TrackRecord, std::vector<Key>>> kept;
    for (const DenseTrack& track : tracks_) {
      const double tolerance = track.weight > 0 ? share * bound / track.weight : 1e300;
      if (at_rest(track, tolerance)) continue;
      TrackRecord record{};
      record.joint = track.joint;
      record.path = static_cast<std::uint8_t>(track.path);
      set_range(track, record);
      kept.emplace_back(record, reduce(track, record, tolerance));
    }
    write(kept, fitted);
    ClipTracksView view;
    view_clip_tracks(fitted.bytes, static_cast<std::uint32_t>(joints_.size()), view);
    std::vector<std::uint32_t> keys;
    fitted.error =
        greatest(bound, [&](std::uint32_t i) { return tracks_pose(joints_, view, i, keys); });
    return fitted;
  }

 private:
  /// The greatest distance of a point, or one that is above `enough`.
  template <class Pose>
  double greatest(double enough, const Pose& pose) const {
    double most = 0;
    for (std::uint32_t i = 0; i < samples_ && std::sqrt(most) <= enough; ++i) {
      const std::vector<glm::dmat4> other = pose(i);
      for (const JointPoints& each : points_) {
        const glm::dmat4 apart = other[each.joint] - poses_[i][each.joint];
        for (const glm::dvec3& p : each.points) {
          const glm::dvec3 d(apart * glm::dvec4(p, 1.0));
          most = std::max(most, glm::dot(d, d));
        }
      }
    }
    return std::sqrt(most);
  }

  /// Reaches: how far the points that a joint moves are from it, in the scene.
  void weigh() {
    reach_.assign(joints_.size(), 0);
    parent_stretch_.assign(joints_.size(), 0);
    moves_.assign(joints_.size(), false);
    for (const JointPoints& each : points_) {
      if (each.points.empty()) continue;
      for (std::uint32_t j = each.joint; j != kNoJoint; j = joints_[j].parent) moves_[j] = true;
    }
    for (const std::vector<glm::dmat4>& pose : poses_) {
      for (std::size_t j = 0; j < joints_.size(); ++j) {
        const std::uint32_t parent = joints_[j].parent;
        const glm::dmat4 outer =
            parent == kNoJoint ? joints_[j].before : pose[parent] * joints_[j].before;
        parent_stretch_[j] = std::max(parent_stretch_[j], stretch_of(outer));
      }
      for (const JointPoints& each : points_) {
        for (const glm::dvec3& p : each.points) {
          const glm::dvec3 at(pose[each.joint] * glm::dvec4(p, 1.0));
          for (std::uint32_t j = each.joint; j != kNoJoint; j = joints_[j].parent) {
            reach_[j] = std::max(reach_[j], glm::distance(at, glm::dvec3(pose[j][3])));
          }
        }
      }
    }
  }

  [[nodiscard]] DenseTrack dense(const SourceTrack& track, double duration) const {
    DenseTrack result{track.joint, track.path, {}, 0};
    for (std::uint32_t i = 0; i < samples_; ++i) {
      glm::dvec4 value = track.at(duration * i / (samples_ - 1));
      if (track.path == TrackPath::kRotation && i > 0 &&
          glm::dot(value, result.values.back()) < 0) {
        value = -value;
      }
      result.values.push_back(value);
    }
    if (!moves_[track.joint]) return result;
    switch (track.path) {
      case TrackPath::kTranslation:
        result.weight = parent_stretch_[track.joint];
        break;
      // A quaternion that is d away turns by 2 d.
      case TrackPath::kRotation:
        result.weight = 2 * reach_[track.joint];
        break;
      case TrackPath::kScale:
        result.weight = reach_[track.joint] / least_scale(result);
        break;
    }
    return result;
  }

  static double least_scale(const DenseTrack& track) {
    double least = 1e300;
    for (const glm::dvec4& v : track.values) {
      for (int i = 0; i < 3; ++i) least = std::min(least, std::abs(v[i]));
    }
    return std::max(least, 1e-3);
  }

  [[nodiscard]] bool at_rest(const DenseTrack& track, double tolerance) const {
    const JointPlace& place = joints_[track.joint].rest;
    glm::dvec4 rest = place.rotation;
    if (track.path == TrackPath::kTranslation) rest = glm::dvec4(place.translation, 0.0);
    if (track.path == TrackPath::kScale) rest = glm::dvec4(place.scale, 0.0);
    return std::all_of(track.values.begin(), track.values.end(), [&](const glm::dvec4& value) {
      return distance(track.path, value, rest) <= tolerance;
    });
  }

  static double distance(TrackPath path, glm::dvec4 a, const glm::dvec4& b) {
    if (path != TrackPath::kRotation) return glm::distance(glm::dvec3(a), glm::dvec3(b));
    a = glm::normalize(a);
    return std::min(glm::distance(a, b), glm::distance(a, -b));
  }

  static void set_range(const DenseTrack& track, TrackRecord& record) {
    if (track.path == TrackPath::kRotation) return;
    for (int i = 0; i < 3; ++i) {
      double low = track.values[0][i];
      double high = low;
      for (const glm::dvec4& value : track.values) {
        low = std::min(low, value[i]);
        high = std::max(high, value[i]);
      }
      record.low[i] = static_cast<float>(low);
      record.step[i] = static_cast<float>((high - low) / kMostValue);
    }
  }

  static std::array<std::uint16_t, 3> words(const DenseTrack& track, const TrackRecord& record,
                                            const glm::dvec4& value) {
    if (track.path == TrackPath::kRotation)
      return pack_rotation({value.x, value.y, value.z, value.w});
    std::array<std::uint16_t, 3> result{};
    for (int i = 0; i < 3; ++i) {
      const auto step = static_cast<double>(record.step[i]);
      const double count = step > 0 ? (value[i] - static_cast<double>(record.low[i])) / step : 0;
      result[static_cast<std::size_t>(i)] =
          static_cast<std::uint16_t>(std::clamp(std::round(count), 0.0, kMostValue));
    }
    return result;
  }

  static glm::dvec4 decoded(const DenseTrack& track, const TrackRecord& record, const Key& key) {
    if (track.path == TrackPath::kRotation) return read_value(unpack_rotation(key.words));
    glm::dvec4 value(0.0);
    for (int i = 0; i < 3; ++i) {
      value[i] = static_cast<double>(record.low[i]) +
                 static_cast<double>(record.step[i]) * key.words[static_cast<std::size_t>(i)];
    }
    return value;
  }

  /// From each key the furthest next one between which all samples stay within the tolerance.
  [[nodiscard]] std::vector<Key> reduce(const DenseTrack& track, const TrackRecord& record,
                                        double tolerance) const {
    const auto key_at = [&](std::uint32_t sample) {
      return Key{static_cast<std::uint16_t>(sample), words(track, record, track.values[sample])};
    };
    std::vector<Key> keys = {key_at(0)};
    const glm::dvec4 first = decoded(track, record, keys[0]);
    const auto holds = [&](std::uint32_t from, const glm::dvec4& a, std::uint32_t to) {
      glm::dvec4 b = decoded(track, record, key_at(to));
      if (track.path == TrackPath::kRotation && glm::dot(a, b) < 0) b = -b;
      for (std::uint32_t i = from + 1; i < to; ++i) {
        const double share = static_cast<double>(i - from) / (to - from);
        if (!(distance(track.path, glm::mix(a, b, share), track.values[i]) <= tolerance))
          return false;
      }
      return true;
    };
    const bool constant = std::all_of(track.values.begin(), track.values.end(), [&](const auto& v) {
      return distance(track.path, first, v) <= tolerance;
    });
    if (constant) return keys;
    std::uint32_t from = 0;
    while (from + 1 < samples_) {
      const glm::dvec4 a = decoded(track, record, keys.back());
      std::uint32_t to = from + 1;
      std::uint32_t step = 1;
      // Twice as far while it holds, then half as far.
      for (bool farther = true; step > 0; step = farther ? 2 * step : step / 2) {
        const bool good = to + step < samples_ && holds(from, a, to + step);
        if (good) to += step;
        if (!good && farther) farther = false;
      }
      keys.push_back(key_at(to));
      from = to;
    }
    return keys;
  }

  void write(std::vector<std::pair<TrackRecord, std::vector<Key>>>& kept,
             FittedClip& fitted) const {
    ClipTracksHeader header{static_cast<std::uint32_t>(kept.size()), samples_, {0, 0}};
    const auto put = [&fitted](const auto& value) {
      const auto* bytes = reinterpret_cast<const std::byte*>(&value);
      fitted.bytes.insert(fitted.bytes.end(), bytes, bytes + sizeof value);
    };
    put(header);
    std::size_t end = sizeof header + kept.size() * sizeof(TrackRecord);
    for (auto& [record, keys] : kept) {
      record.keys = static_cast<std::uint32_t>(end);
      record.key_count = static_cast<std::uint16_t>(keys.size());
      put(record);
      end += 8 * keys.size();
    }
    for (const auto& [record, keys] : kept) {
      for (const Key& key : keys) put(key.sample);
      for (const Key& key : keys) put(key.words);
      fitted.keys += keys.size();
    }
  }

  std::span<const SourceJoint> joints_;
  std::span<const JointPoints> points_;
  std::uint32_t samples_;
  std::vector<std::vector<glm::dmat4>> poses_;  // of each sample
  std::vector<double> reach_;
  std::vector<double> parent_stretch_;
  std::vector<bool> moves_;
  std::vector<DenseTrack> tracks_;
};

/// Whether all keys are at multiples of a part of the duration.
bool on_grid(const SourceClip& clip, double parts) {
  constexpr double kOff = 0.02;  // of a part: exporters round times to floats
  const double part = clip.duration / parts;
  return std::all_of(clip.tracks.begin(), clip.tracks.end(), [part](const SourceTrack& track) {
    return std::all_of(track.times.begin(), track.times.end(), [part](double time) {
      return std::abs(time / part - std::round(time / part)) <= kOff;
    });
  });
}

}  // namespace

std::uint32_t clip_samples(const SourceClip& clip) {
  constexpr double kMost = kMaxClipSamples - 1;
  const double least = std::clamp(std::ceil(clip.duration * kClipRate), 1.0, kMost);
  for (const SourceTrack& track : clip.tracks) {
    const double span = track.times.back() - track.times.front();
    if (!(span > 0)) continue;
    const auto gaps = static_cast<double>(track.times.size() - 1);
    const double parts = std::round(gaps * clip.duration / span);
    const double samples = parts * std::ceil(least / parts);
    if (samples <= kMost && on_grid(clip, parts)) return static_cast<std::uint32_t>(samples) + 1;
  }
  return static_cast<std::uint32_t>(least) + 1;
}

std::vector<glm::dmat4> clip_pose(std::span<const SourceJoint> joints, const SourceClip& clip,
                                  double time) {
  std::vector<JointPlace> places = rest_places(joints);
  for (const SourceTrack& track : clip.tracks) {
    place_value(places[track.joint], track.path, track.at(time));
  }
  return composed(joints, places);
}

std::vector<glm::dmat4> tracks_pose(std::span<const SourceJoint> joints, const ClipTracksView& view,
                                    double sample, std::vector<std::uint32_t>& keys) {
  std::vector<JointPlace> places = rest_places(joints);
  keys.resize(view.tracks.size());
  for (std::size_t t = 0; t < keys.size(); ++t) {
    const TrackRecord& track = view.tracks[t];
    place_value(places[track.joint], static_cast<TrackPath>(track.path),
                read_value(view.at(track, static_cast<float>(sample), keys[t])));
  }
  return composed(joints, places);
}

FittedClip fit_clip(std::span<const SourceJoint> joints, const SourceClip& clip,
                    std::span<const JointPoints> points, double bound) {
  const Fit fit(joints, clip, points);
  if (!fit.moves(bound)) return {};
  // Tracks of one chain add up, seldom at their worst: the most that the measured error allows.
  constexpr double kLeastShare = 1.0 / 256;
  double share = 1;
  FittedClip fitted = fit.pack(bound, share);
  while (fitted.error > bound && share > kLeastShare) fitted = fit.pack(bound, share /= 2);
  return fitted;
}

}  // namespace modar
