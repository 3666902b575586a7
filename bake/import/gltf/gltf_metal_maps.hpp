// Metallic-roughness maps: what they say of the faces of a material. Internal to the glTF reader.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"

namespace modar {

/// The map of a material, with the factors and the base colour (linear) that go with it.
struct MetalMap {
  std::uint32_t material = 0;
  std::string path;
  double roughness = 1;
  double metalness = 1;
  glm::dvec3 base{1.0};
  bool pictured = false;   ///< a picture multiplies the base colour
  bool on_its_uvs = true;  ///< the uvs of the faces are the map's, too
};

/// Sets the reflection of each map's material to the map's mean; where the map varies visibly from
/// face to face, faces that are alike become materials of their own, up to four. A map that cannot
/// be read counts as white and is reported.
void apply_metal_maps(const std::vector<MetalMap>& maps, const std::string& label,
                      SourceModel& model);

}  // namespace modar
