// One pattern before the device's own loop: frames of known pose, and what the loop says of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bake/lab/pose_bench.hpp"
#include "bake/pattern/pose_scene.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"

namespace modar {

/// What the views of one trial have in common; what is left open is drawn for each view.
struct TrialSetting {
  SceneBand band;
  std::optional<SceneLight> light;
  double motion_px = 0;  ///< length of the motion blur, in any direction
};

struct TrialBed {
  GrayImage picture;                         ///< the pattern's
  std::span<const std::byte> bundle;         ///< holds that pattern alone, with its loop record
  Camera camera;                             ///< frames have its size
  std::span<const GrayPicture> backgrounds;  ///< of that size, at least one
  int views = 10;                            ///< of each setting
  std::uint64_t seed = 1;
  unsigned jobs = 1;  ///< threads; what comes out does not depend on it
};

struct TrialOutcome {
  PoseBenchRow row;    ///< two exposures of each view: the pattern is detected, then tracked
  GrayPicture sample;  ///< the first view, a quarter of its sides
  std::array<glm::dvec2, 4> truth{};  ///< pixels of the sample
  std::array<glm::dvec2, 4> seen{};
  bool sample_right = false;  ///< else `seen` means nothing
  [[nodiscard]] double right_share() const {
    return row.frames > 0 ? 1.0 * row.right / row.frames : 0;
  }
};

/// Runs the loop over views of each setting. stepped: called after each, from any thread; may be
/// empty. Errors: those of PoseLoop.
Result<std::vector<TrialOutcome>> try_views(const TrialBed& bed,
                                            std::span<const TrialSetting> settings,
                                            const std::function<void()>& stepped);

}  // namespace modar
