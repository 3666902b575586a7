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
/// Less metal takes less than a tenth of the colour away, 4 % of its stored value.
constexpr double kSomeMetal = 0.1;

}  // namespace

void set_reflection(double roughness, double metalness, const glm::dvec3& base, bool pictured,
                    SourceMaterial& material) {
  roughness = std::clamp(roughness, 0.05, 1.0);
  // As materials store it: what they round to none must not have the highlight of metal.
  metalness = std::round(255 * std::clamp(metalness, 0.0, 1.0)) / 255;
  const double exponent = std::min(1000.0, 2.0 / std::pow(roughness, 4) - 2.0);
  // Of metal, before its colour; fainter where the drawn one is wider.
  const double drawn = std::min(exponent, static_cast<double>(kMostShininess));
  const double highlight = (drawn + 2) / 8 * (drawn / std::max(exponent, 1.0));
  double brightest = 0;
  for (int i = 0; i < 3; ++i) {
    const double straight = kDielectricReflectance + metalness * (base[i] - kDielectricReflectance);
    const double middle = std::clamp(straight * (exponent + 2) / 8, 0.0, 1.0);
    material.specular[i] = static_cast<float>(srgb_of_linear(metalness > 0 ? highlight : middle));
    brightest = std::max(brightest, middle);
  }
  // Pictures have dark places.
  const bool dark = pictured ? metalness < kSomeMetal : std::min({base.r, base.g, base.b}) < kDark;
  // Rougher metal spreads its light as wide as what scatters it; so do files that state nothing,
  // which glTF calls metal of roughness 1.
  const bool shows = (exponent >= 1 && (brightest >= kFaint || metalness >= kSomeMetal)) || dark;
  if (!shows) material.specular = glm::vec3(0.0f);
  material.shininess = shows ? static_cast<float>(std::max(exponent, 1.0)) : 0.0f;
  material.reflectance = shows ? static_cast<float>(kDielectricReflectance) : 0.0f;
  material.metalness = shows ? static_cast<float>(metalness) : 0.0f;
}

}  // namespace modar
