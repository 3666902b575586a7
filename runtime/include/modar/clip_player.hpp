// A model in motion: the matrices of its bones at a time of a clip, or between two clips.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat3x4.hpp>

#include "formats/bundle_view.hpp"

namespace modar {

/// Three rows: from the rest pose in model space to the pose. GLM calls them columns.
using BoneMatrix = glm::mat3x4;

/// The moving part of a material, or kNone.
std::uint32_t part_of(const BundleView& bundle, std::uint32_t material);

/// A run of records.
struct RecordRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};
/// The moving parts of a model, and the bones that these name.
RecordRange parts_of(const BundleView& bundle, std::uint32_t model);
RecordRange bones_of(const BundleView& bundle, std::uint32_t model);

/// Seconds from one clip to the next.
inline constexpr double kClipBlendSeconds = 0.3;

/// Allocates nothing after its construction.
class ClipPlayer {
 public:
  /// bundle: opened; its bytes outlive the player. model: an index.
  ClipPlayer(const BundleView& bundle, std::uint32_t model);

  /// A clip of the model from its beginning; within blend_s the present pose turns into it. False
  /// for one that is not of this model.
  bool play(std::uint32_t clip, bool loops, double blend_s);
  /// The pose stays.
  void stop() { now_.moves = false; }
  /// As at the start.
  void reset();

  void advance(double seconds);
  /// Calculates bones(), if the time is another one than that of the last call.
  void pose();

  /// The clip that moves the model; kNone: none does, or it has ended.
  [[nodiscard]] std::uint32_t playing() const { return now_.moves ? now_.clip : kNone; }
  /// The next pose is another one.
  [[nodiscard]] bool moves() const { return stale_ || now_.moves || blended_s_ < blend_s_; }
  /// Of bones_of() the model; empty before the first play(): the rest pose.
  [[nodiscard]] std::span<const BoneMatrix> bones() const {
    if (!posed_) return {};
    const float* const first = numbers_.data() + (kPlaceFloats + 12) * joints_.count;
    return {reinterpret_cast<const BoneMatrix*>(first), bone_range_.count};
  }

 private:
  struct Place {
    float translation[3];
    float rotation[4];  ///< x, y, z, w
    float scale[3];
  };
  struct Layer {
    std::uint32_t clip = kNone;  ///< kNone: the pose of kHeld
    double time = 0;             ///< seconds of the clip
    bool loops = false;
    bool moves = false;
    std::uint32_t keys = 0;  ///< where in keys_ those that were found last begin
    ClipTracksView tracks;
  };
  /// Places of all joints, one set behind the other.
  enum Set : std::uint32_t { kRest, kHeld, kNow, kBefore, kSets };
  static constexpr std::uint32_t kPlaceFloats = kSets * sizeof(Place) / sizeof(float);

  [[nodiscard]] Place* set(Set which) {
    return reinterpret_cast<Place*>(numbers_.data()) + which * joints_.count;
  }
  void copy(Set from, Set to);
  void move(Layer& layer, double seconds) const;
  void sample(const Layer& layer, Set to);
  void blend(float share);
  void compose();

  BundleView bundle_;
  RecordRange joints_;
  RecordRange clips_;
  RecordRange bone_range_;
  std::vector<std::uint32_t> keys_;
  std::vector<float> numbers_;  ///< kSets of places; matrices of joints, then of bones
  Layer now_;
  Layer before_;
  double blend_s_ = 0;
  double blended_s_ = 0;  ///< of them
  bool posed_ = false;
  bool stale_ = false;
};

}  // namespace modar
