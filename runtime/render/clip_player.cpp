// Tracks to places of joints, places to matrices, parents first.
#include "modar/clip_player.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/gtc/type_ptr.hpp>

namespace modar {
namespace {

/// The first of the records, which rise by `key`, that is not below `value`.
template <class Record, class Key>
std::uint32_t lower_bound(const Table<Record>& records, std::uint32_t value, const Key& key) {
  std::uint32_t low = 0;
  for (std::uint32_t end = records.size(); low < end;) {
    const std::uint32_t middle = low + (end - low) / 2;
    if (key(records[middle]) < value) {
      low = middle + 1;
    } else {
      end = middle;
    }
  }
  return low;
}

/// Records of one model, which follow each other.
template <class Record>
RecordRange run_of(const Table<Record>& records, std::uint32_t model) {
  RecordRange run;
  for (std::uint32_t i = 0; i < records.size(); ++i) {
    if (records[i].model != model) continue;
    if (run.count++ == 0) run.first = i;
  }
  return run;
}

BoneMatrix times(const BoneMatrix& a, const BoneMatrix& b) {
  BoneMatrix product;
  for (int row = 0; row < 3; ++row) {
    product[row] = a[row].x * b[0] + a[row].y * b[1] + a[row].z * b[2];
    product[row].w += a[row].w;
  }
  return product;
}

/// Translation times rotation, of any length, times scale.
BoneMatrix matrix_of(const float (&t)[3], const float (&q)[4], const float (&s)[3]) {
  const float twice = 2.0f / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const float x = twice * q[0];
  const float y = twice * q[1];
  const float z = twice * q[2];
  const float xx = x * q[0];
  const float yy = y * q[1];
  const float zz = z * q[2];
  const float xy = x * q[1];
  const float xz = x * q[2];
  const float yz = y * q[2];
  const float wx = x * q[3];
  const float wy = y * q[3];
  const float wz = z * q[3];
  return {(1.0f - yy - zz) * s[0], (xy - wz) * s[1],        (xz + wy) * s[2],        t[0],
          (xy + wz) * s[0],        (1.0f - xx - zz) * s[1], (yz - wx) * s[2],        t[1],
          (xz - wy) * s[0],        (yz + wx) * s[1],        (1.0f - xx - yy) * s[2], t[2]};
}

float inverse_length(const float (&q)[4]) {
  return 1.0f / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
}

void mix(float (&to)[3], const float (&from)[3], float share) {
  for (int i = 0; i < 3; ++i) to[i] = from[i] + share * (to[i] - from[i]);
}

}  // namespace

std::uint32_t part_of(const BundleView& bundle, std::uint32_t material) {
  const Table<PartRecord> parts = bundle.moving_parts();
  const std::uint32_t part = lower_bound(parts, material, [](const auto& p) { return p.material; });
  return part < parts.size() && parts[part].material == material ? part : kNone;
}

RecordRange parts_of(const BundleView& bundle, std::uint32_t model) {
  const ModelRecord& record = bundle.models()[model];
  const auto material = [](const PartRecord& part) { return part.material; };
  const Table<PartRecord> parts = bundle.moving_parts();
  const std::uint32_t first = lower_bound(parts, record.first_material, material);
  return {first,
          lower_bound(parts, record.first_material + record.material_count, material) - first};
}

RecordRange bones_of(const BundleView& bundle, std::uint32_t model) {
  const RecordRange parts = parts_of(bundle, model);
  std::uint32_t first = kNone;
  std::uint32_t end = 0;
  for (std::uint32_t i = parts.first; i < parts.first + parts.count; ++i) {
    const PartRecord& part = bundle.moving_parts()[i];
    first = std::min(first, part.first_bone);
    end = std::max(end, part.first_bone + part.bone_count + part.target_count);
  }
  return parts.count == 0 ? RecordRange{} : RecordRange{first, end - first};
}

ClipPlayer::ClipPlayer(const BundleView& bundle, std::uint32_t model)
    : bundle_(bundle),
      joints_(run_of(bundle.joints(), model)),
      clips_(run_of(bundle.clips(), model)),
      bone_range_(bones_of(bundle, model)) {
  const std::uint32_t most = 3 * joints_.count;  // a track a path
  keys_.resize(2 * most);
  before_.keys = most;
  numbers_.resize(kPlaceFloats * joints_.count + 12 * (joints_.count + bone_range_.count));
  for (std::uint32_t i = 0; i < joints_.count; ++i) {
    const JointRecord& joint = bundle.joints()[joints_.first + i];
    Place& place = set(kRest)[i];
    std::copy_n(joint.translation, 3, place.translation);
    std::copy_n(joint.rotation, 4, place.rotation);
    std::copy_n(joint.scale, 3, place.scale);
  }
  reset();
}

void ClipPlayer::copy(Set from, Set to) {
  std::copy_n(set(from), joints_.count, set(to));
}

void ClipPlayer::reset() {
  now_.clip = before_.clip = kNone;
  now_.moves = before_.moves = posed_ = stale_ = false;
  blend_s_ = 0;
  copy(kRest, kHeld);
}

bool ClipPlayer::play(std::uint32_t clip, bool loops, double blend_s) {
  if (clip - clips_.first >= clips_.count) return false;
  if (blended_s_ < blend_s_) {
    // Two clips are on their way: their pose is where this one begins.
    pose();
    copy(kNow, kHeld);
    now_.clip = kNone;
    now_.moves = false;
  }
  std::swap(now_, before_);
  now_.clip = clip;
  now_.tracks = bundle_.clip_tracks(clip);
  now_.time = 0;
  now_.loops = loops;
  now_.moves = posed_ = stale_ = true;
  blend_s_ = blend_s > 0 ? blend_s : 0;
  blended_s_ = 0;
  return true;
}

void ClipPlayer::move(Layer& layer, double seconds) const {
  if (!layer.moves) return;
  const auto length = static_cast<double>(bundle_.clips()[layer.clip].seconds);
  layer.time += seconds;
  if (layer.time < length) return;
  layer.moves = layer.loops && length > 0;
  layer.time = layer.moves ? layer.time - length * std::floor(layer.time / length) : length;
}

void ClipPlayer::advance(double seconds) {
  if (!(seconds > 0)) return;
  stale_ = stale_ || now_.moves || blended_s_ < blend_s_;
  move(now_, seconds);
  move(before_, seconds);
  blended_s_ = std::min(blend_s_, blended_s_ + seconds);
}

void ClipPlayer::pose() {
  if (!stale_) return;
  stale_ = false;
  sample(now_, kNow);
  if (blended_s_ < blend_s_) {
    sample(before_, kBefore);
    blend(static_cast<float>(blended_s_ / blend_s_));
  }
  compose();
}

void ClipPlayer::sample(const Layer& layer, Set to) {
  const bool holds = layer.clip == kNone;
  copy(holds ? kHeld : kRest, to);
  const ClipTracksView& view = layer.tracks;
  if (holds || view.tracks.empty()) return;
  const auto length = static_cast<double>(bundle_.clips()[layer.clip].seconds);
  const auto last = static_cast<double>(view.header->sample_count - 1);
  const auto time = static_cast<float>(length > 0 ? layer.time / length * last : 0);
  for (std::size_t i = 0; i < view.tracks.size(); ++i) {
    const TrackRecord& track = view.tracks[i];
    if (track.joint >= joints_.count) break;  // they are sorted
    const TrackValue value = view.at(track, time, keys_[layer.keys + i]);
    Place& place = set(to)[track.joint];
    switch (static_cast<TrackPath>(track.path)) {
      case TrackPath::kTranslation:
        std::copy_n(value.begin(), 3, place.translation);
        break;
      case TrackPath::kRotation:
        std::copy_n(value.begin(), 4, place.rotation);
        break;
      case TrackPath::kScale:
        std::copy_n(value.begin(), 3, place.scale);
        break;
    }
  }
}

/// share: of kNow, where it stays; the rest is of kBefore.
void ClipPlayer::blend(float share) {
  for (std::size_t j = 0; j < joints_.count; ++j) {
    Place& to = set(kNow)[j];
    const Place& from = set(kBefore)[j];
    mix(to.translation, from.translation, share);
    mix(to.scale, from.scale, share);
    float dot = 0;
    for (int i = 0; i < 4; ++i) dot += to.rotation[i] * from.rotation[i];
    // The shorter way round.
    const float own = share * inverse_length(to.rotation);
    const float other = (1.0f - share) * std::copysign(inverse_length(from.rotation), dot);
    for (int i = 0; i < 4; ++i) {
      to.rotation[i] = own * to.rotation[i] + other * from.rotation[i];
    }
  }
}

void ClipPlayer::compose() {
  auto* const matrices =
      reinterpret_cast<BoneMatrix*>(numbers_.data() + kPlaceFloats * joints_.count);
  const Table<JointRecord> joints = bundle_.joints();
  for (std::uint32_t j = 0; j < joints_.count; ++j) {
    const JointRecord& joint = joints[joints_.first + j];
    const Place& place = set(kNow)[j];
    const BoneMatrix own = times(glm::make_mat3x4(joint.before),
                                 matrix_of(place.translation, place.rotation, place.scale));
    const std::uint32_t parent = joint.parent - joints_.first;
    matrices[j] = joint.parent != kNone && parent < j ? times(matrices[parent], own) : own;
  }
  const Table<BoneRecord> bones = bundle_.bones();
  for (std::uint32_t b = 0; b < bone_range_.count; ++b) {
    const BoneRecord& bone = bones[bone_range_.first + b];
    const std::uint32_t joint = bone.joint - joints_.first;
    if (joint < joints_.count)
      matrices[joints_.count + b] = times(matrices[joint], glm::make_mat3x4(bone.inverse));
  }
}

}  // namespace modar
