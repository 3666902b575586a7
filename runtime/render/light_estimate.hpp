// The camera's light: what a pattern's colours look like in a frame, compared with the print.
// Internal to runtime/render.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "formats/bundle_view.hpp"
#include "modar/renderer.hpp"

namespace modar {

/// Light on the pattern's plane at a place, linear; 1: as bright as in the pattern's picture.
struct PlaneLight {
  glm::vec3 middle{1.0f};  ///< red, green, blue in the pattern's middle
  glm::vec2 slope{0.0f};   ///< change of the factor on `middle`, pattern units, right and up
  bool known = false;
};

/// Frames between two looks: light changes slowly, and a look costs as much as some draw calls.
inline constexpr std::uint64_t kLookPause = 4;

/// Follows the light of each pattern from frame to frame.
class LightEstimator {
 public:
  /// Forgets everything. The bundle's bytes outlive the estimator.
  void create(const BundleView& bundle);

  /// Looks at the patterns of the items' scenes in a frame with planes, kLookPause frames after the
  /// last look. passed: frames since the last call. Patterns without stored colours are left out.
  /// Allocates nothing.
  void observe(const CameraPicture& frame, const glm::mat4& projection,
               std::span<const DrawItem> items, std::uint64_t passed = 1);

  /// What a white surface in the plane gets at the place of the scene's model; nothing where nobody
  /// has seen it. scene: any number.
  [[nodiscard]] std::optional<glm::vec3> at_model(std::uint32_t scene) const;

 private:
  struct Watched {
    PlaneLight light;
    std::uint64_t looked = 0;  ///< the frame of the last look that found something
  };

  BundleView bundle_;
  std::vector<Watched> patterns_;
  std::uint64_t frame_ = 0;
};

/// One look, without the past. matrix: pattern plane (x right, y up, z = 0) to clip space of a
/// viewport that shows the whole frame. colours: a SectionType::kPatternColours section. Not known
/// where less than a quarter of the pattern is seen, or the visible part is all black or all white.
PlaneLight look_at_pattern(const CameraPicture& frame, const glm::mat4& matrix,
                           const PatternRecord& pattern, std::span<const std::byte> colours);

}  // namespace modar
