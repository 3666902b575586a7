// What a physically based material reflects, in the terms of a SourceMaterial. Internal to
// bake/import.
#pragma once

#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"

namespace modar {

/// Of the light that falls straight on: what all that is no metal reflects (glTF 2.0, appendix B).
inline constexpr double kDielectricReflectance = 0.04;

/// Sets specular, shininess, reflectance and metalness of a material whose base colour is linear
/// and may be multiplied by a picture: the highlight of GGX that is as wide as the
/// roughness makes it. Where nothing of it would be seen, they become 0, which costs a device less.
/// roughness, metalness: 0 to 1, others are clamped.
void set_reflection(double roughness, double metalness, const glm::dvec3& base, bool pictured,
                    SourceMaterial& material);

}  // namespace modar
