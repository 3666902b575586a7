// From roughness and metalness to a highlight and the reflection.
#include "bake/import/reflection.hpp"

#include <algorithm>
#include <cmath>

#include "formats/base/colour.hpp"
#include "modar/renderer.hpp"

namespace modar {
namespace {

/// Reflection of white below which highlights are invisible. Higher drops visible highlights, lower
/// costs phones time.
constexpr double kFaint = 0.05;
/// Channel below which a surface is seen by what it mirrors: less than dielectrics reflect.
constexpr double kDark = kDielectricReflectance;
/// Of the roughest surfaces: 0 means that nothing is mirrored.
constexpr double kLeastExponent = 0.1;
/// Less metal takes less than a tenth of the colour away, 4 % of its stored value.
constexpr double kSomeMetal = 0.1;

}  // namespace

void set_reflection(double roughness, double metalness, const glm::dvec3& base, bool pictured,
                    SourceMaterial& material) {
  roughness = std::clamp(roughness, 0.05, 1.0);
  // As materials store it: what they round to none must not have the highlight of metal.
  metalness = std::round(255 * std::clamp(metalness, 0.0, 1.0)) / 255;
  const double exponent = std::min(1000.0, 2.0 / std::pow(roughness, 4) - 2.0);
  // Of white metal; fainter where the drawn one is wider, but not by all of its area: by three.js.
  const double drawn = std::min(exponent, static_cast<double>(kMostShininess));
  const double highlight = (drawn + 2) / 8 * (exponent > drawn ? std::sqrt(drawn / exponent) : 1);
  double brightest = 0;
  for (int i = 0; i < 3; ++i) {
    const double straight = kDielectricReflectance + metalness * (base[i] - kDielectricReflectance);
    const double part = metalness > 0 ? 1.0 : straight;
    material.specular[i] = static_cast<float>(srgb_of_linear(part * highlight));
    brightest = std::max(brightest, straight * (exponent + 2) / 8);
  }
  // Pictures have dark places.
  const bool dark = pictured ? metalness < kSomeMetal : std::min({base.r, base.g, base.b}) < kDark;
  const bool shows = (exponent >= 1 && brightest >= kFaint) || metalness >= kSomeMetal || dark;
  if (!shows) material.specular = glm::vec3(0.0f);
  material.shininess = shows ? static_cast<float>(std::max(exponent, kLeastExponent)) : 0.0f;
  material.reflectance = shows ? static_cast<float>(kDielectricReflectance) : 0.0f;
  material.metalness = shows ? static_cast<float>(metalness) : 0.0f;
}

}  // namespace modar
