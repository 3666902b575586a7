// The pictures of a glTF material as the one that our shader draws. Internal to the glTF reader.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>

#include "bake/image/image.hpp"

namespace modar {

/// Pictures of one material, all on the same coordinates, and what the file multiplies them by.
struct GltfPictures {
  enum class Alpha : std::uint8_t {
    kIgnored,  ///< OPAQUE
    kCutOff,   ///< MASK: drawn in full where alpha times its factor is at least `cutoff`
    kKept,     ///< BLEND
  };
  std::string colour;  ///< paths; empty: white
  std::string emissive;
  std::string occlusion;  ///< in red
  std::array<double, 4> colour_factor{1, 1, 1, 1};
  std::array<double, 3> emissive_factor{0, 0, 0};
  double occlusion_strength = 1;
  Alpha alpha = Alpha::kKept;
  double cutoff = 0.5;

  std::partial_ordering operator<=>(const GltfPictures&) const = default;
  /// The one whose size and name the result has: the colour, or the first that there is.
  [[nodiscard]] const std::string& first() const {
    return !colour.empty() ? colour : !emissive.empty() ? emissive : occlusion;
  }
};

/// One picture of the drawn colours, of the size of first(): the colour, darkened by the occlusion,
/// plus the emission, in linear light, with the factors of both where anything is emitted; alpha
/// as asked. Nothing if the colour can be drawn unchanged. Errors: as read_image().
Result<std::optional<RgbaImage>> fold_pictures(const GltfPictures& pictures);

/// Linear light to sRGB (IEC 61966-2-1), both in [0,1].
double stored_light(double linear);

}  // namespace modar
